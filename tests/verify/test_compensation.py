"""What undoes what was done is followed as the engine does it."""

from random import Random

import pytest

from m2pem.fleet.default_fleet import fleet_for
from m2pem.verify.check import check
from m2pem.verify.net.petri_net import Action, Exactness, Kind, PetriNet, Role
from m2pem.verify.net.simplify import simplify
from m2pem.verify.properties.results import Verdict
from m2pem.verify.search.explore import Limits, explore
from m2pem.verify.translate import Options, translate
from tests.engine.notation import mission
from tests.engine.random_compensation import with_compensation
from tests.engine.random_missions import graph, structured
from tests.verify.models import Walk
from tests.verify.test_spin_agreement import one_answer, same
from tests.verify.trace_mapping import TooManyStatesError

OPEN = Options(open_world=True)
EXACT = (30, 36, 87, 126, 154, 176, 206, 242, 261, 297, 309, 329, 339, 362, 387, 393)
"""Random missions in which something is undone, and no transition stops at a bound."""

BY_ITSELF = """
<startEvent id="start"/> <endEvent id="end"/> <userTask id="later">ask on</userTask>
<intermediateThrowEvent id="back">compensate</intermediateThrowEvent>
<subProcess id="sub">
  <startEvent id="s"/> <userTask id="a">ask on</userTask> <endEvent id="e"/>
  <subProcess id="undo" triggeredByEvent="true">
    <startEvent id="us">compensate</startEvent>
    {inside}
  </subProcess>
  s -> a -> e
  {undoes}
</subProcess>
{boundary}
start -> sub -> later -> back -> end
"""
ONE_TASK = '<userTask id="x">ask on</userTask> <endEvent id="ue"/> us -> x -> ue'
THROWS = """
<intermediateThrowEvent id="all">compensate</intermediateThrowEvent>
<userTask id="x">ask on</userTask> <endEvent id="ue"/>
us -> all -> x -> ue
"""
FAILS = '<endEvent id="ue">error E</endEvent> us -> ue'
UNDOES_A = '<userTask id="unA" isForCompensation="true">ask on</userTask>\na undo unA'
CATCHES = """
<boundaryEvent id="b" attachedToRef="sub">error E</boundaryEvent> <endEvent id="caught"/>
b -> caught
"""


def by_itself(inside: str = ONE_TASK, *, undoes: str = "", boundary: str = "") -> str:
    lines = "\n".join(part.strip() for part in inside.replace(" us ->", "\nus ->").split("\n"))
    return BY_ITSELF.format(inside=lines, undoes=undoes, boundary=boundary)


