"""Complex gateways (clauses 10.6.5 and 13.4.5, table 13.5)."""

from tests.engine.kit import Play


def three(condition: str, after: str = "join -> after") -> str:
    """Three user tasks that a complex gateway joins."""
    return f"""
        <startEvent id="start"/> <parallelGateway id="fork"/>
        <userTask id="a"/> <userTask id="b"/> <userTask id="c"/>
        <complexGateway id="join" default="{"rest" if "rest:" in after else ""}">
          <activationCondition>{condition}</activationCondition>
        </complexGateway>
        <userTask id="after"/> <userTask id="late"/>
        start -> fork
        fork -> a
        fork -> b
        fork -> c
        fa: a -> join
        fb: b -> join
        fc: c -> join
        {after}
    """.replace(' default=""', "")


def test_two_of_three_activate_it_and_the_third_only_resets_it() -> None:
    play = Play(three("activationCount &gt;= 2")).start()
    assert play.answer(prompt="a").at == "b c join"
    assert play.answer(prompt="c").at == "b after"
    assert play.answer(prompt="b").at == "after"
    assert play.entered() == "start fork a b c join join after join"
    assert play.answer(prompt="after").ended == "completed"


def test_the_condition_reads_the_tokens_of_each_flow_and_the_data() -> None:
    play = Play(three("fa + fb &gt;= needed")).start({"needed": 2})
    assert play.answer(prompt="a").at == "b c join"
    assert play.answer(prompt="c").at == "b join join"
    assert play.answer(prompt="b").at == "after"


def test_where_all_flows_activate_it_there_is_no_second_phase() -> None:
    play = Play(three("activationCount &gt;= 3")).start()
    play.answer(prompt="a").answer(prompt="b").answer(prompt="c")
    assert play.at == "after"
    assert not next(iter(play.run.state.scopes.values())).activated


def test_conditions_may_tell_the_phases_apart() -> None:
    after = """
        join -> after if waitingForStart
        join -> late if not waitingForStart
    """
    play = Play(three("activationCount &gt;= 1", after)).start()
    assert play.answer(prompt="b").at == "a c after"
    assert play.answer(prompt="a").at == "c after join"
    assert play.answer(prompt="c").at == "after late"


def test_the_default_flow_is_taken_where_no_condition_is_true_in_either_phase() -> None:
    after = """
        join -> after if waitingForStart
        rest: join -> late
    """
    play = Play(three("activationCount &gt;= 2", after)).start()
    play.answer(prompt="a").answer(prompt="b")
    assert play.at == "c after"
    assert play.answer(prompt="c").at == "after late"


def test_no_true_flow_is_an_error_when_it_is_activated_and_none_when_it_resets() -> None:
    play = Play(three("activationCount &gt;= 1", "join -> after if x")).start({"x": False})
    play.answer(prompt="a")
    assert play.ended == "failed"
    assert "NO_FLOW" in play.detail


def test_a_flow_that_no_token_can_reach_any_more_does_not_keep_it_from_resetting() -> None:
    play = Play("""
        <startEvent id="start"/> <inclusiveGateway id="some"/>
        <userTask id="a"/> <userTask id="b"/> <userTask id="c"/>
        <complexGateway id="join">
          <activationCondition>activationCount &gt;= 1</activationCondition>
        </complexGateway>
        <task id="after"/> <task id="late"/>
        start -> some
        some -> a
        some -> b
        some -> c if x
        a -> join
        b -> join
        c -> join
        join -> after if waitingForStart
        join -> late if not waitingForStart
    """).start({"x": False})
    assert play.answer(prompt="a").entered() == "start some a b join after"
    assert play.answer(prompt="b").entered() == "join late"
    assert play.ended == "completed"


def test_a_second_token_on_a_flow_waits_for_the_next_round() -> None:
    play = Play("""
        <startEvent id="s1"/> <startEvent id="s2"/> <startEvent id="s3"/>
        <exclusiveGateway id="m"/> <userTask id="b"/>
        <complexGateway id="join">
          <activationCondition>activationCount &gt;= 2</activationCondition>
        </complexGateway>
        <task id="after"/>
        s1 -> m
        s2 -> m -> join
        s3 -> b -> join -> after
    """).start()
    assert play.at == "b join join"
    assert play.answer(prompt="b").at == ""
    assert play.ended == "failed"
    assert play.detail == "stuck: no token can move from join"


def test_a_condition_that_cannot_be_evaluated_is_an_error_at_the_gateway() -> None:
    play = Play(three("1 / x &gt; 0")).start({"x": 0})
    assert play.answer(prompt="a").ended == "failed"
    assert "activationCondition of join" in play.detail


def test_as_a_split_it_works_like_an_inclusive_gateway() -> None:
    play = Play("""
        <startEvent id="start"/> <complexGateway id="split"/>
        <task id="a"/> <task id="b"/> <task id="c"/>
        start -> split
        split -> a if x > 1
        split -> b if x > 0
        split -> c if x > 5
    """).start({"x": 2})
    assert play.entered() == "start split a b"
    assert play.ended == "completed"


def test_several_reset_at_one_moment() -> None:
    play = Play("""
        <startEvent id="start"/> <parallelGateway id="fork"/> <userTask id="u" default="on"/>
        <userTask id="v"/> <task id="after"/>
        <complexGateway id="g1"><activationCondition>activationCount &gt;= 1</activationCondition>
        </complexGateway>
        <complexGateway id="g2"><activationCondition>activationCount &gt;= 1</activationCondition>
        </complexGateway>
        start -> fork
        fork -> g1
        fork -> g2
        fork -> u
        fork -> v -> g2
        u -> g1 if x
        u -> g2 if x
        on: u -> after
    """).start({"x": False})
    assert play.answer(prompt="v").at == "u g2"
    assert play.answer(prompt="u").ended == "completed"


def test_what_interrupts_its_scope_leaves_nothing_to_reset() -> None:
    after = """
        join -> after
        join -> late if not waitingForStart
        <subProcess id="handler" triggeredByEvent="true">
          <startEvent id="called"><signalEventDefinition signalRef="s"/></startEvent>
          <userTask id="handle"/>
          called -> handle
        </subProcess>
    """
    play = Play(three("activationCount &gt;= 1", after)).start()
    assert play.answer(prompt="a").at == "b c after"
    assert play.signal("s").at == "handle"
    assert play.answer(prompt="handle").ended == "completed"
    assert "late" not in play.entered()
