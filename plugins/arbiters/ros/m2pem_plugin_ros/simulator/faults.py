"""Faults of simulated vehicles: how they are written, and what they do."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from m2pem.api.faults import (
    BATTERY,
    NUMBER,
    Effect,
    FaultGrammar,
    FaultKind,
    PlannedFault,
    battery_left,
    fixed,
)
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


Match = re.Match[str]


@dataclass(frozen=True, slots=True)
class RosFaultKind(FaultKind[FaultTarget]):
    """A kind of fault. `drivers`: of the vehicles that can have it. `detector`: the vehicle needs
    one."""

    drivers: tuple[DriverName, ...] = tuple(DriverName)
    detector: bool = False


def _set(fault: str, value: object, normal: object) -> Effect[FaultTarget]:
    return Effect(
        lambda simulated: setattr(simulated.traffic_faults, fault, value),
        lambda simulated: setattr(simulated.traffic_faults, fault, normal),
    )


def _switch(
    of: Callable[[FaultTarget], object], fault: str
) -> Callable[[Match], Effect[FaultTarget]]:
    """Return the effect that sets a flag of the vehicle, and clears it."""
    return fixed(
        lambda simulated: setattr(of(simulated), fault, True),
        lambda simulated: setattr(of(simulated), fault, False),
    )


def _traffic(simulated: FaultTarget) -> object:
    return simulated.traffic_faults


def _odometer(simulated: FaultTarget) -> object:
    return simulated.vehicle.odometer


def _jump(match: Match) -> Effect[FaultTarget]:
    distance_m = float(match[1])
    return Effect(lambda simulated: simulated.vehicle.odometer.jump(distance_m))


def _battery(match: Match) -> Effect[FaultTarget]:
    left = battery_left(match, LOW)
    return Effect(lambda simulated: setattr(simulated.vehicle.battery, "fraction", left))


def _detect(match: Match) -> Effect[FaultTarget]:
    what = match[1] or ""
    return Effect(lambda simulated: simulated.vehicle.detect(what))


def _start(simulated: FaultTarget) -> None:
    simulated.start()


def _nav2(fault: str, value: object, normal: object) -> Effect[FaultTarget]:
    def put(simulated: FaultTarget, to: object) -> None:
        if simulated.nav2 is not None:
            setattr(simulated.nav2.faults, fault, to)

    return Effect(lambda simulated: put(simulated, value), lambda simulated: put(simulated, normal))


def _enter(state: str) -> Callable[[FaultTarget], None]:
    def enter(simulated: FaultTarget) -> None:
        if simulated.nav2 is not None:
            simulated.nav2.enter(state)

    return enter


NAV2_ONLY = (DriverName.NAV2,)
NODE_ONLY = (DriverName.NODE,)
STEERED = (DriverName.NODE, DriverName.NAV2)
KINDS: Mapping[str, RosFaultKind] = {
    "silent": RosFaultKind(r"silent", _switch(_traffic, "silent")),
    "kill": RosFaultKind(r"kill", fixed(lambda simulated: simulated.kill(), _start)),
    "kill node": RosFaultKind(r"kill node", fixed(lambda simulated: simulated.kill_node(), _start)),
    "start": RosFaultKind(r"start", fixed(_start)),
    "stop odometry": RosFaultKind(r"stop odometry", _switch(_traffic, "no_odometry")),
    "freeze odometry": RosFaultKind(r"freeze odometry", _switch(_odometer, "frozen")),
    "odometry nan": RosFaultKind(r"odometry nan", _switch(_odometer, "nonsense")),
    "jump 20 m": RosFaultKind(rf"jump\s+{NUMBER}\s*m", _jump),
    "stuck": RosFaultKind(r"stuck", _switch(lambda simulated: simulated.vehicle.body, "stuck")),
    "lose gps": RosFaultKind(r"lose gps", _switch(lambda simulated: simulated.vehicle, "gps_lost")),
    "battery low, battery 12 %": RosFaultKind(BATTERY, _battery),
    "detect, detect gpr": RosFaultKind(r"detect(?:\s+(\S+))?", _detect, detector=True),
    'refuse, refuse "text"': RosFaultKind(
        r"refuse(?:\s+\"([^\"]+)\")?",
        lambda match: _set("refusal", match[1] or REFUSAL, None),
        drivers=STEERED,
    ),
    "never accept": RosFaultKind(r"never accept", _switch(_traffic, "deaf"), drivers=NODE_ONLY),
    "lie": RosFaultKind(r"lie", _switch(_traffic, "lies"), drivers=NODE_ONLY),
    "flood, flood 5000": RosFaultKind(
        rf"flood(?:\s+{NUMBER})?",
        lambda match: _set("flood_per_s", float(match[1] or FLOOD_PER_S), 0.0),
        drivers=NODE_ONLY,
    ),
    "nav2 inactive": RosFaultKind(
        r"nav2 inactive", fixed(_enter("inactive"), _enter("active")), drivers=NAV2_ONLY
    ),
    "nav2 reject": RosFaultKind(
        r"nav2 reject", lambda _: _nav2("reject", True, False), drivers=NAV2_ONLY
    ),
    "nav2 hang": RosFaultKind(
        r"nav2 hang", lambda _: _nav2("hang", True, False), drivers=NAV2_ONLY
    ),
    "nav2 abort, nav2 abort 208": RosFaultKind(
        r"nav2 abort(?:\s+(\d+))?",
        lambda match: _nav2("error_code", int(match[1] or BLOCKED_CODE), 0),
        drivers=NAV2_ONLY,
    ),
}
"""How each fault is written, and what it is."""

GRAMMAR = FaultGrammar(
    KINDS,
    "evsg1: silent at 20 s for 5 s",
    targets=(r"[A-Za-z_][\w-]*", "vehicles: say their names, such as evsg1 or evsg1,evsg2"),
)

DRIVER_TEXTS = {
    DriverName.NODE: "an m2pem node",
    DriverName.NAV2: "Nav2",
    DriverName.BASE: "a plain base",
}


def check(fault: PlannedFault[FaultTarget], spec: VehicleSpec) -> None:
    """Check that a vehicle can have a fault.

    Raises:
        FaultError: it cannot, and why.
    """
    kind = fault.kind
    assert isinstance(kind, RosFaultKind)
    if spec.settings.driver not in kind.drivers:
        needs = " or ".join(DRIVER_TEXTS[each] for each in kind.drivers)
        raise fault.error(
            f"{spec.name} is {DRIVER_TEXTS[spec.settings.driver]}; that happens to {needs} alone"
        )
    if kind.detector and not spec.detectors:
        raise fault.error(f"{spec.name} carries no detector")
