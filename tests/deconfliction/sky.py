"""Aircraft over a frame, and requests for them, in metres east and north of one place."""

import itertools
from dataclasses import replace
from typing import Any

from m2pem.api.arbiter import BehaviorRequest
from m2pem.api.telemetry import GeoPosition, VehicleState
from m2pem.deconfliction.reservations import Reservations
from m2pem.fleet.fleet import Domain, Fleet, Vehicle
from m2pem.geo.local_frame import LocalFrame
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.geometry import Area, Point, Route

FRAME = LocalFrame((38.0, -77.0))
GROUND_M = 60.0
"""Of the ground, above mean sea level."""

NOW_US = 1_767_225_600_000_000
NUMBERS = itertools.count(1)


def place(east: float, north: float, up: float | None = None) -> Any:
    """A coordinate."""
    return (*FRAME.to_latlon((east, north)), up)


def point(east: float, north: float, up: float | None = None) -> Point:
    """A target."""
    return Point(place(east, north, up))


def route(*places: tuple[float, ...], frame: str = "relative") -> Route:
    """A route through (east, north) or (east, north, altitude)."""
    return Route(tuple(place(*each) for each in places), frame)


def area(*corners: tuple[float, float]) -> Area:
    """A polygon."""
    ring = tuple(place(*corner) for corner in corners)
    return Area(((*ring, ring[0]),))


def fleet(*names: str, ground: tuple[str, ...] = ()) -> Fleet:
    """Aircraft, and ground vehicles."""
    domains = dict.fromkeys(names, Domain.AIR) | dict.fromkeys(ground, Domain.GROUND)
    vehicles = {
        ResourceId(name): Vehicle(ResourceId(name), domain, "sim", {})
        for name, domain in domains.items()
    }
    return Fleet("test", "test.yaml", vehicles)


def airspace(
    *names: str,
    vertical: float = 10.0,
    horizontal: float = 20.0,
    time: float | None = None,
    ground: tuple[str, ...] = (),
) -> Reservations:
    """Nobody is heard yet."""
    return Reservations(
        replace(
            fleet(*names, ground=ground),
            vertical_separation_m=vertical,
            horizontal_separation_m=horizontal,
            time_separation_s=time,
        )
    )


def state(
    name: str, east: float, north: float, up: float, time_us: int = NOW_US, **more: Any
) -> VehicleState:
    """A vehicle `up` metres above the ground, which is its home's height."""
    return VehicleState(
        ResourceId(name),
        time_us,
        GeoPosition(*FRAME.to_latlon((east, north)), GROUND_M + up),
        up,
        **{"velocity_enu_m_s": (0.0, 0.0, 0.0), "armed": up > 0, **more},
    )


def request(behavior: str, *names: str, **parameters: Any) -> BehaviorRequest:
    """What a run asks for."""
    ids = tuple(ResourceId(name) for name in names)
    return BehaviorRequest(f"r1.b{next(NUMBERS)}", 1, behavior, parameters, ids)


def claim(
    sky: Reservations,
    wished: BehaviorRequest,
    kind: BehaviorType = BehaviorType.VEHICLE,
    now_us: int = NOW_US,
) -> str:
    """As the executive asks."""
    return sky.reserve(wished, kind, now_us, takes_altitude=True)
