"""The fences of single vehicles, which ground stations upload: no behavior may leave them, of a
mission, an operator or a station. The fleet's fence holds, too: the arbiters check it."""

from collections.abc import Callable, Mapping

from m2pem.api.arbiter import BehaviorRequest
from m2pem.api.behavior_parameters import BehaviorParameters
from m2pem.api.bus import FleetBus
from m2pem.api.fence_check import find_breach, known_yaw_rad, stance_on
from m2pem.api.runs import HandedOver
from m2pem.api.telemetry import VehicleState
from m2pem.fleet.behaviors import ORBIT_RADIUS_M
from m2pem.fleet.fence import own_fences
from m2pem.geo.fence import Fence
from m2pem.geo.geojson import parse_geojson
from m2pem.geo.local_frame import LatLon
from m2pem.geo.polygon import circle_ring
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.geometry import Point


class OwnFences:
    """`handed_over` returns the geometries that were handed over for all runs."""

    def __init__(self, handed_over: Callable[[], Mapping[str, HandedOver]], bus: FleetBus) -> None:
        self._handed_over = handed_over
        self._bus = bus
        self._stance_of = stance_on(bus)

    def refusal(self, request: BehaviorRequest) -> str:
        """Return where a behavior would leave the own fence of one of its vehicles; "": nowhere."""
        for resource in request.resources:
            for fence in self.of(resource):
                if breach := self._breach(fence, resource, request):
                    return breach.replace("the fleet's fence", f"the own fence of {resource}")
        return ""

    def of(self, resource: ResourceId) -> list[Fence]:
        """Return the own fences of a vehicle."""
        geometries = {
            name: parse_geojson(each.geometry)
            for name, each in self._handed_over().items()
            if name.startswith(f"{resource}.")
        }
        return own_fences(resource, geometries) if geometries else []

    def _breach(self, fence: Fence, resource: ResourceId, request: BehaviorRequest) -> str:
        parameters = BehaviorParameters(request.parameters)
        state = self._bus.latest(resource)
        start, yaw_rad = None, None
        if isinstance(state, VehicleState) and state.position is not None:
            start, yaw_rad = state.position.latlon, known_yaw_rad(state)
        way = _around(request.behavior, parameters)
        if way:
            return fence.breach(way, start, lambda _: "its way")
        name = request.behavior
        return str(find_breach(fence, name, parameters, start, yaw_rad, self._stance_of) or "")


def _around(behavior: str, parameters: BehaviorParameters) -> list[LatLon]:
    """Return places around what a survey or an orbit covers; none: another behavior."""
    if behavior == "area_survey" and parameters.area is not None:
        return [corner[:2] for corner in parameters.area.rings[0]]
    target = parameters.target
    if behavior in ("orbit", "area_observe") and isinstance(target, Point):
        radius_m = parameters.number("radius") or ORBIT_RADIUS_M
        corners = circle_ring(target.position[:2], radius_m, is_around=True)
        return [*corners, corners[0]]
    return []
