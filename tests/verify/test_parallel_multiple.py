"""Events that wait for all of their triggers."""

from dataclasses import replace

import pytest

from m2pem.fleet.default_fleet import fleet_for
from m2pem.verify.net.petri_net import Action, Exactness, PetriNet, Role
from m2pem.verify.search.explore import Limits, explore
from m2pem.verify.translate import Options, translate
from tests.engine.notation import mission
from tests.verify.models import Walk
from tests.verify.test_spin_agreement import same

BOTH = """
<startEvent id="s"/><userTask id="ask">ask on</userTask><endEvent id="e"/>
<boundaryEvent id="b" attachedToRef="ask"{} parallelMultiple="true">{}</boundaryEvent>
<endEvent id="eb"/>
s -> ask -> e
b -> eb
"""
OPEN = Options(open_world=True)
INTERRUPTS, DOES_NOT = "", ' cancelActivity="false"'


def reached(net: PetriNet) -> set[tuple[str, Action]]:
    found = explore(net, Limits(tokens=3))
    return {
        (s.element, s.action)
        for transition in found.fired
        for s in net.transitions[transition].steps
    }


@pytest.mark.parametrize("attributes", [INTERRUPTS, DOES_NOT])
def test_one_trigger_of_several_is_not_enough(attributes: str) -> None:
    text = BOTH.format(attributes, "signal S; message M").replace("</process>", "")
    some = translate(mission(text))  # nothing sends them
    assert ("b", Action.COMPLETED) not in reached(some)
    every = translate(mission(text), options=OPEN)
    assert ("b", Action.COMPLETED) in reached(every)
    assert not [a for a in every.approximations if a.element == "b"]


def test_a_run_has_every_trigger_before_the_event_is_left() -> None:
    net = translate(mission(BOTH.format(INTERRUPTS, "signal S; timer PT5S")), options=OPEN)
    found = explore(net)
    (left,) = [r for r in net.transitions if r.element == "b" and r.steps[0].action == "completed"]
    run = [net.transitions[transition] for transition in found.run_to(found.fired[left.index])]
    triggers = {transition.trigger for transition in run if transition.trigger is not None}
    assert triggers == {"signal", "timer"}
    assert any(step.action is Action.INTERRUPTED for transition in run for step in transition.steps)


@pytest.mark.parametrize("attributes", [INTERRUPTS, DOES_NOT])
@pytest.mark.parametrize(
    "triggers",
    ["signal S; timer PT5S", "message M; signal S; timer PT2S", "timer PT1S; timer PT3S"],
)
@pytest.mark.parametrize("in_order", [False, True])
def test_the_transitions_can_do_what_the_engine_does(
    attributes: str, triggers: str, in_order: bool
) -> None:
    more = '\n<boundaryEvent id="t" attachedToRef="ask">timer PT2S</boundaryEvent>\n'
    text = BOTH.format(attributes, triggers).replace(
        '<endEvent id="eb"/>', f'<endEvent id="eb"/>{more}<endEvent id="et"/>'
    )
    ways = mission(text + "t -> et\n")
    net = translate(ways, options=Options(open_world=True, timers_in_order=in_order))
    for seed in range(12):
        assert Walk(ways, fleet_for(ways), net, seed).go() == ""


CONDITIONS = """
<startEvent id="s"/><userTask id="ask">ask on</userTask><endEvent id="e"/>
<scriptTask id="one">a = 1</scriptTask><scriptTask id="two">a = 2</scriptTask>
<userTask id="wait">ask on</userTask><endEvent id="e2"/><parallelGateway id="fork"/>
<boundaryEvent id="b" attachedToRef="ask"{} parallelMultiple="true">{}</boundaryEvent>
<endEvent id="eb"/>
s -> fork -> ask -> e
fork -> one -> wait -> two -> e2
b -> eb
"""
HANDLER = """
<startEvent id="s"/><scriptTask id="one">a = 1</scriptTask><userTask id="ask">ask on</userTask>
<scriptTask id="two">a = 2</scriptTask><userTask id="then">ask on</userTask><endEvent id="e"/>
<subProcess id="handler" triggeredByEvent="true">
  <startEvent id="b"{} parallelMultiple="true">{}</startEvent>
  <task id="h"/><endEvent id="he"/>
  b -> h -> he
</subProcess>
s -> one -> ask -> two -> then -> e
"""
FAILING = """
<startEvent id="s"/><subProcess id="sub">
  <startEvent id="s2"/><userTask id="ask">ask on</userTask><endEvent id="e2">error E</endEvent>
  s2 -> ask -> e2
</subProcess><endEvent id="e"/>
<boundaryEvent id="b" attachedToRef="sub" parallelMultiple="true">{}</boundaryEvent>
<endEvent id="eb"/>
s -> sub -> e
b -> eb
"""
BEGUN = """
<process id="MAIN"><startEvent id="s"/><userTask id="ask">ask on</userTask><endEvent id="e"/>
s -> ask -> e
</process>
<process id="OTHER"><startEvent id="b" parallelMultiple="true">{}</startEvent>
<userTask id="h">ask on</userTask><endEvent id="he"/>
b -> h -> he
</process>
"""
DOES_NOT_BEGIN = ' isInterrupting="false"'
MORE = {
    "conditions": CONDITIONS.format(INTERRUPTS, "signal S; conditional a == 2"),
    "conditions again": CONDITIONS.format(DOES_NOT, "signal S; conditional a == 1"),
    "two conditions": CONDITIONS.format(DOES_NOT, "conditional a >= 1; conditional a == 2"),
    "event subprocess": HANDLER.format(INTERRUPTS, "signal S; signal T"),
    "event subprocess again": HANDLER.format(DOES_NOT_BEGIN, "signal S; message M"),
    "event subprocess, timers": HANDLER.format(DOES_NOT_BEGIN, "timer PT1S; cycle R/PT3S"),
    "event subprocess, condition": HANDLER.format(INTERRUPTS, "signal S; conditional a == 2"),
    "event subprocess, condition again": HANDLER.format(
        DOES_NOT_BEGIN, "signal S; conditional a == 1"
    ),
    "error": FAILING.format("signal S; error E"),
    "error and two": FAILING.format("signal S; timer PT5S; error E"),
    "process": BEGUN.format("signal S; signal T"),
    "process, message": BEGUN.format("message M; message N"),
}


