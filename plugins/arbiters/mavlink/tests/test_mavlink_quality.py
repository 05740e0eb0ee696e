"""Loss is what never came: not what came late, twice, or after a restart."""

import random

import pytest
from m2pem_plugin_mavlink.protocol.quality import Reception
from mavlink_memory import held_bytes


def reception(*sequences: int, gap_s: float = 0.01) -> Reception:
    made = Reception(sequences[0] & 255, 0.0)
    for number, sequence in enumerate(sequences):
        made.count(sequence & 255, number * gap_s)
    return made


def test_numbers_wrap() -> None:
    made = reception(*range(250, 1_250))
    assert (made.sent, made.lost, made.doubled) == (1_000, 0, 0)


def test_a_gap_is_loss() -> None:
    made = reception(254, 255, 3)
    assert (made.sent, made.lost) == (6, 3)


def test_what_comes_late_is_not_lost() -> None:
    made = reception(1, 2, 5, 3, 6, 4, 7)
    assert (made.sent, made.lost, made.doubled) == (7, 0, 0)


def test_reordering_across_the_wrap_is_not_loss() -> None:
    made = reception(253, 255, 254, 1, 0, 2)
    assert (made.sent, made.lost, made.doubled) == (6, 0, 0)


def test_duplicates_are_neither_loss_nor_frames() -> None:
    made = reception(1, 1, 2, 3, 2, 4, 4)
    assert (made.sent, made.lost, made.doubled) == (4, 0, 3)


def test_a_late_frame_that_comes_twice_counts_once() -> None:
    made = reception(1, 3, 2, 2, 4)
    assert (made.sent, made.lost, made.doubled) == (4, 0, 1)


@pytest.mark.parametrize("seed", range(20))
def test_random_loss_reordering_and_duplicates_are_told_apart(seed: int) -> None:
    rng = random.Random(seed)
    lost = {number for number in range(1, 1_999) if rng.random() < 0.1}
    late = sorted(
        (number + rng.choice([0, 0, 0, rng.random() * 9]), number)
        for number in range(2_000)
        if number not in lost
    )
    # All of the last few come in order: what is still missing then is lost.
    arriving = [number for _, number in late for _ in range(rng.choice([1, 1, 1, 2]))]
    made = reception(*[0, *arriving, 2_000])
    assert (made.sent, made.lost) == (2_001, len(lost))


def test_a_sender_that_begins_anew_has_not_lost_frames() -> None:
    before, after = range(100), range(0, 60)
    made = reception(*before, *after)
    assert made.lost == 0
    assert made.expected & 255 == 60
    made.count(60, 2.0)
    assert made.lost == 0


def test_after_a_silence_nothing_is_late() -> None:
    made = reception(*range(100))
    made.count(90, 10.0)
    made.count(91, 10.01)
    assert made.expected & 255 == 92
    assert made.doubled == 0


def test_quality_is_that_of_the_last_seconds() -> None:
    made = Reception(0, 0.0)
    for second in range(20):
        for tenth in range(10):
            number = second * 10 + tenth
            if second >= 10 or tenth % 2 == 0:  # at first, half is lost
                made.count(number & 255, second + tenth / 10)
        made.sample(second + 0.95)
        if second == 9:
            early = made.quality(9.95)
    late = made.quality(19.95)
    assert early.loss == pytest.approx(0.5, abs=0.05)
    assert early.rate_hz == pytest.approx(5, rel=0.1)
    assert late.loss == 0
    assert late.rate_hz == pytest.approx(10, rel=0.1)
    assert late.age_s == pytest.approx(0.05)


def test_a_silent_sender_is_all_lost_and_old() -> None:
    made = Reception(0, 0.0)
    made.count(0, 0.0)
    for second in range(1, 20):
        made.sample(float(second))
    quality = made.quality(19.0)
    assert (quality.loss, quality.rate_hz, quality.age_s) == (1.0, 0.0, 19.0)


def test_samples_and_missing_numbers_do_not_pile_up() -> None:
    made, sizes = Reception(0, 0.0), []
    for number in range(0, 400_000, 4):
        made.count(number & 255, number / 1000)
        made.sample(number / 1000)
        if number in (20_000, 399_996):
            sizes.append(held_bytes(made))
    early, late = sizes
    assert late == pytest.approx(early, rel=0.05)
