"""An executive that was replaced commands nothing of the run any more."""

import pytest

from m2pem.api.epoch_fence import REMEMBERED, EpochFence


@pytest.mark.parametrize("behavior", ["r1.b3", "r1.b4", "r1.b3.evsg1", "r1.b4.evsg2/gpr"])
def test_an_older_epoch_is_refused_for_every_behavior_and_part_of_the_run(behavior: str) -> None:
    fence = EpochFence()
    assert fence.admit("r1.b3.evsg1", 2)
    assert not fence.admit(behavior, 1)
    assert fence.admit(behavior, 2)


def test_another_run_has_epochs_apart() -> None:
    fence = EpochFence()
    assert fence.admit("r1.b1", 5)
    assert fence.admit("r11.b1", 1)


def test_the_run_whose_commands_came_longest_ago_is_forgotten_first() -> None:
    fence = EpochFence()
    assert fence.admit("r0.b1", 2)
    for number in range(1, REMEMBERED):
        assert fence.admit(f"r{number}.b1", 1)
    assert fence.admit("r0.b1.evsg1", 2)
    assert fence.admit("new.b1", 1)
    assert not fence.admit("r0.b1", 1)
    assert fence.admit("r1.b1", 0)
