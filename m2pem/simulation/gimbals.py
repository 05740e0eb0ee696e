"""What a payload does for each behavior: where it looks when, and its image captures."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime

import msgspec

from m2pem.api.arbiter import BehaviorId
from m2pem.api.telemetry import GeoPosition
from m2pem.geo.polyline import Polyline
from m2pem.mission.values import Value
from m2pem.simulation.course import RefusedError, turned
from m2pem.simulation.local_parameters import LocalParameters
from m2pem.simulation.manoeuvres import yaw_of
from m2pem.simulation.segments import Look, Pose, Slew, Vector
from m2pem.simulation.settings import Gimbal
from m2pem.simulation.trajectory import Plan

_ROUNDING_S = 1e-6


class Shots(msgspec.Struct, frozen=True):
    """Pictures: `count` of them, every `every_s`, each of which takes `shutter_s`. A video, which
    begins with the behavior at `began_us`, if `count` is 0."""

    count: int = 0
    every_s: float = 0.0
    shutter_s: float = 0.0
    began_us: int = 0

    def time_scaled(self, factor: float) -> "Shots":
        """Return the same pictures, each of which takes `factor` times as long."""
        return Shots(self.count, self.every_s * factor, self.shutter_s * factor, self.began_us)

    def taken(self, after_s: float) -> int:
        """How many pictures there are after so much of the behavior's own time."""
        passed_s = after_s - self.shutter_s + _ROUNDING_S
        if passed_s < 0 or self.every_s <= 0:
            return 0 if passed_s < 0 else self.count
        return min(self.count, int(passed_s / self.every_s) + 1)

    def outputs(
        self,
        behavior: BehaviorId,
        after_s: float,
        now_us: int,
        position: GeoPosition | None,
        *,
        done: bool,
    ) -> Mapping[str, Value]:
        """What has come of it now. `done`: all of it, whatever the time."""
        stem = "sim:" + behavior.replace(".", "/")
        if not self.count:
            return {"video.file": f"{stem}.mp4", "video.time": _iso(self.began_us)}
        taken = self.count if done else self.taken(after_s)
        if not taken:
            return {}
        since_s = max(0.0, after_s - (taken - 1) * self.every_s - self.shutter_s)
        files: list[Value] = [f"{stem}_{number}.jpg" for number in range(1, taken + 1)]
        place: Value = None
        if position is not None:
            place = [position.latitude_deg, position.longitude_deg, position.altitude_m]
        return {
            "picture.file": files[-1],
            "picture.files": files,
            "picture.position": place,
            "picture.time": _iso(now_us - round(since_s * 1e6)),
        }


def _iso(time_us: int) -> str:
    seconds, rest = divmod(time_us, 1_000_000)
    time = datetime.fromtimestamp(seconds, UTC).replace(microsecond=rest)
    return time.isoformat(timespec="microseconds").replace("+00:00", "Z")


DEFAULT_OVERLAP = 0.2
MAST_M = 2.0
"""How high on its vehicle a payload looks from."""

AIM_STEP_S = 1.0
"""How often a tracking payload looks where its target is."""


@dataclass(frozen=True, slots=True)
class Mount:
    """A payload as its behavior sees it. `carrier`: how its vehicle stands, None if unknown."""

    name: str
    gimbal: Gimbal
    look: Look
    carrier: Pose | None
    ground_up_m: float = 0.0

    def pose(self) -> Pose:
        """How its vehicle stands.

        Raises:
            RefusedError: it is not known.
        """
        if self.carrier is None:
            raise RefusedError(f"the position of the vehicle that carries {self.name} is not known")
        return self.carrier


@dataclass(frozen=True, slots=True)
class Gaze:
    """What a payload does. After `plan` it keeps aiming at `aim`, if there is one.

    `aim`: a vehicle's name, or a place. `limit_s`: how long the aiming lasts; None: for ever.
    `shots`: the pictures or the video that it takes.
    """

    plan: Plan[Look]
    aim: str | Vector | None = None
    limit_s: float | None = None
    shots: Shots | None = None


