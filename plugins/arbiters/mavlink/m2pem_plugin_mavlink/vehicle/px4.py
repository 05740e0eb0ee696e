"""The driver of PX4."""

import asyncio
import math
from collections.abc import Awaitable, Callable

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.microservices.commands import CommandPosition
from m2pem_plugin_mavlink.microservices.missions import SetCurrentItem
from m2pem_plugin_mavlink.protocol.transaction import RefusedError
from m2pem_plugin_mavlink.vehicle.autopilot import Autopilot, cannot, not_now
from m2pem_plugin_mavlink.vehicle.driver import FlightMode, TargetPosition
from m2pem_plugin_mavlink.vehicle.identity import ON_THE_GROUND, Kind

SETPOINTS_BEFORE_S = 1.0
SETPOINT_EVERY_S = 0.2
"""OFFBOARD is entered only while setpoints come in, for some time before."""

_CUSTOM = float(dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED)
_AMSL: int = dialect.MAV_FRAME_GLOBAL
_UNSUPPORTED = dialect.MAV_RESULT_UNSUPPORTED


class Px4Driver(Autopilot):
    """The driver of a vehicle with PX4.

    It goes to places in AUTO.LOITER, so that this is also its mode for `FlightMode.GUIDED`;
    OFFBOARD is entered by `move` alone.
    """

    home_items = 0

    async def set_mode(self, mode: FlightMode) -> None:
        """Change the mode; see `Autopilot`. AUTO.MISSION may be refused for a while after an
        upload: PX4 checks the mission first."""
        await super().set_mode(FlightMode.HOLD if mode is FlightMode.GUIDED else mode)

    async def _command_mode(self, custom_mode: int) -> None:
        main, sub = custom_mode >> 16 & 0xFF, custom_mode >> 24 & 0xFF
        await self.command(dialect.MAV_CMD_DO_SET_MODE, _CUSTOM, float(main), float(sub))

    async def _enter_arming_mode(self) -> None:
        """Enter a mode that holds its position: a manual mode may require a remote control."""
        await self.set_mode(FlightMode.HOLD)

    # --- up and down ----------------------------------------------------------------------------

    async def take_off(self, altitude_m: float) -> None:
        if self.kind in ON_THE_GROUND:
            raise cannot(f"a {self.kind} does not take off")
        position = self.state.position
        if self.in_the_air and position is not None:
            await self.go_to(TargetPosition(*position.latlon, altitude_m))
            return
        await self.arm()
        amsl_m = self._amsl(altitude_m, "relative")
        nan = math.nan
        takeoff = self.modes.number("AUTO.TAKEOFF")
        await self._enter(
            takeoff,
            lambda: self.command(dialect.MAV_CMD_NAV_TAKEOFF, nan, nan, nan, nan, nan, nan, amsl_m),
            lambda: self.state.custom_mode == takeoff or self.in_the_air,
            must_accept=True,
        )

    async def land(self) -> None:
        if self.kind in ON_THE_GROUND:
            raise cannot(f"a {self.kind} does not land")
        await self.set_mode(FlightMode.LAND)

    async def return_home(self) -> None:
        if self.kind in ON_THE_GROUND:
            await self._arm_to_drive()
        await self.set_mode(FlightMode.RETURN)

    async def stop(self) -> None:
        """Enter AUTO.LOITER, which brakes at once; one that is not armed has stopped. As this is
        also the mode in which it goes to places, then clear its target."""
        if self.state.armed is not False:
            self.commanded.entered = False  # it stops from every mode
            await self.set_mode(FlightMode.HOLD)
            change = float(dialect.MAV_DO_REPOSITION_FLAGS_CHANGE_MODE)
            nowhere = (math.nan,) * 4
            await self.command(dialect.MAV_CMD_DO_REPOSITION, -1.0, change, 0.0, *nowhere)

    # --- to places ------------------------------------------------------------------------------

    async def go_to(self, place: TargetPosition, speed_m_s: float | None = None) -> None:
        await self._arm_to_drive()
        at = self._position(place)
        params = (
            -1.0 if speed_m_s is None else speed_m_s,
            float(dialect.MAV_DO_REPOSITION_FLAGS_CHANGE_MODE),
            0.0,
            math.nan if place.heading_rad is None else place.heading_rad,
        )
        await self._by_command(
            "AUTO.LOITER", lambda: self.command(dialect.MAV_CMD_DO_REPOSITION, *params, place=at)
        )

    async def orbit(self, center: TargetPosition, radius_m: float, speed_m_s: float | None) -> bool:
        """Circle a place without end, clockwise, facing it."""
        if self.kind in ON_THE_GROUND or self.kind is Kind.PLANE:
            return False
        await self._arm_to_drive()
        at = self._position(center)
        params = (
            radius_m,
            math.nan if speed_m_s is None else speed_m_s,
            float(dialect.ORBIT_YAW_BEHAVIOUR_HOLD_FRONT_TO_CIRCLE_CENTER),
            0.0,
        )
        try:
            await self._by_command(
                "POSCTL.ORBIT", lambda: self.command(dialect.MAV_CMD_DO_ORBIT, *params, place=at)
            )
        except RefusedError as refused:
            if refused.result == _UNSUPPORTED:
                return False
            raise
        return True

    async def _by_command(self, name: str, command: Callable[[], Awaitable[None]]) -> None:
        number = self.modes.number(name)
        await self._enter(
            number, command, lambda: self.state.custom_mode == number, must_accept=True
        )

    def _position(self, place: TargetPosition) -> CommandPosition:
        altitude_m = math.nan
        if place.altitude_m is not None and self.kind not in ON_THE_GROUND:
            altitude_m = self._amsl(place.altitude_m, place.altitude_frame)
        return CommandPosition(*place.latlon, altitude_m, _AMSL)

    def _amsl(self, altitude_m: float, frame: str) -> float:
        """Return a height above mean sea level: PX4 accepts no other, in any frame of the
        command."""
        if frame == "amsl":
            return altitude_m
        if frame == "terrain":
            raise cannot("PX4 has no heights above terrain")
        if self.state.home is None:
            raise not_now("its home is not known, which heights count from")
        return self.state.home.altitude_m + altitude_m

    async def move(self, velocity_ned_m_s: tuple[float, float, float]) -> None:
        """Send one velocity setpoint. Raise an error if another client has left OFFBOARD."""
        offboard = self.modes.number("OFFBOARD")
        if self.state.custom_mode != offboard:
            if self._was_left(offboard) and not self.commanded.changing:
                raise not_now(f"it is in mode {self.modes.name(self.state.custom_mode or 0)} now")
            await self._arm_to_drive()
            await self._enter_offboard(offboard, velocity_ned_m_s)
        self._send_velocity(velocity_ned_m_s)

    async def _enter_offboard(
        self, offboard: int, velocity_ned_m_s: tuple[float, float, float]
    ) -> None:
        setpoints = asyncio.get_running_loop().create_task(self._setpoints(velocity_ned_m_s))
        try:
            await self.vehicle.sleep(SETPOINTS_BEFORE_S)
            await self._change_mode(offboard)
        finally:
            setpoints.cancel()
            await asyncio.wait([setpoints])

    async def _setpoints(self, velocity_ned_m_s: tuple[float, float, float]) -> None:
        while True:
            self._send_velocity(velocity_ned_m_s)
            await self.vehicle.sleep(SETPOINT_EVERY_S)

    # --- missions -------------------------------------------------------------------------------

    async def start_mission(self, first: int = 0) -> None:
        """Start the mission at an item. It has begun already, at its first item, if the vehicle
        flew the mission before it: PX4 turns to the item that an upload marks as the current one
        (without such a mark, it would go on at the number of the item that it was at).

        PX4 repeats ten times which item was reached last, and acknowledges an upload before it
        looks at the mission: until it has begun, that is an item of the mission before.
        """
        await self.arm()
        await self.link.perform(SetCurrentItem(self.link.address, first))
        await self.set_mode(FlightMode.MISSION)
        await self._mission_begins()
        self.state.reached_sequence = None
