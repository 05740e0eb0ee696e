"""Faults of simulators as text: `[TARGETS:] ACTION [at TIME] [for DURATION]`.

All simulators of m2pem read faults by this grammar, such as `evsg1: lose gps at 20 s for 5 s`. The
same fault has the same words everywhere:

- `cut link`: nothing is received from a vehicle, and it receives nothing.
- `silent`: it receives, but sends nothing.
- `refuse ...`: it refuses what it is asked, with a text if one is given.
- `lose gps`, `battery low`, `battery 12 %`, `stuck`: what they say.

A `FaultGrammar` says which faults a simulator has, by name, and what they do to a target of type T.
"""

import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Generic, TypeVar

from m2pem.units import Dimension, quantity

NUMBER = r"(\d+(?:\.\d+)?)"
"""The pattern of a number in the words of a fault."""

BATTERY = rf"battery\s+(?:low|{NUMBER}\s*%)"

T = TypeVar("T")


class FaultError(ValueError):
    """A text is no fault, or the fault cannot happen to its target. The message says what can."""


@dataclass(frozen=True, slots=True)
class Effect(Generic[T]):
    """What a fault does to a target when it begins, and when it ends (None: it has no end)."""

    begin: Callable[[T], object]
    end: Callable[[T], object] | None = None


@dataclass(frozen=True, slots=True)
class FaultKind(Generic[T]):
    """A kind of fault. `pattern`: a regular expression of its words, without regard to case.

    `effect`: makes the effect of the words that were matched; it raises ValueError if a value in
    them is wrong. `for_s`: how long the fault lasts if the text does not say (None: for good).
    `timed`: the text must say when it begins.
    """

    pattern: str
    effect: Callable[[re.Match[str]], Effect[T]]
    for_s: float | None = None
    timed: bool = False


def fixed(
    begin: Callable[[T], object], end: Callable[[T], object] | None = None
) -> Callable[[re.Match[str]], Effect[T]]:
    """Return the `effect` of a kind of fault whose words have no values."""
    return lambda _: Effect(begin, end)


def battery_left(match: re.Match[str], low: float) -> float:
    """Return the fraction that a match of `BATTERY` says; `low` is that of `battery low`.

    Raises:
        ValueError: it is above 100 %.
    """
    left = low if match[1] is None else float(match[1]) / 100
    if left > 1:
        raise ValueError("a battery has at most 100 %")
    return left


@dataclass(frozen=True, slots=True)
class PlannedFault(Generic[T]):
    """A fault that was read from `text`.

    `targets`: the names of what it strikes (None: all). `words`: those of the fault itself. `at_s`:
    when it begins (None: the text does not say); each simulator documents what the time counts
    from. `for_s`: how long it lasts (None: for good).
    """

    text: str
    targets: tuple[str, ...] | None
    kind: FaultKind[T]
    words: str
    effect: Effect[T]
    at_s: float | None = None
    for_s: float | None = None

    def targets_among(self, known: Collection[str]) -> Collection[str]:
        """Return the names of what the fault strikes.

        Raises:
            FaultError: one of them is not known.
        """
        for name in self.targets or ():
            if name not in known:
                raise self.error(f"there is no vehicle {name}; there are: {', '.join(known)}")
        return known if self.targets is None else self.targets

    def error(self, problem: object) -> FaultError:
        """Return the error that says what is wrong with this fault."""
        return FaultError(f"fault {self.text!r}: {problem}")

    def start(self, target: T, after: Callable[[float, Callable[[], object]], object]) -> None:
        """Begin the fault now, and end it by `after(seconds, call)` of the simulation."""
        self.effect.begin(target)
        end = self.effect.end
        if self.for_s is not None and end is not None:
            after(self.for_s, lambda: end(target))


_TIME = r"\d+(?:\.\d+)?\s*[a-z]+"
_SHAPE = re.compile(
    rf"(?:(?P<targets>[^:\"]*):)?\s*(?P<words>.*?)"
    rf"(?:\s+at\s+(?P<at>{_TIME}))?(?:\s+for\s+(?P<for>{_TIME}))?",
    re.DOTALL | re.IGNORECASE,
)


class FaultGrammar(Generic[T]):
    """Reads the faults of one simulator.

    `kinds`: by how each is written, which messages show. `example`: a whole fault. `times`: what
    messages say about the time that `at` counts from. `targets`: the pattern of a target's name
    (None: the simulator has one target, which a fault does not name), and how messages call it.
    """

    def __init__(
        self,
        kinds: Mapping[str, FaultKind[T]],
        example: str,
        *,
        times: str = "without: at once",
        targets: tuple[str, str] | None = None,
    ) -> None:
        self.kinds, self.example = kinds, example
        self._times, self._targets = times, targets

    def parse(self, text: str) -> PlannedFault[T]:
        """Read a fault.

        Raises:
            FaultError: the text is no fault of this simulator.
        """
        shape = _SHAPE.fullmatch(text.strip())
        assert shape is not None, "the pattern takes anything"
        try:
            return self._read(text, shape)
        except FaultError:
            raise
        except ValueError as error:
            raise FaultError(f"fault {text!r}: {error}") from error

    def _read(self, text: str, shape: re.Match[str]) -> PlannedFault[T]:
        targets = self._targets_of(shape["targets"])
        words = " ".join(shape["words"].split())
        at_s, for_s = (
            None if shape[name] is None else quantity(shape[name], Dimension.DURATION)
            for name in ("at", "for")
        )
        for kind in self.kinds.values():
            match = re.fullmatch(kind.pattern, words, re.IGNORECASE)
            if match is None:
                continue
            effect = kind.effect(match)
            if kind.timed and at_s is None:
                raise ValueError(f"say when, such as '{words} at 40 s'")
            if for_s is not None and effect.end is None:
                raise ValueError(f"{words!r} has no end; leave 'for ... s' out")
            for_s = kind.for_s if for_s is None else for_s
            return PlannedFault(text, targets, kind, words, effect, at_s, for_s)
        raise ValueError(
            f"{words!r} is no action. Actions: {'; '.join(self.kinds)}. Then 'at 20 s' "
            f"({self._times}) and 'for 5 s' (without: for good), such as \"{self.example}\""
        )

    def _targets_of(self, said: str | None) -> tuple[str, ...] | None:
        if said is None or (self._targets is not None and said.strip() in ("", "all")):
            return None
        if self._targets is None:
            raise ValueError(f"{said.strip()!r}: leave it out, there is only one")
        pattern, called = self._targets
        names = tuple(each.strip() for each in said.split(","))
        if not all(re.fullmatch(pattern, name) for name in names):
            raise ValueError(f'{said.strip()!r} are no {called}, or all; such as "{self.example}"')
        return names


class FaultSchedule:
    """Calls at points of simulated time, in order; those for the same time in order of planning."""

    def __init__(self) -> None:
        self._planned: list[tuple[float, Callable[[], object]]] = []

    def at(self, time_s: float, call: Callable[[], object]) -> None:
        self._planned.append((time_s, call))

    def run_until(self, now_s: float) -> None:
        """Make the calls that are due, and those that they plan once it is time."""
        due = [each for each in self._planned if each[0] <= now_s]
        if due:
            self._planned = [each for each in self._planned if each[0] > now_s]
            for _, call in sorted(due, key=lambda each: each[0]):
                call()
