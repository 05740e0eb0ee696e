"""Assumptions of a check: what is taken not to happen in the runs that are searched.

The same text is written everywhere: parts with commas between them, all of which are assumed.

- `no-failures`: no behavior or service fails; `failures <= 2`: they fail twice at most in a run;
- `reliable(uav1, uav2)`: behaviors do not fail whose vehicles and payloads are all named;
- `operators-answer`: the timers of a user task do not fire;
- `messages-within 30 s`: a signal or message from outside that a token waits for comes so soon.

`m2pem.verify.translate.assumed` restricts a net to the runs in which that is so.
"""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from m2pem.fleet.allocation import spelled_out
from m2pem.fleet.fleet import Fleet
from m2pem.suggestions import nearest, suggest
from m2pem.units import US_PER_S, Dimension, UnitError, quantity

MOST_FAILURES = 100
"""Most failures that can be counted: each makes the state space larger."""

_FAILURES = re.compile(r"failures\s*(?:<=|≤)\s*(\S+)")
_RELIABLE = re.compile(r"reliable\s*\((.*)\)")
_WITHIN = re.compile(r"messages-within\s+(.+)")
_FORMS = {
    "no-failures": "no-failures",
    "failures": "failures <= 2",
    "reliable": "reliable(uav1, uav2)",
    "operators-answer": "operators-answer",
    "messages-within": "messages-within 30 s",
}
"""By its first word, an example of each assumption."""
_EXAMPLES = f"what can be assumed: {'; '.join(_FORMS.values())}"


class AssumptionError(ValueError):
    """A text is no assumption. `remedy`: what would be right."""

    def __init__(self, message: str, remedy: str = _EXAMPLES) -> None:
        super().__init__(message)
        self.message = message
        self.remedy = remedy

    def __str__(self) -> str:
        return f"{self.message}; {self.remedy}"


@dataclass(frozen=True, slots=True)
class Assumptions:
    """What a check assumes; nothing, if all fields have their defaults.

    `failures`: how often behaviors and services fail at most; None: any number of times.
    `reliable`: vehicles, payloads and teams. `operators_answer`: before the timers of their user
    tasks. `messages_within_us`: microseconds until an awaited signal or message comes from outside;
    None: it need not come.
    """

    failures: int | None = None
    reliable: frozenset[str] = frozenset()
    operators_answer: bool = False
    messages_within_us: int | None = None

    def __bool__(self) -> bool:
        return self != NOTHING

    def __and__(self, other: "Assumptions") -> "Assumptions":
        """Return both assumptions together."""
        return Assumptions(
            _least(self.failures, other.failures),
            self.reliable | other.reliable,
            self.operators_answer or other.operators_answer,
            _least(self.messages_within_us, other.messages_within_us),
        )

    def __str__(self) -> str:
        """The text that `parse` reads; "" for nothing."""
        return ", ".join(self._written())

    def _written(self) -> Iterator[str]:
        if self.failures is not None:
            yield f"failures <= {self.failures}" if self.failures else "no-failures"
        if self.reliable:
            yield f"reliable({', '.join(sorted(self.reliable))})"
        if self.operators_answer:
            yield "operators-answer"
        if self.messages_within_us is not None:
            yield f"messages-within {_seconds(self.messages_within_us)}"

    @property
    def english(self) -> str:
        """The assumptions as the end of a sentence that begins with "if"."""
        return " and ".join(self._said())

    def _said(self) -> Iterator[str]:
        if self.failures == 0:
            yield "no behavior fails"
        elif self.failures is not None:
            times = "once" if self.failures == 1 else f"{self.failures} times"
            yield f"behaviors fail {times} at most"
        if self.reliable:
            *others, last = sorted(self.reliable)
            who = f"{', '.join(others)} and {last}" if others else last
            yield f"{who} {'do' if others else 'does'} not fail"
        if self.operators_answer:
            yield "operators answer in time"
        if self.messages_within_us is not None:
            within = _seconds(self.messages_within_us)
            yield f"awaited signals and messages come within {within}"

    def resources(self, fleet: Fleet) -> frozenset[str]:
        """The vehicles and payloads that do not fail: of a vehicle, all that is mounted on it."""
        found: set[str] = set()
        for name in self.reliable:
            team = fleet.teams.get(name)
            for each in spelled_out(team) if team is not None else (name,):
                vehicle = fleet.vehicles.get(each)  # type: ignore[call-overload]  # any name
                found.update((each, *(vehicle.payloads if vehicle is not None else ())))
        return frozenset(found)


NOTHING = Assumptions()
NO_FAILURES = Assumptions(failures=0)


def _least(one: int | None, other: int | None) -> int | None:
    return other if one is None else one if other is None else min(one, other)


def _seconds(us: int) -> str:
    return f"{us / US_PER_S:g} s"


def parse(text: str | Iterable[str]) -> Assumptions:
    """Read assumptions: a text, or several that all hold.

    Raises:
        AssumptionError: a part of it is none.
    """
    found = NOTHING
    for each in (text,) if isinstance(text, str) else text:
        for part in _parts(each):
            found &= _part(part)
    return found


def _parts(text: str) -> list[str]:
    """The parts between commas that are not inside parentheses."""
    parts = [each.strip() for each in re.split(r",(?![^()]*\))", text)]
    if not all(parts):
        where = "nothing is written" if len(parts) == 1 else "nothing is written between two commas"
        raise AssumptionError(f"'{text}': {where}")
    return parts


def _part(text: str) -> Assumptions:
    if text == "no-failures":
        return NO_FAILURES
    if text == "operators-answer":
        return Assumptions(operators_answer=True)
    if match := _FAILURES.fullmatch(text):
        return Assumptions(failures=_count(match[1], text))
    if match := _RELIABLE.fullmatch(text):
        names = [each.strip() for each in match[1].split(",")]
        if not all(names):
            raise AssumptionError(f"'{text}' names no vehicle", "write reliable(uav1, uav2)")
        return Assumptions(reliable=frozenset(names))
    if match := _WITHIN.fullmatch(text):
        return Assumptions(messages_within_us=_duration_us(match[1], text))
    word = nearest(re.split(r"[\s(<≤]", text, maxsplit=1)[0], _FORMS, 0.6)
    remedy = f"did you mean '{_FORMS[word]}'?" if word else _EXAMPLES
    raise AssumptionError(f"'{text}' is no assumption", remedy)


def _count(text: str, part: str) -> int:
    if not text.isdecimal() or int(text) > MOST_FAILURES:
        raise AssumptionError(
            f"'{part}': '{text}' is no whole number from 0 to {MOST_FAILURES}",
            "write failures <= 2",
        )
    return int(text)


def _duration_us(text: str, part: str) -> int:
    try:
        seconds = quantity(text, Dimension.DURATION)
    except UnitError as error:
        raise AssumptionError(f"'{part}': {error}", "write messages-within 30 s") from None
    if seconds < 0:
        raise AssumptionError(f"'{part}': no time is negative", "write messages-within 30 s")
    return round(seconds * US_PER_S)


def refuse_unknown(assumptions: Assumptions, fleet: Fleet) -> None:
    """Refuse names that the fleet lacks.

    Raises:
        AssumptionError: it has no vehicle, payload or team of a name.
    """
    known = [*fleet.vehicles, *fleet.payloads, *fleet.teams]
    for name in sorted(assumptions.reliable.difference(known)):
        raise AssumptionError(
            f"reliable({name}): the fleet has no vehicle, payload or team '{name}'",
            suggest(name, known, "vehicles, payloads and teams"),
        )
