"""ISO 8601 times of timers."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from m2pem.errors import ExpressionSyntaxError
from m2pem.mission.duration import date_us, duration_us, fixed_us

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
def test_duration(text, expected_us):
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
def test_date(text, expected_us):
    assert date_us(text) == expected_us


@pytest.mark.parametrize("value", [None, 30, 2.5, True, ["PT1S"]])
@pytest.mark.parametrize("read", [lambda text: duration_us(text, 0), date_us])
def test_what_is_no_text_is_refused(read, value):
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


@settings(max_examples=200, deadline=None)
@given(st.integers(0, 10**15), st.integers(-(10**16), 10**16))
def test_durations_are_exact_to_the_microsecond(length_us, at_us):
    seconds, rest_us = divmod(length_us, SECOND_US)
    days, seconds = divmod(seconds, 86_400)
    assert duration_us(f"P{days}DT{seconds}.{rest_us:06}S", at_us) == length_us


@settings(max_examples=300, deadline=None)
@given(
    st.text(st.sampled_from("R/P1203TYMWDHS:-+.,Z 9"), max_size=30) | st.text(max_size=20),
    st.integers(-(2**63), 2**63 - 1),
)
def test_reading_raises_nothing_but_syntax_errors(text, at_us):
    for read in (lambda: duration_us(text, at_us), lambda: date_us(text)):
        try:
            result = read()
        except ExpressionSyntaxError:
            continue
        assert isinstance(result, int)
