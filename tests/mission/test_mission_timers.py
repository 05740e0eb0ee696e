"""Times of timers: durations, dates, cycles and cron texts."""

from datetime import UTC, datetime, timedelta
from itertools import islice

import pytest
from cronsim import CronSim
from dateutil.relativedelta import relativedelta
from hypothesis import given, settings
from hypothesis import strategies as st

from m2pem.errors import ExpressionSyntaxError
from m2pem.mission.cron import parse_cron
from m2pem.mission.timers import (
    Cycle,
    cycle,
    date_us,
    duration_us,
    fixed_us,
    next_round,
    wait_us,
)
from tests.seeds import examples

SECOND_US = 1_000_000
DAY_US = 86_400 * SECOND_US
START_2026_US = 1_767_225_600 * SECOND_US


@pytest.mark.parametrize(
    ("text", "expected_us"),
    [
        ("PT30S", 30 * SECOND_US),
        (" PT5M\n", 300 * SECOND_US),
        ("P1DT2H", DAY_US + 7_200 * SECOND_US),
        ("P2W", 14 * DAY_US),
        ("PT0.5S", SECOND_US // 2),
        ("PT0,5S", SECOND_US // 2),
        ("PT0.000001S", 1),
        ("P0.5D", DAY_US // 2),
        ("PT0S", 0),
        ("PT36H", 36 * 3_600 * SECOND_US),
        ("P100000DT0.000001S", 100_000 * DAY_US + 1),
    ],
)
def test_a_duration_is_read(text, expected_us):
    assert duration_us(text, START_2026_US) == expected_us
    assert duration_us(text, 0) == expected_us


@pytest.mark.parametrize(
    ("text", "start", "end"),
    [
        ("P1M", "2026-01-01", "2026-02-01"),
        ("P1M", "2026-02-01", "2026-03-01"),
        ("P1M", "2026-01-31", "2026-02-28"),
        ("P1M", "2028-01-31", "2028-02-29"),
        ("P1Y", "2028-02-29", "2029-02-28"),
        ("P1Y2M3DT4H", "2026-01-01", "2027-03-04T04:00:00Z"),
        ("P14M", "2026-01-01", "2027-03-01"),
    ],
)
def test_years_and_months_are_those_of_the_calendar(text, start, end):
    assert date_us(start) + duration_us(text, date_us(start)) == date_us(end)


@pytest.mark.parametrize(
    ("text", "expected_us"),
    [
        ("1970-01-01T00:00:00Z", 0),
        ("1969-12-31T23:59:59.999999Z", -1),
        ("2026-01-01T00:00:00Z", START_2026_US),
        ("2026-01-01T00:00:00", START_2026_US),
        ("2026-01-01", START_2026_US),
        ("20260101T000000Z", START_2026_US),
        (" 2026-01-01T00:00Z\n", START_2026_US),
        ("2026-01-01T02:00:00+02:00", START_2026_US),
        ("2025-12-31T18:30:00-05:30", START_2026_US),
        ("2026-01-01T00:00:00.25Z", START_2026_US + SECOND_US // 4),
        ("0001-01-01T00:00:00+14:00", -62_135_647_200 * SECOND_US),
        ("9999-12-31T23:00:00-14:00", 253_402_347_600 * SECOND_US),
    ],
)
def test_a_date_is_read(text, expected_us):
    assert date_us(text) == expected_us


@pytest.mark.parametrize(("seconds", "length_us"), [(30, 30_000_000), (2.5, 2_500_000), (0, 0)])
def test_a_number_is_seconds(seconds, length_us):
    assert duration_us(seconds, START_2026_US) == length_us
    assert date_us(seconds) == length_us


@pytest.mark.parametrize("number", [1e300, float("inf"), float("nan"), -1e18])
@pytest.mark.parametrize("read", [lambda number: duration_us(number, 0), date_us])
def test_a_number_that_is_no_time_is_refused(read, number):
    with pytest.raises(ExpressionSyntaxError, match=r"9999|negative"):
        read(number)


def test_a_timer_whose_computed_duration_is_negative_waits_no_longer():
    """As Camunda 8's timers: zero or negative fires at once."""
    assert [wait_us(value, 0) for value in ("-PT5S", "-P1M", -0.5, 0, "PT1S")] == [
        0,
        0,
        0,
        0,
        10**6,
    ]
    with pytest.raises(ExpressionSyntaxError, match="such as PT30S"):
        wait_us("-5", 0)


@pytest.mark.parametrize("value", [None, True, ["PT1S"]])
@pytest.mark.parametrize("read", [lambda text: duration_us(text, 0), date_us])
def test_a_duration_or_date_that_is_no_text_is_refused(read, value):
    with pytest.raises(ExpressionSyntaxError, match=r"expected a .*, not "):
        read(value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "PT30S"),
        ("P", "PT30S"),
        ("PT", "PT30S"),
        ("P1DT", "PT30S"),
        ("30s", "PT30S"),
        ("30 s", "PT30S"),
        ("pt5s", "PT30S"),
        ("PT1S1M", "PT30S"),
        ("PT1H30", "PT30S"),
        ("P1.5Y", "PT30S"),
        ("P0001-01-01T00:00:00", "PT30S"),
        ("PT٣S", "PT30S"),
        ("PT1E5S", "PT30S"),
        ("-PT5S", "cannot be negative"),
        ("P-1D", "PT30S"),
        ("P9000Y", "after the year 9999"),
        ("P99999999999D", "after the year 9999"),
        ("PT" + "9" * 90 + "S", "after the year 9999"),
        ("P" + "9" * 90 + "Y", "after the year 9999"),
        ("PT" + "9" * 1_000_000 + "S", "PT30S"),
        ("${x}", "PT30S"),
    ],
)
def test_bad_duration_is_refused(text, message):
    with pytest.raises(ExpressionSyntaxError, match=message) as caught:
        duration_us(text, START_2026_US)
    assert len(str(caught.value)) < 200


@pytest.mark.parametrize(
    "text",
    [
        "",
        "now",
        "2026",
        "20",
        "2026-13-01",
        "2026-00-10",
        "20260010T000000Z",
        "2026-01-00",
        "2026-02-30T00:00:00Z",
        "2026-01-01 00:00:00",
        "2026-01-01T",
        "2026-01-01T25:00:00Z",
        "2026-01-01T00:00:60Z",
        "2026-01-01T00:00:00+99:00",
        "2026-01-01T00:00:00+",
        "2026-01-01T::Z",
        "2026-01-01T1.2.3Z",
        "0000-01-01",
        "PT5S",
        "2026-01-01T" + "0" * 1_000_000,
    ],
)
def test_bad_date_is_refused(text):
    with pytest.raises(ExpressionSyntaxError, match="such as 2026-01-01T12:00:00Z") as caught:
        date_us(text)
    assert len(str(caught.value)) < 300


@pytest.mark.parametrize(
    ("text", "expected_us"),
    [("P2W", 14 * DAY_US), ("P1DT2M", DAY_US + 120 * SECOND_US), ("PT1M", 60 * SECOND_US)],
)
def test_a_length_without_months_is_fixed(text, expected_us):
    assert fixed_us(text) == expected_us


@pytest.mark.parametrize("text", ["P1M", "P1Y", "P1Y2DT3M"])
def test_a_length_with_months_is_not(text):
    assert fixed_us(text) is None


@pytest.mark.parametrize("at_us", [-(10**30), 10**30])
def test_a_time_beyond_the_calendar_is_refused(at_us):
    with pytest.raises(ExpressionSyntaxError, match="9999"):
        duration_us("PT1S", at_us)


@settings(max_examples=examples(50, 200), deadline=None)
@given(st.integers(0, 10**15), st.integers(-(10**16), 10**16))
def test_durations_are_exact_to_the_microsecond(length_us, at_us):
    seconds, rest_us = divmod(length_us, SECOND_US)
    days, seconds = divmod(seconds, 86_400)
    assert duration_us(f"P{days}DT{seconds}.{rest_us:06}S", at_us) == length_us


@settings(max_examples=examples(75, 300), deadline=None)
@given(
    st.text(st.sampled_from("R/P1203TYMWDHS:-+.,Z 9"), max_size=30) | st.text(max_size=20),
    st.integers(-(2**63), 2**63 - 1),
)
def test_reading_a_duration_or_date_raises_nothing_but_syntax_errors(text, at_us):
    for read in (lambda: duration_us(text, at_us), lambda: date_us(text)):
        try:
            result = read()
        except ExpressionSyntaxError:
            continue
        assert isinstance(result, int)


# 2026-01-01 is a Thursday.
START_US = date_us("2026-01-01T00:00:00Z")


def dates(text, count=1, start_us=START_US):
    cron = parse_cron(text)
    found = []
    at_us = start_us
    for _ in range(count):
        following = cron.after_us(at_us)
        assert following is not None
        at_us = following
        found.append(f"{datetime.fromtimestamp(at_us / 1e6, UTC):%Y-%m-%d %H:%M:%S}")
    return found


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("30 8 * * *", "2026-01-01 08:30:00"),
        ("*/15 * * * *", "2026-01-01 00:15:00"),
        ("0 8 * * 1-5", "2026-01-01 08:00:00"),
        ("0 8 * * 0", "2026-01-04 08:00:00"),
        ("0 8 * * 7", "2026-01-04 08:00:00"),
        ("0 8 ? * sun", "2026-01-04 08:00:00"),
        ("0 0 10 * 6", "2026-01-03 00:00:00"),
        ("15 0/5 * * * ?", "2026-01-01 00:00:15"),
        ("*/10 * * * * *", "2026-01-01 00:00:10"),
        ("0 0 8 ? * MON-FRI", "2026-01-01 08:00:00"),
        ("0 0 8 ? * FRI-MON", "2026-01-02 08:00:00"),
        ("0 0 8 ? * MON,WED", "2026-01-05 08:00:00"),
        ("0 0 8 ? * MON#2", "2026-01-12 08:00:00"),
        ("0 0 8 ? * FRIL", "2026-01-30 08:00:00"),
        ("0 0 8 L * ?", "2026-01-31 08:00:00"),
        ("0 0 8 LW * ?", "2026-01-30 08:00:00"),
        ("0 0 8 ? FEB */3", "2026-02-01 08:00:00"),
        ("0 0 8 ? * TUE/2", "2026-01-01 08:00:00"),
        ("0 0 8 ? * 2 *", "2026-01-05 08:00:00"),
        ("0 0 8 ? * 6L *", "2026-01-30 08:00:00"),
        ("0 0 8 ? * 1#1 2028", "2028-01-02 08:00:00"),
        ("0 0 8 1 1 ? 2027-2030/3", "2027-01-01 08:00:00"),
        ("@yearly", "2027-01-01 00:00:00"),
        ("@annually", "2027-01-01 00:00:00"),
        ("@monthly", "2026-02-01 00:00:00"),
        ("@weekly", "2026-01-04 00:00:00"),
        ("@daily", "2026-01-02 00:00:00"),
        ("@midnight", "2026-01-02 00:00:00"),
        ("@Hourly", "2026-01-01 01:00:00"),
    ],
)
def test_the_first_date_after_an_instant(text, expected):
    assert dates(text) == [expected]


