"""The legs of a mission: one item of navigation each, from its beginning until it is done."""

import math
from collections.abc import Mapping

from m2pem_plugin_mavlink.simulator.dynamics import (
    CircleSetpoint,
    MotionSetpoint,
    NoThrust,
    PositionSetpoint,
)
from m2pem_plugin_mavlink.simulator.geometry import Location, Point, wrapped_rad
from m2pem_plugin_mavlink.simulator.interfaces import AutopilotInterface, Maneuver
from m2pem_plugin_mavlink.simulator.maneuvers import ReturnToLaunch, descend_to_land
from m2pem_plugin_mavlink.simulator.missions.plan import Item
from m2pem_plugin_mavlink.simulator.specification import SURFACE, Kind

NAV_TAKEOFF = 22


class Leg(Maneuver):
    """Goes to the item's place, and is done there. `done`: go on to the next item."""

    done = False

    def __init__(self, autopilot: AutopilotInterface, item: Item) -> None:
        super().__init__(autopilot)
        self.item = item
        self.place = self._place()
        self._there_s = -1.0

    def _place(self) -> Point:
        """Where it says, or where the vehicle is; at its height, or (0) at the present one."""
        autopilot, item = self.autopilot, self.item
        point = autopilot.position
        if item.has_place:
            point = autopilot.frame.to_point(Location(item.latitude_deg, item.longitude_deg, 0.0))
        if autopilot.spec.kind in SURFACE:
            return point.at_height(0.0)
        if item.z == 0 and not item.has_place:
            return point.at_height(autopilot.body.up_m)
        return point.at_height(autopilot.guided.up_m(item.z, item.frame))

    @property
    def arrived(self) -> bool:
        """It is within the radius of acceptance; copters of PX4 take that of the item."""
        autopilot, radius_m = self.autopilot, self.autopilot.tuning.acceptance_m
        if (autopilot.spec.firmware, autopilot.spec.kind) == ("px4", Kind.COPTER):
            radius_m = self.item.param2 or radius_m
        radius_m = max(radius_m, 0.5)
        near = autopilot.position.distance_m(self.place) <= radius_m
        return near and abs(self.place.up_m - autopilot.body.up_m) <= max(radius_m, 2.0)

    def step(self, dt_s: float) -> MotionSetpoint:
        """Go there; once there, whatever is to be done there."""
        if self._there_s < 0 and self.arrived:
            self._there_s = 0.0
        if self._there_s < 0:
            return self.reach(self.place)
        self._there_s += dt_s
        return self.there()

    def there(self) -> MotionSetpoint:
        """It has arrived: wait as long as the first parameter says (planes don't wait)."""
        plane = self.autopilot.spec.kind is Kind.PLANE
        self.done = plane or self._there_s > self.item.param1
        return self.stay(self.place)


class Takeoff(Leg):
    """Climb to the height; a plane does so along its heading."""

    def _place(self) -> Point:
        autopilot = self.autopilot
        up_m = autopilot.guided.up_m(self.item.z, self.item.frame)
        if autopilot.spec.kind is Kind.PLANE:
            return autopilot.position.moved(autopilot.body.yaw_rad, 3000.0).at_height(up_m)
        return autopilot.position.at_height(up_m)

    _begun = False

    def step(self, dt_s: float) -> MotionSetpoint:
        """Up."""
        if not self._begun and self.autopilot.body.on_ground:
            self.autopilot.log_event("takeoff", "mission")
        self._begun = True
        near_m = 2.0 if self.autopilot.spec.kind is Kind.PLANE else 0.5
        self.done = self.place.up_m - self.autopilot.body.up_m <= near_m
        self.autopilot.modes.maneuver.taking_off = not self.done
        yaw_rad = None if self.autopilot.spec.kind is Kind.PLANE else self.autopilot.body.yaw_rad
        return self.reach(self.place, yaw_rad=yaw_rad)


class Loiter(Leg):
    """Stay there for ever."""

    def there(self) -> MotionSetpoint:
        """Stay, or go around if there is a radius."""
        return self.stay(self.place)


class LoiterTime(Loiter):
    """Stay there as many seconds as the first parameter says."""

    def there(self) -> MotionSetpoint:
        """Stay."""
        self.done = self._there_s >= self.item.param1
        return super().there()


