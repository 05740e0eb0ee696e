"""The driver of ArduPilot: ArduCopter, ArduPlane, ArduRover (boats too) and ArduSub."""

import math
from collections.abc import Sequence

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.microservices.commands import CommandPosition
from m2pem_plugin_mavlink.microservices.mission_items import MissionItem
from m2pem_plugin_mavlink.microservices.missions import SetCurrentItem
from m2pem_plugin_mavlink.protocol.transaction import RefusedError
from m2pem_plugin_mavlink.vehicle.autopilot import SHOWS_WITHIN_S, Autopilot, cannot, not_now
from m2pem_plugin_mavlink.vehicle.driver import FRAMES, FlightMode, TargetPosition
from m2pem_plugin_mavlink.vehicle.fixed_wing import NO_LANDING, WINGED, landing_items, landing_start
from m2pem_plugin_mavlink.vehicle.identity import Kind

STOP_WITHIN_S = 3.0
"""Seconds for which a mode to stop is commanded before another one is tried."""

TAKEOFF_ATTEMPTS = 3
PLANE_PITCH_DEG = 15.0
AS_IT_IS = -1.0

_STOP_MODES = {
    # BRAKE stops fastest and ignores the sticks: from 10 m/s within 4 s, from 5 m/s within 3.
    Kind.COPTER: ("BRAKE", "LOITER"),
    Kind.PLANE: ("LOITER",),  # it cannot stop: it circles where it was
    Kind.VTOL: ("LOITER",),
    Kind.ROVER: ("HOLD",),
    Kind.BOAT: ("LOITER", "HOLD"),
    Kind.SUB: ("POSHOLD", "ALT_HOLD"),
}


