"""The garbage collector while a mission is read."""

import gc
from collections.abc import Iterator

import pytest

from m2pem.bpmn import garbage_collection


@pytest.fixture(autouse=True)
def _as_python_starts() -> Iterator[None]:
    """The collector as it is by default, whatever the tests have set (`conftest.py`)."""
    before = gc.get_threshold()
    gc.unfreeze()
    gc.set_threshold(700, 10, 10)
    yield
    gc.set_threshold(*before)
    gc.enable()
    gc.freeze()


def test_the_collector_is_off_meanwhile_and_on_again_after_an_error() -> None:
    with pytest.raises(KeyError), garbage_collection.paused():
        assert not gc.isenabled()
        raise KeyError
    assert gc.isenabled()


def test_the_collector_stays_off_where_it_was_off() -> None:
    gc.disable()
    with garbage_collection.paused():
        pass
    assert not gc.isenabled()


def test_what_a_program_has_frozen_stays_frozen() -> None:
    gc.freeze()
    with garbage_collection.paused():
        pass
    assert gc.get_freeze_count() > 0


class Circle:
    """Garbage that only the collector finds."""

    alive = 0

    def __init__(self) -> None:
        self.itself = self
        Circle.alive += 1

    def __del__(self) -> None:
        Circle.alive -= 1


@pytest.mark.parametrize(("circles", "times"), [(20, 60), (60, 20)])
def test_what_is_read_and_dropped_again_and_again_does_not_stay(
    monkeypatch: pytest.MonkeyPatch, circles: int, times: int
) -> None:
    monkeypatch.setattr(garbage_collection, "MANY", 50)  # the larger ones are many
    monkeypatch.setattr(garbage_collection, "AT_MOST_UNSEARCHED", 500)
    gc.collect()
    for _ in range(times):
        with garbage_collection.paused():
            read = [Circle() for _ in range(circles)]
        del read
    assert Circle.alive < circles * times / 2
