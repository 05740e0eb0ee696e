"""Times of timers (BPMN 2.0.2, table 10.101): ISO 8601 durations, dates and cycles.

`..._us` counts microseconds: instants from the Unix epoch (UTC), durations by themselves. Values
come from expressions, so each reader takes any value and refuses what is no text. Every reader
raises ExpressionSyntaxError.

A cycle without a date (`R3/PT10S`) is due at mission times, and counts how often it has fired. One
with a start or an end, and a cron text, is due at dates, which also pass during a pause or an
outage of the executive. The rounds of that time are caught up once, not one by one: see
`next_round`.
"""

import re
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta, tzinfo
from typing import NamedTuple, NoReturn

import isodate

from m2pem.errors import ExpressionSyntaxError
from m2pem.mission import cron  # imports this module, too: only its name is bound yet
from m2pem.mission.expression.literals import describe, shorten
from m2pem.mission.values import Value
from m2pem.units import US_PER_S

_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_MICROSECOND = timedelta(microseconds=1)
_MAX_CHARACTERS = 100

_NUMBER = r"[0-9]+(?:[.,][0-9]+)?"
_DURATION = re.compile(
    rf"P(?=[0-9T])(?:[0-9]+Y)?(?:[0-9]+M)?(?:{_NUMBER}W)?(?:{_NUMBER}D)?"
    rf"(?:T(?=[0-9])(?:{_NUMBER}H)?(?:{_NUMBER}M)?(?:{_NUMBER}S)?)?"
)
# isodate 0.7 reads the month 00 as January.
_DATE = re.compile(
    r"(?![0-9]{4}-?00)([0-9]{4}-[0-9]{2}-[0-9]{2}|[0-9]{8})(T[0-9:.,]+(Z|[+-][0-9:]+)?)?"
)


def duration_us(value: Value, at_us: int) -> int:
    """The length of a duration (`PT30S`, `P1DT2H`, `PT0.5S`, `P2W`) that begins at `at_us`.

    Years and months are those of the calendar (UTC) from `at_us` on; where the month is too short
    for the day, its last day counts. A number is seconds, as `duration()` gives them. Rounded to a
    microsecond.

    Raises:
        ExpressionSyntaxError: no duration, a negative one, or one that ends after the year 9999.
    """
    try:
        begin = _EPOCH + timedelta(microseconds=at_us)
        if (seconds := _seconds(value)) is not None:
            if seconds < 0:
                _refuse("a duration cannot be negative", f"{seconds:g}")
            return (begin + timedelta(seconds=seconds) - begin) // _MICROSECOND
        return (_after(begin, _duration_text(value)) - begin) // _MICROSECOND
    except (ValueError, ArithmeticError):
        _refuse("the duration ends after the year 9999", str(value))


def wait_us(value: Value, at_us: int) -> int:
    """How long a timer waits, as `duration_us`; what is computed may be negative, and is over then:
    it is due at once, as a date that has passed is.
    """
    if isinstance(value, str) and value.strip().startswith("-"):
        duration_us(value.strip()[1:], at_us)
        return 0
    seconds = _seconds(value)
    return 0 if seconds is not None and seconds < 0 else duration_us(value, at_us)


def _seconds(value: Value) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return float(value)


def _duration_text(value: Value) -> str:
    what = "a duration such as PT30S, PT0.5S or P1DT2H"
    stripped = text_from(value, what, ", or a number of seconds")
    if stripped.startswith("-"):
        _refuse("a duration cannot be negative", stripped)
    if not _DURATION.fullmatch(stripped):
        _refuse(f"expected {what} (ISO 8601)", stripped)
    return stripped


def _after(begin: datetime, period: str, rounds: int = 1) -> datetime:
    """When so many periods from `begin` on are over. Months are counted from there, so that they
    always end on its day, or where that is missing on the last one.
    """
    end: datetime = begin + rounds * isodate.parse_duration(period)
    return end


