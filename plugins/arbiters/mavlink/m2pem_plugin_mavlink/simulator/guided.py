"""Setpoints for GUIDED: SET_POSITION_TARGET_GLOBAL_INT and _LOCAL_NED (no answer to either)."""

import math
from collections.abc import Mapping
from typing import Any

from m2pem_plugin_mavlink.simulator.dynamics import DriveSetpoint, MotionSetpoint, VelocitySetpoint
from m2pem_plugin_mavlink.simulator.geometry import Location, Point, wrapped_rad
from m2pem_plugin_mavlink.simulator.interfaces import Component, MessageHandler
from m2pem_plugin_mavlink.simulator.maneuvers import Guided
from m2pem_plugin_mavlink.simulator.messages import RELATIVE_FRAMES, TERRAIN_FRAMES, Command, Sender
from m2pem_plugin_mavlink.simulator.specification import Kind

IGNORE_POSITION = 7
IGNORE_VELOCITY = 7 << 3
IGNORE_YAW, IGNORE_YAW_RATE = 1 << 10, 1 << 11
"""POSITION_TARGET_TYPEMASK."""
BODY_FRAMES = (8, 9, 12)
"""MAV_FRAME: velocities are forward, right, down."""
OFFSET_FRAMES = (7, 9)
"""MAV_FRAME: positions are counted from the vehicle."""


class GuidedSetpoints(Component):
    """Hands setpoints to GUIDED; in other modes they are ignored."""

    def messages(self) -> Mapping[str, MessageHandler]:
        """Both setpoints."""
        return {
            "SET_POSITION_TARGET_GLOBAL_INT": self._global,
            "SET_POSITION_TARGET_LOCAL_NED": self._local,
        }

    def forbidden(self, point: Point) -> bool:
        """Whether it must not go there; ArduPilot does not say why."""
        return any(component.forbids(point) for component in self.autopilot.components)

    def up_m(self, z: float, frame: int) -> float:
        """A height in a global frame, above the origin of the vehicle's frame."""
        if frame in RELATIVE_FRAMES or frame in TERRAIN_FRAMES:
            return z + self.autopilot.home.point.up_m
        return z - self.autopilot.frame.origin.altitude_amsl_m

    def point_of(self, command: Command) -> Point:
        """The place in a command."""
        location = Location(command.latitude_deg, command.longitude_deg, 0.0)
        point = self.autopilot.frame.to_point(location)
        return self._on_surface(point.at_height(self.up_m(command.z, command.frame)))

    def _on_surface(self, point: Point) -> Point:
        """What drives or floats stays on the surface, whatever height it was told."""
        surface = self.autopilot.spec.kind in (Kind.ROVER, Kind.BOAT)
        return point.at_height(0.0) if surface else point

    def _guided(self) -> Guided | None:
        maneuver = self.autopilot.modes.maneuver
        return maneuver if isinstance(maneuver, Guided) else None

    def _global(self, message: Any, sender: Sender) -> None:
        values = (message.alt, message.vx, message.vy, message.vz, message.yaw, message.yaw_rate)
        on_earth = abs(message.lat_int) <= 900000000 and abs(message.lon_int) <= 1800000000
        if not on_earth or not all(map(math.isfinite, values)):
            return
        location = Location(message.lat_int * 1e-7, message.lon_int * 1e-7, 0.0)
        up_m = self.up_m(message.alt, message.coordinate_frame)
        self._take(message, self.autopilot.frame.to_point(location).at_height(up_m), False)

    def _local(self, message: Any, sender: Sender) -> None:
        body, frame = self.autopilot.body, message.coordinate_frame
        values = (message.x, message.y, message.z, message.vx, message.vy, message.vz)
        if not all(map(math.isfinite, (*values, message.yaw, message.yaw_rate))):
            return
        north_m, east_m, up_m = message.x, message.y, -message.z
        if frame in BODY_FRAMES:
            north_m, east_m = _turned(north_m, east_m, body.yaw_rad)
        if frame in OFFSET_FRAMES:
            north_m, east_m, up_m = north_m + body.north_m, east_m + body.east_m, up_m + body.up_m
        self._take(message, Point(north_m, east_m, up_m), frame in BODY_FRAMES)

    def _take(self, message: Any, point: Point, of_body: bool) -> None:
        guided, mask = self._guided(), message.type_mask
        if guided is None or not self.autopilot.arming.armed:
            return
        yaw = None if mask & IGNORE_YAW else message.yaw
        if yaw is not None and of_body:
            yaw = wrapped_rad(yaw + self.autopilot.body.yaw_rad)
        if mask & IGNORE_POSITION != IGNORE_POSITION:
            point = self._on_surface(point)
            if not self.forbidden(point):
                guided.go_to(point, yaw)
        elif mask & IGNORE_VELOCITY != IGNORE_VELOCITY and self.autopilot.spec.kind != Kind.PLANE:
            rate = None if mask & IGNORE_YAW_RATE else message.yaw_rate
            guided.move(self._velocity(message.vx, message.vy, -message.vz, yaw, rate, of_body))
        elif not mask & IGNORE_YAW:
            guided.yaw_rad = yaw

    def _velocity(
        self, x: float, y: float, up: float, yaw: float | None, rate: float | None, of_body: bool
    ) -> Any:
        """In the body's frame, the velocity turns with the body."""
        body = self.autopilot.body
        if self.autopilot.spec.kind in (Kind.ROVER, Kind.BOAT) and of_body:
            return lambda: DriveSetpoint(x, rate or 0.0, yaw)

        def setpoint() -> MotionSetpoint:
            north, east = _turned(x, y, body.yaw_rad) if of_body else (x, y)
            return VelocitySetpoint(north, east, up, yaw, rate)

        return setpoint


def _turned(forward: float, right: float, yaw_rad: float) -> tuple[float, float]:
    cos, sin = math.cos(yaw_rad), math.sin(yaw_rad)
    return forward * cos - right * sin, forward * sin + right * cos
