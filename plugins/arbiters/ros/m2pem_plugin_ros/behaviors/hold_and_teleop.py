"""Standing: to stop, and to hold for a time."""

from m2pem_plugin_ros.behaviors.motion import Motion
from m2pem_plugin_ros.behaviors.motion_state import STAND, Ending, Scene, Wish
from m2pem_plugin_ros.behaviors.parameters import LocalParameters
from m2pem_plugin_ros.pose import Pose
from m2pem_plugin_ros.settings import Bounds


class Hold(Motion):
    """Stand for `duration`, counted from when it stands; else until it stands."""

    name = "hold"
    steered = False

    def __init__(self, parameters: LocalParameters, bounds: Bounds) -> None:
        super().__init__(parameters, bounds)
        self._duration_s = parameters.duration_s or 0.0
        self._stood_s: float | None = None

    def step(self, scene: Scene) -> Wish | Ending:
        """Wait."""
        if self._stood_s is not None:
            self._stood_s += scene.dt_s
        elif scene.stands:
            self._stood_s = 0.0
        over = self._stood_s is not None and self._stood_s >= self._duration_s
        return Ending() if over and scene.stands else STAND

    def ends_at(self, pose: Pose) -> bool:
        """Anywhere, without a duration."""
        return self._duration_s == 0.0


class DriveStop(Hold):
    """Stop."""

    name = "drive_stop"


SLOWEST_M_S = 0.01


class Teleop(Motion):
    """Drive as the stick says, within the base's bounds, until interrupted or for `timeout`.

    A stick that is not heard any more is one that says nothing: the base stands.
    """

    name = "teleop"
    steered = False

    def __init__(self, parameters: LocalParameters, bounds: Bounds) -> None:
        super().__init__(parameters, bounds)
        self._timeout_s = parameters.timeout_s
        self._driven_s = 0.0

    def step(self, scene: Scene) -> Wish | Ending:
        """What the stick says now."""
        self._driven_s += scene.dt_s
        if self._timeout_s is not None and self._driven_s >= self._timeout_s:
            return Ending() if scene.stands else STAND
        stick = scene.stick
        if stick is None:
            return STAND
        if abs(stick.forward_m_s) < SLOWEST_M_S:
            return Wish(0.0, 0.0, stick.yaw_rad_s)
        if self.bounds.turn_radius_m > 0:
            return Wish(stick.forward_m_s, stick.yaw_rad_s / stick.forward_m_s)
        return Wish(stick.forward_m_s, 0.0, stick.yaw_rad_s)
