"""A simulated vehicle: where it is, and how full its battery, as functions of time."""

import math

from m2pem.api.arbiter import Connection
from m2pem.api.telemetry import LinkState, VehicleState
from m2pem.mission.catalogue import ResourceId
from m2pem.simulation.course import ALOFT_M, Course, Craft
from m2pem.simulation.frame import FlatFrame
from m2pem.simulation.kinematics import STANDING_LOAD
from m2pem.simulation.manoeuvres import yaw_of
from m2pem.simulation.segments import Pose, Profile, Stand, Travel, Vector
from m2pem.simulation.settings import Settings
from m2pem.simulation.trajectory import Plan, Track, retimed

_PARKING_GAP_M = 10.0
FALL_M_S = 12.0
"""Of an aircraft whose motors have stopped, on average from 20 m."""


class SimVehicle:
    """Begins at its `home`, or (without one) in a row south of the fleet's origin.

    `behavior`: the id of what it is busy with, `doing` the name; "" when free. `held`: whether
    `hold` was called on it. `spare`: full batteries that it has besides the one that it shows.
    """

    def __init__(
        self, connection: Connection, settings: Settings, frame: FlatFrame, place: int, now_us: int
    ) -> None:
        self.id: ResourceId = connection.resource
        self.domain = connection.domain
        self.settings = settings
        self.kinematics = settings.kinematics
        self.behavior = ""
        self.doing = ""
        self.held = False
        self.cruise_m_s = min(
            settings.kinematics.cruise_speed_m_s, settings.kinematics.max_speed_m_s
        )
        self.home = self._home(frame, place)
        self.falls = self.disarmed = False
        self.jumped_m = 0.0
        self.battery = settings.battery
        self.spare = 0.0
        yaw = yaw_of(settings.heading_rad)
        self._driven_m = 0.0
        up = self.home[2] + (settings.altitude_m if self.domain == "air" else 0.0)
        self.track: Track[Pose] = Track(Plan([Stand((*self.home[:2], up), yaw, 0.0, 0.0)]), now_us)

    def _home(self, frame: FlatFrame, place: int) -> Vector:
        if self.settings.home is None:
            return (0.0, -_PARKING_GAP_M * place, 0.0)
        latitude, longitude, altitude = self.settings.home
        up = 0.0 if altitude is None else altitude - frame.origin[2]
        return (*frame.to_place((latitude, longitude)), up)

    def rest(self, now_us: int, then_us: int) -> None:
        """Stand or hover from `then_us` on as it does at `now_us`."""
        pose, self.battery = self.pose(now_us), self.battery_at(now_us)
        self._driven_m = self.driven_m(now_us)
        self.track = Track(Plan([Stand(pose.place, pose.yaw, 0.0, 0.0)]), then_us)

    def pose(self, now_us: int) -> Pose:
        return self.track.at(now_us)

    def craft(self, now_us: int) -> Craft:
        return Craft(
            self.id, self.domain, self.kinematics, self.pose(now_us), self.cruise_m_s, self.home
        )

    def take(self, plan: Plan[Pose], now_us: int) -> None:
        """Follow another plan, which must begin where it is."""
        self.falls = self.disarmed = False
        self.battery = self.battery_at(now_us)
        self._driven_m = self.driven_m(now_us)
        self.track = Track(plan, now_us)

    def driven_m(self, now_us: int) -> float:
        """Return the length of its way in space since it was made, and before that of the plan that
        it was taken up with."""
        return self._driven_m + self.track.driven_m(now_us)

    def stop(self, now_us: int) -> None:
        """Brake straight on, unless it falls."""
        if self.falls:
            return
        self.take(Course(self.craft(now_us)).plan(), now_us)

    def come_down(self, now_us: int) -> None:
        """Brake, and sink to the ground if it flies: the battery is empty."""
        course = Course(self.craft(now_us))
        if self.domain == "air":
            course.climb_to(self.home[2])
        self.take(course.plan(), now_us)

    def fall(self, now_us: int, *, disarmed: bool) -> None:
        """Fall to the ground, if it is in the air: nothing stops it then."""
        pose = self.pose(now_us)
        high_m = pose.place[2] - self.home[2]
        if self.domain == "air" and high_m > 0:
            profile = Profile(high_m, FALL_M_S, FALL_M_S, FALL_M_S, 1.0, 1.0)
            self.take(Plan([Travel(pose.place, (0.0, 0.0, -1.0), pose.yaw, profile)]), now_us)
            self.falls = True
        self.disarmed = disarmed

    def hold(self, now_us: int) -> None:
        """Brake on its path, unless it falls."""
        if self.falls:
            return
        self._count(now_us)
        braking_s = self.pose(now_us).speed / self.kinematics.deceleration_m_s2
        self.track.hold(now_us, braking_s)

    def go_on(self, now_us: int) -> None:
        """Take its path up again."""
        self._count(now_us)
        self.track.go_on(now_us)

    def adjust(self, limit_m_s: float, now_us: int) -> bool:
        """Keep to another speed on the rest of its path; False: it goes on as it did. Who is held
        stays so."""
        tau, _ = self.track.warp.at(now_us)
        speed = self.pose(now_us).speed
        plan = retimed(self.track.plan, tau, speed, limit_m_s, self.kinematics)
        if plan is None:
            return False
        self.take(plan, now_us)
        if self.held:
            self.hold(now_us)
        return True

    def _count(self, now_us: int) -> None:
        # What hovered until now has hovered, even if it stands on the ground later.
        self.battery = self.battery_at(now_us)
        self.track.count_from(now_us)

    def aloft(self, now_us: int) -> bool:
        return self.domain == "air" and self._is_aloft(self.pose(now_us))

    def _is_aloft(self, pose: Pose) -> bool:
        return self.domain == "air" and pose.place[2] - self.home[2] > ALOFT_M

    def battery_at(self, now_us: int) -> float:
        """What is left, as a fraction."""
        # A function of time, as a rehearsal jumps to the moment at which a level is reached. The
        # simulators of plugins integrate in steps instead: by the load that an autopilot reports,
        # or by the distance driven.
        return self._battery(now_us, aloft=self.aloft(now_us))

    def _battery(self, now_us: int, *, aloft: bool) -> float:
        standing = 1.0 if aloft else STANDING_LOAD
        used = self.track.load_s(now_us, standing) / self.kinematics.endurance_s
        return max(0.0, self.battery - used)

    def drained_us(self, level: float, now_us: int) -> int | None:
        """When the battery will be down to `level`, as things go; None: not before it stands.

        What stands on the ground drains too slowly to be watched.
        """
        if math.isinf(self.kinematics.endurance_s):
            return None
        left_s = max(0.0, self.battery_at(now_us) - level) * self.kinematics.endurance_s
        high = now_us + math.ceil(left_s / STANDING_LOAD * 1e6) + 1
        end_us = self.track.end_us
        if end_us is not None and not self.aloft(end_us):
            high = min(high, max(now_us, end_us))
        elif end_us is None and self.track.plan.cycle_from is None and not self.aloft(now_us):
            return None
        if self.battery_at(high) > level:
            return None
        low = now_us
        while high - low > 1:
            middle = (low + high) // 2
            if self.battery_at(middle) > level:
                low = middle
            else:
                high = middle
        return high

    def state(self, now_us: int, frame: FlatFrame) -> VehicleState:
        pose = self.pose(now_us)
        aloft = self._is_aloft(pose)
        battery = max(0.0, self._battery(now_us, aloft=aloft) - self.spare)
        return VehicleState(
            resource=self.id,
            time_us=now_us,
            position=frame.to_position((pose.place[0] + self.jumped_m, *pose.place[1:])),
            altitude_above_home_m=pose.place[2] - self.home[2],
            velocity_enu_m_s=pose.velocity,
            yaw_rad=math.remainder(pose.yaw, math.tau),
            battery_fraction=battery,
            mode=self._mode(aloft),
            armed=(aloft or bool(self.behavior)) and not self.disarmed,
            ready=battery > 0,
            not_ready_reasons=() if battery > 0 else ("the battery is empty",),
            link=LinkState.CONNECTED,
            behavior=self.doing,
        )

    def _mode(self, aloft: bool) -> str:
        if self.held:
            return "hold"
        if self.behavior:
            return "manual" if self.doing == "teleop" else "auto"
        if self.domain == "air":
            return "hover" if aloft else "landed"
        return "standby"


def carrier_of(resource: ResourceId) -> ResourceId:
    """The vehicle of a payload; a vehicle's own id."""
    return ResourceId(resource.partition("/")[0])
