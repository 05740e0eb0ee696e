"""The own fences of vehicles, and what circles a target."""

import math

import pytest

from m2pem.api.arbiter import BehaviorRequest
from m2pem.api.runs import HandedOver
from m2pem.executive.own_fences import OwnFences
from m2pem.geo.geojson import as_geojson
from m2pem.geo.local_frame import LocalFrame
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.geometry import Area, Point
from m2pem.telemetry.bus import Bus

UAV = ResourceId("uav1")
CENTER = (47.3, 8.5)


def refusal(half_m: float, radius_m: float | None, turned_rad: float) -> str:
    """The refusal of an orbit in the middle of a square fence of a half width."""
    frame = LocalFrame(CENTER)
    corners = [
        frame.to_latlon((half_m * math.sqrt(2) * math.sin(a), half_m * math.sqrt(2) * math.cos(a)))
        for a in (turned_rad + math.pi / 4 + quarter * math.pi / 2 for quarter in range(5))
    ]
    ring = tuple((*corner, None) for corner in [*corners[:4], corners[0]])
    geometry = as_geojson(Area((ring,)))
    given = {"uav1.fence": HandedOver(geometry, "anna", 0)}
    parameters = {"target": Point((*CENTER, None))}
    also = {} if radius_m is None else {"radius": radius_m}
    request = BehaviorRequest("r1.b1", 1, "orbit", {**parameters, **also}, (UAV,))
    return OwnFences(lambda: given, Bus()).refusal(request)


@pytest.mark.parametrize("turned_deg", [0.0, 3.0, 11.25, 22.5, 40.0])
def test_an_orbit_is_refused_wherever_its_circle_leaves_the_fence(turned_deg: float) -> None:
    turned_rad = math.radians(turned_deg)
    assert "the own fence of uav1" in refusal(30.3, 30.5, turned_rad)
    assert refusal(30.3, 30.0, turned_rad) == ""
    assert "the own fence of uav1" in refusal(29.9, None, turned_rad)  # a radius of 30 m
    assert refusal(30.3, None, turned_rad) == ""