def test_dates_follow_each_other():
    assert dates("0 0 0 29 2 ? *", 3) == [
        "2028-02-29 00:00:00",
        "2032-02-29 00:00:00",
        "2036-02-29 00:00:00",
    ]
    assert dates("0 0 0 1 1 ? 2027,2035/50", 3) == [
        "2027-01-01 00:00:00",
        "2035-01-01 00:00:00",
        "2085-01-01 00:00:00",
    ]


def test_an_instant_between_two_seconds_is_after_the_first():
    assert parse_cron("* * * * * *").after_us(START_US + 1) == START_US + 1_000_000


@pytest.mark.parametrize(
    ("text", "start"),
    [
        ("0 0 0 1 1 ? 2026", "2026-01-01T00:00:00Z"),
        ("0 0 31 2-4/2 *", "9999-01-01T00:00:00Z"),
        ("@hourly", "9999-12-31T23:30:00Z"),
        ("0 0 0 30 2 MON#5", "2026-01-01T00:00:00Z"),
    ],
)
def test_the_dates_may_end(text, start):
    try:
        cron = parse_cron(text)
    except ExpressionSyntaxError:  # that no month has such a day may be known before
        return
    assert cron.after_us(date_us(start)) is None


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("* * *", "5, 6 .* or 7 fields .*, not 3"),
        ("* * * * * * * *", "not 8"),
        ("61 * * * *", "bad minute"),
        ("* * 25 * * ?", "bad hour"),
        ("0 0 8 15W * ?", "bad day-of-month"),
        ("0 0 8 31 FEB ?", "bad day-of-month"),
        ("@reboot", "expected one of @yearly"),
        ("0 0 8 13 * FRI", "'\\?' for the other"),
        ("0 0 8 ? * 1-5", "which day of the week '1' is"),
        ("0 0 8 ? * 6L", "which day of the week '6' is"),
        ("0 0 8 ? * MON-", "'MON-' is no day of the week"),
        ("0 0 8 ? * L", "'L' is no day of the week"),
        ("0 0 8 ? * 0 *", "'0' is no day of the week: 1"),
        ("0 0 8 ? * MON#6", "is no day of the week"),
        ("0 0 8 1 1 ? 26", "'26' is no year"),
        ("0 0 8 1 1 ? 2030-2026", "years are"),
        ("0 0 8 1 1 ? 2100", "years are"),
        ("H * * * *", "bad minute"),
        ("* * * * " + "9" * 5000, "at most 100"),
    ],
)
def test_what_cannot_be_meant_is_refused(text, message):
    with pytest.raises(ExpressionSyntaxError, match=message) as caught:
        parse_cron(text)
    assert len(str(caught.value)) < 300


