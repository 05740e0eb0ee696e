"""The behaviors in which m2pem does not steer: `hold`, `drive_stop` and `teleop`."""

from m2pem_plugin_ros.behaviors.motion import Motion
from m2pem_plugin_ros.behaviors.motion_state import STANDSTILL, DesiredMotion, Ending, MotionState
from m2pem_plugin_ros.behaviors.parameters import LocalParameters
from m2pem_plugin_ros.pose import Pose
from m2pem_plugin_ros.settings import Bounds


class Hold(Motion):
    """Stand for `duration`, counted from when the base stands; without it, until the base
    stands."""

    name = "hold"
    steered = False

    def __init__(self, parameters: LocalParameters, bounds: Bounds) -> None:
        super().__init__(parameters, bounds)
        self._duration_s = parameters.duration_s or 0.0
        self._stood_s: float | None = None

    def step(self, state: MotionState) -> DesiredMotion | Ending:
        if self._stood_s is not None:
            self._stood_s += state.dt_s
        elif state.stands:
            self._stood_s = 0.0
        over = self._stood_s is not None and self._stood_s >= self._duration_s
        return Ending() if over and state.stands else STANDSTILL

    def ends_at(self, pose: Pose) -> bool:
        """A hold without a duration has ended wherever the base stands."""
        return self._duration_s == 0.0


class DriveStop(Hold):
    """Stop, and end when the base stands."""

    name = "drive_stop"


SLOWEST_M_S = 0.01


class Teleop(Motion):
    """Drive as the joystick commands, within the bounds of the base, until cancelled or for
    `timeout`.

    Without a recent message of the joystick the base stands.
    """

    name = "teleop"
    steered = False

    def __init__(self, parameters: LocalParameters, bounds: Bounds) -> None:
        super().__init__(parameters, bounds)
        self._timeout_s = parameters.timeout_s
        self._driven_s = 0.0

    def step(self, state: MotionState) -> DesiredMotion | Ending:
        self._driven_s += state.dt_s
        if self._timeout_s is not None and self._driven_s >= self._timeout_s:
            return Ending() if state.stands else STANDSTILL
        joystick = state.joystick
        if joystick is None:
            return STANDSTILL
        if abs(joystick.forward_m_s) < SLOWEST_M_S:
            return DesiredMotion(0.0, 0.0, joystick.yaw_rad_s)
        if self.bounds.turn_radius_m > 0:
            return DesiredMotion(joystick.forward_m_s, joystick.yaw_rad_s / joystick.forward_m_s)
        return DesiredMotion(joystick.forward_m_s, 0.0, joystick.yaw_rad_s)
