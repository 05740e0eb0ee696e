"""What is wrong with the traffic of a vehicle's nodes, for as long as a fault lasts."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from m2pem_plugin_ros.settings import DriverName
from m2pem_plugin_ros.simulator.specification import VehicleSpec
from m2pem_plugin_ros.simulator.vehicle import Vehicle


@dataclass(slots=True)
class Troubles:
    """`silent`: nothing is published but what moves the base. `no_odometry`: that alone.

    Of an m2pem or Nav2 node: `refusal`: what it says to every behavior (None: it takes them).
    Of an m2pem node: `deaf`: it hears of no new behavior; `lies`: it tells of behaviors that nobody
    gave it, and contradicts itself; `flood_per_s`: so many statuses in a second of the wall clock.
    """

    silent: bool = False
    no_odometry: bool = False
    refusal: str | None = None
    deaf: bool = False
    lies: bool = False
    flood_per_s: float = 0.0


@dataclass(slots=True)
class Faults:
    """`reject`: no goal is accepted. `hang`: goals are accepted, and nothing is done for them; they
    cannot be cancelled either. `error_code`: goals are aborted with it after `abort_after_s`.
    `miss`: waypoints with these indices are not reached."""

    reject: bool = False
    hang: bool = False
    error_code: int = 0
    error_msg: str = ""
    abort_after_s: float = 0.5
    miss: frozenset[int] = frozenset()


LOW = 0.12
"""So full is a low battery."""

REFUSAL = "it has been told to refuse"
FLOOD_PER_S = 5000.0
BLOCKED_CODE = 208
"""What Nav2's planner says when there is no path."""

NUMBER = r"(\d+(?:\.\d+)?)"


class Afflicted(Protocol):
    """A vehicle as a fault sees it."""

    vehicle: Vehicle
    troubles: Troubles

    @property
    def nav2(self) -> Any:
        """Its simulated Nav2, if it has one that is alive."""
        ...

    def kill(self) -> None:
        """End all its nodes."""
        ...

    def kill_node(self) -> None:
        """End what steers it on board."""
        ...

    def start(self) -> None:
        """Begin the nodes that are not there."""
        ...


