"""The behaviors `ptz_scan_sector` and `ptz_scan_polygon`."""

import math
from collections.abc import Mapping

import numpy as np
import pymap3d
from numpy.typing import NDArray

from m2pem.api import Area, Value, convex_hull, raw_parameters
from m2pem_plugin_ptz.behaviors.behavior import REPORTED_SHARE, BehaviorContext, BehaviorFailedError
from m2pem_plugin_ptz.behaviors.pointing import THERE_RAD, Pointing
from m2pem_plugin_ptz.camera_model.coverage import next_row, points_in_area
from m2pem_plugin_ptz.camera_model.field_of_view import FieldOfView, visible
from m2pem_plugin_ptz.camera_model.frames import Vector
from m2pem_plugin_ptz.camera_model.limits import within_reach
from m2pem_plugin_ptz.camera_model.pose import CameraPose
from m2pem_plugin_ptz.gimbal import PanTiltZoom

_VIEWS_PER_S = 0.5
"""Default speed in fields of view per second: a point stays in the picture for two seconds."""

_LINGERS_S = 1.0
"""Longest wait at the end of a sweep for a camera that stops beside it."""

_BEHIND = 0.25
"""The sweep waits for a camera that is behind by more than this fraction of the field of view."""


class Sweep(Pointing):
    """Points along one elevation from a heading to another, which may be more than a turn away."""

    _elevation_rad = 0.0
    _heading_rad = 0.0
    _end_rad = 0.0
    _stepped_s = 0.0
    _ended_s = math.inf

    def target_angles(self, at_us: int) -> tuple[float, float]:
        """Return the angles of the current heading of the sweep."""
        return self.model.mount_frame(at_us).towards(self._heading_rad, self._elevation_rad)

    @property
    def field_of_view(self) -> FieldOfView:
        """The field of view at the current zoom."""
        return self.model.field_of_view(self.driver.ptz)

    def half_view_rad(self) -> float:
        """Return the angle from the center within which a point is certainly in view."""
        return min(self.field_of_view.width_rad, self.field_of_view.height_rad) / 2

    def speed_rad_s(self) -> float:
        """Return the speed of the sweep."""
        rate_rad_s = (
            self.context.parameters.turn_rate_rad_s or _VIEWS_PER_S * self.field_of_view.width_rad
        )
        return min(rate_rad_s, self.driver.reach.rate_rad_s)

    def start_sweep(self, start_rad: float, end_rad: float, elevation_rad: float) -> None:
        """Start a sweep."""
        self._heading_rad, self._end_rad = start_rad, end_rad
        self._elevation_rad = elevation_rad
        self._ended_s = math.inf

    def sweep(self, elapsed_s: float) -> bool:
        """Continue the sweep, and return whether its end was reached.

        Raises:
            BehaviorFailedError: the camera does not turn, or cannot look there for too long.
        """
        passed_s, self._stepped_s = elapsed_s - self._stepped_s, elapsed_s
        reachable = self.point_ahead()
        if not self.check_reach(reachable, elapsed_s, self.half_view_rad()):
            return False
        pointing_error_rad, near_rad = self.pointing_error_rad(), _BEHIND * 2 * self.half_view_rad()
        self.check_progress(pointing_error_rad, elapsed_s, near_rad)
        if pointing_error_rad > near_rad:
            return False
        left = self._end_rad - self._heading_rad
        step = min(abs(left), self.speed_rad_s() * passed_s)
        self._heading_rad += math.copysign(step, left)
        if abs(left) > step:
            return False
        self._ended_s = min(self._ended_s, elapsed_s)
        return pointing_error_rad <= THERE_RAD or elapsed_s - self._ended_s >= _LINGERS_S

    def heading(self) -> tuple[float, float]:
        """Return heading and elevation of the camera."""
        ptz = self.driver.ptz
        if ptz is None:
            raise BehaviorFailedError("the camera does not report its direction")
        return self.model.mount_frame(self.model.now_us).heading(ptz.pan_rad, ptz.tilt_rad)

    def needs_heading(self) -> str:
        """Return why headings cannot be computed now; "" if they can."""
        _, _, yaw = self.model.vehicle_pose.attitude(self.model.now_us)
        vehicle = self.model.vehicle_pose.vehicle
        return f"the heading of {vehicle} is not known" if yaw is None else ""


_PROBES = 72


