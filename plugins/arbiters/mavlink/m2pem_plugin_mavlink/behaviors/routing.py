"""A route."""

from collections.abc import Sequence

from m2pem_plugin_mavlink.behaviors.behavior import BehaviorFailedError, Job
from m2pem_plugin_mavlink.behaviors.mission_flight import MissionFlight, waypoint
from m2pem_plugin_mavlink.microservices.mission_items import MissionItem


class Routing(MissionFlight):
    """Fly or drive a route from its first waypoint to its last, or over and over."""

    name = "single_vehicle_routing"

    def __init__(self, job: Job) -> None:
        super().__init__(job)
        self.loop = self.wishes.flag("loop")

    def way(self) -> Sequence[MissionItem]:
        route = self.wishes.route
        if route is None or not route.waypoints:
            raise BehaviorFailedError("parameter 'route': it has no waypoints")
        return [
            waypoint((latitude, longitude), *self.wishes.altitude_to_fly(own, route.altitude_frame))
            for latitude, longitude, own in route.waypoints
        ]

    def named(self, index: int) -> str:
        return f"waypoint {index + 1} of the route"
