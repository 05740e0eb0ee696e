"""Commands and setpoints that move the vehicle: takeoff, landing, positions, velocities, speed."""

import math
from collections.abc import Mapping
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.simulator.dynamics import VelocitySetpoint
from m2pem_plugin_mavlink.simulator.geometry import Location, Point, wrapped_rad
from m2pem_plugin_mavlink.simulator.interfaces import CommandHandler, Component, on_message
from m2pem_plugin_mavlink.simulator.maneuvers import Guided
from m2pem_plugin_mavlink.simulator.messages import (
    GLOBAL_FRAMES,
    RELATIVE_FRAMES,
    TERRAIN_FRAMES,
    Command,
    Result,
    Sender,
)
from m2pem_plugin_mavlink.simulator.missions.execution import ITSELF
from m2pem_plugin_mavlink.simulator.specification import SURFACE, Kind

IGNORE_POSITION = 7
IGNORE_VELOCITY = 7 << 3
IGNORE_YAW, IGNORE_YAW_RATE = 1 << 10, 1 << 11
"""POSITION_TARGET_TYPEMASK."""


LEAST_MPS = 0.05
"""AR_WPNAV_SPEED_MIN."""
CHANGE_MODE = 1
"""Parameter 2 of DO_REPOSITION: enter GUIDED if it is in another mode."""


