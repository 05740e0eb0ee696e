"""The parameters of a behavior in the local frame of a simulation."""

from collections.abc import Callable, Mapping

from m2pem.api.arbiter import ResolvedValue
from m2pem.api.behavior_parameters import BehaviorParameters
from m2pem.geo.fence import Fence
from m2pem.geo.local_frame import LatLon
from m2pem.mission.geometry import Area, Coordinate, Point, Route, VehiclePosition
from m2pem.simulation.course import Craft, RefusedError
from m2pem.simulation.frame import FlatFrame
from m2pem.simulation.segments import Pose, Vector


class LocalParameters(BehaviorParameters):
    """Parameters that were checked, in the local frame of a simulation.

    `pose_of_vehicle`: where a vehicle is and how it moves, None if it was never received. `fence`:
    in the same frame.
    """

    def __init__(
        self,
        values: Mapping[str, ResolvedValue],
        frame: FlatFrame,
        pose_of_vehicle: Callable[[str], Pose | None],
        fence: Fence | None = None,
    ) -> None:
        super().__init__(values)
        self.frame = frame
        self.fence = fence
        self._pose_of_vehicle = pose_of_vehicle

    def rings(self, area: Area) -> list[list[tuple[float, float]]]:
        """An area's rings on the map."""
        return [[self._level("area", corner) for corner in ring] for ring in area.rings]

    def places(self, craft: Craft, route: Route, up_m: float) -> list[Vector]:
        """A route's waypoints as `craft` passes them; `up_m` where they say no height."""
        return [
            (*self._level("route", waypoint), self._up(craft, waypoint, frame, up_m))
            for waypoint, frame in zip(route.waypoints, route.frames, strict=True)
        ]

    def target_place(self, craft: Craft, up_m: float) -> Vector:
        """Where `target` is now, at the height that it says, or else at `up_m`."""
        value = self.target
        if isinstance(value, Point):
            level = self._level("target", value.position)
            return (*level, self._up(craft, value.position, value.altitude_frame, up_m))
        if isinstance(value, VehiclePosition):
            east, north, up = self.pose_of(value.vehicle).place
            if craft.flies and self.up_m(craft) is None:
                up_m = max(up, up_m)
            return (east, north, up_m)
        raise RefusedError("it has no target")

    def target_point(self, ground_up_m: float) -> Vector:
        """The point that `target` says, seen from a payload over ground of that height."""
        value = self.target
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
            RefusedError: it has not reported its position yet.
        """
        pose = self._pose_of_vehicle(vehicle)
        if pose is None:
            raise RefusedError(f"parameter 'target': the position of {vehicle} is not known")
        return pose

    def stance(self, vehicle: str) -> tuple[LatLon, float] | None:
        """Where a vehicle is, and its yaw; None: it is not known."""
        pose = self._pose_of_vehicle(vehicle)
        return None if pose is None else (self.frame.to_latlon(pose.place[:2]), pose.yaw)

    def up_m(self, craft: Craft) -> float | None:
        """`up` of the parameter `altitude`, None if not given or nothing to this craft."""
        altitude = self.altitude_m
        if altitude is None:
            return None
        return self._lifted(craft, altitude, self.altitude_frame)

    def _up(self, craft: Craft, place: Coordinate, frame: str, up_m: float) -> float:
        requested = self.up_m(craft)
        if requested is not None:
            return requested
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
