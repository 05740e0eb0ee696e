"""Recorded traces of real autopilots, and how a simulated one differs from them.

`traces/VEHICLE.json` holds what `tools/record_autopilot` wrote down; `traces/differences.yaml` the
differences that are left, each with its reason.
"""

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from types import MappingProxyType
from typing import Any, NamedTuple

import yaml
from m2pem_plugin_mavlink.simulator.specification import Kind, VehicleSpec
from m2pem_plugin_mavlink.sitl.launch import px4_port
from mavlink_recording import Trace
from mavlink_scenarios import Scenario
from mavlink_sitl import MOUNT, ardupilot, px4, running
from mavlink_station import Station
from mavlink_wires import SimulatedWire, UdpWire

FOLDER = Path(__file__).parent / "traces"
NEAR_S, NEAR_SHARE = 4.0, 0.4
"""Times that differ by so many seconds, or by this share of the longer one, are alike."""


class Vehicle(NamedTuple):
    """`model`: of the program's own simulation; `parameters`: what the file of parameters or the
    start script that belongs to it sets; `estimator_s`: of the simulated one; `given`: parameters
    that the real one is started with."""

    kind: Kind
    firmware: str
    model: str
    parameters: Mapping[str, float] = MappingProxyType({})
    estimator_s: float = VehicleSpec().estimator_s
    given: Mapping[str, float] = MappingProxyType({})


VEHICLES = {
    "arducopter": Vehicle(Kind.COPTER, "ardupilot", "quad"),
    "ardurover": Vehicle(
        Kind.ROVER, "ardupilot", "rover", {"WP_SPEED": 5.0, "CRUISE_SPEED": 5.0, "WP_RADIUS": 3.0}
    ),
    "arduplane": Vehicle(Kind.PLANE, "ardupilot", "plane"),
    "arducopter-gimbal": Vehicle(Kind.COPTER, "ardupilot", "quad", given=MOUNT),
    # PX4's start script multiplies these by the speed of time, and knows where it is soon after.
    "px4copter": Vehicle(
        *(Kind.COPTER, "px4", "sihsim_quadx"),
        {"COM_DL_LOSS_T": 50.0, "COM_OF_LOSS_T": 5.0, "COM_DISARM_PRFLT": 50.0},
        estimator_s=1.0,
    ),
}


class Difference(NamedTuple):
    """What differs in a step. `channel`: see `mavlink_recording`, or "took WHAT", "facts WHAT"."""

    step: str
    channel: str
    real: Any
    simulated: Any

    @property
    def key(self) -> str:
        """How `differences.yaml` names it."""
        return f"{self.step}: {self.channel}"


def recorded(vehicle: str) -> dict[str, Trace]:
    """The traces of a real autopilot by scenario."""
    file = FOLDER / f"{vehicle}.json"
    traces: dict[str, Trace] = json.loads(file.read_text(encoding="utf-8"))["scenarios"]
    return traces


def firmware(vehicle: str) -> str:
    """The version of the firmware that was recorded."""
    file = FOLDER / f"{vehicle}.json"
    return str(json.loads(file.read_text(encoding="utf-8"))["firmware"])


def reasons(vehicle: str, scenario: str) -> dict[str, str]:
    """The differences that are left, by `Difference.key`, with their reasons."""
    listed = yaml.safe_load((FOLDER / "differences.yaml").read_text(encoding="utf-8")) or {}
    return dict((listed.get(vehicle) or {}).get(scenario) or {})


@cache
def play_simulated(vehicle: str, scenario: Scenario) -> Trace:
    """The trace of the simulated autopilot."""
    kind, firmware, _, parameters, estimator_s, _ = VEHICLES[vehicle]
    spec = VehicleSpec(kind, firmware=firmware, parameters=parameters, estimator_s=estimator_s)
    station = Station(SimulatedWire(spec))
    station.connect()
    scenario.play(station)
    return station.trace


def play_real(vehicle: str, binary: Path, scenario: Scenario, instance: int) -> tuple[Trace, str]:
    """The trace of a real autopilot and its version; `instance` must differ between programs of a
    machine at the same time."""
    with _real(vehicle, binary, instance) as station:
        station.connect()
        scenario.play(station)
        return station.trace, station.version


@contextmanager
def _real(vehicle: str, binary: Path, instance: int) -> Iterator[Station]:
    kind, firmware, model, _, _, given = VEHICLES[vehicle]
    wire = UdpWire(kind, firmware, px4_port(instance) if firmware == "px4" else 0)
    with TemporaryDirectory() as folder:
        if firmware == "px4":
            launch = px4(binary, instance, Path(folder))
        else:
            launch = ardupilot(binary, model, instance, wire.port, parameters=given)
        with running([launch], Path(folder)):
            try:
                yield Station(wire, instance + 1)
            finally:
                wire.close()


def compare(real: Trace, simulated: Trace) -> list[Difference]:
    """What differs. Texts below a warning may be missing from the simulation, not be added."""
    found: list[Difference] = []
    for number in range(max(len(real), len(simulated))):
        ours = real[number] if number < len(real) else {}
        theirs = simulated[number] if number < len(simulated) else {}
        step = f"{number + 1} {ours.get('do') or theirs.get('do')}"
        for channel, a, b in _channels(ours, theirs):
            if not _alike(channel, a, b):
                found.append(Difference(step, channel, a, b))
    return found


def _channels(real: dict[str, Any], simulated: dict[str, Any]) -> Iterator[tuple[str, Any, Any]]:
    for channel in dict.fromkeys((*real, *simulated)):
        a, b = real.get(channel), simulated.get(channel)
        if channel in ("took", "facts"):
            a, b = a or {}, b or {}
            for what in dict.fromkeys((*a, *b)):
                yield f"{channel} {what}", a.get(what), b.get(what)
        else:
            yield channel, a, b


def _alike(channel: str, real: Any, simulated: Any) -> bool:
    if channel.startswith("took") and real is not None and simulated is not None:
        apart = abs(real - simulated)
        return apart <= NEAR_S or apart <= NEAR_SHARE * max(real, simulated)
    if channel == "texts":
        return set(simulated or ()) <= set(real or ())
    if channel == "warnings":
        return set(simulated or ()) == set(real or ())
    return bool(real == simulated)
