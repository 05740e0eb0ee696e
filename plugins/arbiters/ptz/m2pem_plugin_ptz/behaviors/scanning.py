"""To look from one heading to another, no faster than the camera follows."""

import math

import numpy as np
from numpy.typing import NDArray

from m2pem.api import Area
from m2pem_plugin_ptz.behaviors.behavior import BehaviorFailedError, Job
from m2pem_plugin_ptz.behaviors.pointing import THERE_RAD, Aiming
from m2pem_plugin_ptz.camera_model.coverage import next_row, places_of
from m2pem_plugin_ptz.camera_model.field_of_view import View, visible
from m2pem_plugin_ptz.camera_model.frames import Vector
from m2pem_plugin_ptz.camera_model.limits import within
from m2pem_plugin_ptz.camera_model.pose import Eye
from m2pem_plugin_ptz.gimbal import Look

_VIEWS_PER_S = 0.5
"""Without a wish of the mission: what is looked over stays in the picture for two seconds."""

_LINGERS_S = 1.0
"""At the end of a sweep, so long at most for a camera that does not get there quite."""

_BEHIND = 0.25
"""Of the view: when the camera is farther behind, the sweep waits for it."""


class Sweeping(Aiming):
    """Aims along one elevation from a heading to another, which may lie beyond a whole turn."""

    _elevation_rad = 0.0
    _heading_rad = 0.0
    _end_rad = 0.0
    _stepped_s = 0.0
    _ended_s = math.inf

    def wanted(self, at_us: int) -> tuple[float, float]:
        """Towards the heading at which the sweep is."""
        return self.sight.deck(at_us).towards(self._heading_rad, self._elevation_rad)

    @property
    def view(self) -> View:
        """What it sees."""
        return self.sight.view(self.driver.look)

    def seen_rad(self) -> float:
        """What is no farther from the middle is in the picture, wherever it is."""
        return min(self.view.width_rad, self.view.height_rad) / 2

    def speed_rad_s(self) -> float:
        """Of the sweep."""
        wished = self.job.parameters.turn_rate_rad_s or _VIEWS_PER_S * self.view.width_rad
        return min(wished, self.driver.reach.rate_rad_s)

    def set_out(self, start_rad: float, end_rad: float, elevation_rad: float) -> None:
        """Look along this next."""
        self._heading_rad, self._end_rad = start_rad, end_rad
        self._elevation_rad = elevation_rad
        self._ended_s = math.inf

    def sweep(self, elapsed_s: float) -> bool:
        """Go on; whether the end has been looked at.

        Raises:
            BehaviorFailedError: the camera does not turn, or cannot look there for too long.
        """
        passed_s, self._stepped_s = elapsed_s - self._stepped_s, elapsed_s
        turn = self.aim()
        if not self.check_reach(turn, elapsed_s, self.seen_rad()):
            return False
        off, near_rad = self.off(), _BEHIND * 2 * self.seen_rad()
        self.check_turning(off, elapsed_s, near_rad)
        if off > near_rad:
            return False
        left = self._end_rad - self._heading_rad
        step = min(abs(left), self.speed_rad_s() * passed_s)
        self._heading_rad += math.copysign(step, left)
        if abs(left) > step:
            return False
        self._ended_s = min(self._ended_s, elapsed_s)
        return off <= THERE_RAD or elapsed_s - self._ended_s >= _LINGERS_S

    def heading(self) -> tuple[float, float]:
        """The heading and the elevation to which it looks now."""
        look = self.driver.look
        if look is None:
            raise BehaviorFailedError("the camera does not say where it looks")
        return self.sight.deck(self.sight.now_us).heading(look.pan_rad, look.tilt_rad)

    def needs_heading(self) -> str:
        """Why headings mean nothing now; "" if they do."""
        _, _, yaw = self.sight.carrier.turned(self.sight.now_us)
        vehicle = self.sight.carrier.vehicle
        return f"where {vehicle} heads, is not known" if yaw is None else ""


_PROBES = 72


class ScanSector(Sweeping):
    """From one edge to the other, beginning with the nearer one. The sector stays where it is in
    the world while the vehicle turns."""

    name = "ptz_scan_sector"

    def refusal(self) -> str:
        """It must be able to have each heading of the sector in the picture."""
        if reason := self.needs_heading():
            return reason
        deck, middle, half = self.sight.deck(self.sight.now_us), *self._sector()
        elevation = self._elevation()
        for index in range(_PROBES + 1):
            heading = middle - half + 2 * half * index / _PROBES
            turn = self.sight.turn(*deck.towards(heading, elevation))
            if turn.missing_rad > self.seen_rad():
                return f"heading {math.degrees(heading) % 360:.0f} deg is out of reach: {turn.why}"
        return ""

    async def begin(self) -> None:
        """Choose the edge to begin with."""
        middle, half = self._sector()
        elevation = self._elevation()
        here, _ = self.heading()
        away = math.remainder(here - middle, math.tau)
        near = math.copysign(half, away)
        if half > math.pi - 1e-6:
            self.set_out(here, here + math.tau, elevation)  # all round, from where it looks
            return
        self.set_out(middle + near, middle - near, elevation)

    async def step(self, elapsed_s: float) -> bool:
        """Done at the other edge."""
        return self.sweep(elapsed_s)

    def _sector(self) -> tuple[float, float]:
        parameters = self.job.parameters
        return parameters.heading_rad or 0.0, (parameters.number("sector") or 0.0) / 2

    def _elevation(self) -> float:
        """As the mission says, else as it looks."""
        wished = self.job.parameters.elevation_rad
        if wished is not None or self.driver.look is None:
            return wished or 0.0
        return self.heading()[1]


