"""Dates and durations of FEEL, against DMN 1.5 and feelin 8.2.0 (bpmn.io's FEEL, npm)."""

import pytest

from m2pem.errors import ExpressionError, ExpressionSyntaxError
from m2pem.mission.expression import parse
from m2pem.mission.expression.temporal import NOW

DATA = {NOW: "2026-11-29T12:00:00Z", "x": 7, "due": "2030-01-01T00:00:00Z"}


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        # feelin 8.2.0 gives the same.
        ('duration("PT" + string(x) + "S")', "PT7S"),
        ('duration("PT5S") + duration("PT5S")', "PT10S"),
        ('date and time("2026-11-29T12:00:00Z") + duration("PT1M")', "2026-11-29T12:01:00Z"),
        ('date and time(due) - date and time("2026-11-29T12:00:00Z")', "P1128DT12H"),
        ('date("2026-01-31") + duration("P1M")', "2026-02-28"),
        ('duration("P1M") + date("2026-01-31")', "2026-02-28"),
        ('date("2026-03-31") - duration("P1M")', "2026-02-28"),
        ('date("2026-01-31") + duration("P1D")', "2026-02-01"),
        ('date("2026-01-01") - date("2025-01-01")', "P365D"),
        ('date("2026-01-01") - date and time("2026-01-01T12:00:00Z")', "-PT12H"),
        ('date and time("2026-01-31T10:00:00+02:00") + duration("P1M")',
         "2026-02-28T10:00:00+02:00"),
        ('duration("P1Y2M") - duration("P1M")', "P1Y1M"),
        ('duration("P14M")', "P1Y2M"),
        ('duration("P0Y")', "P0M"),
        ('string(duration("PT90S"))', "PT1M30S"),
        ('string(duration("-PT90S"))', "-PT1M30S"),
        ('duration("PT1M") = duration("PT60S")', True),
        ('duration("PT90S") > duration("PT1M")', True),
        ('date("2026-01-01") < date("2026-01-02")', True),
        ("date(2026, 2, 28)", "2026-02-28"),
        # DMN 1.3, tables 55 to 57, which feelin 8.2.0 does not have.
        ('duration("PT10S") * 3', "PT30S"),
        ('2 * duration("P1M")', "P2M"),
        ('duration("P1Y") / 2', "P6M"),
        ('duration("PT10S") / duration("PT5S")', 2.0),
        ('-duration("PT10S")', "-PT10S"),
        ('-duration("P1Y2M")', "-P1Y2M"),
        ('duration("PT1M") in [duration("PT60S")]', True),
        ('[date("2026-01-01"), duration("PT0S")]', ["2026-01-01", "PT0S"]),
        # Camunda 8's own function for timers.
        ('cycle(3, duration("PT10S"))', "R3/PT10S"),
        ('cycle(duration("P1M"))', "R/P1M"),
        ("now()", "2026-11-29T12:00:00Z"),
        ("today()", "2026-11-29"),
        ('now() + duration("PT1M")', "2026-11-29T12:01:00Z"),
        ("now() < date and time(due)", True),
        ("duration(nothing)", None),
        # One kind of number: 3.0 is as whole as 3.
        ('cycle(6 / 2, duration("PT10S"))', "R3/PT10S"),
        ("date(2026.0, 4 / 2, 28)", "2026-02-28"),
        # Properties (DMN 1.3, table 61).
        ('date("2026-03-09").year', 2026),
        ('date("2026-03-09").weekday', 1),
        ("now().hour", 12),
        ('date and time("2026-03-09T10:20:30.5Z").second', 30),
        ("(date(date and time(due)) - today()).days > 365", True),
        ('duration("P3DT4H5M6S").hours', 4),
        ('duration("-P3DT4H5M6.5S").minutes', -5),
        ('duration("-P3DT4H5M6.5S").seconds', -6),
        ('duration("P1Y2M").months', 2),
        ('duration("-P14M").years', -1),
        ("is defined(now())", True),
        ("list contains([today()], date(2026, 11, 29))", True),
    ],
)  # fmt: skip
def test_feel_computes_with_dates_and_durations(text, expected):
    assert parse(f"= {text}").evaluate(DATA.get) == expected


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('duration("P1M2D")', "duration\\(\\) of the text 'P1M2D'"),
        ('duration("30 s")', "duration\\(\\) of the text '30 s'"),
        ('date("tomorrow")', "date\\(\\) of the text 'tomorrow'"),
        ("date(2026, 2, 30)", "date\\(\\) of the number 2026, the number 2, the number 30"),
        ("date(2026, 1.5, 30)", "the number 1.5 is not whole"),
        ("now().days", "the date and time 2026-11-29T12:00:00Z has no 'days'"),
        ("date(2026)", "date\\(\\) of 1 arguments"),
        ('duration("PT1S") + 5', "duration PT1S and the number 5"),
        ("now() + now()", "'\\+' of the date and time 2026-11-29T12:00:00Z and the date and time"),
        ('duration("P1Y") / 0', "'/' of the years and months duration P1Y and the number 0"),
        ('duration("PT1S") * 1e300', "'\\*' of the days and time duration PT1S and the number 1e"),
        ('date("9999-12-31") + duration("P1D")', "'\\+' of the date 9999-12-31 and the days"),
        ('cycle(1.5, duration("PT1S"))', "the number 1.5 is not whole"),
        # These are null, so that a wrong branch would be taken.
        ('duration("PT1M") > 30', "'>' of the days and time duration PT1M and the number 30"),
        ("now() > due", "'>' of the date and time .* and the text"),
        ('duration("P1M") < duration("P31D")', "'<' of the years and months duration P1M and"),
        ('"3" < 4', "'<' of the text '3' and the number 4"),
        ("1 / 0", "'/' of the number 1 and the number 0"),
        ("not(3)", "the number 3 is not true or false"),
        ('matches("a", "[")', "matches"),
    ],
)
def test_what_feel_cannot_compute_is_an_error(text, message):
    with pytest.raises(ExpressionError, match=message):
        parse(f"= {text}").evaluate(DATA.get)


@pytest.mark.parametrize("text", ["now()", "${now()}"])
def test_now_is_seconds_in_the_other_dialects_as_their_dates_are(text):
    assert parse(text).evaluate(DATA.get) == 1_795_953_600.0
    assert parse("duration('PT1M')").evaluate(DATA.get) == 60.0


def test_an_expression_that_reads_the_time_is_not_constant():
    assert not parse("= now()").constant
    assert parse('= duration("PT1S") * 2').constant


def test_a_function_that_is_not_there_is_refused_with_those_that_are():
    with pytest.raises(ExpressionSyntaxError, match="there is no function 'tomorrowish'"):
        parse("= tomorrowish()")
