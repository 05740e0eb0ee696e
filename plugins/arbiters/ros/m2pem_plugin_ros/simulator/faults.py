"""Faults of simulated vehicles: how they are written, and what they do."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from m2pem_plugin_ros.settings import DriverName
from m2pem_plugin_ros.simulator.specification import VehicleSpec
from m2pem_plugin_ros.simulator.vehicle import Vehicle


@dataclass(slots=True)
class TrafficFaults:
    """The faults in the messages of a vehicle's nodes.

    `silent`: nothing is published except what moves the base. `no_odometry`: only odometry is
    missing. `refusal`: an m2pem or Nav2 node refuses every behavior with this text (None: it does
    not). `deaf`: an m2pem node receives no START. `lies`: it reports behaviors that it was not
    given, and contradicts itself. `flood_per_s`: statuses in a second of real time.
    """

    silent: bool = False
    no_odometry: bool = False
    refusal: str | None = None
    deaf: bool = False
    lies: bool = False
    flood_per_s: float = 0.0


@dataclass(slots=True)
class Nav2Faults:
    """The faults of a simulated Nav2. `reject`: no goal is accepted. `hang`: accepted goals are not
    executed, and cannot be cancelled. `error_code`: goals are aborted with it after
    `abort_after_s`. `miss`: indices of waypoints that are not reached."""

    reject: bool = False
    hang: bool = False
    error_code: int = 0
    error_msg: str = ""
    abort_after_s: float = 0.5
    miss: frozenset[int] = frozenset()


LOW = 0.12
"""The charge of a low battery."""

REFUSAL = "it has been told to refuse"
FLOOD_PER_S = 5000.0
BLOCKED_CODE = 208
"""The error of Nav2's planner if there is no path."""

NUMBER = r"(\d+(?:\.\d+)?)"


class FaultTarget(Protocol):
    """The interface of a vehicle that faults use."""

    vehicle: Vehicle
    traffic_faults: TrafficFaults

    @property
    def nav2(self) -> Any:
        """The simulated Nav2; None if there is none, or it is killed."""
        ...

    def kill(self) -> None:
        """Kill all nodes."""
        ...

    def kill_node(self) -> None:
        """Kill the node that controls the vehicle on board."""
        ...

    def start(self) -> None:
        """Start the nodes that are missing."""
        ...