class ScanSector(Sweep):
    """Scan a sector from its nearer edge to the other. The sector stays fixed in the world while
    the vehicle turns."""

    name = "ptz_scan_sector"
    _reported_rad = 0.0
    """How much was left when that was last reported."""

    def refusal(self) -> str:
        """Return which heading of the sector is not within reach."""
        if reason := self.needs_heading():
            return reason
        mount_frame, middle, half = self.model.mount_frame(self.model.now_us), *self._sector()
        elevation = self._elevation()
        for index in range(_PROBES + 1):
            heading = middle - half + 2 * half * index / _PROBES
            reachable = self.model.nearest_reachable(*mount_frame.towards(heading, elevation))
            if reachable.missing_rad > self.half_view_rad():
                degrees = math.degrees(heading) % 360
                return f"heading {degrees:.0f} deg is out of reach: {reachable.why}"
        return ""

    async def begin(self) -> None:
        """Choose the edge to begin with."""
        middle, half = self._sector()
        elevation = self._elevation()
        here, _ = self.heading()
        away = math.remainder(here - middle, math.tau)
        near = math.copysign(half, away)
        self._reported_rad = 2 * half
        if half > math.pi - 1e-6:
            self.start_sweep(here, here + math.tau, elevation)  # all round, from where it looks
            return
        self.start_sweep(middle + near, middle - near, elevation)

    async def step(self, elapsed_s: float) -> bool:
        """Return whether the sweep has reached the other edge."""
        return self.sweep(elapsed_s)

    def left(self, least: float = REPORTED_SHARE) -> Mapping[str, Value] | None:
        """Return the sector from the present heading to the other edge."""
        left_rad = abs(self._end_rad - self._heading_rad)
        if self._reported_rad - left_rad < least * 2 * self._sector()[1]:
            return None
        self._reported_rad = left_rad
        middle_rad = (self._heading_rad + self._end_rad) / 2
        return {
            "heading": f"{math.degrees(middle_rad) % 360:.3f} deg",
            "sector": f"{math.degrees(left_rad):.3f} deg",
        }

    def _sector(self) -> tuple[float, float]:
        parameters = self.context.parameters
        return parameters.heading_rad or 0.0, (parameters.number("sector") or 0.0) / 2

    def _elevation(self) -> float:
        """Return the elevation of the mission; otherwise the current one."""
        elevation_rad = self.context.parameters.elevation_rad
        if elevation_rad is not None or self.driver.ptz is None:
            return elevation_rad or 0.0
        return self.heading()[1]


OVERLAP = 0.2
ENOUGH = 0.99
"""An area counts as scanned when this fraction was seen and the rest is out of reach."""

_SURE = 0.9
"""Fraction of the picture that counts: a point stands for the ground around it, which must be in
the picture too."""

_ROW = 0.88
"""Greatest height of a row, as a fraction of the picture, so that the whole row counts."""

_MOVED = 0.25
"""A row that has shifted by this fraction of the field of view is planned again."""