class MotionCommands(Component):
    """Executes commands that move the vehicle, as ArduPilot does, and passes setpoints to GUIDED;
    in other modes they are ignored."""

    def forbidden(self, point: Point) -> bool:
        """Return whether the fence forbids a point; ArduPilot sends no reason."""
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
        """Return the point at the surface for a rover or boat, whatever its height."""
        surface = self.autopilot.spec.kind in SURFACE
        return point.at_height(0.0) if surface else point

    def _guided(self) -> Guided | None:
        maneuver = self.autopilot.modes.maneuver
        return maneuver if isinstance(maneuver, Guided) else None

    @on_message("SET_POSITION_TARGET_LOCAL_NED")
    def _take(self, message: Any, sender: Sender) -> None:
        guided, mask = self._guided(), message.type_mask
        local = message.coordinate_frame == dialect.MAV_FRAME_LOCAL_NED
        if guided is None or not local or not self.autopilot.arming.armed:
            return
        values = (message.x, message.y, message.z, message.vx, message.vy, message.vz)
        if not all(map(math.isfinite, (*values, message.yaw, message.yaw_rate))):
            return
        yaw = None if mask & IGNORE_YAW else message.yaw
        if mask & IGNORE_POSITION != IGNORE_POSITION:
            point = self._on_surface(Point(message.x, message.y, -message.z))
            if not self.forbidden(point):
                guided.go_to(point, yaw)
        elif mask & IGNORE_VELOCITY != IGNORE_VELOCITY and self.autopilot.spec.kind != Kind.PLANE:
            rate = None if mask & IGNORE_YAW_RATE else message.yaw_rate
            guided.move(VelocitySetpoint(message.vx, message.vy, -message.vz, yaw, rate))

    @on_message("SET_POSITION_TARGET_GLOBAL_INT")
    def _take_global(self, message: Any, sender: Sender) -> None:
        """A position alone, of copters and of what drives; ArduPilot takes frames 0, 3, 5 and 6."""
        guided, frame = self._guided(), message.coordinate_frame
        plane = self.autopilot.spec.kind is Kind.PLANE
        known = frame in GLOBAL_FRAMES and frame not in TERRAIN_FRAMES
        ignored = message.type_mask & IGNORE_POSITION
        if guided is None or plane or ignored or not known or not self.autopilot.arming.armed:
            return
        place = Location(message.lat_int / 1e7, message.lon_int / 1e7, 0.0)
        up_m = self.up_m(message.alt, frame)
        point = self._on_surface(self.autopilot.frame.to_point(place).at_height(up_m))
        if not self.forbidden(point):
            guided.go_to(point)

    def commands(self) -> Mapping[int, CommandHandler]:
        """By MAV_CMD; what a kind of vehicle cannot do, it does not know."""
        roles, kind = self.autopilot.firmware.roles, self.autopilot.spec.kind
        handlers: dict[int, CommandHandler] = {
            dialect.MAV_CMD_NAV_RETURN_TO_LAUNCH: lambda _: self._enter(roles.rtl),
            dialect.MAV_CMD_NAV_LOITER_UNLIM: lambda _: self._enter(roles.hold),
            dialect.MAV_CMD_DO_REPOSITION: self._reposition,
            dialect.MAV_CMD_DO_CHANGE_SPEED: self._change_speed,
            dialect.MAV_CMD_MISSION_START: self._start_mission,
        }
        land = roles.land
        if land is not None:
            handlers[dialect.MAV_CMD_NAV_LAND] = lambda _: self._enter(land)
        if kind is Kind.COPTER:
            handlers[dialect.MAV_CMD_NAV_TAKEOFF] = self._take_off
            handlers[dialect.MAV_CMD_CONDITION_YAW] = self._yaw
        elif kind is not Kind.PLANE:
            handlers[dialect.MAV_CMD_DO_SET_REVERSE] = self._reverse
        return handlers

    def _enter(self, mode: int) -> Result:
        return Result.ACCEPTED if self.autopilot.modes.switch(mode) else Result.FAILED

    def _take_off(self, command: Command) -> Result:
        """In GUIDED only, armed and on the ground."""
        autopilot, guided = self.autopilot, self._guided()
        up_m = autopilot.home.point.up_m + command.z
        if guided is None or not autopilot.arming.armed or not math.isfinite(command.z):
            return Result.FAILED
        on_ground, down = autopilot.body.on_ground, up_m <= autopilot.body.up_m + 0.1
        if not on_ground or down or not autopilot.estimator.ready:
            return Result.FAILED
        if not guided.taking_off:
            guided.take_off(up_m)
        return Result.ACCEPTED

    def _reposition(self, command: Command) -> Result:
        autopilot = self.autopilot
        placed = command.frame in GLOBAL_FRAMES and command.has_position
        if not placed or not math.isfinite(command.z):
            return Result.DENIED
        kind = autopilot.spec.kind
        surface, plane = kind in SURFACE, kind is Kind.PLANE
        if self._guided() is None and not int(command.param2) & CHANGE_MODE:
            return Result.FAILED if plane else Result.DENIED
        point = autopilot.guided.point_of(command)
        if autopilot.guided.forbidden(point):
            return Result.DENIED if plane else Result.FAILED
        if not autopilot.modes.switch(autopilot.firmware.roles.guided):
            return Result.FAILED
        guided = self._guided()
        assert guided is not None, "that is the mode"
        # Only what drives looks at the speed, and is then in GUIDED already if it refuses.
        if surface and command.param1 > 0 and not self._set_speed(command.param1):
            return Result.FAILED
        if math.isfinite(command.param3) and command.param3 > 0:
            guided.radius_m = command.param3
        guided.go_to(point)
        return Result.ACCEPTED

    def _set_speed(self, speed_mps: float) -> bool:
        if speed_mps < LEAST_MPS or not self.autopilot.modes.maneuver.takes_speed:
            return False
        self.autopilot.modes.set_speed(speed_mps)
        return True

    def _change_speed(self, command: Command) -> Result:
        """Airspeed is ground speed but to planes, whose ground speed is the least one."""
        autopilot, kind, speed_mps = self.autopilot, self.autopilot.spec.kind, command.param2
        vertical = command.param1 in (2, 3)
        if kind is Kind.PLANE:
            least_mps = autopilot.parameters["AIRSPEED_MIN"]
            if command.param1 == 1:
                speed_mps = max(speed_mps, autopilot.tuning.cruise_mps)
            elif not least_mps <= speed_mps <= autopilot.parameters["AIRSPEED_MAX"]:
                return Result.FAILED
        elif vertical if kind in SURFACE else not speed_mps > 0:
            return Result.DENIED
        if command.param1 not in (0, 1):
            taken = vertical and kind is Kind.COPTER and autopilot.modes.maneuver.takes_speed
        else:
            taken = self._set_speed(speed_mps)
        if taken and kind is Kind.PLANE:
            unit = "groundspeed {:.0f}" if command.param1 == 1 else "airspeed {:.0f} m/s"
            autopilot.say("Set " + unit.format(command.param2))
        elif taken and kind in SURFACE and command.sender == ITSELF:
            autopilot.say(f"speed: {speed_mps:.1f} m/s")
        return Result.ACCEPTED if taken else Result.FAILED

    def _yaw(self, command: Command) -> Result:
        guided = self._guided()
        if guided is None or not 0 <= command.param1 <= 360 or command.param4 not in (0, 1):
            return Result.FAILED
        angle = math.radians(command.param1)
        if command.param4 == 1:
            sign = -1 if command.param3 < 0 else 1
            angle = self.autopilot.body.yaw_rad + sign * angle
        guided.yaw_rad = wrapped_rad(angle)
        return Result.ACCEPTED

    def _reverse(self, command: Command) -> Result:
        self.autopilot.modes.reverse = command.param1 == 1
        return Result.ACCEPTED

    def _start_mission(self, command: Command) -> Result:
        """Enter AUTO; a copter that is in it already begins a mission that is not on its way."""
        autopilot = self.autopilot
        if command.param1 or command.param2:
            return Result.DENIED
        result = self._enter(autopilot.firmware.roles.mission)
        if result is Result.ACCEPTED and autopilot.spec.kind is Kind.COPTER:
            autopilot.mission.released = autopilot.arming.armed
            autopilot.modes.maneuver.begin()
        return result
