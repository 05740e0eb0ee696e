"""Cron texts; that fields match as cron's do is the library's own to test."""

from datetime import UTC, datetime

import pytest

from m2pem.errors import ExpressionSyntaxError
from m2pem.mission.cron import parse_cron
from m2pem.mission.duration import date_us

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
