"""One vehicle as behaviors see it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from m2pem.api import GeoPosition, ResourceId, VehicleState
from m2pem_plugin_mavlink.link.vehicle_link import VehicleLink
from m2pem_plugin_mavlink.vehicle.driver import Driver, FlightMode


@dataclass(slots=True)
class Heard:
    """What was heard of a vehicle last; None: not heard yet. Frames and units as in VehicleState.

    `landed`: stands on the ground (EXTENDED_SYS_STATE, or where that is not sent, what the heights
    and speeds say). `changes` counts messages that changed something.
    """

    position: GeoPosition | None = None
    altitude_above_home_m: float | None = None
    altitude_above_terrain_m: float | None = None
    velocity_enu_m_s: tuple[float, float, float] | None = None
    yaw_rad: float | None = None
    custom_mode: int | None = None
    mode: FlightMode = FlightMode.OTHER
    armed: bool | None = None
    landed: bool | None = None
    home: GeoPosition | None = None
    changes: int = 0

    @property
    def speed_m_s(self) -> float:
        """Over ground and in height; infinite while it is not known."""
        if self.velocity_enu_m_s is None:
            return float("inf")
        east, north, up = self.velocity_enu_m_s
        return float((east * east + north * north + up * up) ** 0.5)


class Vehicle(Protocol):
    """A vehicle of the fleet behind its link."""

    resource: ResourceId
    domain: str
    link: VehicleLink
    driver: Driver
    heard: Heard

    def state(self) -> VehicleState:
        """Its telemetry now."""
        ...

    async def identified(self, within_s: float) -> bool:
        """Wait until its heartbeat has told which autopilot and kind of vehicle it is."""
        ...

    async def until(self, true: Callable[[], bool], within_s: float | None = None) -> bool:
        """Wait until something is true; it is looked at whenever the vehicle is heard. False: it
        was not within so many seconds of the arbiter's clock."""
        ...

    async def sleep(self, seconds: float) -> None:
        """Wait, by the arbiter's clock."""
        ...

    def recent_texts(self, within_s: float = 5.0) -> tuple[str, ...]:
        """What it said lately (STATUSTEXT), newest last: the reasons of its refusals."""
        ...