class ArdupilotDriver(Autopilot):
    """The driver of a vehicle with ArduPilot."""

    home_items = 1

    async def _command_mode(self, custom_mode: int) -> None:
        flags = float(dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED)
        await self.command(dialect.MAV_CMD_DO_SET_MODE, flags, float(custom_mode))

    async def _enter_arming_mode(self) -> None:
        """Enter GUIDED, which is refused as long as there is no position: in STABILIZE the arming
        would succeed and the takeoff then fail. A plane that is armed in GUIDED would set out at
        once; it is armed in the mode that it is in."""
        if self.kind not in WINGED:
            await self.set_mode(FlightMode.GUIDED)

    # --- up and down ----------------------------------------------------------------------------

    async def take_off(self, altitude_m: float) -> None:
        """Arm where needed, and climb to a height above home. A plane takes off by a mission, which
        replaces its stored one."""
        match self.kind:
            case Kind.COPTER:
                await self._copter_takes_off(altitude_m)
            case Kind.PLANE | Kind.VTOL:
                await self._plane_takes_off(altitude_m)
            case _:
                raise cannot(f"a {self.kind} does not take off")

    async def _copter_takes_off(self, altitude_m: float) -> None:
        if self.in_the_air:
            await self.go_to(self._here(altitude_m))
            return
        for attempt in range(1, TAKEOFF_ATTEMPTS + 1):
            await self.arm()
            await self.set_mode(FlightMode.GUIDED)
            try:
                await self.command(dialect.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, altitude_m)
            except RefusedError:
                # A copter that was armed long ago disarms itself; or its position is just lost.
                if attempt == TAKEOFF_ATTEMPTS:
                    raise
                await self.vehicle.sleep(1.0)
            else:
                return

    async def _plane_takes_off(self, altitude_m: float) -> None:
        if self.in_the_air:
            await self.go_to(self._here(altitude_m))
            return
        await self._locate()  # its mission begins at its position
        here = self._here(altitude_m)
        vtol = self.kind is Kind.VTOL
        takeoff = dialect.MAV_CMD_NAV_VTOL_TAKEOFF if vtol else dialect.MAV_CMD_NAV_TAKEOFF
        frame = dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT
        place = (*here.latlon, altitude_m)
        await self.upload(
            [
                MissionItem(takeoff, frame, (PLANE_PITCH_DEG, 0.0, 0.0, 0.0), *place),
                MissionItem(dialect.MAV_CMD_NAV_LOITER_UNLIM, frame, (0.0, 0.0, 0.0, 0.0), *place),
            ]
        )
        await self.start_mission()

    def _here(self, altitude_m: float) -> TargetPosition:
        position = self.state.position
        if position is None:
            raise not_now("its position is not known")
        return TargetPosition(*position.latlon, altitude_m)

    async def land(self) -> None:
        """Land at the present position; a plane by the landing sequence of its mission."""
        match self.kind:
            case Kind.COPTER | Kind.VTOL:
                await self.set_mode(FlightMode.LAND)
            case Kind.PLANE:
                begins = landing_start(await self.downloaded())
                if begins is None:
                    raise cannot(NO_LANDING)
                await self.start_mission(begins)
            case _:
                raise cannot(f"a {self.kind} does not land")

    async def return_home(self) -> None:
        if self.kind is Kind.SUB:
            raise cannot("a sub does not return to launch")
        if self.kind in (Kind.ROVER, Kind.BOAT):
            await self._arm_to_drive()
        await self.set_mode(FlightMode.RETURN)

    async def stop(self) -> None:
        """Enter BRAKE, HOLD or LOITER, whichever stops this kind of vehicle best; one that is not
        armed has stopped."""
        if self.state.armed is False:
            return
        self.commanded.entered = False  # it stops from every mode
        *better, last = _STOP_MODES[self.kind]
        for name in better:
            try:
                await self._change_mode(self.modes.number(name), STOP_WITHIN_S)
            except RefusedError:
                continue
            return
        await self._change_mode(self.modes.number(last), STOP_WITHIN_S)

    # --- to places ------------------------------------------------------------------------------

    async def go_to(self, place: TargetPosition, speed_m_s: float | None = None) -> None:
        """Go to a place in GUIDED. The speed is sent after it: a rover without a target refuses a
        speed, also that of the command for the target."""
        await self._arm_to_drive()
        await self.set_mode(FlightMode.GUIDED)
        # Without a radius a plane uses that of its last target.
        await self._reposition(place, self.state.loiter_radius_m or 0.0)
        if speed_m_s is not None:
            await self.set_speed(speed_m_s)
        if place.heading_rad is not None and self.kind is Kind.COPTER:
            heading_deg = math.degrees(place.heading_rad) % 360.0
            await self.command(dialect.MAV_CMD_CONDITION_YAW, heading_deg)

    async def _reposition(self, place: TargetPosition, radius_m: float) -> None:
        """Send a target to a vehicle in GUIDED. It must not change the mode: one that a pilot has
        left GUIDED with refuses it."""
        frame, altitude_m = self._altitude(place)
        at = CommandPosition(*place.latlon, altitude_m, frame)
        params = (AS_IT_IS, 0.0, radius_m, math.nan)
        try:
            await self.command(dialect.MAV_CMD_DO_REPOSITION, *params, place=at)
        except RefusedError:
            guided = self.modes.number("GUIDED")
            if await self.vehicle.until(lambda: self._was_left(guided), SHOWS_WITHIN_S):
                raise self._left("it was in GUIDED") from None
            raise

    def _altitude(self, place: TargetPosition) -> tuple[int, float]:
        """Return a MAV_FRAME and a height in it; ArduPilot accepts no NaN for the present
        height."""
        if self.kind in (Kind.ROVER, Kind.BOAT):
            return dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT, 0.0
        if place.altitude_m is not None:
            return FRAMES[place.altitude_frame], place.altitude_m
        if self.state.position is None:
            raise not_now("its height is not known")
        return dialect.MAV_FRAME_GLOBAL, self.state.position.altitude_m

    async def orbit(self, center: TargetPosition, radius_m: float, speed_m_s: float | None) -> bool:
        """Circle a place with a plane; the CIRCLE of copters and rovers has no command for its
        centre."""
        if self.kind not in WINGED:
            return False
        await self._arm_to_drive()
        await self.set_mode(FlightMode.GUIDED)
        await self._reposition(center, radius_m)
        if speed_m_s is not None:
            await self.set_speed(speed_m_s)
        return True

    async def move(self, velocity_ned_m_s: tuple[float, float, float]) -> None:
        """Send one velocity setpoint, which holds for 3 s. Raise an error if another client has
        left GUIDED."""
        if self.kind in WINGED:
            raise cannot(f"a {self.kind} takes no velocities")
        guided = self.modes.number("GUIDED")
        if self.state.custom_mode != guided:
            if self._was_left(guided) and not self.commanded.changing:
                raise not_now(f"it is in mode {self.modes.name(self.state.custom_mode or 0)} now")
            await self._arm_to_drive()
            await self.set_mode(FlightMode.GUIDED)
        self._send_velocity(velocity_ned_m_s)

    # --- missions -------------------------------------------------------------------------------

    def _as_stored(self, items: tuple[MissionItem, ...]) -> tuple[MissionItem, ...]:
        """Return the items behind item 0, which is home; the vehicle replaces it by its own."""
        home = self.state.home
        place = (*home.latlon, home.altitude_m) if home else (0.0, 0.0, 0.0)
        frame = dialect.MAV_FRAME_GLOBAL
        return (MissionItem(dialect.MAV_CMD_NAV_WAYPOINT, frame, (0.0,) * 4, *place), *items)

    async def upload(self, items: Sequence[MissionItem]) -> None:
        """Store a mission. The landing sequence of the mission before stays behind it, unless the
        new one has its own; the mission must not continue into it.

        In AUTO an ArduPilot would go on at once with the new mission, at the number of the item
        that it was at in the old one. So it leaves AUTO first: if m2pem is killed before the
        mission is started at its first item, the vehicle waits.
        """
        if self.kind is Kind.PLANE and items and landing_start(items) is None:
            items = (*items, *landing_items(await self.downloaded()))
        if self.state.mode is FlightMode.MISSION:
            await self.set_mode(FlightMode.GUIDED)
        await super().upload(items)

    async def start_mission(self, first: int = 0) -> None:
        """Fly the stored mission from an item on, arming where needed. From the ground a copter
        wants a mission that begins with a takeoff, and MISSION_START; a plane sets out when it is
        armed, and so is armed last.

        AUTO in AUTO changes nothing: a mission that is complete stays complete, and one that was
        stored since does not begin. So it leaves AUTO first.
        """
        if self.kind not in WINGED:
            await self.arm()
        self.state.reached_sequence = None
        self.commanded.first_item = first
        if self.state.mode is FlightMode.MISSION:
            await self.set_mode(FlightMode.GUIDED)
        await self.link.perform(SetCurrentItem(self.link.address, first + self.home_items))
        await self.set_mode(FlightMode.MISSION)
        if self.kind in WINGED:
            await self.arm()
        elif self.kind is Kind.COPTER and not self.in_the_air:
            await self.command(dialect.MAV_CMD_MISSION_START)
        await self._mission_begins()
