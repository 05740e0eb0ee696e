"""The home position. It is set when the estimator is ready, and again at arming."""

from collections.abc import Mapping
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.simulator.geometry import Location, Point
from m2pem_plugin_mavlink.simulator.interfaces import (
    AutopilotInterface,
    CommandHandler,
    Component,
    ReportMaker,
)
from m2pem_plugin_mavlink.simulator.messages import Command, Result

HIGHEST_M = 100_000.0


class Home(Component):
    """The home position, and the origin of local coordinates."""

    def __init__(self, autopilot: AutopilotInterface) -> None:
        super().__init__(autopilot)
        self.point = Point(0.0, 0.0, 0.0)
        self.known = False
        self._locked = False

    def set(self, point: Point) -> None:
        """Set home, and report it to all peers."""
        self.point, self.known = point, True
        self.autopilot.send(self._home())
        self.autopilot.send(self._origin())

    def set_at_arming(self) -> None:
        """Set home at arming, unless a command has set it."""
        if self.known and not self._locked:
            self.set(self.autopilot.position)

    def step(self, dt_s: float) -> None:
        """Set home when the position is first known."""
        if not self.known and self.autopilot.estimator.ready:
            self.set(self.autopilot.position)

    def reports(self) -> Mapping[int, ReportMaker]:
        """HOME_POSITION and GPS_GLOBAL_ORIGIN."""
        return {
            dialect.MAVLINK_MSG_ID_HOME_POSITION: self._home,
            dialect.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN: self._origin,
        }

    def commands(self) -> Mapping[int, CommandHandler]:
        """Setting and asking."""
        return {
            dialect.MAV_CMD_DO_SET_HOME: self._set,
            dialect.MAV_CMD_GET_HOME_POSITION: self._get,
        }

    def _set(self, command: Command) -> Result:
        autopilot = self.autopilot
        if command.param1 == 1:
            if not autopilot.estimator.ready:
                return Result.FAILED
            self.set(autopilot.position)
        elif command.has_position and abs(command.z) < HIGHEST_M:
            origin_m = autopilot.frame.origin.altitude_amsl_m
            relative = command.frame in (3, 6, 10, 11) and not command.was_long
            z_m = command.z + self.point.up_m + origin_m if relative else command.z
            self.set(
                autopilot.frame.to_point(Location(command.latitude_deg, command.longitude_deg, z_m))
            )
        else:
            return Result.DENIED
        self._locked = True
        return Result.ACCEPTED

    def _get(self, command: Command) -> Result:
        message = self._home()
        if message is None:
            return Result.FAILED
        self.autopilot.send(message, command.sender.peer)
        return Result.ACCEPTED

    def _home(self) -> Any:
        if not self.known:
            return None
        place = self.autopilot.frame.to_location(self.point)
        return dialect.MAVLink_home_position_message(
            round(place.latitude_deg * 1e7),
            round(place.longitude_deg * 1e7),
            round(place.altitude_amsl_m * 1e3),
            self.point.north_m,
            self.point.east_m,
            -self.point.up_m,
            [1.0, 0.0, 0.0, 0.0],
            0.0,
            0.0,
            0.0,
            int(self.autopilot.since_boot_s * 1e6),
        )

    def _origin(self) -> Any:
        if not self.known:
            return None
        origin = self.autopilot.frame.origin
        return dialect.MAVLink_gps_global_origin_message(
            round(origin.latitude_deg * 1e7),
            round(origin.longitude_deg * 1e7),
            round(origin.altitude_amsl_m * 1e3),
            int(self.autopilot.since_boot_s * 1e6),
        )
