"""Cron texts in time zones, against Quartz's answers and where clocks change."""

import csv
from datetime import UTC, datetime, timedelta
from itertools import pairwise
from pathlib import Path
from zoneinfo import ZoneInfo

import pytest

from m2pem.errors import ExpressionSyntaxError
from m2pem.mission.cron import Cron, parse_cron

BERLIN = ZoneInfo("Europe/Berlin")
S = 1_000_000
QUARTZ = Path(__file__).parent / "quartz_dates.csv"
"""What Quartz 2.3.2 answers to random texts with seconds and years, around changes of clocks."""


def dates(cron: Cron, zone: ZoneInfo, after_s: float, until_s: float) -> list[float]:
    found, at_us = [], cron.after_us(round(after_s * S), zone)
    while at_us is not None and at_us <= until_s * S:
        found.append(at_us / S)
        at_us = cron.after_us(at_us, zone)
    return found


def clock(at_s: float, zone: ZoneInfo) -> datetime:
    return datetime.fromtimestamp(at_s, zone).replace(tzinfo=None)


def exists(local: datetime, zone: ZoneInfo) -> bool:
    again = local.replace(tzinfo=zone).astimezone(UTC).astimezone(zone)
    return again.replace(tzinfo=None) == local


def quartz() -> list[tuple[str, str, int, list[int]]]:
    with QUARTZ.open(encoding="utf-8") as file:
        return [
            (row["cron"], row["zone"], int(row["after"]), [*map(int, row["dates"].split())])
            for row in csv.DictReader(file, delimiter=";")
        ]


def test_clocks_show_what_they_show_at_quartzs_dates() -> None:
    """What clocks skip does not come there, and what they show twice comes the second time."""
    same = 0
    for text, name, after_s, expected in quartz():
        zone, cron = ZoneInfo(name), parse_cron(text)
        last = clock(expected[-1], zone)
        found = dates(cron, zone, after_s, expected[-1])
        same += found == expected
        shown = [each for at in found if (each := clock(at, zone)) <= last]
        begin = [each for each in shown if not exists(each - timedelta(seconds=1), zone)]
        wanted = {clock(each, zone) for each in expected}
        assert {*shown} - {*begin} == wanted - {*begin}, (text, name)
        assert cron.hourly or len(shown) == len({*shown}), (text, name)
    assert same > 350


def test_the_date_before_a_date_is_the_one_before() -> None:
    for text, name, after_s, expected in quartz():
        zone, cron = ZoneInfo(name), parse_cron(text)
        for a, b in pairwise(dates(cron, zone, after_s, expected[-1])):
            assert cron.before_us(round(b * S), zone) == a * S, (text, name)


@pytest.mark.parametrize(
    "text", ["30 2 * * *", "0 30 2 * * ?", "0 30 2 * * ? 2026", "0 30 2-2 ? * SUN-SAT 2026-2027"]
)
@pytest.mark.parametrize(
    ("day", "times"),
    [
        ("2026-03-28", ["2026-03-28T02:30:00+01:00", "2026-03-29T03:00:00+02:00"]),
        ("2026-10-24", ["2026-10-24T02:30:00+02:00", "2026-10-25T02:30:00+02:00"]),
    ],
)
def test_where_clocks_change_a_time_comes_once_in_all_lengths(
    text: str, day: str, times: list[str]
) -> None:
    begin_s = datetime.fromisoformat(day).replace(tzinfo=BERLIN).timestamp()
    found = dates(parse_cron(text), BERLIN, begin_s, begin_s + 47 * 3600)
    assert [datetime.fromtimestamp(at, BERLIN).isoformat() for at in found] == times


@pytest.mark.parametrize(("day", "hours"), [("2026-03-29", 23), ("2026-10-25", 25)])
@pytest.mark.parametrize("text", ["0 * * * *", "0 0 * * * ?", "0 0 0-23 * * ?", "@hourly"])
def test_what_comes_each_hour_comes_in_each_hour_that_there_is(
    text: str, day: str, hours: int
) -> None:
    begin = datetime.fromisoformat(day).replace(tzinfo=BERLIN)
    end_s = (begin + timedelta(days=1)).timestamp()
    found = dates(parse_cron(text), BERLIN, begin.timestamp() - 1, end_s - 1)
    assert [b - a for a, b in pairwise(found)] == [3600.0] * (hours - 1)


def test_what_falls_into_a_day_that_a_zone_skips_comes_as_the_next_begins() -> None:
    zone = ZoneInfo("Pacific/Apia")  # which had no December 30 in 2011
    begin_s = datetime(2011, 12, 29, 12, tzinfo=zone).timestamp()
    found = dates(parse_cron("0 15 8 * * ?"), zone, begin_s, begin_s + 86400)
    assert [str(clock(at, zone)) for at in found] == ["2011-12-31 00:00:00", "2011-12-31 08:15:00"]


@pytest.mark.parametrize("text", ["15-15/3 8 * * *", "0 15-15/3 8 * * ?"])
def test_a_step_from_one_value_to_itself_is_that_value(text: str) -> None:
    """As for Quartz 2.3.2; cronsim 2.8 reads 15/3."""
    times = dates(parse_cron(text), ZoneInfo("UTC"), 0, 86400)
    assert times == [8 * 3600 + 15 * 60]


@pytest.mark.parametrize(
    "text", ["*/60 * * * *", "0/70 * * * * ?", "0 0 */24 * * ?", "0 0 0 1/32 * ?", "0 0 0 1 1/13 ?"]
)
def test_a_step_longer_than_its_field_is_refused(text: str) -> None:
    with pytest.raises(ExpressionSyntaxError, match="is longer than its field: at most"):
        parse_cron(text)
