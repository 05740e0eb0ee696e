"""Where one vehicle is: from its odometry and its satellite receiver."""

from typing import Protocol

from m2pem.api import GeoPosition
from m2pem_plugin_ros.pose import Pose, Twist


class Localization(Protocol):
    """The latest that is known; `None` before the first."""

    @property
    def pose(self) -> Pose | None:
        """In the fleet's local frame."""
        ...

    @property
    def twist(self) -> Twist | None:
        """In the vehicle's own frame."""
        ...

    @property
    def position(self) -> GeoPosition | None:
        """WGS-84, altitude above mean sea level."""
        ...

    @property
    def age_s(self) -> float:
        """How long ago, on the arbiter's clock, the pose was heard; infinite before the first."""
        ...