Action = Callable[[Afflicted], None]
Made = tuple[Action, Action | None]
"""What begins a fault, and what ends it (None: nothing does)."""


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of fault. `drivers`: to which vehicles it can happen; `detector`: only with one."""

    pattern: str
    make: Callable[[re.Match[str]], Made]
    drivers: tuple[DriverName, ...] = tuple(DriverName)
    detector: bool = False


def _trouble(name: str, value: object, normal: object) -> Callable[[re.Match[str]], Made]:
    def made(_: re.Match[str]) -> Made:
        return (
            lambda host: setattr(host.troubles, name, value),
            lambda host: setattr(host.troubles, name, normal),
        )

    return made


def _odometer(name: str) -> Callable[[re.Match[str]], Made]:
    def made(_: re.Match[str]) -> Made:
        return (
            lambda host: setattr(host.vehicle.odometer, name, True),
            lambda host: setattr(host.vehicle.odometer, name, False),
        )

    return made


def _jump(match: re.Match[str]) -> Made:
    distance_m = float(match[1])
    return (lambda host: host.vehicle.odometer.jump(distance_m)), None


def _stuck(_: re.Match[str]) -> Made:
    return (
        lambda host: setattr(host.vehicle.body, "stuck", True),
        lambda host: setattr(host.vehicle.body, "stuck", False),
    )


def _refuse(match: re.Match[str]) -> Made:
    return _trouble("refusal", match[1] or REFUSAL, None)(match)


def _flood(match: re.Match[str]) -> Made:
    per_s = FLOOD_PER_S if match[1] is None else float(match[1])
    return _trouble("flood_per_s", per_s, 0.0)(match)


def _battery(match: re.Match[str]) -> Made:
    left = LOW if match[1] is None else float(match[1]) / 100
    if left > 1:
        raise ValueError("a battery has at most 100 %")
    return (lambda host: setattr(host.vehicle.battery, "fraction", left)), None


def _gps(_: re.Match[str]) -> Made:
    return (
        lambda host: setattr(host.vehicle, "gps_lost", True),
        lambda host: setattr(host.vehicle, "gps_lost", False),
    )


def _detect(match: re.Match[str]) -> Made:
    what = match[1] or ""
    return (lambda host: host.vehicle.detect(what)), None


def _kill(_: re.Match[str]) -> Made:
    return (lambda host: host.kill()), (lambda host: host.start())


def _kill_node(_: re.Match[str]) -> Made:
    return (lambda host: host.kill_node()), (lambda host: host.start())


def _start(_: re.Match[str]) -> Made:
    return (lambda host: host.start()), None


def _nav2(name: str, value: object, normal: object) -> Callable[[re.Match[str]], Made]:
    def made(_: re.Match[str]) -> Made:
        return (lambda host: _set(host, name, value)), (lambda host: _set(host, name, normal))

    return made


def _set(host: Afflicted, name: str, value: object) -> None:
    if host.nav2 is not None:
        setattr(host.nav2.faults, name, value)


def _nav2_abort(match: re.Match[str]) -> Made:
    return _nav2("error_code", int(match[1] or BLOCKED_CODE), 0)(match)


def _nav2_inactive(_: re.Match[str]) -> Made:
    return (lambda host: _enter(host, "inactive")), (lambda host: _enter(host, "active"))


def _enter(host: Afflicted, state: str) -> None:
    if host.nav2 is not None:
        host.nav2.enter(state)


NAV2_ONLY = (DriverName.NAV2,)
NODE_ONLY = (DriverName.NODE,)
STEERED = (DriverName.NODE, DriverName.NAV2)
KINDS: Mapping[str, Kind] = {
    "silent": Kind(r"silent", _trouble("silent", True, False)),
    "kill": Kind(r"kill", _kill),
    "kill node": Kind(r"kill node", _kill_node),
    "start": Kind(r"start", _start),
    "stop odometry": Kind(r"stop odometry", _trouble("no_odometry", True, False)),
    "freeze odometry": Kind(r"freeze odometry", _odometer("frozen")),
    "odometry nan": Kind(r"odometry nan", _odometer("nonsense")),
    "jump 20 m": Kind(rf"jump\s+{NUMBER}\s*m", _jump),
    "wheels stuck": Kind(r"wheels stuck", _stuck),
    "lose gps": Kind(r"lose gps", _gps),
    "battery low, battery 12 %": Kind(rf"battery\s+(?:low|{NUMBER}\s*%)", _battery),
    "detect, detect gpr": Kind(r"detect(?:\s+(\S+))?", _detect, detector=True),
    'refuse, refuse "text"': Kind(r"refuse(?:\s+\"([^\"]+)\")?", _refuse, STEERED),
    "never accept": Kind(r"never accept", _trouble("deaf", True, False), NODE_ONLY),
    "lie": Kind(r"lie", _trouble("lies", True, False), NODE_ONLY),
    "flood, flood 5000": Kind(rf"flood(?:\s+{NUMBER})?", _flood, NODE_ONLY),
    "nav2 inactive": Kind(r"nav2 inactive", _nav2_inactive, NAV2_ONLY),
    "nav2 reject": Kind(r"nav2 reject", _nav2("reject", True, False), NAV2_ONLY),
    "nav2 hang": Kind(r"nav2 hang", _nav2("hang", True, False), NAV2_ONLY),
    "nav2 abort, nav2 abort 208": Kind(r"nav2 abort(?:\s+(\d+))?", _nav2_abort, NAV2_ONLY),
}
"""How a fault is written, and what it is."""


EXAMPLE = '"evsg1: silent at 20 s for 5 s"'
SHAPE = re.compile(
    rf"(?:(?P<who>[^:\"]*):)?\s*(?P<what>.*?)"
    rf"(?:\s+at\s+(?P<at>{NUMBER})\s*s)?(?:\s+for\s+(?P<for>{NUMBER})\s*s)?",
    re.DOTALL,
)
NAME = re.compile(r"[A-Za-z_][\w-]*")


class FaultError(ValueError):
    """It is no fault, or cannot happen there. The text says what would be right."""


@dataclass(frozen=True, slots=True)
class PlannedFault:
    """A fault in words.

    `vehicles`: their names (None: all); `at_s`: how long after it was planned; `for_s`: how long it
    lasts (None: for good). Both are simulated time.
    """

    text: str
    vehicles: tuple[str, ...] | None
    kind: Kind
    begin: Action
    end: Action | None
    at_s: float = 0.0
    for_s: float | None = None

    def check(self, spec: VehicleSpec) -> None:
        """See that it can happen to a vehicle.

        Raises:
            FaultError: it cannot, and why.
        """
        if spec.settings.driver not in self.kind.drivers:
            needs = " or ".join(WORDS[each] for each in self.kind.drivers)
            raise FaultError(
                f"fault {self.text!r}: {spec.name} is {WORDS[spec.settings.driver]}; that happens "
                f"to {needs} alone"
            )
        if self.kind.detector and not spec.detectors:
            raise FaultError(f"fault {self.text!r}: {spec.name} carries no detector")


WORDS = {
    DriverName.NODE: "an m2pem node",
    DriverName.NAV2: "Nav2",
    DriverName.BASE: "a plain base",
}


def parse(text: str) -> PlannedFault:
    """Read `[VEHICLES:] ACTION [at SECONDS s] [for SECONDS s]`.

    Raises:
        FaultError: it is something else.
    """
    shape = SHAPE.fullmatch(text.strip())
    assert shape is not None, "the pattern takes anything"
    vehicles = _vehicles(text, shape["who"])
    what = " ".join(shape["what"].split())
    at_s = float(shape["at"] or 0.0)
    for_s = None if shape["for"] is None else float(shape["for"])
    for kind in KINDS.values():
        match = re.fullmatch(kind.pattern, what, re.IGNORECASE)
        if match is None:
            continue
        try:
            begin, end = kind.make(match)
        except ValueError as error:
            raise FaultError(f"fault {text!r}: {error}") from error
        if for_s is not None and end is None:
            raise FaultError(f"fault {text!r}: {what!r} has no end; leave 'for ... s' out")
        return PlannedFault(text, vehicles, kind, begin, end, at_s, for_s)
    known = "; ".join(KINDS)
    raise FaultError(
        f"fault {text!r}: {what!r} is no action. Actions: {known}. Then 'at 20 s' (without: at "
        f"once) and 'for 5 s' (without: for good), such as {EXAMPLE}"
    )


def _vehicles(text: str, who: str | None) -> tuple[str, ...] | None:
    if who is None or who.strip() in ("", "all"):
        return None
    names = tuple(each.strip() for each in who.split(","))
    if not all(NAME.fullmatch(each) for each in names):
        raise FaultError(
            f"fault {text!r}: {who.strip()!r} are no vehicles: say their names, such as evsg1 or "
            f"evsg1,evsg2, or all; such as {EXAMPLE}"
        )
    return names


__all__ = ["FaultError", "PlannedFault", "parse"]
