"""Timers that repeat: ISO 8601 cycles; cron texts have tests of their own."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from m2pem.errors import ExpressionSyntaxError
from m2pem.mission.cycle import Cycle, cycle, next_round
from m2pem.mission.duration import date_us

SECOND_US = 1_000_000
HOUR_US = 3_600 * SECOND_US
START_2026_US = 1_767_225_600 * SECOND_US


def at(hour):
    return START_2026_US + round(hour * HOUR_US)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("R3/PT10S", Cycle(3, None, "PT10S")),
        ("R/PT1M", Cycle(None, None, "PT1M")),
        ("R1/P1M", Cycle(1, None, "P1M")),
        (" R2/2026-01-01T00:00:00Z/PT10S ", Cycle(2, START_2026_US, "PT10S")),
        ("R/2026-01-01T02:00:00+02:00/P1D", Cycle(None, START_2026_US, "P1D")),
        ("R/PT1H/2026-01-01", Cycle(None, None, "PT1H", START_2026_US)),
        ("R4/2026-01-01/2026-01-01T00:00:01.5Z", Cycle(4, START_2026_US, "PT1.500000S")),
        (" @hourly ", Cycle(None, None, "@hourly")),
        ("0 0/5 * * * ?", Cycle(None, None, "0 0/5 * * * ?")),
    ],
)
def test_cycle(text, expected):
    assert cycle(text) == expected


def test_a_cycle_fires_after_one_period_and_then_every_period():
    assert cycle("R3/PT10S").first(5) == (5 + 10 * SECOND_US, 2)
    assert next_round("PT10S", 20, 20, 2, dated=False) == (20 + 10 * SECOND_US, 1)
    assert next_round("PT10S", 20, 20, 0, dated=False) is None


def test_a_cycle_with_a_start_fires_there_first_also_when_it_has_passed():
    every = cycle("R3/2026-01-01T00:00:00Z/PT10S")
    for armed_us in (START_2026_US - 1, START_2026_US + 7):
        assert every.first(armed_us) == (START_2026_US, 2)


@pytest.mark.parametrize(
    ("text", "armed", "due", "left"),
    [
        ("R3/PT1H/2026-01-01T12:00Z", 0, 10, 2),
        ("R3/PT1H/2026-01-01T12:00Z", 11.5, 10, 2),
        ("R3/PT1H/2026-01-01T12:00Z", 99, 10, 2),
        ("R/PT1H/2026-01-01T12:00Z", 8.5, 9, 3),
        ("R/PT1H/2026-01-01T12:00Z", 9, 9, 3),
        ("R/PT1H/2026-01-01T12:00Z", 99, 12, 0),
    ],
)
def test_a_cycle_with_an_end_is_counted_back_from_it(text, armed, due, left):
    assert cycle(text).first(at(armed)) == (at(due), left)


def test_a_monthly_cycle_follows_the_calendar():
    first_us, left = cycle("R/P1M").first(date_us("2026-02-01"))
    assert (first_us, left) == (date_us("2026-03-01"), -1)
    assert next_round("P1M", first_us, first_us, -1, dated=False) == (date_us("2026-04-01"), -1)


@pytest.mark.parametrize(
    ("left", "dated", "expected"),
    [
        (-1, True, (at(5), -1)),
        (9, True, (at(5), 5)),
        (4, True, (at(5), 0)),
        (3, True, None),
        (-1, False, (at(5), -1)),
        (9, False, (at(5), 8)),
        (1, False, (at(5), 0)),
    ],
)
def test_missed_rounds_come_once_and_only_those_of_dates_are_used_up(left, dated, expected):
    assert next_round("PT1H", at(1), at(4.5), left, dated=dated) == expected


def test_missed_months_are_counted_too():
    due_us, now_us = date_us("2026-01-31"), date_us("2026-05-01")
    assert next_round("P1M", due_us, now_us, 6, dated=True) == (date_us("2026-05-28"), 2)


def test_a_round_that_comes_at_the_same_moment_is_missed_too():
    assert next_round("PT1H", at(1), at(3), -1, dated=False) == (at(4), -1)


@pytest.mark.parametrize("period", ["P3000Y", "PT10000000H"])
def test_what_is_beyond_the_calendar_never_comes(period):
    assert next_round(period, date_us("9000-01-01"), 0, -1, dated=True) is None


def test_a_cron_text_goes_on_from_now():
    assert cycle("@hourly").first(at(0.5)) == (at(1), -1)
    assert next_round("@hourly", at(1), at(1), -1, dated=True) == (at(2), -1)
    assert next_round("@hourly", at(1), at(7.5), -1, dated=True) == (at(8), -1)


def test_a_cron_text_without_a_date_left_is_refused_when_it_is_armed():
    with pytest.raises(ExpressionSyntaxError, match="none of its dates is left"):
        cycle("0 0 0 1 1 ? 2020").first(START_2026_US)


@pytest.mark.parametrize("value", [None, 30, 2.5, True, ["PT1S"]])
def test_what_is_no_text_is_refused(value):
    with pytest.raises(ExpressionSyntaxError, match=r"expected a .*, not "):
        cycle(value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "such as R3/PT10S"),
        ("PT10S", "such as R3/PT10S"),
        ("R3", "such as R3/PT10S"),
        ("R3/", "PT30S"),
        ("R-1/PT1S", "such as R3/PT10S"),
        ("R9999999999/PT1S", "such as R3/PT10S"),
        ("R3/PT", "PT30S"),
        ("R3//PT1S", "2026-01-01T12:00:00Z"),
        ("R3/2026/PT1S", "2026-01-01T12:00:00Z"),
        ("R0/PT1S", "never fire"),
        ("R3/PT0S", "longer than nothing"),
        ("R/PT0.0000001S", "longer than nothing"),
        ("R/2026-01-02/2026-01-01", "longer than nothing"),
        ("R/P1M/2026-01-01", "no one length"),
        ("R/PT0S/2026-01-01", "longer than nothing"),
        ("R/PT1H/PT1H", "2026-01-01T12:00:00Z"),
        ("R/2026-01-01/PT1H/PT1H", "such as R3/PT10S"),
        ("now and then", "fields"),
        ("@sometimes", "@hourly"),
    ],
)
def test_bad_cycle_is_refused(text, message):
    with pytest.raises(ExpressionSyntaxError, match=message):
        cycle(text)


@settings(max_examples=300, deadline=None)
@given(
    st.text(st.sampled_from("R/P1203TYMWDHS:-+.,Z 9*?#L@"), max_size=30) | st.text(max_size=20),
    st.integers(-(10**16), 10**16),
)
def test_reading_raises_nothing_but_syntax_errors(text, at_us):
    try:
        every = cycle(text)
        due_us, left = every.first(at_us)
    except ExpressionSyntaxError:
        return
    following = next_round(every.period, due_us, at_us, left, dated=every.dated)
    assert following is None or following[0] > max(due_us, at_us)