class _Looks:
    """A plan in the making."""

    def __init__(self, mount: Mount) -> None:
        self._mount = mount
        self._slews: list[Slew] = []
        self.look = mount.look

    def to(self, look: Look, rate_rad_s: float | None = None) -> "_Looks":
        gimbal = self._mount.gimbal
        rate = min(gimbal.slew_rate_rad_s, rate_rad_s or math.inf)
        seconds = max(
            abs(look.pan - self.look.pan) / rate,
            abs(look.tilt - self.look.tilt) / rate,
            abs(look.zoom - self.look.zoom) / gimbal.zoom_rate_s,
        )
        if seconds > 0:
            self._slews.append(Slew(self.look, look, seconds))
        self.look = look
        return self

    def stare(self, seconds: float) -> "_Looks":
        if seconds > 0:
            self._slews.append(Slew(self.look, self.look, seconds))
        return self

    def plan(self) -> Plan[Look]:
        return Plan(self._slews or [Slew(self.look, self.look, 0.0)])


def direction(carrier: Pose, place: Vector) -> tuple[float, float]:
    """Bearing from the bow (clockwise) and elevation of a place, in rad."""
    east, north = place[0] - carrier.place[0], place[1] - carrier.place[1]
    up = place[2] - carrier.place[2] - MAST_M
    level = math.hypot(east, north)
    bearing = turned(math.atan2(north, east), carrier.yaw) if level > 1e-6 else 0.0
    return bearing, math.atan2(up, level) if level > 1e-6 or abs(up) > 1e-6 else 0.0


def within(gimbal: Gimbal, pan: float, tilt: float) -> str:
    """Why the payload cannot look there; "" if it can."""
    if abs(pan) > gimbal.pan_limit_rad + 1e-9:
        return f"bearing {math.degrees(pan):.0f} deg is beyond its pan limit"
    if not gimbal.tilt_low_rad - 1e-9 <= tilt <= gimbal.tilt_high_rad + 1e-9:
        return f"elevation {math.degrees(tilt):.0f} deg is beyond its tilt limits"
    return ""


def aimed(gimbal: Gimbal, look: Look, carrier: Pose, place: Vector) -> Slew:
    """One step of keeping a place in view, as far as the limits let it."""
    pan, tilt = direction(carrier, place)
    pan = max(-gimbal.pan_limit_rad, min(gimbal.pan_limit_rad, pan))
    tilt = max(gimbal.tilt_low_rad, min(gimbal.tilt_high_rad, tilt))
    reach = gimbal.slew_rate_rad_s * AIM_STEP_S
    turn = pan - look.pan if gimbal.pan_limit_rad < math.pi else turned(look.pan, pan)
    return Slew(
        look,
        Look(
            look.pan + max(-reach, min(reach, turn)),
            look.tilt + max(-reach, min(reach, tilt - look.tilt)),
            look.zoom,
        ),
        AIM_STEP_S,
    )


def _target(mount: Mount, parameters: LocalParameters) -> tuple[str | Vector, Vector]:
    vehicle = parameters.target_vehicle
    if vehicle is not None:
        return vehicle, parameters.pose_of(vehicle).place
    place = parameters.target_point(mount.ground_up_m)
    return place, place


def _looking(mount: Mount, pan: float, tilt: float) -> Look:
    pan = math.remainder(pan, math.tau)
    problem = within(mount.gimbal, pan, tilt)
    if problem:
        raise RefusedError(f"{mount.name}: {problem}")
    return Look(pan, tilt, mount.look.zoom)


def _point_at(mount: Mount, parameters: LocalParameters) -> Gaze:
    bearing, elevation = parameters.bearing_rad, parameters.elevation_rad
    if bearing is not None and elevation is not None:
        return Gaze(_Looks(mount).to(_looking(mount, bearing, elevation)).plan())
    _, place = _target(mount, parameters)
    pan, tilt = direction(mount.pose(), place)
    return Gaze(_Looks(mount).to(_looking(mount, pan, tilt)).plan())


