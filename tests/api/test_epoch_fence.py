"""An executive that was replaced commands nothing of the run any more."""

from pathlib import Path

import pytest

from m2pem.api.epoch_fence import REMEMBERED, EpochFence
from m2pem.errors import StaleCommandError


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


def test_a_fence_with_a_file_refuses_past_epochs_after_a_restart(tmp_path: Path) -> None:
    file = tmp_path / "epochs.json"
    fence = EpochFence(file)
    assert fence.admit("r1.b1", 3)
    assert fence.admit("r2.b1", 1)
    assert file.stat().st_mode & 0o777 == 0o600
    again = EpochFence(file)
    assert again.newest("r1") == 3
    with pytest.raises(StaleCommandError, match=r"start of r1.b2 is refused: .* epoch 3 was seen"):
        again.require("start", "r1.b2", 2)
    again.require("start", "r2.b2", 1)


def test_a_fence_goes_on_without_its_file(tmp_path: Path, caplog) -> None:
    file = tmp_path / "epochs.json"
    file.write_text("[1")
    fence = EpochFence(file)
    assert "cannot be read" in caplog.text
    missing = EpochFence(tmp_path / "none" / "epochs.json")
    assert missing.admit("r1", 2)
    assert "cannot be kept" in caplog.text
    assert not missing.admit("r1", 1)
    assert fence.newest("r1") == 0