def date_us(value: Value) -> int:
    """The instant of a date and time (`2026-01-01T12:00:00Z`, `...+02:00`).

    Without an offset it is UTC; without a time it is midnight. A number is seconds since the Unix
    epoch, as `date()` gives them.

    Raises:
        ExpressionSyntaxError: no date and time, or one that does not exist.
    """
    seconds = _seconds(value)
    if seconds is None:
        what = "a date and time such as 2026-01-01T12:00:00Z"
        return (moment(text_from(value, what, ", or seconds since 1970")) - _EPOCH) // _MICROSECOND
    try:
        return (_EPOCH + timedelta(seconds=seconds) - _EPOCH) // _MICROSECOND
    except (ValueError, ArithmeticError):
        _refuse("the date is not in the years 1 to 9999", f"{seconds:g}")


def date_text(at_us: int) -> str:
    """The date and time of an instant, as `date_us` reads it."""
    return (_EPOCH + timedelta(microseconds=at_us)).isoformat().replace("+00:00", "Z")


def moment(text: str) -> datetime:
    """The date and time that a text says, with its offset (UTC where it has none).

    Raises:
        ExpressionSyntaxError: it says none, or one that does not exist.
    """
    what = "expected a date and time such as 2026-01-01T12:00:00Z (ISO 8601)"
    if len(text) > _MAX_CHARACTERS or not _DATE.fullmatch(text):
        _refuse(what, text)
    try:
        if "T" in text:
            instant: datetime = isodate.parse_datetime(text)
        else:
            instant = datetime.combine(isodate.parse_date(text), datetime.min.time())
        instant = instant if instant.tzinfo is not None else instant.replace(tzinfo=UTC)
        instant - _EPOCH  # raises for an offset that no date has
    except (ValueError, ArithmeticError) as error:
        _refuse(f"{what}: {error}", text)
    return instant


def fixed_us(value: Value) -> int | None:
    """The length of a duration that is the same whenever it begins; None: it has months or years.

    Raises:
        ExpressionSyntaxError: as for `duration_us`.
    """
    length_us = duration_us(value, 0)
    days, _, _ = str(value).partition("T")
    return None if "Y" in days or "M" in days else length_us


def text_from(value: Value, what: str, otherwise: str = "") -> str:
    """A value's text, without the space around it; `what` says what it should have been.

    Raises:
        ExpressionSyntaxError: it is none, or far too long.
    """
    if not isinstance(value, str):
        _refuse(f"expected {what} (ISO 8601){otherwise}, not {describe(value)}", "")
    stripped = value.strip()
    if len(stripped) > _MAX_CHARACTERS:
        _refuse(f"expected {what} (ISO 8601)", stripped)
    return stripped


def _refuse(message: str, text: str) -> NoReturn:
    raise ExpressionSyntaxError(message, shorten(text), 0) from None


_WHAT = "a cycle such as R3/PT10S, R/PT1M or R3/2026-01-01T12:00:00Z/PT10S"
_CYCLE = re.compile(r"R(?P<repetitions>[0-9]{0,9})/(?P<first>[^/]*)(?:/(?P<second>[^/]*))?")


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
    zone: tzinfo = field(default=UTC, compare=False)
    """That of its start, in which months and years are counted."""

    @property
    def dated(self) -> bool:
        """Whether it is due at dates, not at mission times."""
        return self.start_us is not None or self.end_us is not None or cron.is_cron(self.period)

    def first(self, at_us: int) -> "Round":
        """When it is due first, if it is armed at `at_us`. A date may have passed already: it is
        due at once then.

        Raises:
            ExpressionSyntaxError: that is after the year 9999, or no date of a cron text is left.
        """
        left = -1 if self.repetitions is None else self.repetitions - 1
        if self.start_us is not None:
            return Round(self.start_us, left, self._period(0, self.start_us))
        if self.end_us is not None:
            period_us = fixed_us(self.period)
            assert period_us is not None
            if left < 0:
                left = max(0, self.end_us - at_us) // period_us
            return Round(self.end_us - left * period_us, left, self.period)
        if cron.is_cron(self.period):
            due_us = cron.parse_cron(self.period).after_us(at_us)
            if due_us is None:
                _refuse("none of its dates is left", self.period)
            return Round(due_us, left, self.period)
        return Round(at_us + duration_us(self.period, at_us), left, self._period(1, at_us))

    def _period(self, number: int, start_us: int) -> str:
        if fixed_us(self.period) is not None:
            return self.period
        start = (_EPOCH + timedelta(microseconds=start_us)).astimezone(self.zone)
        return f"R{number}/{start.isoformat()}/{self.period}"


