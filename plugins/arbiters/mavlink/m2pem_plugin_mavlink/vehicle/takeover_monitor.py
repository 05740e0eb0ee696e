"""Detects that a vehicle was taken over: by another ground station, a pilot, or its own failsafes.

MAVLink lets every ground station command (there is no arbitration between them). So the vehicle's
mode and mission are compared with what was commanded here. The cause of a difference is read from
the vehicle's texts; without a text it is a guess, and the reason says so.
"""

import asyncio
import re
from collections.abc import Callable, Collection
from dataclasses import dataclass
from enum import StrEnum

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.microservices.mission_items import MissionItem
from m2pem_plugin_mavlink.microservices.missions import ReadMissionItem
from m2pem_plugin_mavlink.protocol.messages import Address, Message, message_type
from m2pem_plugin_mavlink.protocol.transaction import ExchangeError
from m2pem_plugin_mavlink.vehicle.driver import FlightMode
from m2pem_plugin_mavlink.vehicle.fixed_wing import landing_start
from m2pem_plugin_mavlink.vehicle.identity import Firmware
from m2pem_plugin_mavlink.vehicle.other_stations import Act, Meaning, meaning
from m2pem_plugin_mavlink.vehicle.settings_monitor import SettingsMonitor
from m2pem_plugin_mavlink.vehicle.vehicle import Vehicle

SETTLES_S = 1.5
"""Seconds between a change and its judgement: a text that explains it may come later."""

RESTART_SHOWS_WITHIN_S = 12.0
"""A vehicle that is suddenly disarmed may have restarted, which its clock shows: its streams are
requested again after 5 s of silence."""

TEXTS_BEFORE_S = 3.0
"""Seconds before a change in which a text may explain it."""

_FAILSAFE = re.compile(
    r"failsafe|fail-safe|fence|battery.*(low|critical|emergency)|low battery|EKF variance|"
    r"glitch|crash|terrain data|dead reckon|vibration|"
    r"(link|connection|control|signal|position).*lost",
    re.IGNORECASE,
)
_PILOT = re.compile(r"pilot took over|manual control|sticks|RC override|taking over", re.IGNORECASE)
_STANDS_AFTER = frozenset({FlightMode.LAND, FlightMode.RETURN})
"""Modes in which an aircraft that has landed is disarmed: its behavior sees that by itself."""
_FOLLOWS = {
    FlightMode.TAKEOFF: frozenset({FlightMode.HOLD}),
    FlightMode.RETURN: frozenset({FlightMode.LAND, FlightMode.HOLD}),
    FlightMode.MISSION: frozenset({FlightMode.HOLD, FlightMode.RETURN, FlightMode.LAND}),
}
"""The modes that autopilots enter by themselves when a mode is complete."""

_COUNT = message_type("MISSION_COUNT").id
_ACK = message_type("MISSION_ACK").id
_REQUESTS = (message_type("MISSION_REQUEST").id, message_type("MISSION_REQUEST_INT").id)


class Cause(StrEnum):
    """The cause of a takeover, as far as known."""

    FAILSAFE = "failsafe"
    PILOT = "pilot"
    STATION = "station"
    RESTART = "restart"
    FALL = "fall"
    PAUSE = "pause"


PAUSED = "paused by another station"


@dataclass(frozen=True, slots=True)
class Takeover:
    """A vehicle does something that m2pem did not command. `reason`: for operators. In a pause the
    behavior waits until the other station continues it."""

    cause: Cause
    reason: str


