"""The pilot of a plain base (docs/ros.md, "A plain base"): pure code, in the local frame."""

from m2pem_plugin_ros.pilot.motions import MOTIONS, Motion, make_motion
from m2pem_plugin_ros.pilot.motions.teleop import Teleop
from m2pem_plugin_ros.pilot.pilot import STALE_S, STANDING, Pilot
from m2pem_plugin_ros.pilot.wishes import Wishes
from m2pem_plugin_ros.pilot.words import Ending, RefusedError, Seen, Step, Target

__all__ = [
    "MOTIONS",
    "STALE_S",
    "STANDING",
    "Ending",
    "Motion",
    "Pilot",
    "RefusedError",
    "Seen",
    "Step",
    "Target",
    "Teleop",
    "Wishes",
    "make_motion",
]
