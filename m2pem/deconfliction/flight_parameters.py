"""What a behavior's parameters ask of an aircraft: places in the frame, and heights."""

import math
from collections.abc import Callable, Mapping

from m2pem.api.arbiter import ResolvedValue
from m2pem.api.behavior_parameters import BehaviorParameters
from m2pem.deconfliction.craft import Craft, Span
from m2pem.geo.local_frame import EastNorth, LocalFrame
from m2pem.mission.geometry import Area, Coordinate, Point, Route, VehiclePosition

ANY_HEIGHT = Span(-math.inf, math.inf)


class FlightParameters(BehaviorParameters):
    """The parameters of a behavior of one aircraft.

    `height_of`: the height of another vehicle now. `unknown`: is set to why something that was
    asked for is boundless.
    """

    def __init__(
        self,
        values: Mapping[str, ResolvedValue],
        craft: Craft,
        frame: LocalFrame,
        height_of: Callable[[str], float | None],
    ) -> None:
        super().__init__(values)
        self.craft = craft
        self.frame = frame
        self.unknown = ""
        self._height_of = height_of

    def to_local(self, place: Coordinate) -> EastNorth:
        """A coordinate in the frame."""
        return self.frame.to_local(place[:2])

    def ring(self, area: Area) -> list[EastNorth]:
        """The corners of an area's outer ring, each once."""
        return [self.to_local(corner) for corner in area.rings[0][:-1]]

    def waypoint_spans(self, route: Route) -> list[Span]:
        """The height at each waypoint of a route."""
        return [self.span(each[2], route.altitude_frame) for each in route.waypoints]

    def target_place(self) -> tuple[EastNorth | None, Span]:
        """Where `target` is, None if that is wherever a vehicle goes; and the height to be at."""
        value = self.target
        if isinstance(value, Point):
            return self.to_local(value.position), self.span(value.position[2], value.altitude_frame)
        if not isinstance(value, VehiclePosition):
            self.unknown = "it has no target that is known"
            return None, ANY_HEIGHT
        self.unknown = f"it goes wherever {value.vehicle} goes"
        span = self.span()
        target_m = self._height_of(value.vehicle)
        if self.altitude_m is None and target_m is not None and target_m > span.low_m:
            span = span.to(Span(target_m, target_m))
        return None, span

    def span(self, own_m: float | None = None, own_frame: str = "relative") -> Span:
        """The height to move at: as the parameters say, else as a place does, else as it is."""
        altitude_m = self.altitude_m
        if altitude_m is not None:
            return self._lifted(altitude_m, self.altitude_frame)
        if own_m is not None:
            return self._lifted(own_m, own_frame)
        if self.craft.flies:
            return self.craft.span
        self.unknown = "nobody says how high it is to fly: give it an altitude"
        return Span(self.craft.span.low_m, math.inf)

    def _lifted(self, altitude_m: float, frame: str) -> Span:
        home_m = self.craft.home_m
        if frame == "terrain":
            self.unknown = "its altitude is above the terrain, whose height is not known here"
            return ANY_HEIGHT
        if frame == "amsl":
            up_m = altitude_m
        elif home_m is None:
            self.unknown = "the height of its home is not known, which its altitude counts from"
            return ANY_HEIGHT
        else:
            up_m = home_m + altitude_m
        # What would be below its home is flown there, or at home's height.
        return Span(up_m, up_m if home_m is None else max(up_m, home_m))
