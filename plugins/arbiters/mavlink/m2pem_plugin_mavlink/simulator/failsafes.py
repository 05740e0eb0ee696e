"""What a vehicle does itself when it loses the ground station, its battery or its position.

Sources: ArduPilot events.cpp and failsafe.cpp; PX4 Commander, failsafe.cpp.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from enum import Enum
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.simulator.firmware.px4_modes import (
    DESCEND,
    HOLD,
    LAND,
    MISSION,
    OFFBOARD,
    RETURN,
    custom_mode,
)
from m2pem_plugin_mavlink.simulator.interfaces import AutopilotInterface, Component, on_message
from m2pem_plugin_mavlink.simulator.messages import Sender
from m2pem_plugin_mavlink.simulator.specification import SURFACE, Kind


class Change(Enum):
    """What has changed."""

    NONE = 0
    WRONG = 1
    WELL = 2


class Watch:
    """Tracks whether a condition is bad, and reports changes."""

    def __init__(self) -> None:
        self.wrong = False
        self._since_s = math.inf

    def look(self, wrong: bool, seconds: float = 0.0, now_s: float = 0.0) -> Change:
        """How it is now; what has changed since the last look. It counts as bad only once it has
        been for some seconds."""
        self._since_s = min(self._since_s, now_s) if wrong else math.inf
        before, self.wrong = self.wrong, wrong and now_s - self._since_s >= seconds
        if self.wrong == before:
            return Change.NONE
        return Change.WRONG if self.wrong else Change.WELL


class Failsafes(Component, ABC):
    """Monitors the ground station, the battery and the position. Before its first heartbeat a
    ground station is not missed."""

    def __init__(self, autopilot: AutopilotInterface) -> None:
        super().__init__(autopilot)
        self._heartbeat_s = math.inf
        self._link = Watch()
        self._position = Watch()

    @on_message("HEARTBEAT")
    def _received(self, message: Any, sender: Sender) -> None:
        if self._counts(message, sender):
            self._heartbeat_s = self.autopilot.now_s

    @abstractmethod
    def _counts(self, message: Any, sender: Sender) -> bool:
        """Return whether it is a heartbeat of a ground station that counts."""

    def _missed(self, seconds: float) -> bool:
        """Return whether no heartbeat has come for longer than that."""
        return self.autopilot.now_s - self._heartbeat_s > seconds


EKF_S = 1.0
"""For how long the estimator must be without a position."""
CONTINUE_AUTO_WITHOUT_GCS = 1 << 1
CONTINUE_PILOTED_WITHOUT_GCS = 1 << 4
"""FS_OPTIONS."""
PILOTED = ("STABILIZE", "ACRO", "ALT_HOLD", "LOITER", "POSHOLD", "BRAKE")
"""Modes of copters that count as controlled by a pilot (ArduCopter: Mode::is_autopilot)."""

Modes = Mapping[int, str]
COPTER_BATTERY: Modes = {1: "LAND", 2: "RTL", 3: "SMART_RTL", 4: "SMART_RTL", 6: "RTL", 7: "BRAKE"}
"""BATT_FS_LOW_ACT and BATT_FS_CRT_ACT."""
COPTER_GCS: Modes = {**COPTER_BATTERY, 1: "RTL", 5: "LAND"}
"""FS_GCS_ENABLE."""
ROVER_ACTIONS: Modes = {1: "RTL", 2: "HOLD", 3: "SMART_RTL", 4: "SMART_RTL", 6: "LOITER"}
"""FS_ACTION, BATT_FS_LOW_ACT."""
PLANE_ACTIONS: Modes = {1: "RTL", 2: "RTL", 5: "RTL"}
"""FS_LONG_ACTN, BATT_FS_LOW_ACT: gliding and automatic landing end in RTL here."""


class ArduPilotFailsafes(Failsafes):
    """Monitors one ground station, and the estimator."""

    def __init__(self, autopilot: AutopilotInterface) -> None:
        super().__init__(autopilot)
        self._battery = {"CRT": Watch(), "LOW": Watch()}

    @property
    def failsafe(self) -> bool:
        """One of them is not well."""
        watches = (self._link, self._position, *self._battery.values())
        return any(watch.wrong for watch in watches)

    def _counts(self, message: Any, sender: Sender) -> bool:
        return sender.system == self.autopilot.parameters["MAV_GCS_SYSID"]

    def step(self, dt_s: float) -> None:
        """Check all three conditions."""
        self._look_at_link()
        for level, watch in self._battery.items():
            self._look_at_battery(level, watch)
            if watch.wrong:
                break
        self._look_at_position()

    # --- the ground station -----------------------------------------------------------------------

    def _look_at_link(self) -> None:
        autopilot, p = self.autopilot, self.autopilot.parameters
        kind = autopilot.spec.kind
        plane = kind is Kind.PLANE
        enabled = int(p["FS_GCS_ENABL" if plane else "FS_GCS_ENABLE"])
        timeout_s = p["FS_LONG_TIMEOUT" if plane else "FS_GCS_TIMEOUT"]
        missed = enabled > 0 and self._missed(timeout_s)
        change = self._link.look(missed)
        if change is Change.WELL and kind in SURFACE:
            autopilot.say("GCS Failsafe Cleared")
        elif change is Change.WELL:
            autopilot.warn("GCS Failsafe Cleared")
        if change is not Change.WRONG:
            return
        mode = autopilot.modes.mode.name
        auto = mode == "AUTO"
        if kind is Kind.COPTER:
            options, instead = int(p["FS_OPTIONS"]), ""
            if options & CONTINUE_AUTO_WITHOUT_GCS and auto:
                instead = "Continuing Auto Mode"
            elif options & CONTINUE_PILOTED_WITHOUT_GCS and mode in PILOTED:
                instead = "Continuing Pilot Control"
            self._act("GCS", COPTER_GCS.get(enabled), instead)
        elif kind in SURFACE:
            # Rovers look after radio and ground station together, and name the radio
            # (Rover::failsafe_trigger).
            goes_on = enabled == 2 and auto
            self._act("Radio", None if goes_on else ROVER_ACTIONS.get(int(p["FS_ACTION"])))
        else:
            self._act("GCS", PLANE_ACTIONS.get(int(p["FS_LONG_ACTN"])))

    def _act(self, what: str, mode: str | None, instead: str = "") -> None:
        """Say it, and change the mode. On the ground the motors of what flies are stopped."""
        autopilot = self.autopilot
        autopilot.log_event("failsafe", what)
        flies = autopilot.spec.kind not in SURFACE
        if autopilot.arming.armed and flies and autopilot.body.on_ground and not instead:
            autopilot.arming.disarm()
            instead = "Disarming"
        autopilot.warn(f"{what} Failsafe" + (f" - {instead}" if instead else ""))
        if mode is None or instead or not autopilot.arming.armed:
            return
        self._enter(mode)

    def _enter(self, mode: str) -> None:
        """A mode, or, if that cannot be, the last resort."""
        modes = self.autopilot.modes
        resort = "HOLD" if self.autopilot.spec.kind in SURFACE else "LAND"
        numbers = {each.name: each.number for each in modes.by_number.values()}
        for name in (mode, resort):
            if name in numbers and modes.switch(numbers[name]):
                return

    # --- the battery ------------------------------------------------------------------------------

    def _look_at_battery(self, level: str, watch: Watch) -> None:
        autopilot, p = self.autopilot, self.autopilot.parameters
        delay_s = p["BATT_LOW_TIMER"]
        change = watch.look(self._empty(level), delay_s, autopilot.now_s)
        if change is not Change.WRONG:
            return
        used_mah = (1 - autopilot.battery.left) * p["BATT_CAPACITY"]
        name = "low" if level == "LOW" else "critical"
        volts = autopilot.battery.voltage_v
        autopilot.warn(f"Battery 1 is {name} {volts:.2f}V used {used_mah:.0f} mAh")
        actions = {Kind.COPTER: COPTER_BATTERY, Kind.PLANE: PLANE_ACTIONS}
        action = int(p[f"BATT_FS_{level}_ACT"])
        mode = actions.get(autopilot.spec.kind, ROVER_ACTIONS).get(action)
        if mode is not None or autopilot.spec.kind is Kind.COPTER:
            self._act("Battery", mode)

    def _empty(self, level: str) -> bool:
        """Below the voltage or the charge that is set."""
        autopilot, p = self.autopilot, self.autopilot.parameters
        left_mah = autopilot.battery.left * p["BATT_CAPACITY"]
        return (
            autopilot.battery.voltage_v < p[f"BATT_{level}_VOLT"]
            or left_mah < p[f"BATT_{level}_MAH"]
        )

    def refusals(self) -> Iterator[str]:
        """It is not armed with an empty battery."""
        if self._empty("LOW"):
            yield "Battery 1 low voltage failsafe"

    # --- the estimator ----------------------------------------------------------------------------

    def _look_at_position(self) -> None:
        autopilot = self.autopilot
        needs = autopilot.arming.armed and autopilot.modes.mode.needs_position
        lost = (needs or self._position.wrong) and not autopilot.estimator.ready
        action = int(autopilot.parameters["FS_EKF_ACTION"])
        change = self._position.look(lost, EKF_S, autopilot.now_s)
        surface = autopilot.spec.kind in SURFACE
        if change is Change.WELL and action:
            autopilot.warn("EKF failsafe cleared" if surface else "EKF Failsafe Cleared")
        if change is not Change.WRONG or not action:
            return
        autopilot.log_event("failsafe", "EKF")
        kind = autopilot.spec.kind
        if kind in SURFACE and action == 1:
            self._enter("HOLD")
        elif kind is Kind.COPTER:
            self._enter("ALT_HOLD" if action == 2 else "LAND")
        elif kind is Kind.PLANE:
            self._enter("CIRCLE")
        mode = autopilot.modes.mode.name
        autopilot.warn("EKF failsafe" if surface else f"EKF Failsafe: changed to {mode} Mode")


POSITION_S = 1.0
"""For how long the position must be unknown."""
LINK_ACTIONS = {1: HOLD, 2: RETURN, 3: LAND, 5: LAND, 6: LAND}
"""NAV_DLL_ACT; terminating and disarming end in landing here."""
EXCEPTIONS = {MISSION: 1, HOLD: 2, OFFBOARD: 4}
"""COM_DLL_EXCEPT: modes that go on without a ground station."""
RETURN_THEN_LAND = 3
"""COM_LOW_BAT_ACT: return when it is critical, land in an emergency."""


class Px4Failsafes(Failsafes):
    """Monitors all ground stations."""

    def __init__(self, autopilot: AutopilotInterface) -> None:
        super().__init__(autopilot)
        self._low, self._critical, self._emergency = Watch(), Watch(), Watch()
        self._acting_in: int | None = None
        self._then: int | None = None  # the mode that follows on holding
        self._holds_until_s = 0.0
        self._before = HOLD  # the mode in which the position was lost

    @property
    def failsafe(self) -> bool:
        """It acts until it is disarmed or another mode is entered."""
        return self._acting_in is not None

    def _counts(self, message: Any, sender: Sender) -> bool:
        return bool(message.type == dialect.MAV_TYPE_GCS)

    def step(self, dt_s: float) -> None:
        """Check all three conditions."""
        autopilot = self.autopilot
        if not autopilot.arming.armed or autopilot.modes.mode.number != self._acting_in:
            self._acting_in = self._then = None
        if self._then is not None and autopilot.now_s >= self._holds_until_s:
            then, self._then = self._then, None
            self._enter(then)
        self._look_at_link()
        self._look_at_battery()
        self._look_at_position()

    def act(self, what: str, mode: int, *, at_once: bool = False) -> None:
        """Enter a mode, in the air only, after holding for COM_FAIL_ACT_T unless it acts already;
        never one that is milder than LAND once in that."""
        autopilot = self.autopilot
        autopilot.log_event("failsafe", what)
        present = autopilot.modes.mode.number
        if not autopilot.arming.armed or present == LAND or present == mode == RETURN:
            return
        delay_s = autopilot.parameters["COM_FAIL_ACT_T"]
        if self._then is not None and not at_once:
            self._then = mode
        elif at_once or mode == HOLD or self._acting_in is not None or not delay_s:
            self._then = None
            self._enter(mode)
        elif autopilot.modes.switch(HOLD):
            self._acting_in, self._then = HOLD, mode
            self._holds_until_s = autopilot.now_s + delay_s
            autopilot.warn(f"Failsafe activated: entering Hold for {delay_s:.0f} seconds")

    def _enter(self, mode: int) -> None:
        autopilot = self.autopilot
        last_resort = LAND if LAND in autopilot.modes.by_number else custom_mode(1)
        for number in (mode, last_resort):
            if number in autopilot.modes.by_number and autopilot.modes.switch(number):
                self._acting_in = number
                autopilot.warn("Failsafe activated")
                return

    def _look_at_link(self) -> None:
        autopilot, p = self.autopilot, self.autopilot.parameters
        change = self._link.look(self._missed(p["COM_DL_LOSS_T"]))
        if change is Change.WELL:
            autopilot.say("GCS connection regained")
        if change is not Change.WRONG:
            return
        autopilot.say("Connection to ground station lost")
        mode = LINK_ACTIONS.get(int(p["NAV_DLL_ACT"]))
        excepted = EXCEPTIONS.get(autopilot.modes.mode.number, 0) & int(p["COM_DLL_EXCEPT"])
        if mode is not None and not excepted:
            self.act("no ground station", mode)

    def _look_at_battery(self) -> None:
        autopilot, p = self.autopilot, self.autopilot.parameters
        left, action = autopilot.battery.left, int(p["COM_LOW_BAT_ACT"])
        if self._low.look(left < p["BAT_LOW_THR"]) is Change.WRONG:
            autopilot.warn("Low battery")
        if self._critical.look(left < p["BAT_CRIT_THR"]) is Change.WRONG:
            autopilot.warn("Critical battery")
            if action:
                self.act("critical battery", RETURN if action == RETURN_THEN_LAND else LAND)
        if self._emergency.look(left < p["BAT_EMERGEN_THR"]) is Change.WRONG:
            autopilot.say("Emergency battery level", dialect.MAV_SEVERITY_EMERGENCY)
            if action:
                self.act("empty battery", LAND)

    def refusals(self) -> Iterator[str]:
        """It is not armed with an empty battery."""
        autopilot = self.autopilot
        if autopilot.battery.left < autopilot.parameters["BAT_CRIT_THR"]:
            yield "Low battery"

    def _look_at_position(self) -> None:
        autopilot = self.autopilot
        needs = autopilot.modes.mode.needs_position or self._position.wrong
        lost = autopilot.arming.armed and needs and not autopilot.estimator.ready
        change = self._position.look(lost, POSITION_S, autopilot.now_s)
        if change is Change.WRONG:
            self._before = autopilot.modes.mode.number
            self.act("no valid position estimate", DESCEND, at_once=True)
        elif change is Change.WELL and self._acting_in == DESCEND:
            autopilot.modes.switch(self._before)
