import pytest

from m2pem.api.epoch_fence import EpochFence


def test_an_epoch_below_the_highest_of_its_run_is_past() -> None:
    epochs = EpochFence()
    assert epochs.admit("r1.b1", 2)
    assert not epochs.admit("r1.b7", 1)
    assert epochs.admit("r1.b7", 2)
    assert epochs.admit("r2.b1", 1)


def test_the_run_seen_longest_ago_is_forgotten(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("m2pem.api.epoch_fence.REMEMBERED", 2)
    epochs = EpochFence()
    for run in ("r1", "r2", "r1", "r3"):
        epochs.admit(f"{run}.b1", 5)
    assert epochs.admit("r2.b1", 1)
    assert not epochs.admit("r3.b1", 1)
