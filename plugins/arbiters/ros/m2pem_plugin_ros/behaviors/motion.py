"""The interface of a motion: what a base does for one behavior, in steps."""

from abc import ABC, abstractmethod
from typing import ClassVar

from m2pem_plugin_ros.behaviors.motion_state import DesiredMotion, Ending, MotionState, Place
from m2pem_plugin_ros.behaviors.parameters import LocalParameters
from m2pem_plugin_ros.pose import Pose
from m2pem_plugin_ros.settings import Bounds


class Motion(ABC):
    """One motion, made from the parameters of a request. Raises RefusedError if they cannot be
    used.

    `target`: the vehicle whose state the motion needs, or "". `places`: where the motion leads to.

    `steered`: m2pem steers, so that a base that does not move is stuck.
    """

    name: ClassVar[str]
    steered: ClassVar[bool] = True

    def __init__(self, parameters: LocalParameters, bounds: Bounds) -> None:
        self.bounds = bounds
        self.target = ""
        self.places: tuple[Place, ...] = ()
        self.speed_m_s = bounds.speed_m_s
        self._take_speed(parameters)

    @abstractmethod
    def step(self, state: MotionState) -> DesiredMotion | Ending:
        """Return the desired motion, or how the motion ends. A success is reported when the base
        stands."""

    def found_at(self, place: Place, moved_m: float) -> None:  # noqa: B027  # most keep no place
        """Continue from a position that the base did not drive to, `moved_m` from its last one."""

    def take_up(self) -> None:  # noqa: B027  # most begin anew
        """Continue from where the base stands, as a part of the motion was done before a
        restart."""

    def adjust(self, parameters: LocalParameters) -> None:
        """Change parameters. Those that are missing, or cannot be changed, stay as they are."""
        self._take_speed(parameters)

    def ends_at(self, pose: Pose) -> bool:
        """Return whether a base that stands at `pose` has certainly completed the motion."""
        return False

    def _take_speed(self, parameters: LocalParameters) -> None:
        speed = parameters.speed_m_s
        if speed is not None:
            self.speed_m_s = min(speed, self.bounds.speed_m_s)
