"""Times of timers and timeouts that `check` judges: by value, else by kind."""

import pytest

from m2pem.bpmn.times import wrong_time
from m2pem.mission.events import TimerKind
from m2pem.mission.expression import template

DATE, DURATION, CYCLE = TimerKind.DATE, TimerKind.DURATION, TimerKind.CYCLE


@pytest.mark.parametrize(
    ("kind", "text"),
    [
        (DURATION, "PT5S"),
        (DURATION, '= duration("PT5S") + duration("PT5S")'),
        (DURATION, '= duration("PT" + string(x) + "S")'),
        (DURATION, "= x"),
        (DURATION, "= x * 2"),
        (DURATION, "PT${x}S"),
        (DURATION, '= date and time("2030-01-01T00:00:00Z") - now()'),
        (DATE, '= now() + duration("PT1M")'),
        (DATE, "= date(x)"),
        (DATE, '= date("2026-01-01")'),
        (CYCLE, '= cycle(3, duration("PT10S"))'),
        (CYCLE, "= cycle(x, duration(y))"),
        (CYCLE, '= "R3/" + x'),
    ],
)
def test_a_time_that_may_be_right_is_not_refused(kind, text):
    assert wrong_time(template(text), kind) == ""


@pytest.mark.parametrize(
    ("kind", "text", "message"),
    [
        (DURATION, "= true", "not true"),
        (DURATION, "= x > 2", "'= x > 2' gives a boolean, not a duration"),
        (DURATION, "= now()", "gives a date and time, not a duration"),
        (DURATION, "= today()", "gives a date, not a duration"),
        (DURATION, '= duration("PT5S") - duration("PT10S")', "cannot be negative"),
        (DURATION, "= [x]", "gives a list, not a duration"),
        (DURATION, "= now() + 5", "has no value, not a duration"),
        (DURATION, "7", "such as PT30S"),
        (DATE, '= now() - date("2026-01-01")', "gives a days and time duration, not a date"),
        (DATE, "= duration(x)", "years and months duration, not a date"),
        (DURATION, "= abs(now())", "has no value, not a duration"),
        (CYCLE, "= duration(x)", "not a cycle"),
        (CYCLE, '= cycle(x, "PT5S")', "has no value, not a cycle"),
        (CYCLE, "= x * 2", "gives a number, not a cycle"),
        (CYCLE, '= duration("PT5S")', "such as R3/PT10S"),
    ],
)
def test_a_time_that_can_never_be_right_is_refused(kind, text, message):
    assert message in wrong_time(template(text), kind)