def _scan_sector(mount: Mount, parameters: LocalParameters) -> Gaze:
    middle = turned(yaw_of(parameters.heading_rad or 0.0), mount.pose().yaw)
    half = (parameters.number("sector") or 0.0) / 2
    tilt = parameters.elevation_rad
    tilt = mount.look.tilt if tilt is None else tilt
    limit = mount.gimbal.pan_limit_rad
    for pan in (middle - half, middle + half):
        # A payload that turns all round has no edge in the middle of a sector.
        if limit < math.pi:
            _looking(mount, pan, tilt)
    _looking(mount, middle, tilt)
    looks = _Looks(mount).to(Look(middle - half, tilt, mount.look.zoom))
    looks.to(Look(middle + half, tilt, mount.look.zoom), parameters.speed_m_s)
    return Gaze(looks.plan())


def _scan_polygon(mount: Mount, parameters: LocalParameters) -> Gaze:
    """Rows of pan across the area as it is seen from the vehicle, from the far edge to the near."""
    area = parameters.area
    if area is None:
        raise RefusedError("parameter 'area': there is none")
    carrier = mount.pose()
    ring = parameters.rings(area)[0]
    # The steepest look down is to the nearest point, which need not be a corner.
    points = [*ring, Polyline(ring).nearest(carrier.place[:2])]
    seen = [direction(carrier, (east, north, mount.ground_up_m)) for east, north in points]
    middle = seen[0][0]
    pans = [middle + turned(middle, pan) for pan, _ in seen]
    tilts = [tilt for _, tilt in seen]
    overlap = parameters.number("overlap")
    row = mount.gimbal.view_rad / mount.look.zoom
    row *= 1 - (DEFAULT_OVERLAP if overlap is None else overlap)
    rows = max(1, math.ceil((max(tilts) - min(tilts)) / row - 1e-9))
    step = (max(tilts) - min(tilts)) / rows
    looks = _Looks(mount)
    for index in range(rows):
        tilt = max(tilts) - step * (index + 0.5)
        ends = (min(pans), max(pans))
        first, last = ends if index % 2 == 0 else ends[::-1]
        if mount.gimbal.pan_limit_rad < math.pi:
            _looking(mount, first, tilt)
        _looking(mount, last, tilt)
        looks.to(Look(first, tilt, mount.look.zoom))
        looks.to(Look(last, tilt, mount.look.zoom), parameters.speed_m_s)
    return Gaze(looks.plan())


def _track(mount: Mount, parameters: LocalParameters) -> Gaze:
    aim, _ = _target(mount, parameters)
    mount.pose()
    return Gaze(_Looks(mount).plan(), aim, parameters.duration_s)


def _zoom(mount: Mount, parameters: LocalParameters) -> Gaze:
    level = parameters.zoom
    if not 1.0 <= level <= mount.gimbal.zoom_max:
        raise RefusedError(f"parameter 'level': {level:g} is not in 1 to {mount.gimbal.zoom_max:g}")
    return Gaze(_Looks(mount).to(Look(mount.look.pan, mount.look.tilt, level)).plan())


def _take_picture(mount: Mount, parameters: LocalParameters) -> Gaze:
    shutter = mount.gimbal.shutter_s
    shots = Shots(parameters.count, max(parameters.interval_s, shutter), shutter)
    plan = _Looks(mount).stare((shots.count - 1) * shots.every_s + shutter).plan()
    return Gaze(plan, shots=shots)


def _record(mount: Mount, parameters: LocalParameters) -> Gaze:
    seconds = parameters.duration_s
    plan = _Looks(mount).stare(math.inf if seconds is None else seconds).plan()
    return Gaze(plan, shots=Shots())


GAZES: Mapping[str, Callable[[Mount, LocalParameters], Gaze]] = {
    "ptz_point_at": _point_at,
    "ptz_scan_sector": _scan_sector,
    "ptz_scan_polygon": _scan_polygon,
    "ptz_track": _track,
    "zoom": _zoom,
    "take_picture": _take_picture,
    "record_video": _record,
}
"""By behavior's name, for one payload."""
