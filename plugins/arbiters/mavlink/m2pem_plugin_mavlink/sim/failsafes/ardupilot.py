"""Failsafes of ArduPilot: ground station, battery, estimator (events.cpp, failsafe.cpp)."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from m2pem_plugin_mavlink.sim.failsafes.watch import Change, Heartbeats, Lasting, Watch
from m2pem_plugin_mavlink.sim.part import MessageHandler, Part
from m2pem_plugin_mavlink.sim.peers import Heard
from m2pem_plugin_mavlink.sim.specification import Kind

if TYPE_CHECKING:
    from m2pem_plugin_mavlink.sim.autopilot import Autopilot

EKF_S = 1.0
"""For how long the estimator must be without a position."""
CONTINUE_AUTO_WITHOUT_GCS = 1 << 1
"""FS_OPTIONS."""
SURFACE = (Kind.ROVER, Kind.BOAT)

Modes = Mapping[int, str]
COPTER_BATTERY: Modes = {1: "LAND", 2: "RTL", 3: "SMART_RTL", 4: "SMART_RTL", 6: "RTL", 7: "BRAKE"}
"""BATT_FS_LOW_ACT and BATT_FS_CRT_ACT."""
COPTER_GCS: Modes = {**COPTER_BATTERY, 1: "RTL", 5: "LAND"}
"""FS_GCS_ENABLE."""
ROVER_ACTIONS: Modes = {1: "RTL", 2: "HOLD", 3: "SMART_RTL", 4: "SMART_RTL", 6: "LOITER"}
"""FS_ACTION, BATT_FS_LOW_ACT."""
PLANE_ACTIONS: Modes = {1: "RTL", 2: "RTL", 5: "RTL"}
"""FS_LONG_ACTN, BATT_FS_LOW_ACT: gliding and automatic landing end in RTL here."""


class ArduPilotFailsafes(Part):
    """Watches the ground station, the battery and the estimator."""

    def __init__(self, autopilot: "Autopilot") -> None:
        super().__init__(autopilot)
        self._heartbeats = Heartbeats()
        self._link = Watch()
        self._position = Lasting()
        self._battery = {"CRT": Lasting(), "LOW": Lasting()}

    @property
    def failsafe(self) -> bool:
        """One of them is not well."""
        watches = (self._link, self._position, *self._battery.values())
        return any(watch.wrong for watch in watches)

    def messages(self) -> Mapping[str, MessageHandler]:
        """Heartbeats of the one ground station that counts."""
        return {"HEARTBEAT": self._heard}

    def _heard(self, message: Any, sender: Heard) -> None:
        if sender.system == self.autopilot.parameters["MAV_GCS_SYSID"]:
            self._heartbeats.heard(self.autopilot.now_s)

    def step(self, dt_s: float) -> None:
        """Look after all three."""
        self._look_at_link()
        for level, watch in self._battery.items():
            self._look_at_battery(level, watch)
            if watch.wrong:
                break
        self._look_at_position()

    # --- the ground station -----------------------------------------------------------------------

    def _look_at_link(self) -> None:
        pilot, p = self.autopilot, self.autopilot.parameters
        kind = pilot.spec.kind
        plane = kind is Kind.PLANE
        enabled = int(p["FS_GCS_ENABL" if plane else "FS_GCS_ENABLE"])
        timeout_s = p["FS_LONG_TIMEOUT" if plane else "FS_GCS_TIMEOUT"]
        missed = enabled > 0 and self._heartbeats.missed(timeout_s, pilot.now_s)
        change = self._link.look(missed)
        if change is Change.WELL and kind in SURFACE:
            pilot.say("GCS Failsafe Cleared")
        elif change is Change.WELL:
            pilot.warn("GCS Failsafe Cleared")
        if change is not Change.WRONG:
            return
        auto = pilot.modes.mode.name == "AUTO"
        if kind is Kind.COPTER:
            goes_on = int(p["FS_OPTIONS"]) & CONTINUE_AUTO_WITHOUT_GCS and auto
            self._act("GCS", COPTER_GCS.get(enabled), "Continuing Auto Mode" if goes_on else "")
        elif kind in SURFACE:
            # Rovers look after radio and ground station together, and name the radio
            # (Rover::failsafe_trigger).
            goes_on = enabled == 2 and auto
            self._act("Radio", None if goes_on else ROVER_ACTIONS.get(int(p["FS_ACTION"])))
        else:
            self._act("GCS", PLANE_ACTIONS.get(int(p["FS_LONG_ACTN"])))

    def _act(self, what: str, mode: str | None, instead: str = "") -> None:
        """Say it, and change the mode. On the ground the motors of what flies are stopped."""
        pilot = self.autopilot
        pilot.note("failsafe", what)
        flies = pilot.spec.kind not in SURFACE
        if pilot.arming.armed and flies and pilot.body.on_ground and not instead:
            pilot.arming.disarm()
            instead = "Disarming"
        pilot.warn(f"{what} Failsafe" + (f" - {instead}" if instead else ""))
        if mode is None or instead or not pilot.arming.armed:
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

    def _look_at_battery(self, level: str, watch: Lasting) -> None:
        pilot, p = self.autopilot, self.autopilot.parameters
        delay_s = p["BATT_LOW_TIMER"]
        change = watch.look_for(self._empty(level), delay_s, pilot.now_s)
        if change is not Change.WRONG:
            return
        used_mah = (1 - pilot.battery.left) * p["BATT_CAPACITY"]
        name = "low" if level == "LOW" else "critical"
        volts = pilot.battery.voltage_v
        pilot.warn(f"Battery 1 is {name} {volts:.2f}V used {used_mah:.0f} mAh")
        actions = {Kind.COPTER: COPTER_BATTERY, Kind.PLANE: PLANE_ACTIONS}
        action = int(p[f"BATT_FS_{level}_ACT"])
        mode = actions.get(pilot.spec.kind, ROVER_ACTIONS).get(action)
        if mode is not None or pilot.spec.kind is Kind.COPTER:
            self._act("Battery", mode)

    def _empty(self, level: str) -> bool:
        """Below the voltage or the charge that is set."""
        pilot, p = self.autopilot, self.autopilot.parameters
        left_mah = pilot.battery.left * p["BATT_CAPACITY"]
        return (
            pilot.battery.voltage_v < p[f"BATT_{level}_VOLT"] or left_mah < p[f"BATT_{level}_MAH"]
        )

    def refusals(self) -> Iterator[str]:
        """It is not armed with an empty battery."""
        if self._empty("LOW"):
            yield "Battery 1 low voltage failsafe"

    # --- the estimator ----------------------------------------------------------------------------

    def _look_at_position(self) -> None:
        pilot = self.autopilot
        needs = pilot.arming.armed and pilot.modes.mode.needs_position
        lost = (needs or self._position.wrong) and not pilot.estimator.ready
        action = int(pilot.parameters["FS_EKF_ACTION"])
        change = self._position.look_for(lost, EKF_S, pilot.now_s)
        surface = pilot.spec.kind in SURFACE
        if change is Change.WELL and action:
            pilot.warn("EKF failsafe cleared" if surface else "EKF Failsafe Cleared")
        if change is not Change.WRONG or not action:
            return
        pilot.note("failsafe", "EKF")
        kind = pilot.spec.kind
        if kind in SURFACE and action == 1:
            self._enter("HOLD")
        elif kind is Kind.COPTER:
            self._enter("ALT_HOLD" if action == 2 else "LAND")
        elif kind is Kind.PLANE:
            self._enter("CIRCLE")
        mode = pilot.modes.mode.name
        pilot.warn("EKF failsafe" if surface else f"EKF Failsafe: changed to {mode} Mode")