Action = Callable[[FaultTarget], None]
Made = tuple[Action, Action | None]
"""The start of a fault, and its end (None: it has no end)."""


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of fault. `drivers`: of the vehicles that can have it. `detector`: the vehicle needs
    one."""

    pattern: str
    make: Callable[[re.Match[str]], Made]
    drivers: tuple[DriverName, ...] = tuple(DriverName)
    detector: bool = False


def _traffic_fault(name: str, value: object, normal: object) -> Callable[[re.Match[str]], Made]:
    def made(_: re.Match[str]) -> Made:
        return (
            lambda simulated: setattr(simulated.traffic_faults, name, value),
            lambda simulated: setattr(simulated.traffic_faults, name, normal),
        )

    return made


def _odometer(name: str) -> Callable[[re.Match[str]], Made]:
    def made(_: re.Match[str]) -> Made:
        return (
            lambda simulated: setattr(simulated.vehicle.odometer, name, True),
            lambda simulated: setattr(simulated.vehicle.odometer, name, False),
        )

    return made


def _jump(match: re.Match[str]) -> Made:
    distance_m = float(match[1])
    return (lambda simulated: simulated.vehicle.odometer.jump(distance_m)), None


def _stuck(_: re.Match[str]) -> Made:
    return (
        lambda simulated: setattr(simulated.vehicle.body, "stuck", True),
        lambda simulated: setattr(simulated.vehicle.body, "stuck", False),
    )


def _refuse(match: re.Match[str]) -> Made:
    return _traffic_fault("refusal", match[1] or REFUSAL, None)(match)


def _flood(match: re.Match[str]) -> Made:
    per_s = FLOOD_PER_S if match[1] is None else float(match[1])
    return _traffic_fault("flood_per_s", per_s, 0.0)(match)


def _battery(match: re.Match[str]) -> Made:
    left = LOW if match[1] is None else float(match[1]) / 100
    if left > 1:
        raise ValueError("a battery has at most 100 %")
    return (lambda simulated: setattr(simulated.vehicle.battery, "fraction", left)), None


def _gps(_: re.Match[str]) -> Made:
    return (
        lambda simulated: setattr(simulated.vehicle, "gps_lost", True),
        lambda simulated: setattr(simulated.vehicle, "gps_lost", False),
    )


def _detect(match: re.Match[str]) -> Made:
    what = match[1] or ""
    return (lambda simulated: simulated.vehicle.detect(what)), None


def _kill(_: re.Match[str]) -> Made:
    return (lambda simulated: simulated.kill()), (lambda simulated: simulated.start())


def _kill_node(_: re.Match[str]) -> Made:
    return (lambda simulated: simulated.kill_node()), (lambda simulated: simulated.start())


def _start(_: re.Match[str]) -> Made:
    return (lambda simulated: simulated.start()), None


def _nav2(name: str, value: object, normal: object) -> Callable[[re.Match[str]], Made]:
    def made(_: re.Match[str]) -> Made:
        return (lambda simulated: _set(simulated, name, value)), (
            lambda simulated: _set(simulated, name, normal)
        )

    return made


def _set(simulated: FaultTarget, name: str, value: object) -> None:
    if simulated.nav2 is not None:
        setattr(simulated.nav2.faults, name, value)


def _nav2_abort(match: re.Match[str]) -> Made:
    return _nav2("error_code", int(match[1] or BLOCKED_CODE), 0)(match)


def _nav2_inactive(_: re.Match[str]) -> Made:
    return (lambda simulated: _enter(simulated, "inactive")), (
        lambda simulated: _enter(simulated, "active")
    )


def _enter(simulated: FaultTarget, state: str) -> None:
    if simulated.nav2 is not None:
        simulated.nav2.enter(state)


NAV2_ONLY = (DriverName.NAV2,)
NODE_ONLY = (DriverName.NODE,)
STEERED = (DriverName.NODE, DriverName.NAV2)
KINDS: Mapping[str, Kind] = {
    "silent": Kind(r"silent", _traffic_fault("silent", True, False)),
    "kill": Kind(r"kill", _kill),
    "kill node": Kind(r"kill node", _kill_node),
    "start": Kind(r"start", _start),
    "stop odometry": Kind(r"stop odometry", _traffic_fault("no_odometry", True, False)),
    "freeze odometry": Kind(r"freeze odometry", _odometer("frozen")),
    "odometry nan": Kind(r"odometry nan", _odometer("nonsense")),
    "jump 20 m": Kind(rf"jump\s+{NUMBER}\s*m", _jump),
    "wheels stuck": Kind(r"wheels stuck", _stuck),
    "lose gps": Kind(r"lose gps", _gps),
    "battery low, battery 12 %": Kind(rf"battery\s+(?:low|{NUMBER}\s*%)", _battery),
    "detect, detect gpr": Kind(r"detect(?:\s+(\S+))?", _detect, detector=True),
    'refuse, refuse "text"': Kind(r"refuse(?:\s+\"([^\"]+)\")?", _refuse, STEERED),
    "never accept": Kind(r"never accept", _traffic_fault("deaf", True, False), NODE_ONLY),
    "lie": Kind(r"lie", _traffic_fault("lies", True, False), NODE_ONLY),
    "flood, flood 5000": Kind(rf"flood(?:\s+{NUMBER})?", _flood, NODE_ONLY),
    "nav2 inactive": Kind(r"nav2 inactive", _nav2_inactive, NAV2_ONLY),
    "nav2 reject": Kind(r"nav2 reject", _nav2("reject", True, False), NAV2_ONLY),
    "nav2 hang": Kind(r"nav2 hang", _nav2("hang", True, False), NAV2_ONLY),
    "nav2 abort, nav2 abort 208": Kind(r"nav2 abort(?:\s+(\d+))?", _nav2_abort, NAV2_ONLY),
}
"""How each fault is written, and what it is."""


EXAMPLE = '"evsg1: silent at 20 s for 5 s"'
SHAPE = re.compile(
    rf"(?:(?P<who>[^:\"]*):)?\s*(?P<what>.*?)"
    rf"(?:\s+at\s+(?P<at>{NUMBER})\s*s)?(?:\s+for\s+(?P<for>{NUMBER})\s*s)?",
    re.DOTALL,
)
NAME = re.compile(r"[A-Za-z_][\w-]*")


class FaultError(ValueError):
    """A text is not a fault, or the vehicle cannot have it; the message says what is right."""


@dataclass(frozen=True, slots=True)
class PlannedFault:
    """A fault that was read from a text.

    `vehicles`: their names (None: all). `at_s`: when it starts after it was planned. `for_s`: how
    long it lasts (None: for good). Both are in simulated time.
    """

    text: str
    vehicles: tuple[str, ...] | None
    kind: Kind
    begin: Action
    end: Action | None
    at_s: float = 0.0
    for_s: float | None = None

    def check(self, spec: VehicleSpec) -> None:
        """Check that a vehicle can have the fault.

        Raises:
            FaultError: it cannot, and why.
        """
        if spec.settings.driver not in self.kind.drivers:
            needs = " or ".join(DRIVER_TEXTS[each] for each in self.kind.drivers)
            raise FaultError(
                f"fault {self.text!r}: {spec.name} is {DRIVER_TEXTS[spec.settings.driver]}; "
                f"that happens to {needs} alone"
            )
        if self.kind.detector and not spec.detectors:
            raise FaultError(f"fault {self.text!r}: {spec.name} carries no detector")


DRIVER_TEXTS = {
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