HOUR_US = 3_600 * SECOND_US


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
def test_a_cycle_is_read(text, expected):
    assert cycle(text) == expected


def test_a_cycle_fires_after_one_period_and_then_every_period():
    assert cycle("R3/PT10S").first(5) == (5 + 10 * SECOND_US, 2, "PT10S")
    assert next_round("PT10S", 20, 20, 2, dated=False) == (20 + 10 * SECOND_US, 1, "PT10S")
    assert next_round("PT10S", 20, 20, 0, dated=False) is None


def test_a_cycle_with_a_start_fires_there_first_also_when_it_has_passed():
    every = cycle("R3/2026-01-01T00:00:00Z/PT10S")
    for armed_us in (START_2026_US - 1, START_2026_US + 7):
        assert every.first(armed_us) == (START_2026_US, 2, "PT10S")


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
    assert cycle(text).first(at(armed)) == (at(due), left, "PT1H")


def rounds(text, count, armed="2026-01-01T00:00:00Z"):
    """The dates of the first rounds of a cycle that is armed at a date."""
    every = cycle(text)
    found = [every.first(date_us(armed))]
    while len(found) < count:
        due_us, left, period = found[-1]
        found.append(next_round(period, due_us, due_us, left, dated=every.dated))
    epoch = datetime(1970, 1, 1, tzinfo=UTC)
    return [(epoch + timedelta(microseconds=each.due_us)).isoformat() for each in found]