class TakeoverMonitor:
    """Monitors a vehicle between `open` and `close`.

    `own_system`: the system id that this arbiter sends with. None: unknown; then messages of the
    vehicle to another ground station count only while no exchange of this arbiter is active.
    """

    def __init__(self, vehicle: Vehicle, own_system: int | None = None) -> None:
        self.vehicle = vehicle
        self.own_system = own_system
        self._settings = SettingsMonitor(vehicle)
        self._unsubscribe: list[Callable[[], None]] = []
        self._mode: int | None = None
        self._mode_s = 0.0
        self._before: int | None = None
        self._armed: bool | None = None
        self._disarmed: tuple[float, FlightMode] | None = None
        self._said_fallen = False
        self._boots = vehicle.state.boots
        self._settled: tuple[int | None, int | None] = (None, None)
        self._mission: tuple[MissionItem, ...] | None = None
        self._mission_s = 0.0
        self._replaced = ""
        self._landing_s: float | None = None
        self._checked: int | None = None
        self._check: asyncio.Task[None] | None = None

    def open(self) -> None:
        self._settings.open()
        self._unsubscribe.append(self.vehicle.watch(self._update))
        ids = (_COUNT, _ACK, *_REQUESTS)
        self._unsubscribe.append(self.vehicle.link.listen(ids, self._receive_from_mission_protocol))

    async def close(self) -> None:
        for end in self._unsubscribe:
            end()
        self._unsubscribe.clear()
        await self._settings.close()
        if self._check is not None:
            self._check.cancel()
            await asyncio.wait([self._check])

    # --- judgement ------------------------------------------------------------------------------

    def begin(self) -> None:
        """A new command follows: the present state is no takeover."""
        self._disarmed = None
        self._boots = self.vehicle.state.boots
        self.vehicle.commanded.entered = False
        self._settled = (self.vehicle.state.custom_mode, self.vehicle.commanded.custom_mode)

    def restarted(self) -> Takeover | None:
        """Return whether the autopilot has restarted since `begin`: its clock has gone back, and it
        is not armed."""
        state = self.vehicle.state
        if state.armed is not False or state.boots <= max(self._boots, 1):
            return None
        return Takeover(Cause.RESTART, "its autopilot has restarted, and its motors have stopped")

    def fallen(self) -> Takeover | None:
        """Return whether the vehicle was disarmed in the air since `begin`."""
        height_m = self.vehicle.state.fell_from_m
        if height_m is None or self._disarmed is None:
            return None
        at_s, mode = self._disarmed
        said = [text for text in self._texts_around(at_s) if _FAILSAFE.search(text)]
        by = "; ".join(said) or "by another ground station or by its autopilot"
        height = f"was disarmed {height_m:.0f} m above its home, in {mode}"
        return Takeover(Cause.FALL, f"{height}, and falls: {by}")

    def takeover(self, modes: Collection[FlightMode], behavior: str = "") -> Takeover | None:
        """Return a takeover of a vehicle that should be in one of these modes for a behavior of
        this name; None: there is none.

        A change that was just seen is judged `SETTLES_S` later, or once a text explains it. The
        mode of a vehicle that is not armed does not matter.
        """
        return (
            self._disarmed_by(modes)
            or self._mode_by(modes, behavior)
            or self._mission_by(modes)
            or self._landing_by(modes)
        )

    def mode_is_commanded(self, modes: Collection[FlightMode]) -> bool:
        """Return whether the vehicle is in the commanded mode, or in one of these modes that it
        enters by itself afterwards."""
        state, commanded = self.vehicle.state, self.vehicle.commanded.custom_mode
        if commanded is None or state.custom_mode == commanded:
            return commanded is not None or state.mode in modes
        purpose = self.vehicle.driver.flight_mode(commanded)
        follows = state.mode in modes and state.mode in _FOLLOWS.get(purpose, ())
        return follows and (purpose is not FlightMode.MISSION or self._mission_is_over())

    def _mode_by(self, modes: Collection[FlightMode], behavior: str) -> Takeover | None:
        state, commanded = self.vehicle.state, self.vehicle.commanded
        number = state.custom_mode
        if number is None or not state.armed or commanded.changing:
            return None
        if (number, commanded.custom_mode) == self._settled or self.mode_is_commanded(modes):
            return None
        name = self.vehicle.driver.mode_name(number)
        before = "" if self._before is None else self.vehicle.driver.mode_name(self._before)
        changed = f"the mode changed from {before} to {name}" if before else f"the mode is {name}"
        if self._is_paused() and meaning(Act.HOLD, behavior) is Meaning.WAITS:
            return self._explained(self._mode_s, changed, Takeover(Cause.PAUSE, PAUSED))
        return self._explained(
            self._mode_s,
            changed,
            Takeover(
                Cause.PILOT, f"a person has taken over: {changed}, which m2pem did not command"
            )
            if state.mode is FlightMode.MANUAL
            else Takeover(
                Cause.STATION,
                f"another ground station or a switch has taken over: {changed}, "
                "which m2pem did not command",
            ),
        )

    def _is_paused(self) -> bool:
        """Return whether the vehicle holds in place of its mission: stations pause a PX4 so."""
        vehicle, commanded = self.vehicle, self.vehicle.commanded.custom_mode
        if commanded is None or vehicle.state.mode is not FlightMode.HOLD:
            return False
        if vehicle.state.mission_state == dialect.MISSION_STATE_COMPLETE:
            return False
        px4 = vehicle.identity is not None and vehicle.identity.firmware is Firmware.PX4
        return px4 and vehicle.driver.flight_mode(commanded) is FlightMode.MISSION

    def _disarmed_by(self, modes: Collection[FlightMode]) -> Takeover | None:
        if self._disarmed is None or not modes:
            return None
        at_s, mode = self._disarmed
        if self.vehicle.state.landed and mode in _STANDS_AFTER and self.vehicle.domain == "air":
            return None
        clock_s = self.vehicle.state.clock_s
        waits = self.vehicle.link.now_s() - at_s < RESTART_SHOWS_WITHIN_S
        if clock_s is not None and clock_s <= at_s and waits:
            return None
        changed = f"it was disarmed in {mode}"
        return self._explained(
            at_s,
            changed,
            Takeover(Cause.STATION, f"{changed}: by another ground station or by its autopilot"),
        )

    def _mission_by(self, modes: Collection[FlightMode]) -> Takeover | None:
        if FlightMode.MISSION not in modes or not self._replaced:
            return None
        return Takeover(Cause.STATION, f"another ground station has {self._replaced}")

    def _landing_by(self, modes: Collection[FlightMode]) -> Takeover | None:
        """Whether the mission went on with the landing that is stored behind it. Failsafes of
        ArduPlane do that in AUTO; what m2pem stores ends with a circle before the landing."""
        if FlightMode.MISSION not in modes or self._landing_s is None:
            return None
        return self._explained(
            self._landing_s,
            "its mission went on with its landing",
            Takeover(Cause.STATION, "another ground station has started its landing"),
        )

    def _explained(self, since_s: float, changed: str, otherwise: Takeover) -> Takeover | None:
        """Return the takeover that the texts explain; without a text `otherwise`, after
        `SETTLES_S`."""
        now_s = self.vehicle.link.now_s()
        texts = self._texts_around(since_s)
        for cause, pattern in ((Cause.FAILSAFE, _FAILSAFE), (Cause.PILOT, _PILOT)):
            said = [text for text in texts if pattern.search(text)]
            if cause is Cause.FAILSAFE and not said:
                said = self._fence_breached(since_s)
            if said:
                who = "a failsafe of its own" if cause is Cause.FAILSAFE else "a person"
                return Takeover(cause, f"{who} has taken over: {changed}: {'; '.join(said)}")
        return otherwise if now_s - since_s >= SETTLES_S else None

    def _texts_around(self, since_s: float) -> tuple[str, ...]:
        now_s = self.vehicle.link.now_s()
        return self.vehicle.recent_texts(now_s - since_s + TEXTS_BEFORE_S)

    def _fence_breached(self, since_s: float) -> list[str]:
        """Return a breach from FENCE_STATUS: ArduRover sends no text."""
        state = self.vehicle.state
        breached_s = state.fence_breached_s
        if breached_s is None or breached_s < since_s - TEXTS_BEFORE_S:
            return []
        return [f"fence breached ({state.fence_breach or 'it is inside again'})"]

    def _mission_is_over(self) -> bool:
        mission, driver = self.vehicle.commanded.mission, self.vehicle.driver
        if not mission:
            return True
        last = len(mission) - 1
        return (driver.reached_item or 0) >= last or (driver.current_item or 0) >= last

    # --- observation ----------------------------------------------------------------------------

    def _update(self) -> None:
        state, commanded, now_s = (
            self.vehicle.state,
            self.vehicle.commanded,
            self.vehicle.link.now_s(),
        )
        if state.custom_mode != self._mode:
            self._before, self._mode, self._mode_s = self._mode, state.custom_mode, now_s
            if state.custom_mode == commanded.custom_mode:
                self._settled = (None, None)  # to leave it again is a change
        if state.armed != self._armed:
            if self._armed and state.armed is False and not commanded.disarming:
                self._disarmed = (now_s, state.mode)
            elif state.armed:
                self._disarmed = None
            self._armed = state.armed
        self._settings.look_at_home()
        if (fell := self.fallen()) is None:
            self._said_fallen = False
        elif not self._said_fallen:
            self._said_fallen = True
            self.vehicle.alarm(fell.reason)
        if commanded.mission is not self._mission:
            self._mission, self._replaced, self._checked = commanded.mission, "", None
            self._mission_s = now_s
        self._landing_s = (self._landing_s or now_s) if self._lands_unasked() else None
        # Messages from before the upload may still come.
        settled = now_s - self._mission_s > SETTLES_S
        if commanded.mission is not None and settled and not commanded.exchanging:
            self._check_mission(commanded.mission)

    def _lands_unasked(self) -> bool:
        state, commanded = self.vehicle.state, self.vehicle.commanded
        if commanded.mission is None or commanded.exchanging or commanded.changing:
            return False
        item = self.vehicle.driver.current_item
        if item is None:
            return False
        begins = landing_start(commanded.mission)
        if begins is None or state.loiter_radius_m is None:
            return False
        return state.mode is FlightMode.MISSION and commanded.first_item < begins <= item

    def _check_mission(self, mission: tuple[MissionItem, ...]) -> None:
        state = self.vehicle.state
        current_s = state.messages_s.get(dialect.MAVLINK_MSG_ID_MISSION_CURRENT)
        if current_s is None or current_s != state.at_s:
            return
        if state.mission_total is not None and state.mission_total != len(mission):
            self._replaced = (
                f"replaced the mission: it has {state.mission_total} items, not {len(mission)}"
                if state.mission_total
                else "cleared the mission"
            )
        item = self.vehicle.driver.current_item
        checking = self._check is not None and not self._check.done()
        if item is not None and item != self._checked and item < len(mission) and not checking:
            self._checked = item
            if self._answers_single_requests:
                work = self._compare_item(item, mission)
                self._check = asyncio.get_running_loop().create_task(work)

    @property
    def _answers_single_requests(self) -> bool:
        """Return whether single items can be read: PX4 sends an item only as part of a download."""
        identity = self.vehicle.identity
        return identity is not None and identity.firmware is Firmware.ARDUPILOT

    async def _compare_item(self, item: int, mission: tuple[MissionItem, ...]) -> None:
        """Read the current item: it must be the one that was uploaded.

        It is read again if it is another one: the answer to an earlier request may come late.
        """
        link = self.vehicle.link
        for _ in range(2):
            try:
                found = await link.perform(ReadMissionItem(link.address, item + 1))
            except ExchangeError:
                return  # a missing answer proves nothing
            if self.vehicle.commanded.mission is not mission or found.is_stored_as(mission[item]):
                return
        self._replaced = f"replaced the mission: its item {item + 1} was not uploaded here"

    def _receive_from_mission_protocol(self, message: Message, sender: Address) -> None:
        """Receive the vehicle's messages about missions to another ground station. Not all links
        carry them."""
        if sender != self.vehicle.link.address or message.mission_type:
            return
        to: int = message.target_system
        commanded = self.vehicle.commanded
        if (
            to in (0, self.own_system)
            or (self.own_system is None and commanded.exchanging)
            or commanded.mission is None
        ):
            return
        id_ = message.TYPE.id
        if id_ in _REQUESTS:
            self._replaced = f"begun to replace the mission (system {to})"
        elif id_ == _ACK and message.type == dialect.MAV_MISSION_ACCEPTED:
            # Also the end of a download; then its count was the same.
            self._checked = None
        elif id_ == _COUNT:
            home = self.vehicle.driver.home_items
            if message.count != len(commanded.mission) + home:
                self._replaced = f"replaced the mission: it has {message.count - home} items"
