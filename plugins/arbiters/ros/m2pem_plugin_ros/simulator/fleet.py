"""The simulated vehicles of a fleet file (arbiter `ros`, `sitl: true`), or a default row of
them."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from m2pem.api import Connection, Fleet
from m2pem.errors import PluginError
from m2pem_plugin_ros.frames import Origin
from m2pem_plugin_ros.pose import Pose
from m2pem_plugin_ros.settings import (
    Bounds,
    DetectorMessage,
    DetectorSettings,
    DriverName,
    Settings,
    read_detectors,
    read_settings,
)
from m2pem_plugin_ros.simulator.dynamics import Chassis, limits
from m2pem_plugin_ros.simulator.sensors import DetectorSpec, Target
from m2pem_plugin_ros.simulator.specification import (
    SettingError,
    VehicleSpec,
    apply_settings,
    detector,
)

ARBITER = "ros"
SIM = "sim"
"""The key of the settings of a simulated vehicle in its connection."""


def read_specs(fleet: Fleet, words: Mapping[str, Any]) -> Iterator[VehicleSpec]:
    """Yield the specifications of the simulated vehicles of a fleet, as an executive with the same
    file expects them.

    `words` are settings of all vehicles, and override those of the file.

    Raises:
        PluginError: a connection is wrong; the text names the resource and the key.
        WordError: one of `words` is wrong.
    """
    vehicles = [each for each in fleet.vehicles.values() if each.arbiter == ARBITER and each.sitl]
    connections = {each.id: Connection.of(fleet, each.id) for each in vehicles}
    payloads = {
        payload.id: Connection.of(fleet, payload.id)
        for vehicle in vehicles
        for payload in (fleet.payloads[name] for name in vehicle.payloads)
        if payload.arbiter == ARBITER and payload.detector
    }
    settings = read_settings(connections)
    detectors = read_detectors({**connections, **payloads})
    for number, vehicle in enumerate(vehicles):
        domain, own = vehicle.domain.value, settings[vehicle.id]
        spec = VehicleSpec(
            vehicle.id,
            own,
            domain,
            start_of(number),
            fleet.origin,
            _chassis(domain, own),
            detectors=tuple(
                _detector(payloads[name], vehicle.settings, detectors[name], fleet.origin)
                for name in payloads
                if fleet.payloads[name].vehicle == vehicle.id and detectors[name].other is None
            ),
        )
        try:
            spec = apply_settings(vehicle.settings.get(SIM, {}), spec)
        except SettingError as error:
            raise PluginError(f"{vehicle.id}: connection.{SIM}.{error}") from error
        yield apply_settings(words, spec)


def _chassis(domain: str, settings: Settings) -> Chassis:
    """Return the capabilities that the fleet says; otherwise the defaults of the domain."""
    usual, bounds = chassis_of(domain), settings.bounds
    if settings.driver is not DriverName.BASE and bounds == Bounds():
        return usual
    return replace(usual, **limits(bounds))


def _detector(
    payload: Connection,
    vehicle_settings: Mapping[str, Any],
    settings: DetectorSettings,
    origin: Origin,
) -> DetectorSpec:
    usual = DetectorSpec()
    spec = replace(
        usual,
        payload=payload.resource,
        topic=settings.topic,
        type=settings.type or usual.type,
        plain=settings.message is DetectorMessage.STRING,
    )
    words = payload.settings.get(SIM, {})
    if words == vehicle_settings.get(SIM):  # a payload inherits what is said of its vehicle
        return spec
    try:
        return detector(words, spec, origin)
    except SettingError as error:
        raise PluginError(f"{payload.resource}: connection.{SIM}.{error}") from error


APART_M = 5.0
"""Distance of vehicles in the row to the east. They face north."""

NORTH_RAD = 1.5707963267948966

BOAT = Chassis(
    speed_m_s=3.0,
    reverse_m_s=0.5,
    acceleration_m_s2=0.5,
    yaw_rate_rad_s=0.5,
    yaw_acceleration_rad_s2=0.5,
    lag_s=0.5,
)
ROVER = Chassis()


def chassis_of(domain: str) -> Chassis:
    """Return the default capabilities of a domain."""
    return BOAT if domain == "surface" else ROVER


def start_of(number: int) -> Pose:
    """Return the start pose of the vehicle with an index."""
    return Pose(number * APART_M, 0.0, NORTH_RAD)


def make_default_vehicles(
    domains: Sequence[str],
    driver: DriverName,
    origin: Origin,
    targets: Sequence[Target] = (),
    words: Mapping[str, Any] | None = None,
) -> Iterator[VehicleSpec]:
    """Yield a vehicle with a detector for each domain, named after it: ugv1, ugv2, usv1, ...

    Raises:
        WordError: a word is not known, or its value has no sense.
    """
    counts = {"ground": 0, "surface": 0}
    for number, domain in enumerate(domains):
        counts[domain] += 1
        name = f"{'usv' if domain == 'surface' else 'ugv'}{counts[domain]}"
        spec = VehicleSpec(
            name,
            Settings(f"/{name}", driver=driver, hardware_id=name),
            domain,
            start_of(number),
            origin,
            chassis_of(domain),
            detectors=(DetectorSpec(targets=tuple(targets)),),
        )
        yield apply_settings(words or {}, spec)
