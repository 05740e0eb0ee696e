"""Covering an area in parallel tracks."""

import math
from collections.abc import Sequence

from m2pem.api import LocalFrame, lawn_mower, longest_edge_yaw
from m2pem_plugin_mavlink.behaviors.behavior import BehaviorFailedError
from m2pem_plugin_mavlink.behaviors.looking import away_m
from m2pem_plugin_mavlink.behaviors.mission_flight import MissionFlight, waypoint
from m2pem_plugin_mavlink.microservices.mission_items import MissionItem

SPACING_M = 20.0


class Survey(MissionFlight):
    """The passes of a lawn-mower, begun at the nearer of their two ends."""

    name = "area_survey"

    def way(self) -> Sequence[MissionItem]:
        """The ends of the passes."""
        area = self.wishes.area
        if area is None:
            raise BehaviorFailedError("parameter 'area': there is none")
        frame = LocalFrame(area.rings[0][0][:2])
        rings = [[frame.to_local(corner[:2]) for corner in ring] for ring in area.rings]
        heading = self.wishes.number("heading")
        yaw = longest_edge_yaw(rings[0]) if heading is None else math.pi / 2 - heading
        try:
            points = lawn_mower(
                rings,
                self.wishes.number("spacing") or SPACING_M,
                yaw,
                self.wishes.number("overshoot") or 0.0,
            )
        except ValueError as error:
            raise BehaviorFailedError(f"parameter 'spacing': {error}") from None
        places = [frame.to_latlon(point) for point in points]
        if away_m(self.vehicle, places[-1]) < away_m(self.vehicle, places[0]):
            places.reverse()
        height = self.wishes.altitude_to_fly(area.rings[0][0][2], area.altitude_frame)
        return [waypoint(place, *height) for place in places]

    def named(self, index: int) -> str:
        """By the number of its pass, from 1."""
        return f"{'end' if index % 2 else 'begin'} of pass {index // 2 + 1} of the survey"
