"""Timers that repeat: ISO 8601 cycles and cron texts (`timeCycle`; BPMN 2.0.2, table 10.101).

A cycle without a date (`R3/PT10S`) is due at mission times, and counts how often it has fired. One
with a start or an end, and a cron text, is due at dates, which pass whether anybody looks or not.
Either way, rounds that nobody was there for (a pause, an outage) are made up for once, not one by
one: see `next_round`.
"""

import re
from dataclasses import dataclass
from typing import NoReturn

from m2pem.errors import ExpressionSyntaxError
from m2pem.mission.cron import is_cron, parse_cron
from m2pem.mission.duration import date_us, duration_us, fixed_us, text_from
from m2pem.mission.expression.literals import shorten
from m2pem.mission.values import Value

_WHAT = "a cycle such as R3/PT10S, R/PT1M or R3/2026-01-01T12:00:00Z/PT10S"
_CYCLE = re.compile(r"R(?P<repetitions>[0-9]{0,9})/(?P<first>[^/]*)(?:/(?P<second>[^/]*))?")
_US_PER_S = 1_000_000


@dataclass(frozen=True, slots=True)
class Cycle:
    """A repeating timer. `repetitions`: how often it fires; None is for ever.

    `period`: an ISO 8601 duration longer than nothing, or a cron text. `start_us`: its first date,
    `end_us`: its last, in microseconds since the Unix epoch, when the text says one.
    """

    repetitions: int | None
    start_us: int | None
    period: str
    end_us: int | None = None

    @property
    def dated(self) -> bool:
        """Whether it is due at dates, not at mission times."""
        return self.start_us is not None or self.end_us is not None or is_cron(self.period)

    def first(self, at_us: int) -> tuple[int, int]:
        """When it is due first, if it is armed at `at_us`, and how often it fires after that (-1:
        for ever). A date may have passed already: it is due at once then.

        Raises:
            ExpressionSyntaxError: that is after the year 9999, or no date of a cron text is left.
        """
        left = -1 if self.repetitions is None else self.repetitions - 1
        if self.start_us is not None:
            return self.start_us, left
        if self.end_us is not None:
            period_us = fixed_us(self.period)
            assert period_us is not None
            if left < 0:
                left = max(0, self.end_us - at_us) // period_us
            return self.end_us - left * period_us, left
        if is_cron(self.period):
            due_us = parse_cron(self.period).after_us(at_us)
            if due_us is None:
                _refuse("none of its dates is left", self.period)
            return due_us, left
        return at_us + duration_us(self.period, at_us), left


def next_round(
    period: str, due_us: int, at_us: int, left: int, *, dated: bool
) -> tuple[int, int] | None:
    """The round after the one that was due at `due_us` and fires at `at_us`, as `Cycle.first`.

    It is the first one after `at_us`: those between have been missed, and the one that fires now
    stands for them. Of a `dated` cycle they are over, as their dates are; of another they still
    come, later, so that `R3/PT10S` fires three times. None: there is no further round.
    """
    if left == 0:
        return None
    if is_cron(period):
        found = parse_cron(period).after_us(max(due_us, at_us))
        return None if found is None else (found, left)
    length_us = fixed_us(period)
    try:
        if length_us is not None:
            rounds = max(0, at_us - due_us) // length_us + 1
            next_us = due_us + rounds * length_us
            duration_us("PT0S", next_us)
        else:
            rounds, next_us = 0, due_us
            while next_us <= max(due_us, at_us):
                rounds, next_us = rounds + 1, next_us + duration_us(period, next_us)
    except ExpressionSyntaxError:  # beyond the calendar: it never comes
        return None
    if left < 0:
        return next_us, left
    left -= rounds if dated else 1
    return None if left < 0 else (next_us, left)


def cycle(text: Value) -> Cycle:
    """Read a cycle: `R3/PT10S`, `R/PT1M` (for ever), `R3/2026-01-01T00:00:00Z/PT10S`,
    `R/PT1H/2026-01-01T00:00:00Z` (the last date), or a cron text (`m2pem.mission.cron`).

    Raises:
        ExpressionSyntaxError: no cycle, or one that never fires.
    """
    stripped = text_from(text, _WHAT)
    if is_cron(stripped):
        parse_cron(stripped)
        return Cycle(None, None, stripped)
    match = _CYCLE.fullmatch(stripped)
    if match is None:
        _refuse(f"expected {_WHAT} (ISO 8601), or a cron text such as 0 0 8 * * MON-FRI", stripped)
    repetitions = int(match["repetitions"]) if match["repetitions"] else None
    if repetitions == 0:
        _refuse("the cycle would never fire; leave the number out to repeat for ever", stripped)
    first, second = match["first"], match["second"]
    if second is None:
        found = Cycle(repetitions, None, first)
    elif first.startswith("P"):
        found = Cycle(repetitions, None, first, date_us(second))
        if duration_us(first, 0) and fixed_us(first) is None:
            _refuse("counted back from an end, months and years have no one length", stripped)
    elif second.startswith("P"):
        found = Cycle(repetitions, date_us(first), second)
    else:
        found = Cycle(repetitions, date_us(first), _between(date_us(first), date_us(second)))
    if duration_us(found.period, 0) == 0:
        _refuse("the period of a cycle must be longer than nothing", stripped)
    return found


def _between(start_us: int, end_us: int) -> str:
    seconds, rest_us = divmod(max(0, end_us - start_us), _US_PER_S)
    return f"PT{seconds}.{rest_us:06}S" if rest_us else f"PT{seconds}S"


def _refuse(message: str, text: str) -> NoReturn:
    raise ExpressionSyntaxError(message, shorten(text), 0)
