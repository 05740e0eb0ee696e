"""The faults of simulated vehicles and payloads: what a fleet says, and which still wait."""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from m2pem.api.faults import Effect, FaultGrammar, FaultKind
from m2pem.units import Dimension, quantity

FAULT_KINDS = ("reject", "fail", "stall", "lose_link")


@dataclass(frozen=True, slots=True)
class Fault:
    """`kind` is one of `FAULT_KINDS`; it strikes `after_s` into the behavior.

    `behavior`: the name of those that it strikes, "" for all. `times`: how many of them.

    * reject: the behavior is refused (`after_s` has no meaning).
    * fail: the vehicle stops, and the behavior fails with `error` ("" is FAILED).
    * stall: the vehicle stops and nothing more is received of the behavior.
    * lose_link: nothing more is received of the vehicle, and it receives nothing.
    """

    kind: str
    behavior: str = ""
    after_s: float = 0.0
    error: str = ""
    times: int = 1


class FaultList:
    """The faults that still wait for a behavior of one resource, first come first served."""

    def __init__(self, faults: Iterable[Fault] = ()) -> None:
        self._waiting: list[Fault] = list(faults)

    def add(self, fault: Fault) -> None:
        self._waiting.append(fault)

    def take(self, behavior: str) -> Fault | None:
        """The fault that strikes a behavior which starts now; used up by this."""
        for index, fault in enumerate(self._waiting):
            if fault.behavior in ("", behavior):
                if fault.times > 1:
                    self._waiting[index] = replace(fault, times=fault.times - 1)
                else:
                    del self._waiting[index]
                return fault
        return None


def _strikes(kind: str) -> Callable[[re.Match[str]], Effect[list[Fault]]]:
    """Return the effect of the words of a fault: it is noted in a list."""

    def effect(match: re.Match[str]) -> Effect[list[Fault]]:
        fault = Fault(kind, error=next(iter(match.groups(default="")), ""))
        return Effect(lambda noted: noted.append(fault))

    return effect


_CODE = r"(?:\s+([A-Za-z_]\w*))?"
GRAMMAR: FaultGrammar[list[Fault]] = FaultGrammar(
    {
        "refuse, refuse CODE": FaultKind(f"refuse{_CODE}", _strikes("reject")),
        "fail, fail CODE": FaultKind(f"fail{_CODE}", _strikes("fail")),
        "stall": FaultKind("stall", _strikes("stall")),
        "cut link": FaultKind("cut link", _strikes("lose_link")),
    },
    "goto: fail ROUTE_BLOCKED at 5 s",
    times="of the behavior; without: as it begins",
    targets=(r"\w+", "behaviors: say their names, such as goto or goto,orbit"),
)


def read_faults(said: str | Mapping[str, Any]) -> Sequence[Fault]:
    """Read a fault of a fleet: text of the grammar, or a map of the fields of `Fault`.

    A text that names several behaviors is a fault for each of them.

    Raises:
        ValueError: a value is wrong.
        KeyError: the map has no kind.
    """
    if isinstance(said, str):
        planned = GRAMMAR.parse(said)
        noted: list[Fault] = []
        planned.effect.begin(noted)
        return [
            replace(fault, behavior=behavior, after_s=planned.at_s or 0.0)
            for behavior in planned.targets or ("",)
            for fault in noted
        ]
    kind = said["kind"]
    if kind not in FAULT_KINDS:
        raise ValueError(f"kind: {kind!r} is not one of {', '.join(FAULT_KINDS)}")
    times = said.get("times", 1)
    if isinstance(times, bool) or not isinstance(times, int) or times < 1:
        raise ValueError(f"times: {times!r} is not a whole number above 0")
    behavior, error = str(said.get("behavior", "")), str(said.get("error", ""))
    after_s = quantity(said.get("after", 0.0), Dimension.DURATION)
    return [Fault(kind, behavior, after_s, error, times)]
