"""What is left out of a search changes no verdict."""

from itertools import pairwise
from random import Random

import pytest

from m2pem.verify.net import concurrency
from m2pem.verify.net.petri_net import PetriNet
from m2pem.verify.net.simplify import simplify
from m2pem.verify.search.explore import Exploration, Limits, explore
from m2pem.verify.search.stubborn_sets import StubbornSets
from m2pem.verify.translate import translate
from tests.bpmn.bpmn_text import flow
from tests.engine.notation import mission as notation
from tests.engine.random_missions import graph, structured
from tests.verify.missions import mission, task
from tests.verify.models import branches

SMALL = Limits(states=1_000, tokens=3, seconds=60.0)


def seen(found: Exploration) -> tuple[object, ...]:
    """What properties are read from, told by names."""
    net = found.net
    places = net.places
    return (
        {
            tuple(sorted((places[p].name, n) for p, n in found.marking(s).tokens.items()))
            for s in found.terminals
        },
        {step.element for transition in found.fired for step in net.transitions[transition].steps},
        {(net.transitions[r].element, net.transitions[r].flag) for r in found.flagged},
        bool(found.overflows),
    )


def reduced(net: PetriNet, **given: bool) -> Exploration:
    return explore(net, SMALL, reduction=StubbornSets(net), **given)


@pytest.mark.parametrize("seed", range(24))
def test_a_random_mission_shows_the_same_with_and_without_reduction(seed: int) -> None:
    whole = translate(notation((structured if seed % 2 else graph)(Random(1000 + seed))))
    small = simplify(whole)
    full = explore(whole, SMALL)
    if full.stopped is not None:
        pytest.skip("too large to look at whole")
    # A second token where tokens only pass is not seen once that place is taken out.
    simple = explore(small, SMALL)
    assert seen(simple)[:3] == seen(full)[:3]
    assert seen(reduced(small)) == seen(simple)


@pytest.mark.parametrize("seed", [3014, 3056])
def test_what_is_put_off_round_a_circle_is_tried_at_last(seed: int) -> None:
    small = simplify(translate(notation((structured if seed % 2 else graph)(Random(seed)))))
    assert seen(reduced(small)) == seen(explore(small, SMALL))


def test_branches_are_searched_in_time_that_grows_with_their_number_alone() -> None:
    for interruptible in (False, True):
        net = simplify(translate(branches(100, interruptible=interruptible)))
        found = reduced(net)
        assert found.complete
        assert len(found.states) < 320
        assert set(found.fired) == set(range(len(net.transitions)))


def failing(count: int, *, service: bool = False) -> PetriNet:
    """Branches of tasks in a subprocess, each of which may fail, which interrupts all of it.

    They are a vehicle's, or a service's.
    """
    row = range(3)
    inside = '<startEvent id="s"/><parallelGateway id="f"/><parallelGateway id="j"/>'
    inside += f'<endEvent id="e"/>{flow("s", "f")}{flow("j", "e")}'
    for branch in range(count):
        names = ["f", *(f"t{branch}x{place}" for place in row), "j"]
        inside += "".join(
            f'<serviceTask id="{each}" m2pem:class="Work"/>'
            if service
            else task(each, f"v{branch}", "goto", target="x")
            for each in names[1:-1]
        )
        inside += "".join(flow(one, other) for one, other in pairwise(names))
    around = mission(
        f'<startEvent id="S"/><subProcess id="SUB">{inside}</subProcess><endEvent id="E"/>',
        '<boundaryEvent id="B" attachedToRef="SUB"><errorEventDefinition/></boundaryEvent>',
        f'<endEvent id="EB"/>{flow("S", "SUB")}{flow("SUB", "E")}{flow("B", "EB")}',
    )
    return simplify(translate(around))


def test_a_failure_that_interrupts_its_siblings_does_not_bring_their_orders_back() -> None:
    few = failing(3)
    assert seen(reduced(few)) == seen(explore(few))
    all_orders_are_left_out_but_one(failing(20))


def test_nor_does_it_where_there_are_too_many_places_to_prove_which_meet(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(concurrency, "MOST_PLACES", 0)
    few = failing(3, service=True)
    assert few.single is None
    assert seen(reduced(few)) == seen(explore(few))
    all_orders_are_left_out_but_one(failing(20, service=True))


def all_orders_are_left_out_but_one(many: PetriNet) -> None:
    found = reduced(many)
    assert found.complete
    assert len(found.states) < 70
    assert set(found.fired) == set(range(len(many.transitions)))


def test_without_reduction_every_order_is_searched() -> None:
    found = explore(simplify(translate(branches(5))))
    assert len(found.states) == 4**5 + 3
