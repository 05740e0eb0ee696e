"""Inclusive gateways: splits, and joins by the rule of BPMN 2.0.2, table 13.3."""

import pytest

from tests.engine.kit import Play

SPLIT = """
    <startEvent id="start"/> <inclusiveGateway id="split" default="other"/>
    <userTask id="a"/> <userTask id="b"/> <userTask id="c"/> <userTask id="d"/>
    <inclusiveGateway id="join"/> <userTask id="after"/>
    start -> split
    split -> a if a
    split -> b if b
    split -> c if c
    other: split -> d
    a -> join
    b -> join
    c -> join
    d -> join -> after
"""


@pytest.mark.parametrize(
    ("given", "taken"), [("abc", "a b c"), ("b", "b"), ("ac", "a c"), ("", "d")]
)
def test_every_true_flow_is_taken_else_the_default(given: str, taken: str) -> None:
    play = Play(SPLIT).start(dict.fromkeys(given, True))
    assert play.at == taken


@pytest.mark.parametrize("given", ["abc", "b", "ac", ""])
def test_the_join_waits_for_what_was_split_and_for_nothing_else(given: str) -> None:
    play = Play(SPLIT).start(dict.fromkeys(given, True))
    for task in given or "d":
        assert "after" not in play.at
        play.answer(prompt=task)
    assert play.at == "after"


def test_a_flow_without_a_condition_is_true() -> None:
    play = Play("""
        <startEvent id="start"/> <inclusiveGateway id="split"/> <userTask id="a"/>
        <userTask id="b"/>
        start -> split
        split -> a
        split -> b if b
    """).start({"b": False})
    assert play.at == "a"


def test_a_split_with_nothing_true_and_no_default_throws_no_flow() -> None:
    play = Play("""
        <startEvent id="start"/> <inclusiveGateway id="split"/> <userTask id="a"/>
        <userTask id="b"/>
        start -> split
        split -> a if a
        split -> b if b
    """).start()
    assert play.ended == "failed"
    assert "NO_FLOW" in play.detail


def test_the_join_needs_to_wait_only_for_tokens_that_can_reach_it() -> None:
    play = Play("""
        <startEvent id="start"/> <parallelGateway id="fork"/> <userTask id="a"/>
        <userTask id="b"/> <userTask id="elsewhere"/> <inclusiveGateway id="join"/>
        <userTask id="after"/> <endEvent id="end"/>
        start -> fork -> a -> join
        fork -> b -> join -> after
        fork -> elsewhere -> end
    """).start()
    play.answer(prompt="a")
    assert play.at == "b elsewhere join"
    assert play.answer(prompt="b").at == "elsewhere after"


def test_a_token_that_turns_away_upstream_releases_the_join() -> None:
    play = Play("""
        <startEvent id="start"/> <parallelGateway id="fork"/> <userTask id="a"/>
        <userTask id="b"/> <exclusiveGateway id="turn" default="away"/>
        <inclusiveGateway id="join"/> <userTask id="after"/> <userTask id="elsewhere"/>
        start -> fork -> a -> join
        fork -> b -> turn
        turn -> join if stay
        away: turn -> elsewhere
        join -> after
    """).start({"stay": False})
    play.answer(prompt="a")
    assert play.at == "b join"
    assert play.answer(prompt="b").at == "elsewhere after"


def test_a_token_that_dies_upstream_releases_the_join() -> None:
    play = Play("""
        <startEvent id="start"/> <parallelGateway id="fork"/> <userTask id="a"/>
        <userTask id="b"/> <exclusiveGateway id="turn" default="out"/> <endEvent id="dead"/>
        <inclusiveGateway id="join"/> <userTask id="after"/>
        start -> fork -> a -> join
        fork -> b -> turn
        turn -> join if stay
        out: turn -> dead
        join -> after
    """).start()
    assert play.answer(prompt="a").at == "b join"
    assert play.answer(prompt="b").at == "after"


def test_a_token_that_an_interruption_takes_away_releases_the_join() -> None:
    play = Play("""
        <startEvent id="start"/> <parallelGateway id="fork"/> <userTask id="a"/>
        <userTask id="b"/> <boundaryEvent id="stop" attachedToRef="b">signal go</boundaryEvent>
        <endEvent id="dead"/> <inclusiveGateway id="join"/> <userTask id="after"/>
        start -> fork -> a -> join
        fork -> b -> join -> after
        stop -> dead
    """).start()
    assert play.answer(prompt="a").at == "b join"
    assert play.signal("go").at == "after"


def test_the_join_waits_for_a_token_that_can_reach_it_by_a_boundary_event() -> None:
    play = Play("""
        <startEvent id="start"/> <parallelGateway id="fork"/> <userTask id="a"/>
        <userTask id="b"/> <boundaryEvent id="late" attachedToRef="b">timer PT5S</boundaryEvent>
        <endEvent id="end"/> <inclusiveGateway id="join"/> <userTask id="after"/>
        start -> fork -> a -> join
        fork -> b -> end
        late -> join -> after
    """).start()
    assert play.answer(prompt="a").at == "b join"
    assert play.advance(5).at == "after"


