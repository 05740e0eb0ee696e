"""The motions of a base, by the behavior that they are for."""

from collections.abc import Mapping

from m2pem_plugin_ros.pilot.motions.follow import Follow
from m2pem_plugin_ros.pilot.motions.goto import Goto
from m2pem_plugin_ros.pilot.motions.motion import Motion
from m2pem_plugin_ros.pilot.motions.reverse import Reverse
from m2pem_plugin_ros.pilot.motions.route import SingleVehicleRouting
from m2pem_plugin_ros.pilot.motions.standing import DriveStop, Hold
from m2pem_plugin_ros.pilot.motions.teleop import Teleop
from m2pem_plugin_ros.pilot.wishes import Wishes
from m2pem_plugin_ros.pilot.words import RefusedError
from m2pem_plugin_ros.settings import Bounds

__all__ = ["MOTIONS", "Motion", "make_motion"]

MOTIONS: Mapping[str, type[Motion]] = {
    motion.name: motion
    for motion in (SingleVehicleRouting, Goto, Hold, DriveStop, Reverse, Follow, Teleop)
}


def make_motion(behavior: str, wishes: Wishes, bounds: Bounds) -> Motion:
    """The motion for a behavior.

    Raises:
        RefusedError: a plain base cannot do it, or not so.
    """
    if behavior not in MOTIONS:
        raise RefusedError(
            f"a plain base cannot do '{behavior}', only {', '.join(sorted(MOTIONS))}"
        )
    return MOTIONS[behavior](wishes, bounds)
