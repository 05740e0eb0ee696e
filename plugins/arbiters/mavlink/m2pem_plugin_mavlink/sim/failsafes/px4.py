"""Failsafes of PX4: ground station, battery, position (PX4: Commander, failsafe.cpp)."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.sim.failsafes.watch import Change, Heartbeats, Lasting, Watch
from m2pem_plugin_mavlink.sim.firmware.px4_modes import (
    DESCEND,
    HOLD,
    LAND,
    MISSION,
    OFFBOARD,
    RETURN,
    custom_mode,
)
from m2pem_plugin_mavlink.sim.part import MessageHandler, Part
from m2pem_plugin_mavlink.sim.peers import Heard

if TYPE_CHECKING:
    from m2pem_plugin_mavlink.sim.autopilot import Autopilot

POSITION_S = 1.0
"""For how long the position must be unknown."""
LINK_ACTIONS = {1: HOLD, 2: RETURN, 3: LAND, 5: LAND, 6: LAND}
"""NAV_DLL_ACT; terminating and disarming end in landing here."""
EXCEPTIONS = {MISSION: 1, HOLD: 2, OFFBOARD: 4}
"""COM_DLL_EXCEPT: modes that go on without a ground station."""
RETURN_THEN_LAND = 3
"""COM_LOW_BAT_ACT: return when it is critical, land in an emergency."""


class Px4Failsafes(Part):
    """Watches the ground station, the battery and the position."""

    def __init__(self, autopilot: "Autopilot") -> None:
        super().__init__(autopilot)
        self._heartbeats = Heartbeats()
        self._link = Watch()
        self._position = Lasting()
        self._low, self._critical, self._emergency = Watch(), Watch(), Watch()
        self._acting_in: int | None = None
        self._then: int | None = None  # the mode that follows on holding
        self._holds_until_s = 0.0
        self._before = HOLD  # the mode in which the position was lost

    @property
    def failsafe(self) -> bool:
        """It acts until it is disarmed or another mode is entered."""
        return self._acting_in is not None

    def messages(self) -> Mapping[str, MessageHandler]:
        """Heartbeats of any ground station."""
        return {"HEARTBEAT": self._heard}

    def _heard(self, message: Any, sender: Heard) -> None:
        if message.type == dialect.MAV_TYPE_GCS:
            self._heartbeats.heard(self.autopilot.now_s)

    def step(self, dt_s: float) -> None:
        """Look after all three."""
        pilot = self.autopilot
        if not pilot.arming.armed or pilot.modes.mode.number != self._acting_in:
            self._acting_in = self._then = None
        if self._then is not None and pilot.now_s >= self._holds_until_s:
            then, self._then = self._then, None
            self._enter(then)
        self._look_at_link()
        self._look_at_battery()
        self._look_at_position()

    def act(self, what: str, mode: int, *, at_once: bool = False) -> None:
        """Enter a mode, in the air only, after holding for COM_FAIL_ACT_T unless it acts already;
        never one that is milder than LAND once in that."""
        pilot = self.autopilot
        pilot.note("failsafe", what)
        present = pilot.modes.mode.number
        if not pilot.arming.armed or present == LAND or present == mode == RETURN:
            return
        delay_s = pilot.parameters["COM_FAIL_ACT_T"]
        if self._then is not None and not at_once:
            self._then = mode
        elif at_once or mode == HOLD or self._acting_in is not None or not delay_s:
            self._then = None
            self._enter(mode)
        elif pilot.modes.switch(HOLD):
            self._acting_in, self._then = HOLD, mode
            self._holds_until_s = pilot.now_s + delay_s
            pilot.warn(f"Failsafe activated: entering Hold for {delay_s:.0f} seconds")

    def _enter(self, mode: int) -> None:
        pilot = self.autopilot
        last_resort = LAND if LAND in pilot.modes.by_number else custom_mode(1)
        for number in (mode, last_resort):
            if number in pilot.modes.by_number and pilot.modes.switch(number):
                self._acting_in = number
                pilot.warn("Failsafe activated")
                return

    def _look_at_link(self) -> None:
        pilot, p = self.autopilot, self.autopilot.parameters
        change = self._link.look(self._heartbeats.missed(p["COM_DL_LOSS_T"], pilot.now_s))
        if change is Change.WELL:
            pilot.say("GCS connection regained")
        if change is not Change.WRONG:
            return
        pilot.say("Connection to ground station lost")
        mode = LINK_ACTIONS.get(int(p["NAV_DLL_ACT"]))
        excepted = EXCEPTIONS.get(pilot.modes.mode.number, 0) & int(p["COM_DLL_EXCEPT"])
        if mode is not None and not excepted:
            self.act("no ground station", mode)

    def _look_at_battery(self) -> None:
        pilot, p = self.autopilot, self.autopilot.parameters
        left, action = pilot.battery.left, int(p["COM_LOW_BAT_ACT"])
        if self._low.look(left < p["BAT_LOW_THR"]) is Change.WRONG:
            pilot.warn("Low battery")
        if self._critical.look(left < p["BAT_CRIT_THR"]) is Change.WRONG:
            pilot.warn("Critical battery")
            if action:
                self.act("critical battery", RETURN if action == RETURN_THEN_LAND else LAND)
        if self._emergency.look(left < p["BAT_EMERGEN_THR"]) is Change.WRONG:
            pilot.say("Emergency battery level", dialect.MAV_SEVERITY_EMERGENCY)
            if action:
                self.act("empty battery", LAND)

    def refusals(self) -> Iterator[str]:
        """It is not armed with an empty battery."""
        pilot = self.autopilot
        if pilot.battery.left < pilot.parameters["BAT_CRIT_THR"]:
            yield "Low battery"

    def _look_at_position(self) -> None:
        pilot = self.autopilot
        needs = pilot.modes.mode.needs_position or self._position.wrong
        lost = pilot.arming.armed and needs and not pilot.estimator.ready
        change = self._position.look_for(lost, POSITION_S, pilot.now_s)
        if change is Change.WRONG:
            self._before = pilot.modes.mode.number
            self.act("no valid position estimate", DESCEND, at_once=True)
        elif change is Change.WELL and self._acting_in == DESCEND:
            pilot.modes.switch(self._before)