def test_the_join_waits_for_a_subprocess_by_its_activity_however_deep_its_tokens_are() -> None:
    play = Play("""
        <startEvent id="start"/> <parallelGateway id="fork"/> <userTask id="a"/>
        <subProcess id="sub"> <startEvent id="s"/>
          <subProcess id="inner"> <startEvent id="s2"/> <userTask id="deep"/>
            s2 -> deep
          </subProcess>
          s -> inner
        </subProcess>
        <inclusiveGateway id="join"/> <userTask id="after"/>
        start -> fork -> a -> join
        fork -> sub -> join -> after
    """).start()
    assert play.answer(prompt="a").at == "deep join"
    assert play.answer(prompt="deep").at == "after"


def test_a_token_that_can_also_reach_a_taken_flow_does_not_delay_the_join() -> None:
    # Table 13.3: the path to the empty flow counts only if the token can't reach a taken one.
    play = Play("""
        <startEvent id="start"/> <parallelGateway id="fork"/> <userTask id="a"/>
        <userTask id="b"/> <exclusiveGateway id="either" default="second"/>
        <exclusiveGateway id="merge"/> <inclusiveGateway id="join"/> <userTask id="after"/>
        start -> fork -> a -> merge -> join
        fork -> b -> either
        either -> merge if first
        second: either -> join
        join -> after
    """).start({"first": False})
    assert play.answer(prompt="a").at == "b after"
    assert play.answer(prompt="b").at == "after after"


def test_a_token_that_must_pass_the_join_to_reach_an_empty_flow_does_not_delay_it() -> None:
    play = Play(
        """
        <startEvent id="start"/> <inclusiveGateway id="join"/> <userTask id="work"/>
        <exclusiveGateway id="more" default="out"/> <endEvent id="end"/>
        start -> join -> work -> more
        again: more -> join if user.decision == 'again'
        out: more -> end
    """.replace('<userTask id="work"/>', '<userTask id="work">ask again enough</userTask>')
    ).start()
    assert play.at == "work"
    assert play.answer("again").at == "work"
    assert play.answer("again").at == "work"
    assert play.answer("enough").ended == "completed"


def test_the_tokens_of_a_loop_join_round_by_round() -> None:
    play = Play("""
        <startEvent id="start"/> <exclusiveGateway id="merge"/> <inclusiveGateway id="split"/>
        <task id="a"/> <task id="b"/> <inclusiveGateway id="join"/>
        <scriptTask id="count">n = n + 1</scriptTask> <exclusiveGateway id="more" default="out"/>
        <endEvent id="end"/>
        start -> merge -> split
        split -> a
        split -> b if n != 1
        a -> join
        b -> join -> count -> more
        more -> merge if n < 3
        out: more -> end
    """).start({"n": 0})
    assert play.ended == "completed"
    assert play.entered().split().count("count") == 3


def test_the_second_token_on_a_flow_of_the_join_waits_for_the_next_round() -> None:
    play = Play("""
        <startEvent id="start"/> <parallelGateway id="fork"/> <exclusiveGateway id="merge"/>
        <userTask id="b"/> <inclusiveGateway id="join"/> <userTask id="after"/>
        start -> fork
        fork -> merge
        fork -> merge
        fork -> b
        merge -> join
        b -> join -> after
    """).start()
    assert play.at == "b join join"
    assert play.answer(prompt="b").at == "after after"


def test_joins_in_a_row_fire_one_after_the_other() -> None:
    play = Play("""
        <startEvent id="start"/> <inclusiveGateway id="one"/> <inclusiveGateway id="two"/>
        <userTask id="slow"/> <inclusiveGateway id="join"/> <inclusiveGateway id="last"/>
        <userTask id="after"/>
        start -> one
        one -> two
        one -> slow if slow
        two -> join
        slow -> join
        two -> last
        join -> last -> after
    """).start({"slow": True})
    assert play.at == "slow join last"
    assert play.answer(prompt="slow").at == "after"


def test_two_joins_that_wait_for_each_other_are_named_when_the_run_fails() -> None:
    play = Play("""
        <startEvent id="start"/> <parallelGateway id="fork"/>
        <parallelGateway id="one"/> <parallelGateway id="two"/> <endEvent id="end"/>
        start -> fork -> one -> two
        fork -> two -> one
        one -> end
    """).start()
    assert play.ended == "failed"
    assert play.detail == "stuck: no token can move from one, two"


def test_a_join_that_forks_splits_again() -> None:
    play = Play("""
        <startEvent id="start"/> <inclusiveGateway id="split"/> <inclusiveGateway id="both"/>
        <userTask id="c"/> <userTask id="d"/> <userTask id="e"/>
        start -> split
        split -> both
        split -> both
        both -> c
        both -> d if d
        both -> e if e
    """).start({"d": True, "e": False})
    assert play.at == "c d"


def test_joins_of_several_instances_are_several_joins() -> None:
    play = Play("""
        <process id="MAIN" isExecutable="true"> <startEvent id="start"/>
          <parallelGateway id="fork"/> <callActivity id="one" calledElement="P"/>
          <callActivity id="two" calledElement="P"/>
          start -> fork -> one
          fork -> two
        </process>
        <process id="P"> <startEvent id="s"/> <parallelGateway id="f"/> <userTask id="u"/>
          <userTask id="v"/> <inclusiveGateway id="j"/> <userTask id="w"/>
          s -> f -> u -> j
          f -> v -> j -> w
        </process>
    """).start()
    assert play.at == "u v u v"
    assert play.answer(prompt="p1").answer(prompt="p3").at == "v v j j"
    assert play.answer(prompt="p4").at == "v j w"
    assert play.answer(prompt="p2").at == "w w"
