"""Makes simulated vehicles without a fleet file: ugv1, ugv2, usv1, ..."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from m2pem_plugin_ros.frames import Origin
from m2pem_plugin_ros.pose import Pose
from m2pem_plugin_ros.settings import DriverName, Settings
from m2pem_plugin_ros.sim.body import Chassis
from m2pem_plugin_ros.sim.detector import DetectorSpec, Target
from m2pem_plugin_ros.sim.specification import VehicleSpec
from m2pem_plugin_ros.sim.words import apply

APART_M = 5.0
"""Vehicles stand in a row to the east, so far from each other, and face north."""

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
    """How vehicles of a domain move unless something else is said."""
    return BOAT if domain == "surface" else ROVER


def start_of(number: int) -> Pose:
    """Where the vehicle with that number stands, from 0."""
    return Pose(number * APART_M, 0.0, NORTH_RAD)


def make_crew(
    domains: Sequence[str],
    driver: DriverName,
    origin: Origin,
    targets: Sequence[Target] = (),
    words: Mapping[str, Any] | None = None,
) -> Iterator[VehicleSpec]:
    """A vehicle for each domain, named by it; each carries a detector.

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
        yield apply(words or {}, spec)