@pytest.mark.parametrize("text", MORE.values(), ids=MORE)
def test_the_transitions_can_do_what_the_engine_does_wherever_all_must_come(text: str) -> None:
    read = mission(text)
    net = translate(read, options=OPEN)
    for seed in range(16):
        assert Walk(read, fleet_for(read), net, seed).go() == ""
    assert not [a for a in net.approximations if a.exactness is Exactness.MORE]


@pytest.mark.parametrize("text", MORE.values(), ids=MORE)
def test_spin_sees_the_same_wherever_all_must_come(text: str) -> None:
    same(translate(mission(text), options=OPEN))


@pytest.mark.parametrize("begins", [INTERRUPTS, DOES_NOT_BEGIN])
def test_an_event_subprocess_begins_when_all_have_come(begins: str) -> None:
    text = HANDLER.format(begins, "signal S; timer PT5S")
    assert ("h", Action.COMPLETED) not in reached(translate(mission(text)))  # nothing sends S
    assert ("h", Action.COMPLETED) in reached(translate(mission(text), options=OPEN))


def test_a_process_begins_with_one_and_goes_on_when_all_have_come() -> None:
    text = BEGUN.format("signal S; signal T").replace(
        '<userTask id="ask">ask on</userTask>',
        '<intermediateThrowEvent id="ask">signal {}</intermediateThrowEvent>',
        1,
    )
    one = reached(translate(mission(text.format("S"))))
    assert ("b", Action.TRIGGERED) in one
    assert ("h", Action.ENTERED) not in one
    assert ("h", Action.ENTERED) in reached(translate(mission(text.format("S; signal T"))))


def test_an_error_that_is_one_of_several_triggers_is_enough() -> None:
    net = translate(mission(FAILING.format("signal S; error E")))
    assert ("b", Action.COMPLETED) in reached(net)
    without = translate(mission(FAILING.format("signal S; error F")))
    assert ("b", Action.COMPLETED) not in reached(without)


def test_a_condition_must_be_seen_false_before_it_comes_again() -> None:
    at_once = CONDITIONS.format(DOES_NOT, "signal S; conditional a >= 1")
    again = at_once.replace("a = 2", "a = 0; b = 1").replace("two -> e2", "two -> three -> e2")
    again = again.replace("<endEvent", '<scriptTask id="three">a = 1</scriptTask><endEvent', 1)
    once, twice = (translate(mission(text), options=OPEN) for text in (at_once, again))
    assert most_often(once, "eb") == 1
    assert most_often(twice, "eb") == 2


def most_often(net: PetriNet, element: str) -> int:
    """How many tokens can be together at an end event, if none goes on from there."""
    at = {p.index for p in net.places if p.element == element and p.role is Role.ENTERING}
    stays = tuple(r for r in net.transitions if not at & {p for p, _ in r.consume})
    held = replace(net, transitions=tuple(replace(r, index=n) for n, r in enumerate(stays)))
    found = explore(held, Limits(tokens=3))
    tokens = [found.marking(state).tokens for state in range(len(found.states))]
    return max(each.get(place, 0) for each in tokens for place in at)


def test_behind_an_event_based_gateway_it_is_told_that_one_is_enough() -> None:
    text = """
    <startEvent id="s"/><eventBasedGateway id="g"/><endEvent id="e"/><endEvent id="e2"/>
    <intermediateCatchEvent id="b" parallelMultiple="true">signal S; signal T
    </intermediateCatchEvent>
    <intermediateCatchEvent id="t">timer PT5S</intermediateCatchEvent>
    s -> g -> b -> e
    g -> t -> e2
    """
    kinds = [a.exactness for a in translate(mission(text)).approximations if a.element == "b"]
    assert kinds == [Exactness.MORE]
