"""What a payload does for each behavior: where it looks, when."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from m2pem.simulation.corners import turned
from m2pem.simulation.local_parameters import LocalParameters, RefusedError
from m2pem.simulation.manoeuvres import nearest_edge, yaw_of
from m2pem.simulation.phases import Look, Pose, Slew, Vector
from m2pem.simulation.settings import Gimbal
from m2pem.simulation.shots import Shots
from m2pem.simulation.track import Plan

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
    points = [*ring, nearest_edge(ring, carrier.place)]
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