@pytest.mark.parametrize(
    ("text", "start", "months"),
    [
        ("R/2026-01-31T12:00:00Z/P1M", "2026-01-31T12:00:00+00:00", 1),
        ("R/2024-02-29T12:00:00Z/P1Y", "2024-02-29T12:00:00+00:00", 12),
        ("R/2025-08-31T12:00:00Z/P6M", "2025-08-31T12:00:00+00:00", 6),
        # The offset of the start decides which day it is: in UTC these begin on the 30th.
        ("R/2026-01-31T00:30:00+02:00/P1M", "2026-01-31T00:30:00+02:00", 1),
        ("R/2026-03-31T23:30:00-08:00/P1M", "2026-03-31T23:30:00-08:00", 1),
    ],
)
def test_a_round_of_months_is_so_many_periods_after_the_start(text, start, months):
    """As dateutil counts; java.time's `start.plus(period.multipliedBy(n))` is the same."""
    begin = datetime.fromisoformat(start)
    expected = [
        (begin + relativedelta(months=months * n)).astimezone(UTC).isoformat() for n in range(14)
    ]
    assert rounds(text, 14) == expected


def test_a_cycle_of_months_without_a_date_counts_from_when_it_is_armed():
    dates = rounds("R/P1M", 4, "2026-01-31T08:00:00Z")
    assert [date[:10] for date in dates] == ["2026-02-28", "2026-03-31", "2026-04-30", "2026-05-31"]


def test_a_cycle_of_months_that_waited_in_a_pause_keeps_its_days():
    # Armed on January 31; a pause of five hours came before the first round.
    due_us, left, period = cycle("R/P1M").first(date_us("2026-01-31T08:00:00Z"))
    late_us = due_us + 5 * HOUR_US
    following = next_round(period, late_us, late_us, left, dated=False)
    assert following.due_us == date_us("2026-03-31T13:00:00Z")


def test_a_cycle_of_months_of_an_older_journal_goes_on_from_its_last_round():
    due_us = date_us("2026-03-01")
    assert next_round("P1M", due_us, due_us, -1, dated=False) == (date_us("2026-04-01"), -1, "P1M")