DEFAULT = """
<startEvent id="start"/> <endEvent id="end"/>
<intermediateThrowEvent id="back">compensate{}</intermediateThrowEvent>
<subProcess id="outer">
  <startEvent id="s"/> <endEvent id="e"/>
  <subProcess id="inner">
    <startEvent id="s2"/> <userTask id="a">ask on</userTask> <endEvent id="e2">{}</endEvent>
    <userTask id="unA" isForCompensation="true">ask on</userTask>
    s2 -> a -> e2
    a undo unA
  </subProcess>
  s -> inner -> e
</subProcess>
start -> outer -> back -> end
"""
TWO_THROWS = """
<startEvent id="start"/> <userTask id="a">ask on</userTask> <parallelGateway id="fork"/>
<endEvent id="one">compensate</endEvent> <endEvent id="two">compensate</endEvent>
<userTask id="unA" isForCompensation="true">ask on</userTask>
start -> a -> fork -> one
fork -> two
a undo unA
"""
INTERRUPTED_UNDOING = """
<startEvent id="start"/> <userTask id="a">ask on</userTask> <userTask id="b">ask on</userTask>
<endEvent id="back">compensate</endEvent>
<userTask id="unA" isForCompensation="true">ask on</userTask>
<userTask id="unB" isForCompensation="true">ask on</userTask>
<boundaryEvent id="late" attachedToRef="unB">timer PT5S</boundaryEvent> <endEvent id="left"/>
<subProcess id="stop" triggeredByEvent="true">
  <startEvent id="hs">signal S</startEvent> <endEvent id="he">compensate</endEvent>
  hs -> he
</subProcess>
start -> a -> b -> back
late -> left
a undo unA
b undo unB
"""
HANDLED = """
<startEvent id="start"/> <endEvent id="end"/> <userTask id="later">ask on</userTask>
<endEvent id="back">compensate</endEvent>
<subProcess id="sub">
  <startEvent id="s"/> <userTask id="a">ask on</userTask> <endEvent id="e"/>
  <subProcess id="handler" triggeredByEvent="true">
    <startEvent id="hs">signal S</startEvent> <endEvent id="he"/>
    hs -> he
  </subProcess>
  s -> a -> e
</subProcess>
<userTask id="unSub" isForCompensation="true">ask on</userTask>
start -> sub -> later -> back
sub undo unSub
"""
CALLED = """
<process id="MAIN"><startEvent id="start"/> <endEvent id="back">compensate</endEvent>
<callActivity id="call" calledElement="OTHER"/>
start -> call -> back
</process>
<process id="OTHER"><startEvent id="s"/> <task id="a"/> <endEvent id="e"/>
<subProcess id="undo" triggeredByEvent="true">
  <startEvent id="us">compensate</startEvent> <userTask id="x">ask on</userTask> <endEvent id="ue"/>
  us -> x -> ue
</subProcess>
s -> a -> e
</process>
"""
INSTANCES = """
<startEvent id="start"/> <endEvent id="back">compensate</endEvent>
<subProcess id="sub"><each>2</each>
  <startEvent id="s"/> <userTask id="a">ask on</userTask> <endEvent id="e"/>
  <subProcess id="undo" triggeredByEvent="true">
    <startEvent id="us">compensate</startEvent> <userTask id="x">ask on</userTask>
    <endEvent id="ue"/>
    us -> x -> ue
  </subProcess>
  s -> a -> e
</subProcess>
start -> sub -> back
"""
MISSIONS = {
    "by itself": by_itself(),
    "throws again": by_itself(THROWS, undoes=UNDOES_A),
    "fails": by_itself(FAILS, boundary=CATCHES),
    "default": DEFAULT.format("", ""),
    "named": DEFAULT.format(" outer", ""),
    "not waiting": DEFAULT.format(" outer nowait", ""),
    "terminated": DEFAULT.format("", "terminate"),
    "two throws": TWO_THROWS,
    "interrupted": INTERRUPTED_UNDOING,
    "handled": HANDLED,
    "called": CALLED,
    "instances": INSTANCES,
}


def reached(net: PetriNet) -> set[str]:
    found = explore(net, Limits(tokens=3))
    steps = {step for transition in found.fired for step in net.transitions[transition].steps}
    return {step.element for step in steps if step.action is not Action.INTERRUPTED}


@pytest.mark.parametrize("text", MISSIONS.values(), ids=MISSIONS)
def test_the_transitions_can_do_what_the_engine_does(text: str) -> None:
    read = mission(text)
    net = translate(read, options=OPEN)
    assert not [a for a in net.approximations if a.exactness is Exactness.BOUNDED]
    for seed in range(12):
        assert Walk(read, fleet_for(read), net, seed).go() == ""


@pytest.mark.parametrize("text", MISSIONS.values(), ids=MISSIONS)
def test_spin_sees_the_same(text: str) -> None:
    read = mission(text)
    same(translate(read, options=OPEN))
    one_answer(read)


