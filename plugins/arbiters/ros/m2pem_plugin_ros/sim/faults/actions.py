"""What faults do to a vehicle, and how they are written."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from m2pem_plugin_ros.settings import DriverName
from m2pem_plugin_ros.sim.troubles import Troubles
from m2pem_plugin_ros.sim.vehicle import Vehicle

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
