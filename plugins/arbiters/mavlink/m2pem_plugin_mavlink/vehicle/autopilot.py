"""The interface of drivers, and what is the same for all autopilots: they send commands until the
vehicle's own messages confirm them."""

import contextlib
import re
from abc import ABC, abstractmethod
from collections.abc import Awaitable, Callable, Sequence
from typing import Protocol

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import LatLon
from m2pem_plugin_mavlink.link.vehicle_link import VehicleLink
from m2pem_plugin_mavlink.microservices.commands import Command, CommandPosition
from m2pem_plugin_mavlink.microservices.mission_download import DownloadMission
from m2pem_plugin_mavlink.microservices.mission_items import MissionItem, MissionType
from m2pem_plugin_mavlink.microservices.mission_upload import UploadMission
from m2pem_plugin_mavlink.microservices.missions import ClearMission
from m2pem_plugin_mavlink.protocol.messages import message_type
from m2pem_plugin_mavlink.protocol.transaction import ExchangeError, NoAnswerError, RefusedError
from m2pem_plugin_mavlink.vehicle.driver import FlightMode, Readiness, TargetPosition
from m2pem_plugin_mavlink.vehicle.identity import Identity, Kind
from m2pem_plugin_mavlink.vehicle.modes import modes_of
from m2pem_plugin_mavlink.vehicle.readiness import TEXTS_WITHIN_S, readiness, unlocated
from m2pem_plugin_mavlink.vehicle.state import AutopilotState, CommandedState

LOCATED_WITHIN_S = 90.0
"""An ArduPilot has a position some 41 s after it was switched on."""

CHECKED_WITHIN_S = 20.0
"""Pre-arm checks may fail for a while: gyros warm up, a change of mode is not yet looked at."""

MODE_WITHIN_S = 10.0
ARM_WITHIN_S = 20.0
SHOWS_WITHIN_S = 2.5
"""Seconds to wait for a heartbeat: it comes every second, and one may be lost."""

BEGINS_WITHIN_S = 5.0
"""A mission that is started is flown; MISSION_CURRENT comes every second."""

RETRY_S = 1.0

SHOWS_OTHERS_AFTER_S = 1.0
"""A heartbeat that comes so long after an acknowledgement was sent after it, on every link."""

_STAYS = frozenset({FlightMode.GUIDED, FlightMode.HOLD})
"""The modes that autopilots do not leave by themselves, unless by a failsafe."""

_SECONDS = re.compile(r", \d+ s(?=;|$)")
_SET_POSITION_TARGET = message_type("SET_POSITION_TARGET_LOCAL_NED")
_VELOCITY_ONLY = (
    dialect.POSITION_TARGET_TYPEMASK_X_IGNORE
    | dialect.POSITION_TARGET_TYPEMASK_Y_IGNORE
    | dialect.POSITION_TARGET_TYPEMASK_Z_IGNORE
    | dialect.POSITION_TARGET_TYPEMASK_AX_IGNORE
    | dialect.POSITION_TARGET_TYPEMASK_AY_IGNORE
    | dialect.POSITION_TARGET_TYPEMASK_AZ_IGNORE
    | dialect.POSITION_TARGET_TYPEMASK_YAW_IGNORE
    | dialect.POSITION_TARGET_TYPEMASK_YAW_RATE_IGNORE
)
_BEGUN = (dialect.MISSION_STATE_ACTIVE, dialect.MISSION_STATE_COMPLETE)
_MISSION_STATES = {
    dialect.MISSION_STATE_NO_MISSION: "it has none",
    dialect.MISSION_STATE_NOT_STARTED: "not started",
    dialect.MISSION_STATE_PAUSED: "paused",
}
_UNSUPPORTED: int = dialect.MAV_RESULT_UNSUPPORTED
_LATER: int = dialect.MAV_RESULT_TEMPORARILY_REJECTED


def cannot(reason: str) -> RefusedError:
    """Return the error for a command that this vehicle does not have; nothing was sent."""
    return RefusedError(reason, _UNSUPPORTED)


