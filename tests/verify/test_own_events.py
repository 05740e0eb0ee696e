"""What an element throws may interrupt what is around it, or itself: then it does not complete."""

import pytest

from m2pem.fleet.default_fleet import fleet_for
from m2pem.verify.net.petri_net import Action
from m2pem.verify.search.explore import explore
from m2pem.verify.spin.search import search
from m2pem.verify.translate import translate
from tests.engine.kit import Play
from tests.engine.notation import mission as notation
from tests.verify.models import Walk

BEHIND = """
    <userTask id="well"/> <userTask id="cut"/> <endEvent id="e"/>
    start -> work -> well -> e
    b -> cut -> e
"""
BY_ITSELF = """
    <startEvent id="start"/> <sendTask id="work" messageRef="m"/>
    <boundaryEvent id="b" attachedToRef="work"%s>message m</boundaryEvent>
"""
FROM_INSIDE = """
    <startEvent id="start"/>
    <subProcess id="work"> <startEvent id="s"/> %s
    s -> thrower -> rest
    <task id="rest"/> </subProcess>
    <boundaryEvent id="b" attachedToRef="work"%s>%s</boundaryEvent>
"""
HANDLED = """
    <startEvent id="start"/>
    <subProcess id="work"> <startEvent id="s"/> %s
    s -> thrower -> rest
    <task id="rest"/>
    <subProcess id="h" triggeredByEvent="true"> <startEvent id="hs">%s</startEvent> %s
    hs -> last -> cut
    <userTask id="cut"/> </subProcess> </subProcess>
    start -> work
"""
THROWERS = {
    "a signal": (
        '<intermediateThrowEvent id="thrower">signal g</intermediateThrowEvent>',
        "signal g",
    ),
    "a message": (
        '<intermediateThrowEvent id="thrower">message m</intermediateThrowEvent>',
        "message m",
    ),
    "a sent one": ('<sendTask id="thrower" messageRef="m"/>', "message m"),
}
ON = ' cancelActivity="false"'


def completed(text: str, element: str) -> tuple[bool, bool]:
    """Whether an element completes: in the engine's run, and in some run of the transitions."""
    mission = notation(text)
    play = Play(text).start()
    lines = play.trace()
    net = translate(mission)
    found = explore(net)
    spins = search(net)
    assert spins.fired == found.fired.keys()
    steps = {step for transition in found.fired for step in net.transitions[transition].steps}
    walk = Walk(mission, fleet_for(mission), net, 1)
    assert walk.go() == ""
    return f"leave {element}" in lines, any(
        step.element == element and step.action is Action.COMPLETED for step in steps
    )


@pytest.mark.parametrize("goes_on", [False, True])
def test_a_message_that_its_own_sender_waits_for(goes_on: bool) -> None:
    text = BY_ITSELF % (ON if goes_on else "") + BEHIND
    assert completed(text, "work") == (goes_on, goes_on)
    assert ("well" in Play(text).start().at) is goes_on


@pytest.mark.parametrize("kind", THROWERS)
@pytest.mark.parametrize("goes_on", [False, True])
def test_what_is_around_its_thrower(kind: str, goes_on: bool) -> None:
    thrower, event = THROWERS[kind]
    text = FROM_INSIDE % (thrower, ON if goes_on else "", event) + BEHIND
    assert completed(text, "thrower") == (goes_on, goes_on)
    assert completed(text, "rest") == (goes_on, goes_on)


@pytest.mark.parametrize("kind", THROWERS)
def test_an_event_subprocess_that_throws_again_what_it_began_with(kind: str) -> None:
    thrower, event = THROWERS[kind]
    text = HANDLED % (thrower, event, thrower.replace("thrower", "last"))
    assert completed(text, "thrower") == (False, False)
    assert completed(text, "last") == (True, True)