OVERLAP = 0.2
ENOUGH = 0.99
"""Of the area: when so much was seen, and the rest cannot be, it has been looked over."""

_SURE = 0.9
"""Of the picture: its rim does not count, for a place stands for what is around it."""

_ROW = 0.88
"""Of the picture: no row is higher, so that the whole of it counts."""

_MOVED = 0.25
"""Of the view: when what is left has shifted by so much, the row is planned anew."""


class ScanPolygon(Sweeping):
    """In rows, from the farthest to the nearest. What the camera has seen is kept: whatever held it
    up or moved it, it goes on with what is left."""

    name = "ptz_scan_polygon"

    def __init__(self, job: Job) -> None:
        super().__init__(job)
        self._places: Vector = np.empty((0, 3))
        self._seen: NDArray[np.bool_] = np.zeros(0, dtype=bool)
        self._given_up: NDArray[np.bool_] = np.zeros(0, dtype=bool)
        self._row: NDArray[np.intp] | None = None
        self._left_at_start = 0
        self._planned_from: Vector = np.zeros(3)

    def refusal(self) -> str:
        """It must be able to see nearly all of the area from where it is now."""
        if reason := self.sight.carrier.missing():
            return reason
        self._survey()
        eye = self._eye()
        reached = self._reached(eye)
        share = float(reached.mean())
        if share >= ENOUGH:
            self._given_up = ~reached
            return ""
        over = ~visible(eye, self._places)
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
        """Done when everything was in the picture."""
        eye = self._eye()
        self._look(eye)
        left = np.flatnonzero(~self._seen & ~self._given_up)
        if self._row is not None and (self._row_seen() or self._shifted(eye)):
            self._row = None
        if not len(left):
            return self._over()
        if self._row is None:
            self._plan(eye, left)
        if self.sweep(elapsed_s):
            self._look(eye)
            row = self._row
            if row is not None and int((~self._seen[row]).sum()) == self._left_at_start:
                # The camera was there, and saw nothing more of it: nor would it the next time.
                self._given_up[row] = True
            self._row = None
        return False

    # --- inside ---------------------------------------------------------------------------------

    def _eye(self) -> Eye:
        eye = self.sight.eye(self.sight.now_us)
        if eye is None:
            raise BehaviorFailedError(self.sight.carrier.missing())
        return eye

    def _survey(self) -> None:
        area = self.job.parameters.area
        assert isinstance(area, Area)  # the catalogue asks for one
        ground_m = self.sight.carrier.ground_m()
        self._places = places_of(area, self._eye(), self.view, ground_m)
        self._seen = np.zeros(len(self._places), dtype=bool)
        self._given_up = self._seen.copy()

    def _overlap(self) -> float:
        overlap = self.job.parameters.number("overlap")
        return max(OVERLAP if overlap is None else overlap, 1.0 - _ROW)

    def _reached(self, eye: Eye) -> NDArray[np.bool_]:
        """Which places some look within reach has in the picture."""
        vectors = eye.seen(self._places)
        vectors = vectors / np.linalg.norm(vectors, axis=1)[:, None]
        directions = eye.deck.as_pan_zero_sees(vectors)
        reached = within(self.driver.reach, directions, _SURE * self.seen_rad())
        return reached & visible(eye, self._places)

    def _look(self, eye: Eye) -> None:
        """What is in the picture now, has been seen."""
        look: Look | None = self.driver.look
        if look is None:
            return
        left = np.flatnonzero(~self._seen)
        axes = eye.deck.axes(look.pan_rad, look.tilt_rad)
        held = self.view.holds(axes, eye.seen(self._places[left]), _SURE)
        self._seen[left[held]] = True

    def _row_seen(self) -> bool:
        return bool(self._seen[self._row].all())

    def _shifted(self, eye: Eye) -> bool:
        """Whether the vehicle has moved so far that what is left is elsewhere in the picture."""
        moved = float(np.linalg.norm(eye.place - self._planned_from))
        if moved < 0.01 or self._row is None:
            return False
        nearest = float(np.linalg.norm(self._places[self._row] - eye.place, axis=1).min())
        return moved > nearest * _MOVED * 2 * self.seen_rad()

    def _plan(self, eye: Eye, left: NDArray[np.intp]) -> None:
        here, _ = self.heading()
        row = next_row(
            eye.seen(self._places), left, self.view, self._overlap(), here, self._stop(eye)
        )
        self._row, self._planned_from = row.points, eye.place
        self._left_at_start = len(row.points)
        self.set_out(row.start_rad, row.end_rad, row.elevation_rad)

    def _stop(self, eye: Eye) -> float | None:
        """The heading over which the camera cannot turn."""
        reach = self.driver.reach
        low, high = reach.pan_rad
        if reach.endless or high - low > math.tau + 1e-6:
            return None
        heading, _ = eye.deck.heading((low + high) / 2 + math.pi, 0.0)
        return heading

    def _over(self) -> bool:
        share = float(self._seen.mean())
        if share >= ENOUGH:
            return True
        raise BehaviorFailedError(
            f"only {_percent(share)} of the area could be looked over: the rest is out of reach"
        )


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %"
