"""The home position. It is set when the estimator is ready, and again at arming."""

from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.simulator.geometry import Location, Point
from m2pem_plugin_mavlink.simulator.interfaces import (
    AutopilotInterface,
    Component,
    makes,
    on_command,
)
from m2pem_plugin_mavlink.simulator.messages import Command, Result

HIGHEST_M = 100_000.0
"""Messages have the height of home in millimetres, in 32 bits."""


class Home(Component):
    """The home position, and the origin of local coordinates."""

    def __init__(self, autopilot: AutopilotInterface) -> None:
        super().__init__(autopilot)
        self.point = Point(0.0, 0.0, 0.0)
        self.known = False

    def set(self, point: Point) -> None:
        """Set home, and report it to all peers."""
        self.point, self.known = point, True
        self.autopilot.send(self._home())
        self.autopilot.send(self._origin())

    def set_at_arming(self) -> None:
        """Set home at arming."""
        if self.known:
            self.set(self.autopilot.position)

    @on_command(dialect.MAV_CMD_DO_SET_HOME)
    def _command(self, command: Command) -> Result:
        """Here, or at a place with its altitude above mean sea level."""
        if command.param1 == 1:
            self.set(self.autopilot.position)
        elif not (command.has_position and abs(command.z) < HIGHEST_M):
            return Result.FAILED
        else:
            place = Location(command.latitude_deg, command.longitude_deg, command.z)
            self.set(self.autopilot.frame.to_point(place))
        return Result.ACCEPTED

    def step(self, dt_s: float) -> None:
        """Set home when the position is first known."""
        if not self.known and self.autopilot.estimator.ready:
            self.set(self.autopilot.position)

    @makes(dialect.MAVLINK_MSG_ID_HOME_POSITION)
    def _home(self) -> Any:
        if not self.known:
            return None
        place = self.autopilot.frame.to_location(self.point)
        return dialect.MAVLink_home_position_message(
            *place.scaled,
            self.point.north_m,
            self.point.east_m,
            -self.point.up_m,
            [1.0, 0.0, 0.0, 0.0],
            *[0.0] * 3,
            int(self.autopilot.since_boot_s * 1e6),
        )

    @makes(dialect.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN)
    def _origin(self) -> Any:
        if not self.known:
            return None
        origin = self.autopilot.frame.origin
        return dialect.MAVLink_gps_global_origin_message(
            *origin.scaled, int(self.autopilot.since_boot_s * 1e6)
        )
