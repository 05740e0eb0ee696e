"""Leaving out orders of steps changes no answer."""

from hypothesis import given, settings
from hypothesis import strategies as st

from m2pem.resources.madeup import fleet_for
from m2pem.verify.derive import Options, derive
from m2pem.verify.explore import explore
from m2pem.verify.ltl import parse
from m2pem.verify.ltl.formula import Active, Completed, Formula, Proposition, rebuilt
from m2pem.verify.product import Result
from m2pem.verify.requirements import Requirement
from m2pem.verify.requirements.checking import check_mission, check_requirement, reduction_for
from tests.verify import formulas
from tests.verify.branches import branches, shapes

CERTAIN = Options(failures=False)


def about(formula: Formula, atoms: dict[Proposition, Proposition]) -> Formula:
    if isinstance(formula, (Active, Completed)):
        return atoms[formula]
    return rebuilt(formula, lambda each: about(each, atoms))


@settings(max_examples=60, deadline=None)
@given(shapes, formulas.formulas, st.data())
def test_no_answer_changes(
    shape: list[tuple[int, bool]], formula: Formula, data: st.DataObject
) -> None:
    mission = branches(shape)
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
    assert {step.element for rule in answer.cycle for step in rule.steps} >= {"A1", "D1"}


def test_what_is_broken_once_and_for_all_needs_fewer_states() -> None:
    mission = branches([(2, False)] * 4)
    fleet = fleet_for(mission)
    system = derive(mission, fleet, options=CERTAIN)
    requirement = Requirement("a", parse("!completed(T1x1) W completed(T1x0)"), "")
    reduction = reduction_for(system, mission, fleet, requirement)
    assert reduction is not None
    found = explore(system, reduction=reduction)
    assert len(found.states) < len(explore(system).states) / 2
    assert check_requirement(found, mission, fleet, requirement).result is Result.HOLDS
