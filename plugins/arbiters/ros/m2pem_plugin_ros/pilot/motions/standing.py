"""Standing: to stop, and to hold for a time."""

from m2pem_plugin_ros.pilot.motions.motion import Motion
from m2pem_plugin_ros.pilot.wishes import Wishes
from m2pem_plugin_ros.pilot.words import STAND, Ending, Scene, Wish
from m2pem_plugin_ros.pose import Pose
from m2pem_plugin_ros.settings import Bounds


class Hold(Motion):
    """Stand for `duration`, counted from when it stands; else until it stands."""

    name = "hold"
    steered = False

    def __init__(self, wishes: Wishes, bounds: Bounds) -> None:
        super().__init__(wishes, bounds)
        self._duration_s = wishes.number("duration") or 0.0
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
