"""A detector such as a ground-penetrating radar: it finds what the vehicle comes near to."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from m2pem_plugin_ros.pose import Pose


@dataclass(frozen=True, slots=True)
class Target:
    """Something to be found, in the fleet's local frame."""

    type: str
    east_m: float
    north_m: float


@dataclass(frozen=True, slots=True)
class DetectorSpec:
    """`payload`: its name in the fleet, "" if it has none; `topic`: as the vehicle resolves it;
    `type`: of what it finds when it is told to find something; `plain`: it publishes only types,
    as std_msgs/String."""

    payload: str = ""
    topic: str = "detections"
    type: str = "gpr"
    range_m: float = 5.0
    targets: Sequence[Target] = ()
    plain: bool = False


@dataclass(frozen=True, slots=True)
class Found:
    """A detection: what, and where in the local frame."""

    type: str
    east_m: float
    north_m: float


class Detector:
    """Finds each target once."""

    def __init__(self, spec: DetectorSpec) -> None:
        self.spec = spec
        self._hidden = list(spec.targets)

    @property
    def hidden(self) -> int:
        """How many targets it has not found."""
        return len(self._hidden)

    def find(self, pose: Pose) -> Iterator[Found]:
        """What comes into its reach there."""
        if not self._hidden:
            return
        for target in list(self._hidden):
            distance_m = math.hypot(target.east_m - pose.east_m, target.north_m - pose.north_m)
            if distance_m <= self.spec.range_m:
                self._hidden.remove(target)
                yield Found(target.type, target.east_m, target.north_m)