@pytest.mark.parametrize("seed", EXACT)
def test_the_transitions_can_do_what_the_engine_does_of_random_compensation(seed: int) -> None:
    dice = Random(seed)
    read, text = with_compensation((structured if seed % 3 else graph)(dice), dice)
    net = translate(read, options=OPEN)
    assert not [a for a in net.approximations if a.exactness is Exactness.BOUNDED]
    for walk in range(4):
        try:
            game = Walk(read, fleet_for(read), net, walk)
            lost = game.go()
        except TooManyStatesError:
            continue
        detail = game.run.state.detail
        if lost and "EXPRESSION" not in detail and not detail.startswith("stuck"):
            small = explore(simplify(net), Limits(states=20_000, tokens=3))
            assert small.overflows, f"{lost}\n{text}"


def test_an_event_subprocess_undoes_what_has_completed_and_nothing_else() -> None:
    assert {"undo", "us", "x", "ue"} <= reached(translate(mission(by_itself())))
    ended = by_itself().replace('<endEvent id="e"/>', '<endEvent id="e">terminate</endEvent>')
    assert not {"undo", "us", "x", "ue"} & reached(translate(mission(ended)))


def test_what_was_ended_early_is_not_undone() -> None:
    assert "unA" in reached(translate(mission(DEFAULT.format("", ""))))
    assert "unA" not in reached(translate(mission(DEFAULT.format("", "terminate"))))
    assert "unSub" in reached(translate(mission(HANDLED), options=OPEN))
    never = HANDLED.replace("signal S", "timer PT5S").replace(
        '<userTask id="a">ask on</userTask>',
        '<intermediateCatchEvent id="a">signal NEVER</intermediateCatchEvent>',
    )
    found = reached(translate(mission(never)))
    assert "back" in found
    assert "unSub" not in found


def test_a_throw_does_not_wait_for_what_another_one_undoes() -> None:
    net = translate(mission(TWO_THROWS))
    found = explore(net)
    rests = [
        {net.places[p].element for p in found.marking(state).tokens if _shows(net, p)}
        for state in range(len(found.states))
        if all(net.transitions[r].kind is Kind.EXTERNAL for r, _ in found.successors(state))
    ]
    assert [each for each in rests if "unA" in each] == [{"unA", "one"}, {"unA", "two"}]


def _shows(net: PetriNet, place: int) -> bool:
    return net.places[place].role is Role.ACTIVE


def test_the_errors_of_what_undoes_pass_by_the_boundary_of_what_is_undone() -> None:
    read = mission(by_itself(FAILS, boundary=CATCHES))
    assert "caught" not in reached(translate(read))
    results = {each.property: each for each in check(read).results}
    (violation,) = results["errors-caught"].violations
    assert violation.elements[0] == "ue"


FOREVER = """
<exclusiveGateway id="again"/> <userTask id="x">ask on</userTask>
us -> again -> x -> again
"""
TWICE = """
<parallelGateway id="fork"/> <parallelGateway id="join"/> <endEvent id="ue"/>
<scriptTask id="x">do drive_stop evsg1</scriptTask>
<scriptTask id="y">do drive_stop {}</scriptTask>
us -> fork -> x -> join -> ue
fork -> y -> join
"""


@pytest.mark.parametrize(
    ("inside", "asked", "elements"),
    [
        (FOREVER, "no-livelock", {"x"}),
        (TWICE.format("evsg1"), "one-behavior", {"x", "y"}),
    ],
)
def test_what_is_wrong_in_an_event_subprocess_that_undoes_is_found(
    inside: str, asked: str, elements: set[str]
) -> None:
    broken = mission(by_itself(inside))
    (result,) = [each for each in check(broken).results if each.property == asked]
    assert result.verdict is Verdict.VIOLATED
    assert {element for each in result.violations for element in each.elements} == elements
    assert one_answer(broken) is Verdict.VIOLATED


def test_the_same_without_the_mistake_holds() -> None:
    report = check(mission(by_itself(TWICE.format("evsg2"))))
    assert {each.property for each in report.results if each.verdict is not Verdict.HOLDS} == {
        "failures-handled"
    }