@pytest.mark.parametrize(
    ("left", "dated", "expected"),
    [
        (-1, True, (at(5), -1, "PT1H")),
        (9, True, (at(5), 5, "PT1H")),
        (4, True, (at(5), 0, "PT1H")),
        (3, True, None),
        (-1, False, (at(5), -1, "PT1H")),
        (9, False, (at(5), 8, "PT1H")),
        (1, False, (at(5), 0, "PT1H")),
    ],
)
def test_missed_rounds_come_once_and_only_those_of_dates_are_used_up(left, dated, expected):
    assert next_round("PT1H", at(1), at(4.5), left, dated=dated) == expected


def test_missed_months_are_counted_too():
    due_us, left, period = cycle("R7/2026-01-31/P1M").first(0)
    following = next_round(period, due_us, date_us("2026-05-01"), left, dated=True)
    assert following == (date_us("2026-05-31"), 2, "R4/2026-01-31T00:00:00+00:00/P1M")


def test_a_round_that_comes_at_the_same_moment_is_missed_too():
    assert next_round("PT1H", at(1), at(3), -1, dated=False) == (at(4), -1, "PT1H")


@pytest.mark.parametrize("period", ["P3000Y", "PT10000000H"])
def test_what_is_beyond_the_calendar_never_comes(period):
    assert next_round(period, date_us("9000-01-01"), 0, -1, dated=True) is None


def test_a_cron_text_goes_on_from_now():
    assert cycle("@hourly").first(at(0.5)) == (at(1), -1, "@hourly")
    assert next_round("@hourly", at(1), at(1), -1, dated=True) == (at(2), -1, "@hourly")
    assert next_round("@hourly", at(1), at(7.5), -1, dated=True) == (at(8), -1, "@hourly")


def test_a_cron_text_without_a_date_left_is_refused_when_it_is_armed():
    with pytest.raises(ExpressionSyntaxError, match="none of its dates is left"):
        cycle("0 0 0 1 1 ? 2020").first(START_2026_US)


@pytest.mark.parametrize("value", [None, 30, 2.5, True, ["PT1S"]])
def test_a_cycle_that_is_no_text_is_refused(value):
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


@settings(max_examples=examples(75, 300), deadline=None)
@given(
    st.text(st.sampled_from("R/P1203TYMWDHS:-+.,Z 9*?#L@"), max_size=30) | st.text(max_size=20),
    st.integers(-(10**16), 10**16),
)
def test_reading_a_cycle_raises_nothing_but_syntax_errors(text, at_us):
    try:
        every = cycle(text)
        due_us, left = every.first(at_us)
    except ExpressionSyntaxError:
        return
    following = next_round(every.period, due_us, at_us, left, dated=every.dated)
    assert following is None or following[0] > max(due_us, at_us)


@pytest.mark.parametrize(
    ("text", "days"),
    [
        # January 2026 begins on a Thursday: its Fridays are the 2nd, 9th, 16th, 23rd and 30th.
        ("0 8 1-7 * FRI", [1, 2, 3, 4, 5, 6, 7, 9, 16, 23, 30]),
        ("0 8 */2 * FRI", [9, 23]),
        ("0 8 * * FRI", [2, 9, 16, 23, 30]),
        ("0 8 * * 5L", [30]),
    ],
)
def test_both_days_of_five_fields_are_as_the_docs_say(text, days):
    """As cronsim 2.8 and Debian's cron: one of the two, but both where one begins with `*`."""
    found = [int(each[8:10]) for each in dates(text, 12) if each.startswith("2026-01")]
    assert found == days


@pytest.mark.parametrize(
    ("named", "numbered"),
    [
        ("0 8 * * FRIL", "0 8 * * 5L"),
        ("0 8 * * mon,sunl", "0 8 * * 1,0L"),
        ("0 8 * * FRI-MON", "0 8 * * 5,6,0,1"),
        ("0 8 1-7 * MON-WED", "0 8 1-7 * 1-3"),
        ("0 8 */2 * MON#2", "0 8 */2 * 1#2"),
        ("0 8 * * */2", "0 8 * * */2"),
    ],
)
def test_named_days_in_five_fields_are_those_of_the_numbers_that_cronsim_reads(named, numbered):
    own, dates = parse_cron(named), CronSim(numbered, datetime(2026, 1, 1, tzinfo=UTC))
    at_us = START_2026_US
    for expected in islice(dates, 30):
        at_us = own.after_us(at_us)
        assert at_us == expected.timestamp() * 1_000_000
