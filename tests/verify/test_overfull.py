"""Places that get more tokens than are meant there."""

import pytest

from m2pem.verify.net.petri_net import Action, Kind, PetriNet, Place, Role, Scope, Step, Transition
from m2pem.verify.search.explore import Limits, Stopped, explore

ENDS = tuple(Place(n, f"end{n}", f"end{n}", 0, Role.END) for n in range(3))
START, REACHED, WORK = 3, 4, 5


def fills(*made: tuple[int, int]) -> PetriNet:
    """One transition makes these tokens all at once; then the work is done, a token at a time."""
    places = (
        *ENDS,
        Place(START, "start", "start", 0, Role.ACTIVE),
        Place(REACHED, "reached", "reached", 0, Role.CONTROL, once=True),
        Place(WORK, "work", "work", 0, Role.ACTIVE),
    )
    step = (Step("start", Action.COMPLETED),)
    transitions = (
        Transition(0, "begin", Kind.INTERNAL, step, consume=((START, 1),), produce=made),
        Transition(1, "work", Kind.EXTERNAL, step, consume=((WORK, 1),)),
    )
    return PetriNet(
        "m.bpmn",
        "P",
        (Scope(0, "P", None, ()),),
        places,
        (),
        transitions,
        ((START, 1),),
        completed=0,
        terminated=1,
        failed=2,
        elements={each.element: each.element for each in places},
    )


@pytest.mark.parametrize("made", [((REACHED, 2), (WORK, 2)), ((WORK, 2), (REACHED, 2))])
def test_a_place_that_is_overfull_together_with_an_end_is_given_room(
    made: tuple[tuple[int, int], ...],
) -> None:
    found = explore(fills(*made))
    assert found.complete
    assert set(found.overflows) == {REACHED, WORK}
    assert len(found.states) == 4  # before, and with two, one and none left of the work


def test_what_has_no_room_for_all_is_never_taken_for_complete() -> None:
    found = explore(fills((REACHED, 2), (WORK, 9)), Limits(tokens=3))
    assert found.stopped is Stopped.TOKENS
    assert found.beyond == {WORK}
