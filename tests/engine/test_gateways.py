"""Exclusive and parallel gateways; flows out of activities; implicit forks and merges."""

import pytest

from m2pem.engine import records as r
from tests.engine.kit import Play
from tests.engine.trace import table

EXCLUSIVE = """
    <startEvent id="start"/> <exclusiveGateway id="which" {default}/>
    <task id="a"/> <task id="b"/> <task id="c"/>
    start -> which
    which -> a if x > 1
    which -> b if x > 0
    other: which -> c{last}
"""


@pytest.mark.parametrize(("x", "expected"), [(2, "a"), (1, "b"), (0, "c")])
def test_exclusive_takes_the_first_true_flow_in_the_files_order(x: int, expected: str) -> None:
    play = Play(EXCLUSIVE.format(default="", last="")).start({"x": x})
    assert play.entered() == f"start which {expected}"


@pytest.mark.parametrize(("x", "expected"), [(1, "b"), (0, "c")])
def test_exclusive_takes_the_default_only_when_nothing_is_true(x: int, expected: str) -> None:
    text = """
        <startEvent id="start"/> <exclusiveGateway id="which" default="other"/>
        <task id="b"/> <task id="c"/>
        start -> which
        other: which -> c
        which -> b if x > 0
    """
    assert Play(text).start({"x": x}).entered() == f"start which {expected}"


def test_exclusive_without_a_true_flow_throws_no_flow_at_the_gateway() -> None:
    play = Play(EXCLUSIVE.format(default="", last=" if x == 5")).start({"x": 0})
    [error] = [record for record in play.records() if isinstance(record, r.ErrorThrown)]
    assert (error.element, error.code) == ("which", "NO_FLOW")
    assert play.ended == "failed"
    assert "NO_FLOW" in play.detail
    assert "which" in play.detail


def test_a_condition_that_cannot_be_evaluated_throws_expression_at_the_gateway() -> None:
    play = Play(EXCLUSIVE.format(default="", last=" if 1 / x > 0")).start({"x": 0})
    [error] = [record for record in play.records() if isinstance(record, r.ErrorThrown)]
    assert (error.element, error.code) == ("which", "EXPRESSION")
    assert error.reason.startswith("condition of other: '/' divides")
    assert play.ended == "failed"


def test_exclusive_as_a_merge_passes_every_token() -> None:
    play = Play("""
        <startEvent id="start"/> <parallelGateway id="fork"/> <task id="a"/> <task id="b"/>
        <exclusiveGateway id="merge"/> <task id="after"/>
        start -> fork -> a -> merge
        fork -> b -> merge -> after
    """).start()
    assert play.entered() == "start fork a b merge merge after after"


# --- parallel -----------------------------------------------------------------------------------


def test_parallel_forks_and_joins() -> None:
    play = Play("""
        <startEvent id="start"/> <parallelGateway id="fork"/> <parallelGateway id="join"/>
        <userTask id="a"/> <userTask id="b"/> <task id="after"/>
        start -> fork -> a -> join
        fork -> b -> join -> after
    """).start()
    assert play.at == "a b"
    assert play.answer(prompt="b").at == "a join"
    assert play.answer(prompt="a").entered() == "start fork a b join join after"
    assert play.ended == "completed"


def test_the_token_that_comes_last_goes_on_and_the_others_are_consumed() -> None:
    play = Play("""
        <startEvent id="start"/> <parallelGateway id="fork"/> <parallelGateway id="join"/>
        <userTask id="after"/>
        start -> fork -> join
        fork -> join -> after
    """).start()
    entered = [x for x in play.records() if isinstance(x, r.TokenEntered)]
    assert [(x.token, x.element) for x in entered] == [
        (1, "start"),
        (1, "fork"),
        (1, "join"),
        (2, "join"),
        (1, "after"),
    ]


def test_a_join_asks_which_flows_have_come_never_how_many_tokens() -> None:
    play = Play("""
        <startEvent id="start"/> <parallelGateway id="fork"/> <parallelGateway id="join"/>
        <userTask id="b"/> <userTask id="after"/>
        <exclusiveGateway id="merge"/>
        start -> fork
        fork -> merge
        fork -> merge
        fork -> b
        merge -> join
        b -> join -> after
    """).start()
    assert play.at == "b join join"
    assert play.answer(prompt="b").at == "join after"


def test_a_second_token_on_the_same_flow_waits_for_the_next_round() -> None:
    play = Play("""
        <startEvent id="start"/> <parallelGateway id="fork"/> <exclusiveGateway id="again"/>
        <receiveTask id="left" messageRef="m"/> <receiveTask id="right" messageRef="n"/>
        <parallelGateway id="join"/> <userTask id="after"/>
        <exclusiveGateway id="more"/>
        start -> fork
        fork -> again
        fork -> again
        fork -> more
        fork -> more
        again -> left -> join
        more -> right -> join -> after
    """).start()
    play.message("m").message("m")
    assert play.at == "right right join join"
    first, second = [t for t in play.run.state.tokens.values() if t.node.id == "join"]
    assert play.message("n").at == "right join after"
    assert first.id not in play.run.state.tokens
    assert second.id in play.run.state.tokens
    assert play.message("n").at == "after after"


def test_a_parallel_gateway_may_join_and_fork_at_once() -> None:
    play = Play("""
        <startEvent id="start"/> <parallelGateway id="fork"/> <parallelGateway id="both"/>
        <userTask id="a"/> <userTask id="b"/> <userTask id="c"/> <userTask id="d"/>
        start -> fork -> a -> both -> c
        fork -> b -> both -> d
    """).start()
    assert play.answer(prompt="a").at == "b both"
    assert play.answer(prompt="b").at == "c d"