class Round(NamedTuple):
    """A round of a cycle: when it is due, in microseconds since the Unix epoch, and how often the
    cycle fires after it (-1: for ever).

    `period`: by what the next one is found. It is the cycle's; one with months or years also has
    the number of this round and the start, `R2/2026-01-31T12:00:00+00:00/P1M`: each round is that
    many periods after the start, so that the 31st comes again after a shorter month.
    """

    due_us: int
    left: int
    period: str


_COUNTED = re.compile(r"R([0-9]+)/([^/]+)/(P.+)")


def next_round(period: str, due_us: int, at_us: int, left: int, *, dated: bool) -> Round | None:
    """The round after the one that was due at `due_us` and fires at `at_us`, as `Cycle.first`.

    It is the first one after `at_us`: those between have been missed, and the one that fires now
    stands for them. Of a `dated` cycle they are over, as their dates are; of another they still
    come, later, so that `R3/PT10S` fires three times. None: there is no further round.
    """
    if left == 0:
        return None
    if cron.is_cron(period):
        found = cron.parse_cron(period).after_us(max(due_us, at_us))
        return None if found is None else Round(found, left, period)
    try:
        if counted := _COUNTED.fullmatch(period):
            number, start, each = int(counted[1]), moment(counted[2]), counted[3]
            begun, rounds, next_us = _after(start, each, number), 0, due_us
            while next_us <= max(due_us, at_us):
                rounds += 1
                next_us = due_us + (_after(start, each, number + rounds) - begun) // _MICROSECOND
            period = f"R{number + rounds}/{counted[2]}/{each}"
        elif (length_us := fixed_us(period)) is not None:
            rounds = max(0, at_us - due_us) // length_us + 1
            next_us = due_us + rounds * length_us
        else:  # of a journal that has no start yet
            rounds, next_us = 0, due_us
            while next_us <= max(due_us, at_us):
                rounds, next_us = rounds + 1, next_us + duration_us(period, next_us)
        duration_us("PT0S", next_us)
    except (ExpressionSyntaxError, ValueError, ArithmeticError):
        return None  # beyond the calendar: it never comes
    if left > 0:
        left -= rounds if dated else 1
        if left < 0:
            return None
    return Round(next_us, left, period)


def cycle(text: Value) -> Cycle:
    """Read a cycle: `R3/PT10S`, `R/PT1M` (for ever), `R3/2026-01-01T00:00:00Z/PT10S`,
    `R/PT1H/2026-01-01T00:00:00Z` (the last date), or a cron text (`m2pem.mission.cron`).

    Raises:
        ExpressionSyntaxError: no cycle, or one that never fires.
    """
    stripped = text_from(text, _WHAT)
    if cron.is_cron(stripped):
        cron.parse_cron(stripped)
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
        start_us = date_us(first)
        found = Cycle(repetitions, start_us, second, zone=moment(first.strip()).tzinfo or UTC)
    else:
        found = Cycle(repetitions, date_us(first), _between(date_us(first), date_us(second)))
    if duration_us(found.period, 0) == 0:
        _refuse("the period of a cycle must be longer than nothing", stripped)
    return found


def _between(start_us: int, end_us: int) -> str:
    seconds, rest_us = divmod(max(0, end_us - start_us), US_PER_S)
    return f"PT{seconds}.{rest_us:06}S" if rest_us else f"PT{seconds}S"
