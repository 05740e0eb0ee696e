"""Behaviors of a plain base (docs/ros.md, "A plain base"). They do no I/O, and use the local
frame."""

from collections.abc import Mapping

from m2pem_plugin_ros.behaviors.follow import Follow
from m2pem_plugin_ros.behaviors.goto import Goto
from m2pem_plugin_ros.behaviors.hold_and_teleop import DriveStop, Hold, Teleop
from m2pem_plugin_ros.behaviors.motion import Motion
from m2pem_plugin_ros.behaviors.motion_state import Ending, Observation, RefusedError, Step, Target
from m2pem_plugin_ros.behaviors.parameters import LocalParameters
from m2pem_plugin_ros.behaviors.pilot import STALE_S, STANDING, Pilot
from m2pem_plugin_ros.behaviors.reverse import Reverse
from m2pem_plugin_ros.behaviors.route import SingleVehicleRouting
from m2pem_plugin_ros.settings import Bounds

__all__ = [
    "MOTIONS",
    "STALE_S",
    "STANDING",
    "Ending",
    "Motion",
    "Pilot",
    "RefusedError",
    "Observation",
    "Step",
    "Target",
    "Teleop",
    "LocalParameters",
    "make_motion",
]


MOTIONS: Mapping[str, type[Motion]] = {
    motion.name: motion
    for motion in (SingleVehicleRouting, Goto, Hold, DriveStop, Reverse, Follow, Teleop)
}


def make_motion(behavior: str, parameters: LocalParameters, bounds: Bounds) -> Motion:
    """Make the motion of a behavior.

    Raises:
        RefusedError: a plain base cannot execute it, or not with these parameters.
    """
    if behavior not in MOTIONS:
        raise RefusedError(
            f"a plain base cannot do '{behavior}', only {', '.join(sorted(MOTIONS))}"
        )
    return MOTIONS[behavior](parameters, bounds)
