"""What a base does for one behavior, step by step."""

from abc import ABC, abstractmethod
from typing import ClassVar

from m2pem_plugin_ros.behaviors.motion_state import Ending, Place, Scene, Wish
from m2pem_plugin_ros.behaviors.parameters import LocalParameters
from m2pem_plugin_ros.pose import Pose
from m2pem_plugin_ros.settings import Bounds


class Motion(ABC):
    """Made of a request's parameters; raises RefusedError if they cannot be.

    `target`: the vehicle whose state it must be shown, or "". `places`: where it leads.
    `steered`: whether it is we who steer, so that a base which does not move is stuck.
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
    def step(self, scene: Scene) -> Wish | Ending:
        """One step. A success is told when the base stands; of anything else it is stopped."""

    def found_at(self, place: Place, moved_m: float) -> None:  # noqa: B027  # most keep no place
        """The vehicle is at a place that it has not driven to, so far from where it was."""

    def take_up(self) -> None:  # noqa: B027  # most begin anew
        """A part of it was done before: go on from where the base stands, if that can be told."""

    def adjust(self, parameters: LocalParameters) -> None:
        """Go on with these; what is not given, or cannot be changed, stays as it is."""
        self._take_speed(parameters)

    def ends_at(self, pose: Pose) -> bool:
        """Whether who stands so has surely done it, or need not do it."""
        return False

    def _take_speed(self, parameters: LocalParameters) -> None:
        speed = parameters.speed_m_s
        if speed is not None:
            self.speed_m_s = min(speed, self.bounds.speed_m_s)
