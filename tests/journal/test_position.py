import pytest

from m2pem.engine.records import RunEnded, RunOutcome, RunPaused, RunResumed, RunStarted
from m2pem.errors import InternalError, StaleEpochError
from m2pem.journal.position import RunPosition
from m2pem.testing.contracts.journal_harness import entry

NEW = RunPosition(epoch=3, pid=1, started_us=5)


def test_one_entry_may_say_several_things():
    first = entry("r1", 1, RunStarted("P", 9), RunPaused(10), RunResumed(11), epoch=3)
    after = NEW.after(first)
    assert (after.started_us, after.paused, after.last_seq, after.outcome) == (9, False, 3, None)
    ended = after.after(entry("r1", 4, RunPaused(12), RunEnded(RunOutcome.FAILED, "x"), epoch=3))
    assert (ended.paused, ended.outcome, ended.detail) == (False, RunOutcome.FAILED, "x")
    assert ended.ended_us == entry("r1", 4).at_us


def test_a_claim_raises_the_epoch_and_changes_nothing_else():
    after = NEW.after(entry("r1", 1, RunPaused(1), epoch=3))
    claimed = after.claimed(pid=2)
    assert (claimed.epoch, claimed.pid, claimed.paused, claimed.last_seq) == (4, 2, True, 1)


def test_an_entry_from_before_the_claim_says_who_is_shut_out():
    with pytest.raises(StaleEpochError, match=r"r1 was claimed.*\(epoch 3; this one has 2\)"):
        NEW.after(entry("r1", 1, epoch=2))


@pytest.mark.parametrize(("seq", "epoch"), [(2, 3), (0, 3), (1, 4)])
def test_an_entry_that_does_not_follow_is_a_bug(seq, epoch):
    with pytest.raises(InternalError, match="r1"):
        NEW.after(entry("r1", seq, epoch=epoch))
