"""The faults of simulated vehicles and payloads: what a fleet says, and which still wait."""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from m2pem.api.arbiter import BehaviorRequest
from m2pem.api.faults import NUMBER, Effect, FaultGrammar, FaultKind
from m2pem.geo.local_frame import offset
from m2pem.mission.geometry import Coordinate, Point, Route
from m2pem.units import Dimension, quantity

FAULT_KINDS = ("reject", "fail", "stall", "lose_link", "disarm", "fall", "end_early", "go_on")
DEVIATING = ("disarm", "fall", "end_early", "go_on", "skip", "drift", "jump")
"""Faults that telemetry alone shows (docs/evidence.md)."""


@dataclass(frozen=True, slots=True)
class Fault:
    """`kind` is one of `FAULT_KINDS`; it strikes `after_s` into the behavior.

    `behavior`: the name of those that it strikes, "" for all. `times`: how many of them.

    * reject: the behavior is refused (`after_s` has no meaning).
    * fail: the vehicle stops, and the behavior fails with `error` ("" is FAILED).
    * stall: the vehicle stops and nothing more is received of the behavior.
    * lose_link: nothing more is received of the vehicle, and it receives nothing.
    * disarm, fall: an aircraft falls, in the first case disarmed, and reports nothing.
    * end_early: the vehicle stops, and reports that it has succeeded.
    * go_on: after a cancel, it reports that it is cancelled, and goes on.
    * skip: the waypoints `first` to `last` of its route, from 1, are left out.
    * drift: its way lies `by_m` east of the commanded one, from the start.
    * jump: the reported position moves east by `by_m`.
    """

    kind: str
    behavior: str = ""
    after_s: float = 0.0
    error: str = ""
    times: int = 1
    by_m: float = 0.0
    first: int = 0
    last: int = 0


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


def _skips(match: re.Match[str]) -> Effect[list[Fault]]:
    first, last = int(match[1]), int(match[2] or match[1])
    if not 1 <= first <= last:
        raise ValueError("waypoints count from 1: say the first and the last that are skipped")
    return Effect(lambda noted: noted.append(Fault("skip", first=first, last=last)))


def _by(kind: str) -> Callable[[re.Match[str]], Effect[list[Fault]]]:
    """Return the effect of a fault with a distance in metres."""
    return lambda match: Effect(lambda noted: noted.append(Fault(kind, by_m=float(match[1]))))


_CODE = r"(?:\s+([A-Za-z_]\w*))?"
GRAMMAR: FaultGrammar[list[Fault]] = FaultGrammar(
    {
        "refuse, refuse CODE": FaultKind(f"refuse{_CODE}", _strikes("reject")),
        "fail, fail CODE": FaultKind(f"fail{_CODE}", _strikes("fail")),
        "stall": FaultKind("stall", _strikes("stall")),
        "cut link": FaultKind("cut link", _strikes("lose_link")),
        "disarm": FaultKind("disarm", _strikes("disarm")),
        "fall": FaultKind("fall", _strikes("fall")),
        "end early": FaultKind("end early", _strikes("end_early")),
        "go on after cancel": FaultKind("go on after cancel", _strikes("go_on")),
        "skip waypoint 4, skip waypoints 4 to 7": FaultKind(
            r"skip waypoints? (\d+)(?: to (\d+))?", _skips
        ),
        "drift 30 m": FaultKind(rf"drift {NUMBER} ?m", _by("drift")),
        "jump 50 m": FaultKind(rf"jump {NUMBER} ?m", _by("jump")),
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


def altered(request: BehaviorRequest, fault: Fault) -> BehaviorRequest:
    """Return what a vehicle with a fault does instead of a request, without knowing it."""
    changed: dict[str, Any] = {}
    for name, value in request.parameters.items():
        if isinstance(value, Route) and fault.kind == "skip":
            kept = [
                at for at in range(len(value.waypoints)) if not fault.first <= at + 1 <= fault.last
            ]
            if not kept:
                continue
            changed[name] = Route.of(
                [value.waypoints[at] for at in kept], [value.frames[at] for at in kept]
            )
        elif isinstance(value, Route) and fault.kind == "drift":
            aside = tuple(_aside(each, fault.by_m) for each in value.waypoints)
            changed[name] = replace(value, waypoints=aside)
        elif isinstance(value, Point) and fault.kind == "drift":
            changed[name] = replace(value, position=_aside(value.position, fault.by_m))
    return replace(request, parameters={**request.parameters, **changed})


def _aside(place: Coordinate, by_m: float) -> Coordinate:
    return (*offset(place[:2], by_m, 0.0), place[2])
