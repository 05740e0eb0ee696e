"""To look from one heading to another, no faster than the camera follows."""

import math

from m2pem_plugin_ptz.behaviors.aiming import THERE_RAD, Aiming
from m2pem_plugin_ptz.behaviors.behavior import BehaviorFailedError
from m2pem_plugin_ptz.geometry.view import View

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
        wished = self.job.number("speed") or _VIEWS_PER_S * self.view.width_rad
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
