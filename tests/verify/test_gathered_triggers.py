"""Boundary events that wait for all of their triggers."""

import pytest

from m2pem.resources.madeup import fleet_for
from m2pem.verify.derive import Options, derive
from m2pem.verify.explore import Limits, explore
from m2pem.verify.system import Action, Exactness, System
from tests.engine.notation import mission
from tests.verify.models import Walk

BOTH = """
<startEvent id="s"/><userTask id="ask">ask on</userTask><endEvent id="e"/>
<boundaryEvent id="b" attachedToRef="ask"{} parallelMultiple="true">{}</boundaryEvent>
<endEvent id="eb"/>
s -> ask -> e
b -> eb
"""
OPEN = Options(open_world=True)
INTERRUPTS, DOES_NOT = "", ' cancelActivity="false"'


def reached(system: System) -> set[tuple[str, Action]]:
    found = explore(system, Limits(tokens=3))
    return {(s.element, s.action) for rule in found.fired for s in system.rules[rule].steps}


@pytest.mark.parametrize("attributes", [INTERRUPTS, DOES_NOT])
def test_one_trigger_of_several_is_not_enough(attributes: str) -> None:
    text = BOTH.format(attributes, "signal S; message M").replace("</process>", "")
    some = derive(mission(text))  # nothing sends them
    assert ("b", Action.COMPLETED) not in reached(some)
    every = derive(mission(text), options=OPEN)
    assert ("b", Action.COMPLETED) in reached(every)
    assert not [a for a in every.approximations if a.element == "b"]


def test_a_run_has_every_trigger_before_the_event_is_left() -> None:
    system = derive(mission(BOTH.format(INTERRUPTS, "signal S; timer PT5S")), options=OPEN)
    found = explore(system)
    (left,) = [r for r in system.rules if r.element == "b" and r.steps[0].action == "completed"]
    run = [system.rules[rule] for rule in found.run_to(found.fired[left.index])]
    triggers = {rule.trigger for rule in run if rule.trigger is not None}
    assert triggers == {"signal", "timer"}
    assert any(step.action is Action.INTERRUPTED for rule in run for step in rule.steps)


@pytest.mark.parametrize("attributes", [INTERRUPTS, DOES_NOT])
@pytest.mark.parametrize(
    "triggers",
    ["signal S; timer PT5S", "message M; signal S; timer PT2S", "timer PT1S; timer PT3S"],
)
@pytest.mark.parametrize("in_order", [False, True])
def test_the_rules_can_do_what_the_engine_does(
    attributes: str, triggers: str, in_order: bool
) -> None:
    more = '\n<boundaryEvent id="t" attachedToRef="ask">timer PT2S</boundaryEvent>\n'
    text = BOTH.format(attributes, triggers).replace(
        '<endEvent id="eb"/>', f'<endEvent id="eb"/>{more}<endEvent id="et"/>'
    )
    ways = mission(text + "t -> et\n")
    system = derive(ways, options=Options(open_world=True, timers_in_order=in_order))
    for seed in range(12):
        assert Walk(ways, fleet_for(ways), system, seed).go() == ""


def test_conditions_that_come_again_are_still_told_as_approximated() -> None:
    text = BOTH.format(DOES_NOT, "signal S; conditional a == 1")
    kinds = [a.exactness for a in derive(mission(text)).approximations if a.element == "b"]
    assert Exactness.MORE in kinds