class ScanPolygon(Sweep):
    """Scan an area in rows, from the farthest to the nearest. The points that were seen are kept,
    so that an interrupted scan continues with the rest."""

    name = "ptz_scan_polygon"

    def __init__(self, context: BehaviorContext) -> None:
        super().__init__(context)
        self._points: Vector = np.empty((0, 3))
        self._seen: NDArray[np.bool_] = np.zeros(0, dtype=bool)
        self._given_up: NDArray[np.bool_] = np.zeros(0, dtype=bool)
        self._row: NDArray[np.intp] | None = None
        self._left_at_start = 0
        self._planned_from: Vector = np.zeros(3)
        self._reported = 0.0

    def refusal(self) -> str:
        """Return why too much of the area is out of reach from the current pose."""
        if reason := self.model.vehicle_pose.missing():
            return reason
        self._make_points()
        camera_pose = self._camera_pose()
        reached = self._reached(camera_pose)
        share = float(reached.mean())
        if share >= ENOUGH:
            self._given_up = ~reached
            return ""
        over = ~visible(camera_pose, self._points)
        if float(over.mean()) > 1 - ENOUGH:
            return f"{_percent(over.mean())} of the area is beyond the horizon of the camera"
        reach = self.driver.reach
        pan = (
            "all round"
            if reach.endless
            else " to ".join(f"{math.degrees(end):.0f}" for end in reach.pan_rad)
        )
        tilt = " to ".join(f"{math.degrees(end):.0f}" for end in reach.tilt_rad)
        return f"only {_percent(share)} of the area is within reach: pan {pan}, tilt {tilt} deg"

    async def step(self, elapsed_s: float) -> bool:
        """Return whether all points were in the picture."""
        camera_pose = self._camera_pose()
        self._mark_seen(camera_pose)
        left = np.flatnonzero(~self._seen & ~self._given_up)
        if self._row is not None and (self._row_seen() or self._shifted(camera_pose)):
            self._row = None
        if not len(left):
            return self._check_coverage()
        if self._row is None:
            self._plan(camera_pose, left)
        if self.sweep(elapsed_s):
            self._mark_seen(camera_pose)
            row = self._row
            if row is not None and int((~self._seen[row]).sum()) == self._left_at_start:
                # The camera pointed at the row and saw no new point; another sweep would not
                # either.
                self._given_up[row] = True
            self._row = None
        return False

    def left(self, least: float = REPORTED_SHARE) -> Mapping[str, Value] | None:
        """Return the area around what was not seen. Of an area that is not convex, that would reach
        beyond it: all is left."""
        area = self.context.parameters.area
        share = float(self._seen.mean()) if len(self._seen) else 0.0
        if not isinstance(area, Area) or share - self._reported < least or not _is_convex(area):
            return None
        latitudes, longitudes, _ = pymap3d.ecef2geodetic(*self._points[~self._seen].T)
        hull = convex_hull(zip(latitudes.tolist(), longitudes.tolist(), strict=True))
        if len(hull) < 3:
            return None
        self._reported = share
        up_m = area.rings[0][0][2]
        ring = tuple((*corner, up_m) for corner in (*hull, hull[0]))
        return raw_parameters({"area": Area((ring,), area.altitude_frame)})

    # --- inside ---------------------------------------------------------------------------------

    def _camera_pose(self) -> CameraPose:
        camera_pose = self.model.camera_pose(self.model.now_us)
        if camera_pose is None:
            raise BehaviorFailedError(self.model.vehicle_pose.missing())
        return camera_pose

    def _make_points(self) -> None:
        area = self.context.parameters.area
        assert isinstance(area, Area)  # the catalogue asks for one
        ground_m = self.model.vehicle_pose.ground_m()
        self._points = points_in_area(area, self._camera_pose(), self.field_of_view, ground_m)
        self._seen = np.zeros(len(self._points), dtype=bool)
        self._given_up = self._seen.copy()

    def _overlap(self) -> float:
        overlap = self.context.parameters.number("overlap")
        return max(OVERLAP if overlap is None else overlap, 1.0 - _ROW)

    def _reached(self, camera_pose: CameraPose) -> NDArray[np.bool_]:
        """Return which points are in the picture for some reachable direction."""
        vectors = camera_pose.vector_to(self._points)
        vectors = vectors / np.linalg.norm(vectors, axis=1)[:, None]
        directions = camera_pose.mount_frame.as_pan_zero_sees(vectors)
        reached = within_reach(self.driver.reach, directions, _SURE * self.half_view_rad())
        return reached & visible(camera_pose, self._points)

    def _mark_seen(self, camera_pose: CameraPose) -> None:
        """Mark the points in the current picture as seen."""
        ptz: PanTiltZoom | None = self.driver.ptz
        if ptz is None:
            return
        left = np.flatnonzero(~self._seen)
        axes = camera_pose.mount_frame.axes(ptz.pan_rad, ptz.tilt_rad)
        held = self.field_of_view.holds(axes, camera_pose.vector_to(self._points[left]), _SURE)
        self._seen[left[held]] = True

    def _row_seen(self) -> bool:
        return bool(self._seen[self._row].all())

    def _shifted(self, camera_pose: CameraPose) -> bool:
        """Return whether the vehicle has moved so far that the row has shifted in the picture."""
        moved = float(np.linalg.norm(camera_pose.place - self._planned_from))
        if moved < 0.01 or self._row is None:
            return False
        nearest = float(np.linalg.norm(self._points[self._row] - camera_pose.place, axis=1).min())
        return moved > nearest * _MOVED * 2 * self.half_view_rad()

    def _plan(self, camera_pose: CameraPose, left: NDArray[np.intp]) -> None:
        here, _ = self.heading()
        row = next_row(
            camera_pose.vector_to(self._points),
            left,
            self.field_of_view,
            self._overlap(),
            here,
            self._stop_heading(camera_pose),
        )
        self._row, self._planned_from = row.points, camera_pose.place
        self._left_at_start = len(row.points)
        self.start_sweep(row.start_rad, row.end_rad, row.elevation_rad)

    def _stop_heading(self, camera_pose: CameraPose) -> float | None:
        """Return the heading over which the camera cannot turn; None if it can turn all round."""
        reach = self.driver.reach
        low, high = reach.pan_rad
        if reach.endless or high - low > math.tau + 1e-6:
            return None
        heading, _ = camera_pose.mount_frame.heading((low + high) / 2 + math.pi, 0.0)
        return heading

    def _check_coverage(self) -> bool:
        share = float(self._seen.mean())
        if share >= ENOUGH:
            return True
        raise BehaviorFailedError(
            f"only {_percent(share)} of the area could be scanned: the rest is out of reach"
        )


def _is_convex(area: Area) -> bool:
    """Whether an area has no hole, and all of its corners are on its convex hull."""
    corners = {corner[:2] for corner in area.rings[0]}
    return len(area.rings) == 1 and len(convex_hull(corners)) == len(corners)


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %"
