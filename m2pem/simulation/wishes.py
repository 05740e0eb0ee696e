"""A request's parameters, and places on the ground, as a manoeuvre asks for them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from m2pem.api.arbiter import ResolvedValue
from m2pem.mission.geometry import Area, Coordinate, Point, Route, VehiclePosition
from m2pem.simulation.course import Craft
from m2pem.simulation.frame import FlatFrame
from m2pem.simulation.phases import Pose, Vector


class RefusedError(Exception):
    """The behavior cannot be done; the text says why, `code` is that of the report."""

    def __init__(self, reason: str, code: str = "REJECTED") -> None:
        self.reason = reason
        self.code = code
        super().__init__(reason)


@dataclass(frozen=True, slots=True)
class Wishes:
    """Parameters that were checked, in the local frame.

    `whereabouts`: how a vehicle stands and moves now, None if it was never heard.
    """

    values: Mapping[str, ResolvedValue]
    frame: FlatFrame
    whereabouts: Callable[[str], Pose | None]

    def number(self, name: str) -> float | None:
        """A number in SI, None if not given."""
        value = self.values.get(name)
        return float(value) if isinstance(value, int | float) else None

    def flag(self, name: str) -> bool:
        """Whether something is wished."""
        return self.values.get(name) is True

    def text(self, name: str, default: str) -> str:
        """A text."""
        value = self.values.get(name)
        return value if isinstance(value, str) else default

    def route(self) -> Route | None:
        """The parameter `route`."""
        value = self.values.get("route")
        return value if isinstance(value, Route) else None

    def area(self) -> Area | None:
        """The parameter `area`."""
        value = self.values.get("area")
        return value if isinstance(value, Area) else None

    def target_vehicle(self) -> str | None:
        """The vehicle that `target` names, if it names one."""
        value = self.values.get("target")
        return value.vehicle if isinstance(value, VehiclePosition) else None

    def rings(self, area: Area) -> list[list[tuple[float, float]]]:
        """An area's rings on the map."""
        return [[self._level("area", corner) for corner in ring] for ring in area.rings]

    def places(self, craft: Craft, route: Route, up_m: float) -> list[Vector]:
        """A route's waypoints as `craft` passes them; `up_m` where they say no height."""
        return [
            (*self._level("route", waypoint), self._up(craft, waypoint, route.altitude_frame, up_m))
            for waypoint in route.waypoints
        ]

    def target(self, craft: Craft, up_m: float) -> Vector:
        """Where `target` is now, at the height that it says, or else at `up_m`."""
        value = self.values.get("target")
        if isinstance(value, Point):
            level = self._level("target", value.position)
            return (*level, self._up(craft, value.position, value.altitude_frame, up_m))
        if isinstance(value, VehiclePosition):
            east, north, up = self.pose_of(value.vehicle).place
            if craft.flies and self.height(craft) is None:
                up_m = max(up, up_m)
            return (east, north, up_m)
        raise RefusedError("it has no target")

    def point(self, ground_up_m: float) -> Vector:
        """The point that `target` says, seen from a payload over ground of that height."""
        value = self.values.get("target")
        if not isinstance(value, Point):
            raise RefusedError("it has no target")
        altitude = value.position[2] or 0.0
        if value.altitude_frame == "amsl" and value.position[2] is not None:
            up = altitude - self.frame.origin[2]
        else:
            up = ground_up_m + altitude
        return (*self._level("target", value.position), up)

    def pose_of(self, vehicle: str) -> Pose:
        """How a vehicle stands now.

        Raises:
            RefusedError: it was never heard.
        """
        pose = self.whereabouts(vehicle)
        if pose is None:
            raise RefusedError(f"parameter 'target': the position of {vehicle} is not known")
        return pose

    def height(self, craft: Craft) -> float | None:
        """`up` of the parameter `altitude`, None if not given or nothing to this craft."""
        altitude = self.number("altitude")
        if altitude is None:
            return None
        return self._lifted(craft, altitude, self.text("altitude_frame", "relative"))

    def _up(self, craft: Craft, place: Coordinate, frame: str, up_m: float) -> float:
        wished = self.height(craft)
        if wished is not None:
            return wished
        return up_m if place[2] is None else self._lifted(craft, place[2], frame)

    def _lifted(self, craft: Craft, altitude_m: float, frame: str) -> float:
        ground = craft.home[2]
        up = altitude_m - self.frame.origin[2] if frame == "amsl" else ground + altitude_m
        if craft.domain == "air":
            return max(ground, up)
        return min(ground, up) if craft.domain == "subsurface" else ground

    def _level(self, parameter: str, place: Coordinate) -> tuple[float, float]:
        try:
            return self.frame.to_place(place[:2])
        except ValueError as error:
            raise RefusedError(f"parameter '{parameter}': {error}") from None