def test_a_parallel_join_in_a_loop_takes_one_round_after_the_other() -> None:
    play = Play("""
        <startEvent id="start"/> <exclusiveGateway id="merge"/> <parallelGateway id="fork"/>
        <task id="a"/> <task id="b"/> <parallelGateway id="join"/>
        <scriptTask id="count">n = n + 1</scriptTask> <exclusiveGateway id="more" default="out"/>
        <endEvent id="end"/>
        start -> merge -> fork -> a -> join
        fork -> b -> join -> count -> more
        more -> merge if n < 3
        out: more -> end
    """).start({"n": 0})
    assert play.ended == "completed"
    assert play.data == {"n": 3}
    assert play.entered().split().count("join") == 6


def test_a_gateway_in_an_unfinished_branch_of_another_instance_is_another_join() -> None:
    play = Play("""
        <process id="MAIN" isExecutable="true"> <startEvent id="start"/>
          <parallelGateway id="fork"/> <callActivity id="one" calledElement="P"/>
          <callActivity id="two" calledElement="P"/> <endEvent id="end"/>
          start -> fork -> one -> end
          fork -> two -> end
        </process>
        <process id="P"> <startEvent id="s"/> <parallelGateway id="f"/> <userTask id="u"/>
          <parallelGateway id="j"/> <endEvent id="e"/>
          s -> f -> u -> j
          f -> j -> e
        </process>
    """).start()
    assert play.at == "u j u j"
    assert play.answer(prompt="p1").at == "u j"
    assert play.answer(prompt="p2").ended == "completed"


# --- flows out of activities --------------------------------------------------------------------

CONDITIONAL = """
    <startEvent id="start"/> <task id="t" default="other"/>
    <task id="a"/> <task id="b"/> <task id="c"/>
    start -> t
    t -> a if x > 0
    t -> b if x > 1
    other: t -> c
"""


@pytest.mark.parametrize(("x", "expected"), [(2, "a b"), (1, "a"), (0, "c")])
def test_an_activity_leaves_by_every_true_flow_else_by_its_default(x: int, expected: str) -> None:
    assert Play(CONDITIONAL).start({"x": x}).entered() == f"start t {expected}"


def test_an_unconditional_flow_beside_conditional_ones_is_always_taken() -> None:
    text = CONDITIONAL.replace(' default="other"', "")
    assert Play(text).start({"x": 1}).entered() == "start t a c"


def test_an_activity_with_nothing_true_and_no_default_throws_no_flow() -> None:
    play = Play("""
        <startEvent id="start"/> <task id="t"/> <task id="a"/> <task id="rescue"/>
        <boundaryEvent id="stuck" attachedToRef="t">error NO_FLOW</boundaryEvent>
        start -> t
        t -> a if x > 0
        stuck -> rescue
    """).start()
    assert play.entered() == "start t stuck rescue"


def test_several_flows_without_a_gateway_fork_and_each_token_runs_what_they_merge_into() -> None:
    play = Play("""
        <startEvent id="start"/> <task id="a"/> <task id="b"/> <task id="merge"/>
        <endEvent id="end"/>
        start -> a -> merge -> end
        start -> b -> merge
    """).start()
    assert play.entered() == "start a b merge merge end end"
    assert play.ended == "completed"


def test_an_activity_that_nothing_follows_ends_its_path() -> None:
    play = Play("""
        <startEvent id="start"/> <task id="last"/>
        start -> last
    """).start()
    assert play.trace("leave", "close", "end") == table("""
        leave start; leave last; close MAIN; end completed
    """)


def test_a_flow_that_is_taken_says_which_conditions_were_null_and_why() -> None:
    text = """
        <startEvent id="start"/> <exclusiveGateway id="which" default="other"/>
        <task id="a"/> <task id="b"/>
        start -> which
        when_armed: which -> a if = armed
        when_near: which -> a if = x > 1 and near
        other: which -> b
    """
    play = Play(text).start({"x": 2})
    taken = [each for each in play.records() if isinstance(each, r.FlowTaken)]
    assert [each.reason for each in taken if each.flow == "other"] == [
        "condition of when_armed is null: armed is not set; "
        "condition of when_near is null: near is not set"
    ]
    assert [each.reason for each in taken if each.flow != "other"] == [""]
    play = Play(text).start({"x": 0, "armed": False})
    taken = [each for each in play.records() if isinstance(each, r.FlowTaken)]
    assert {each.reason for each in taken} == {""}


def test_where_no_flow_is_true_the_error_says_which_conditions_were_null() -> None:
    play = Play("""
        <startEvent id="start"/> <exclusiveGateway id="which"/> <task id="a"/> <task id="b"/>
        start -> which
        first: which -> a if = armed
        which -> b if = x > 5
    """).start({"x": 2})
    assert "NO_FLOW" in play.detail
    assert play.detail.endswith("; condition of first is null: armed is not set")


def test_a_condition_that_fails_names_its_part_and_the_values_in_the_record() -> None:
    play = Play("""
        <startEvent id="start"/> <exclusiveGateway id="which"/> <task id="a"/>
        start -> which
        first: which -> a if = x > 1 and a + 1 > 3
    """).start({"x": 2, "a": "low"})
    [error] = [record for record in play.records() if isinstance(record, r.ErrorThrown)]
    assert error.reason == (
        "condition of first: it has no value: '+' of the text 'low' and the number 1, "
        "in 'a + 1' at column 13 of '= x > 1 and a + 1 > 3', where a is the text 'low'"
    )
    assert error.reason in play.detail