class LoiterLaps(Leg):
    """Go around as often as the first parameter says; the third is the radius."""

    _turned_rad = 0.0
    _bearing_rad: float | None = None

    def step(self, dt_s: float) -> MotionSetpoint:
        """Go around, and count."""
        autopilot = self.autopilot
        radius_m = self.item.param3 or autopilot.tuning.loiter_radius_m
        distance_m = autopilot.position.distance_m(self.place)
        bearing = self.place.bearing_rad(autopilot.position)
        if abs(distance_m - abs(radius_m)) < max(2.0, abs(radius_m) / 3):
            if self._bearing_rad is not None:
                self._turned_rad += abs(wrapped_rad(bearing - self._bearing_rad))
            self._bearing_rad = bearing
        self.done = self._turned_rad >= math.tau * self.item.param1
        return CircleSetpoint(self.place, radius_m, autopilot.modes.speed_mps)


class LoiterToAltitude(Leg):
    """Go there, and be done at the height."""

    def there(self) -> MotionSetpoint:
        """It was there at that height."""
        self.done = True
        return self.stay(self.place)


class Px4Takeoff(LoiterToAltitude):
    """Climb if it is on the ground, and go to the item's place; its first parameter is no
    time."""

    def __init__(self, autopilot: AutopilotInterface, item: Item) -> None:
        super().__init__(autopilot, item)
        self._climb = Takeoff(autopilot, item) if autopilot.body.on_ground else None

    def step(self, dt_s: float) -> MotionSetpoint:
        """Up, then there."""
        if self._climb is not None and not self._climb.done:
            return self._climb.step(dt_s)
        return super().step(dt_s)


class Return(Leg):
    """RTL, within the mission."""

    def __init__(self, autopilot: AutopilotInterface, item: Item) -> None:
        super().__init__(autopilot, item)
        self._return = ReturnToLaunch(autopilot)
        self._return.begin()

    def step(self, dt_s: float) -> MotionSetpoint:
        """Home; there a copter has landed, a rover has stopped, a plane circles."""
        autopilot = self.autopilot
        if autopilot.spec.kind is Kind.COPTER and self._return.arrived and autopilot.body.on_ground:
            # Its motors stop when that was reported.
            self.done = True
            return NoThrust()
        setpoint = self._return.step(dt_s)
        self.done = self._return.arrived and autopilot.spec.kind in SURFACE
        return setpoint


class Land(Leg):
    """Go there at the present height, and come down; a plane glides there."""

    def _place(self) -> Point:
        up_m = self.autopilot.body.up_m
        return super()._place().at_height(up_m)

    def step(self, dt_s: float) -> MotionSetpoint:
        """Come down."""
        if self.autopilot.spec.kind is not Kind.PLANE:
            return super().step(dt_s)
        autopilot = self.autopilot
        if autopilot.body.on_ground:
            if autopilot.body.ground_speed_mps < 1.0:
                self.done = True
                autopilot.arming.disarm_after_landing()
            return NoThrust()
        seconds = autopilot.position.distance_m(self.place) / max(
            autopilot.body.ground_speed_mps, 1.0
        )
        sink_mps = min(autopilot.tuning.descent_mps, autopilot.body.up_m / max(seconds, 1.0))
        speed_mps = autopilot.modes.speed_mps
        return PositionSetpoint(self.place.at_height(-10.0), speed_mps, 0.0, max(sink_mps, 0.5))

    def there(self) -> MotionSetpoint:
        """Down; on the ground the motors stop."""
        setpoint = descend_to_land(self, self.place)
        self.done = self.autopilot.body.on_ground
        return setpoint


class Delay(Leg):
    """Wait as many seconds as the first parameter says."""

    def step(self, dt_s: float) -> MotionSetpoint:
        """Wait here."""
        self._there_s = max(self._there_s, 0.0) + dt_s
        self.done = self._there_s >= self.item.param1
        return self.stay(self.place)

    def _place(self) -> Point:
        return self.autopilot.position


LEGS: Mapping[int, type[Leg]] = {
    16: Leg,
    17: Loiter,
    18: LoiterLaps,
    19: LoiterTime,
    20: Return,
    21: Land,
    NAV_TAKEOFF: Takeoff,
    31: LoiterToAltitude,
    82: Leg,
    93: Delay,
}
"""By MAV_CMD; one for each of `plan.NAVIGATION`."""


def leg_of(autopilot: AutopilotInterface, item: Item) -> Leg:
    """What flies an item of navigation."""
    if item.command == NAV_TAKEOFF and not autopilot.firmware.is_ardupilot:
        return Px4Takeoff(autopilot, item)
    return LEGS[item.command](autopilot, item)
