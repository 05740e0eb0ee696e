"""The garbage collector while a mission is read."""

import gc
from collections.abc import Iterator

import pytest

from m2pem.model.bpmn import collector


@pytest.fixture(autouse=True)
def _on_again() -> Iterator[None]:
    yield
    gc.unfreeze()
    gc.enable()


def test_it_is_off_meanwhile_and_on_again_after_an_error() -> None:
    with pytest.raises(KeyError), collector.paused():
        assert not gc.isenabled()
        raise KeyError
    assert gc.isenabled()


def test_it_stays_off_where_it_was_off() -> None:
    gc.disable()
    with collector.paused():
        pass
    assert not gc.isenabled()


def test_what_a_program_has_frozen_stays_frozen() -> None:
    gc.freeze()
    with collector.paused():
        pass
    assert gc.get_freeze_count() > 0
