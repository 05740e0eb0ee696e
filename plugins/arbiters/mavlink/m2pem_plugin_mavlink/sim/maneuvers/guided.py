"""GUIDED: go where, or as fast as, a ground station says."""

from collections.abc import Callable
from dataclasses import replace

from pymavlink.dialects.v20.ardupilotmega import (
    MAV_SEVERITY_WARNING,
    MAVLink_mission_item_reached_message,
)

from m2pem_plugin_mavlink.sim.demands import Circle, Demand, Drive, Go, Reach, Rest
from m2pem_plugin_mavlink.sim.geometry import Point
from m2pem_plugin_mavlink.sim.maneuvers.maneuver import Maneuver
from m2pem_plugin_mavlink.sim.maneuvers.standing import Stay
from m2pem_plugin_mavlink.sim.specification import Kind

SURFACE = (Kind.ROVER, Kind.BOAT)
TAKEN_OFF_M = 0.3
"""A takeoff is over when it is that near to its height."""


class Guided(Maneuver):
    """What was last asked for: a takeoff, a place, a velocity; without any, it stays.

    `aimed`: it is on the way to a place, or (not boats, which then loiter) has arrived there. A
    copter goes as fast as it is set up whenever that begins or ends; what drives takes no speed
    before. (ArduPilot: ModeGuided::set_desired_speed of rovers, pva_control_start of copters.)
    `radius_m`: a plane circles the place so far away (0: WP_LOITER_RAD), until the mode is left.
    A velocity is forgotten after `tuning.setpoint_timeout_s` (ArduPilot: 3 s, GUID_TIMEOUT).
    """

    takeoff_up_m: float | None = None
    radius_m = 0.0
    destination: Point | None = None
    paused = False
    _entered = False
    aimed = False

    @property
    def takes_speed(self) -> bool:
        """What drives does so on the way to a place only."""
        return self.aimed or self.autopilot.spec.kind not in SURFACE

    def _aim(self, aimed: bool) -> None:
        if aimed != self.aimed and self.autopilot.spec.kind is Kind.COPTER:
            self.autopilot.modes.set_speed(None)
        self.aimed = aimed

    def begin(self) -> None:
        """Nothing has been asked for yet."""
        self._stay = Stay(self.autopilot)
        self._velocity: Callable[[], Demand] | None = None
        self._velocity_until_s = 0.0
        self.yaw_rad: float | None = None
        if not self._entered:
            self._say_reached()
        self._entered = True

    def _say_reached(self) -> None:
        """A plane takes its last circle for that around the new place, and says at once, and only
        then, that it is there (Plane::update_loiter)."""
        if self.autopilot.spec.kind is Kind.PLANE:
            self.autopilot.send(MAVLink_mission_item_reached_message(0))

    def take_off(self, up_m: float) -> None:
        """Climb to a height (metres above the frame's origin)."""
        self._aim(False)
        self.takeoff_up_m, self.taking_off = up_m, True
        self._start = self.autopilot.position
        self.destination = self._velocity = None
        self.autopilot.note("takeoff", f"{up_m:g} m")

    def go_to(self, point: Point, yaw_rad: float | None = None) -> None:
        """Go there, and stay."""
        if (
            self.destination is None
            or self.destination.distance_m(point) > 0.1
            or (abs(self.destination.up_m - point.up_m) > 0.1)
        ):
            place = self.autopilot.frame.to_location(point)
            self.autopilot.note("motion", f"{place.latitude_deg:.7f},{place.longitude_deg:.7f}")
            self._say_reached()
        self._aim(True)
        self.taking_off, self._velocity, self.paused = False, None, False
        self.destination, self.yaw_rad = point, yaw_rad

    def move(self, demand: Callable[[], Demand]) -> None:
        """Have a velocity, for a while."""
        if self._velocity is None:
            self.autopilot.note("motion", "velocity")
        self._aim(False)
        self.taking_off, self.destination = False, None
        self._velocity = demand
        self._velocity_until_s = self.autopilot.now_s + self.autopilot.tuning.setpoint_timeout_s

    def pause(self, *, on: bool) -> None:
        """Stop on the way, or go on."""
        self.paused = on
        self._stay = Stay(self.autopilot)

    def stop(self) -> None:
        """Stay where it is."""
        self.destination = self._velocity = None
        self.taking_off = False
        self._stay = Stay(self.autopilot)

    def step(self, dt_s: float) -> Demand:
        """What was asked for."""
        pilot = self.autopilot
        if self.taking_off and self.takeoff_up_m is not None:
            if abs(self.takeoff_up_m - pilot.body.up_m) > TAKEN_OFF_M or pilot.body.on_ground:
                yaw_rad = pilot.body.yaw_rad
                return self.reach(self._start.at_height(self.takeoff_up_m), yaw_rad=yaw_rad)
            self.taking_off = False
            self._stay = Stay(pilot)
        if pilot.body.on_ground and pilot.spec.kind in (Kind.COPTER, Kind.PLANE):
            return Rest()
        if self._velocity is not None:
            if pilot.now_s <= self._velocity_until_s:
                return self._velocity()
            self.stop()
            if pilot.spec.kind in SURFACE:
                text = "target not received last 3secs, stopping"
                pilot.say(text, MAV_SEVERITY_WARNING)
        if self.destination is not None and not self.paused:
            return self._towards(self.destination)
        return self._turned(self._stay.step(dt_s))

    def _towards(self, destination: Point) -> Demand:
        pilot = self.autopilot
        match pilot.spec.kind:
            case Kind.PLANE:
                radius_m = self.radius_m or pilot.tuning.loiter_radius_m
                return Circle(destination, radius_m, pilot.modes.speed_mps)
            case Kind.ROVER | Kind.BOAT:
                if pilot.position.distance_m(destination) <= pilot.tuning.acceptance_m:
                    self.destination = None
                    self._stay = Stay(pilot)
                    self.aimed = pilot.spec.kind is Kind.ROVER
                    pilot.send(MAVLink_mission_item_reached_message(0))
                    return Drive(0.0)
        return self.reach(destination, yaw_rad=self.yaw_rad)

    def _turned(self, demand: Demand) -> Demand:
        if self.yaw_rad is not None and isinstance(demand, Reach | Go):
            return replace(demand, yaw_rad=self.yaw_rad)
        return demand
