"""Leaving out orders of steps changes no answer."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from m2pem.fleet.default_fleet import fleet_for
from m2pem.mission.mission import Mission
from m2pem.verify.assumptions import NO_FAILURES
from m2pem.verify.ltl import parse
from m2pem.verify.ltl.formula import Active, Completed, Formula, Proposition, rebuilt
from m2pem.verify.ltl.model_check import Result
from m2pem.verify.requirements import Requirement
from m2pem.verify.requirements.check import (
    check_requirement,
    net_for,
    reduction_for,
)
from m2pem.verify.search.explore import Exploration, explore
from m2pem.verify.search.stubborn_sets import states_to_expand
from m2pem.verify.translate import Options
from tests.bpmn.bpmn_text import flow
from tests.seeds import examples
from tests.verify import formulas
from tests.verify.answers import check_mission
from tests.verify.branches import branches, shapes
from tests.verify.missions import ask
from tests.verify.missions import mission as build
from tests.verify.models import branches as user_tasks

CERTAIN = Options(assumed=NO_FAILURES)


def about(formula: Formula, atoms: dict[Proposition, Proposition]) -> Formula:
    if isinstance(formula, (Active, Completed)):
        return atoms[formula]
    return rebuilt(formula, lambda each: about(each, atoms))


@settings(max_examples=examples(15, 60), deadline=None)
@given(shapes, st.booleans(), formulas.formulas, st.data())
def test_no_answer_changes(
    shape: list[tuple[int, bool]], interruptible: bool, formula: Formula, data: st.DataObject
) -> None:
    mission = branches(shape, interruptible=interruptible)
    fleet = fleet_for(mission)
    ids = sorted(node.id for node in mission.nodes)
    atoms: dict[Proposition, Proposition] = {
        each: data.draw(st.sampled_from([Active, Completed]))(data.draw(st.sampled_from(ids)))
        for each in formulas.ATOMS
    }
    requirement = Requirement("a", about(formula, atoms), "")
    whole, reduced = (
        check_mission(mission, fleet, [requirement], options=CERTAIN, reduce=each)[0]
        for each in (False, True)
    )
    assert reduced.result is whole.result


def test_an_operator_who_goes_on_for_ever_in_one_branch_is_not_left_out() -> None:
    mission = branches([(2, False), (1, True)])
    requirement = Requirement("a", parse("<> completed(T0x1)"), "")
    fleet = fleet_for(mission)
    answer = check_mission(mission, fleet, [requirement], options=CERTAIN, reduce=True)[0]
    assert answer.result is Result.VIOLATED
    assert {step.element for transition in answer.cycle for step in transition.steps} >= {
        "A1",
        "D1",
    }


ORDERS = (
    "[](completed(t0_0) -> <> completed(t1_2))",
    "!completed(t1_1) W completed(t0_2)",
    "[] !(active(t0_1) && active(t1_1))",
    "<> completed(t0_2)",
)


def searched(mission: Mission, text: str) -> tuple[Exploration, Result]:
    """The reduced search for a requirement, and its answer."""
    fleet = fleet_for(mission)
    requirement = Requirement("a", parse(text), "")
    net = net_for(mission, fleet, [requirement], options=CERTAIN)
    found = explore(net, reduction=reduction_for(net, mission, fleet, requirement))
    return found, check_requirement(found, mission, fleet, requirement).result


@pytest.mark.parametrize("kind", ["plain", "interruptible", "error"])
@pytest.mark.parametrize("text", ORDERS)
def test_states_grow_with_the_number_of_branches_alone(kind: str, text: str) -> None:
    few, many = (
        user_tasks(n, interruptible=kind == "interruptible", error=kind == "error")
        for n in (3, 100)
    )
    found, result = searched(many, text)
    assert len(found.states) < 3 * 100 + 50
    whole = check_mission(few, fleet_for(few), [Requirement("a", parse(text), "")], options=CERTAIN)
    assert result is whole[0].result


@pytest.mark.parametrize(
    "text",
    [
        # The timer comes when one branch is done and another is not.
        "[](completed(B) -> !once(completed(t0_2)))",
        # The subprocess ends with the last of all branches, no matter which that is.
        "[](completed(t0_2) -> <> completed(SUB))",
        "[](completed(t0_2) -> (active(SUB) W completed(t1_2)))",
        "[](completed(t0_2) && once(completed(t1_2)) -> !<> completed(B))",
    ],
)
def test_what_ends_a_scope_is_not_brought_forward(text: str) -> None:
    mission = user_tasks(3, 3, interruptible=True)
    _, result = searched(mission, text)
    assert result is Result.VIOLATED


def test_what_follows_a_join_does_not_follow_before_its_time() -> None:
    mission = in_fork(
        ("A", ask("A", "ok")), ("B", ask("B", "ok")), beside=("C", ask("C", "ok")), after="X"
    )
    # A and C are done while B is not: X comes after C.
    _, result = searched(mission, "[](completed(A) -> (!completed(C) W active(X)))")
    assert result is Result.VIOLATED


def in_fork(*joined: tuple[str, str], beside: tuple[str, str], after: str) -> Mission:
    """Tasks that are joined before another one, and one beside all of that."""
    body = [
        '<startEvent id="S"/><parallelGateway id="F"/><parallelGateway id="J"/><endEvent id="E"/>',
        '<endEvent id="E2"/>',
        *(text for _, text in (*joined, beside)),
        ask(after, "ok"),
        *(flow("S", "F"), flow("J", after), flow(after, "E")),
        *(flow("F", beside[0]), flow(beside[0], "E2")),
    ]
    for name, _ in joined:
        body += [flow("F", name), flow(name, "J")]
    return build(*body)


@pytest.mark.parametrize("text", ["[] !completed(T)", "<> completed(T)"])
def test_what_is_beside_a_branch_that_never_ends_is_not_put_off_for_ever(text: str) -> None:
    mission = build(
        '<startEvent id="S"/><parallelGateway id="F"/><exclusiveGateway id="M"/><endEvent id="E"/>',
        *(ask("A", "ok"), ask("B", "ok"), ask("T", "ok")),
        *(flow("S", "F"), flow("F", "M"), flow("M", "A"), flow("A", "B"), flow("B", "M")),
        *(flow("F", "T"), flow("T", "E")),
    )
    _, result = searched(mission, text)
    assert result is Result.VIOLATED


def test_nothing_is_put_off_on_every_state_of_a_circle() -> None:
    ring = [[1], [2, 3], [0], []]
    assert states_to_expand(ring, inner=(), partly={1}) == set()  # there is another state on it
    assert states_to_expand(ring, inner=(), partly={0, 1, 2}) == {0}
    assert states_to_expand(ring, inner={0, 2}, partly={1}) == {1}
    assert states_to_expand(ring, inner={0, 1, 2}, partly={0, 1}) == set()
    assert states_to_expand(ring, inner={0, 1, 2}, partly={0, 1, 2}) == {0}
    assert states_to_expand([[1], [2], []], inner=(), partly={0, 1}) == set()


def test_several_circles_through_one_state_are_each_broken() -> None:
    eight = [[1, 2], [0, 1], [0]]
    assert states_to_expand(eight, inner=(), partly={0, 1, 2}) == {0, 1}
