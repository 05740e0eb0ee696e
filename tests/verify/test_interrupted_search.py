"""A search that is interrupted by hand, wherever it is, leaves behind what it has seen."""

import sys
from types import FrameType
from typing import Any

import pytest

from m2pem.verify.net.petri_net import PetriNet
from m2pem.verify.net.simplify import simplify
from m2pem.verify.search.explore import Exploration, Stopped, _Search, explore
from m2pem.verify.search.stubborn_sets import StubbornSets
from m2pem.verify.translate import translate
from tests.verify.models import branches


class Interruption:
    """Ctrl-C at the line that is the `at`-th one of the search."""

    def __init__(self, at: int) -> None:
        self.left = at

    def __call__(self, frame: FrameType, event: str, _: Any) -> Any:
        if frame.f_code is not _Search._loop.__code__:
            return None
        if event == "line":
            self.left -= 1
            if self.left == 0:
                raise KeyboardInterrupt
        return self


def interrupted(net: PetriNet, at: int, *, reduced: bool) -> tuple[Exploration, bool]:
    """What was seen then, and whether the search was long enough for that."""
    interruption, before = Interruption(at), sys.gettrace()
    sys.settrace(interruption)
    try:
        found = explore(net, reduction=StubbornSets(net) if reduced else None)
    finally:
        sys.settrace(before)
    return found, interruption.left <= 0


@pytest.mark.parametrize("reduced", [False, True])
def test_whatever_was_being_done_what_is_left_fits_together(reduced: bool) -> None:
    net = simplify(translate(branches(2)))
    at, met = 1, True
    while met:
        found, met = interrupted(net, at, reduced=reduced)
        assert (found.stopped is Stopped.INTERRUPTED) is met
        count = len(found.states)
        assert len(found.parents) == len(found.via) == count
        assert len(set(found.states)) == count
        for state in range(count):
            assert all(after < count for _, after in found.successors(state))
            run = found.run_to(state)
            assert (run == []) is (state == 0)
        assert all(state < count for state in (*found.terminals, *found.fired.values()))
        at += 1
    assert at > 100