def not_now(reason: str) -> RefusedError:
    """Return the error for a command that is impossible in the present state; nothing was sent."""
    return RefusedError(reason, _LATER, temporary=True)


class ModeLeftError(ExchangeError):
    """Another client, a pilot or a failsafe has changed the mode while m2pem prepared a behavior.
    That has precedence: nothing more is sent."""


class DrivenVehicle(Protocol):
    """The interface of a vehicle for its driver."""

    link: VehicleLink
    state: AutopilotState
    commanded: CommandedState

    async def until(self, true: Callable[[], bool], within_s: float | None = None) -> bool: ...
    async def sleep(self, seconds: float) -> None: ...
    def recent_texts(self, within_s: float = 5.0) -> tuple[str, ...]: ...
    def warn(self, text: str) -> None: ...


class Autopilot(ABC):
    """A driver. Each method returns when the vehicle has accepted and its own messages confirm it
    (HEARTBEAT for a mode, not the acknowledgement), after retries; it does not wait until the
    motion ends.

    Raises:
        ExchangeError: the vehicle refuses (with its STATUSTEXT as the reason) or does not answer.
    """

    home_items: int
    """How many items of a stored mission stand before the first real one."""

    def __init__(self, vehicle: DrivenVehicle, identity: Identity) -> None:
        self.vehicle = vehicle
        self.identity = identity
        self.kind: Kind = identity.kind
        self.name: str = identity.firmware
        self.modes = modes_of(identity)
        self.link = vehicle.link
        self.state = vehicle.state
        self.commanded = vehicle.commanded

    # --- state ------------------------------------------------------------------------------------

    def mode_name(self, custom_mode: int) -> str:
        """Return the autopilot's own name of a mode: "GUIDED", "AUTO.MISSION"."""
        return self.modes.name(custom_mode)

    def flight_mode(self, custom_mode: int) -> FlightMode:
        """Return the purpose of a mode."""
        return self.modes.purpose(custom_mode)

    def readiness(self) -> Readiness:
        """Return whether the vehicle may be armed now."""
        texts = self.vehicle.recent_texts(TEXTS_WITHIN_S)
        return readiness(self.identity.firmware, self.state, texts, self.link.now_s())

    @property
    def current_item(self) -> int | None:
        """The item that the vehicle moves to, numbered as in `upload`."""
        return self._item(self.state.mission_sequence)

    @property
    def reached_item(self) -> int | None:
        """The item reached last since the mission was started."""
        return self._item(self.state.reached_sequence)

    def _item(self, sequence: int | None) -> int | None:
        if sequence is None or sequence < self.home_items:
            return None
        return sequence - self.home_items

    @property
    def in_the_air(self) -> bool:
        return bool(self.state.armed) and self.state.landed is False

    # --- modes ----------------------------------------------------------------------------------

    async def set_mode(self, mode: FlightMode) -> None:
        """Change the mode; repeat the command until a heartbeat confirms it, within
        `MODE_WITHIN_S`.

        Raises:
            ExchangeError: the mode does not change, or it is one of manual control.
            ModeLeftError: others have changed it meanwhile.
        """
        if mode in (FlightMode.MANUAL, FlightMode.OTHER):
            raise cannot(f"mode {mode} is a mode of manual control")
        custom_mode = self.modes.for_purpose(mode)
        if custom_mode is None:
            raise cannot(f"a {self.kind} with {self.name} has no mode for {mode}")
        if self._stays_in(custom_mode):
            return  # again, it might revoke what a pilot has just commanded
        await self._change_mode(custom_mode)

    def _stays_in(self, custom_mode: int) -> bool:
        """Return whether the vehicle was brought into a mode for the present behavior, and is in
        it."""
        commanded = self.commanded
        stays = self.modes.purpose(custom_mode) in _STAYS
        brought = commanded.entered and commanded.custom_mode == custom_mode
        return stays and brought and self.state.custom_mode == custom_mode

    def _refuse_if_left(self) -> None:
        """Check that nobody else has changed the mode since it was entered from here.

        Raises:
            ModeLeftError: somebody has.
        """
        commanded, number = self.commanded, self.state.custom_mode
        if commanded.custom_mode is None or number is None or number == commanded.custom_mode:
            return
        if commanded.entered and self.modes.purpose(commanded.custom_mode) in _STAYS:
            raise self._left(f"it was in {self.modes.name(commanded.custom_mode)}")

    def _left(self, before: str) -> ModeLeftError:
        return ModeLeftError(
            f"{before}, and then another ground station, a pilot or a failsafe has changed the "
            f"mode to {self.modes.name(self.state.custom_mode or 0)}"
        )

    async def _change_mode(self, custom_mode: int, within_s: float = MODE_WITHIN_S) -> None:
        await self._enter(
            custom_mode,
            lambda: self._command_mode(custom_mode),
            lambda: self.state.custom_mode == custom_mode,
            within_s,
            # The last heartbeat may show a mode that it has left by itself since.
            must_accept=self.modes.purpose(custom_mode) not in _STAYS,
        )

    @abstractmethod
    async def _command_mode(self, custom_mode: int) -> None: ...

    async def _enter(
        self,
        custom_mode: int,
        command: Callable[[], Awaitable[None]],
        shows: Callable[[], bool],
        within_s: float = MODE_WITHIN_S,
        *,
        must_accept: bool = False,
    ) -> None:
        """Send a command that changes the mode, and note that the change was commanded here."""
        self._refuse_if_left()
        before = self.commanded.custom_mode, self.commanded.entered
        self.commanded.custom_mode, self.commanded.entered = custom_mode, False
        self.commanded.changing += 1
        name = f"mode {self.modes.name(custom_mode)}"

        def revoked(accepted_s: float) -> None:
            received_s = self.state.heartbeat_s
            if received_s is not None and received_s >= accepted_s + SHOWS_OTHERS_AFTER_S:
                raise self._left(f"{name} was accepted")

        try:
            await self._repeat(command, shows, within_s, name, revoked, must_accept=must_accept)
            self.commanded.entered = self.state.custom_mode == custom_mode
        except RefusedError:
            self.commanded.custom_mode, self.commanded.entered = before
            raise
        finally:
            self.commanded.changing -= 1

    async def _repeat(
        self,
        command: Callable[[], Awaitable[None]],
        shows: Callable[[], bool],
        within_s: float,
        what: str,
        revoked: Callable[[float], None] = lambda _: None,
        *,
        must_accept: bool = False,
    ) -> None:
        """Send a command until received messages confirm it: an acknowledgement may be lost, and a
        refusal may be temporary. `must_accept`: the messages prove nothing, as the vehicle may have
        been in this state before. `revoked` is called with the time of an acceptance that was not
        confirmed; it raises an error if the command must not be repeated."""
        end_s = self.link.now_s() + within_s
        while True:
            error: ExchangeError = NoAnswerError(f"{what} was accepted, but was not confirmed")
            accepted, wait_s = False, RETRY_S
            accepted_s = self.link.now_s()
            try:
                await command()
                accepted, wait_s, accepted_s = True, SHOWS_WITHIN_S, self.link.now_s()
            except RefusedError as refused:
                error = refused
                if refused.result == _UNSUPPORTED:
                    raise
            except NoAnswerError as silence:
                error = silence
            if must_accept and not accepted:
                await self.vehicle.sleep(wait_s)
            elif await self.vehicle.until(shows, wait_s):
                return
            if accepted:
                revoked(accepted_s)
            if self.link.now_s() >= end_s:
                raise error

    # --- arming ---------------------------------------------------------------------------------

    async def arm(self) -> None:
        """Wait until the position is known and the checks pass, within `LOCATED_WITHIN_S` and
        `CHECKED_WITHIN_S`; then arm until a heartbeat confirms it. An armed vehicle is left as it
        is.

        Raises:
            ExchangeError: it is not ready (and why), or refuses.
        """
        if self.state.armed:
            return
        await self._locate()
        # Other checks may fail because of the present mode: some modes cannot be armed.
        await self._enter_arming_mode()
        if not self.readiness().ready:
            await self._have_it_checked()
        await self._until(lambda: self.readiness().ready, CHECKED_WITHIN_S)
        self._refuse_if_left()
        await self._arm()

    async def _locate(self) -> None:
        """Wait until the position is known."""
        firmware, now_s = self.identity.firmware, self.link.now_s
        await self._until(lambda: not unlocated(firmware, self.state, now_s()), LOCATED_WITHIN_S)

    async def _until(self, ready: Callable[[], bool], within_s: float) -> None:
        """Wait; show operators the reasons, and changes of them."""
        end_s = self.link.now_s() + within_s
        shown = ""

        def reasons() -> str:
            return _SECONDS.sub("", "; ".join(self.readiness().reasons))

        while not ready():
            left_s = end_s - self.link.now_s()
            if left_s <= 0:
                raise not_now("not ready: " + "; ".join(self.readiness().reasons))
            if (now := reasons()) and now != shown:
                shown = now
                self.vehicle.warn(f"waits until it is ready: {shown}")
            await self.vehicle.until(lambda shown=shown: ready() or reasons() != shown, left_s)  # type: ignore[misc]
        if shown:
            self.vehicle.warn("is ready")

    async def _have_it_checked(self) -> None:
        """Request the reasons against arming now; unasked, ArduPilot sends them every 30 s, and PX4
        when they change."""
        with contextlib.suppress(ExchangeError):  # older autopilots do not have the command
            await self.command(dialect.MAV_CMD_RUN_PREARM_CHECKS)

    @abstractmethod
    async def _enter_arming_mode(self) -> None: ...

    async def _arm(self) -> None:
        await self._repeat(
            lambda: self.command(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 1.0),
            lambda: self.state.armed is True,
            ARM_WITHIN_S,
            "arming",
        )
        self.commanded.disarming = False

    async def disarm(self) -> None:
        """Disarm; refused in flight."""
        if self.state.armed is False:
            return
        self.commanded.disarming = True
        try:
            await self.command(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 0.0)
        except RefusedError:
            self.commanded.disarming = False
            raise
        if not await self.vehicle.until(lambda: self.state.armed is False, 2 * SHOWS_WITHIN_S):
            raise NoAnswerError("disarming was accepted, but was not confirmed")

    async def _arm_to_drive(self) -> None:
        """Arm a vehicle that drives; one that flies must take off first."""
        if self.state.armed:
            return
        if self.kind in (Kind.COPTER, Kind.PLANE, Kind.VTOL):
            raise not_now("it is on the ground, not armed: it must take off first")
        await self.arm()

    # --- motion ---------------------------------------------------------------------------------

    @abstractmethod
    async def take_off(self, altitude_m: float) -> None:
        """Arm where needed, and climb to a height above home."""

    @abstractmethod
    async def go_to(self, place: TargetPosition, speed_m_s: float | None = None) -> None:
        """Go to a place and stay there (DO_REPOSITION or its equivalent)."""

    @abstractmethod
    async def orbit(self, center: TargetPosition, radius_m: float, speed_m_s: float | None) -> bool:
        """Circle a place without end; return False if the autopilot has no command for it."""

    @abstractmethod
    async def stop(self) -> None:
        """Stop at once (HOLD, LOITER, BRAKE) from any motion; idempotent."""

    @abstractmethod
    async def return_home(self) -> None:
        """Return to launch."""

    @abstractmethod
    async def land(self) -> None:
        """Land at the present position."""

    @abstractmethod
    async def move(self, velocity_ned_m_s: tuple[float, float, float]) -> None:
        """Send one velocity setpoint; repeat it twice a second, or the vehicle stops."""

    def _send_velocity(self, velocity_ned_m_s: tuple[float, float, float]) -> None:
        north, east, down = velocity_ned_m_s
        self.link.send(
            _SET_POSITION_TARGET.make(
                **self.link.address.as_target,
                coordinate_frame=dialect.MAV_FRAME_LOCAL_NED,
                type_mask=_VELOCITY_ONLY,
                vx=north,
                vy=east,
                vz=down,
            )
        )

    def _was_left(self, custom_mode: int) -> bool:
        """Return whether the vehicle was brought into a mode from here and has left it since."""
        return self.commanded.custom_mode == custom_mode and self.state.custom_mode != custom_mode

    # --- missions -------------------------------------------------------------------------------

    async def upload(self, items: Sequence[MissionItem]) -> None:
        """Store a mission; an empty one clears it. Item 0 is the first real one: home, where the
        autopilot requires it as item 0, is added here, and left out of `downloaded` and
        `current_item`."""
        self.commanded.mission = None
        self.commanded.exchanging += 1
        try:
            if items:
                await self._store(self._as_stored(tuple(items)))
            else:
                await self.link.perform(ClearMission(self.link.address))
        finally:
            self.commanded.exchanging -= 1
        self.commanded.mission = tuple(items)
        self.state.reached_sequence = None

    async def _store(self, items: tuple[MissionItem, ...]) -> None:
        """Upload items. An autopilot that has all of them, and whose acknowledgement was lost,
        refuses an item that it gets again: so what it has stored is read before this fails."""
        upload = UploadMission(self.link.address, items)
        try:
            await self.link.perform(upload)
        except ExchangeError:
            if not upload.all_sent:
                raise
            try:
                stored = await self.link.perform(DownloadMission(self.link.address))
            except ExchangeError:
                stored = ()
            if len(stored) != len(items):
                raise
            pairs = zip(stored[self.home_items :], items[self.home_items :], strict=True)
            if not all(one.is_stored_as(other) for one, other in pairs):
                raise

    def _as_stored(self, items: tuple[MissionItem, ...]) -> tuple[MissionItem, ...]:
        return items

    async def downloaded(self) -> tuple[MissionItem, ...]:
        """Return the stored mission, in the form that `upload` takes."""
        self.commanded.exchanging += 1
        try:
            stored = await self.link.perform(DownloadMission(self.link.address))
            return stored[self.home_items :]
        finally:
            self.commanded.exchanging -= 1

    async def rally_points(self) -> Sequence[LatLon]:
        """Return the places where the vehicle may land instead of at home: latitudes and longitudes
        in degrees."""
        found = await self.link.perform(DownloadMission(self.link.address, MissionType.RALLY))
        return [each.latlon for each in found]

    @abstractmethod
    async def start_mission(self, first: int = 0) -> None:
        """Execute the stored mission from an item on (numbered as in `upload`), arming where
        needed."""

    async def _mission_begins(self) -> None:
        """Wait until MISSION_CURRENT shows that the mission is active or complete. An autopilot
        that does not report this is assumed to begin.

        Raises:
            ExchangeError: the mission does not begin.
        """
        self.state.mission_state = None  # an earlier message may concern the earlier mission
        begun = lambda: self.state.mission_state in _BEGUN  # noqa: E731
        if not await self.vehicle.until(begun, BEGINS_WITHIN_S):
            state = self.state.mission_state
            if state is not None:
                raise NoAnswerError(
                    f"the mission does not begin: {_MISSION_STATES.get(state, state)} for "
                    f"{BEGINS_WITHIN_S:g} s in {self.modes.name(self.state.custom_mode or 0)}"
                )

    # --- speed ----------------------------------------------------------------------------------

    async def set_speed(self, speed_m_s: float) -> None:
        """Set the speed over ground of the following motion (of a plane: the airspeed)."""
        air = self.kind is Kind.PLANE
        type_ = dialect.SPEED_TYPE_AIRSPEED if air else dialect.SPEED_TYPE_GROUNDSPEED
        await self.command(dialect.MAV_CMD_DO_CHANGE_SPEED, float(type_), speed_m_s, -1.0)

    async def command(
        self, command: int, *params: float, place: CommandPosition | None = None
    ) -> None:
        """Send a command: a MAV_CMD with up to seven parameters, or the first four and a place; the
        others are 0."""
        await self.link.perform(Command(self.link.address, command, params, place=place))
