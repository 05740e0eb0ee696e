"""What Nav2 is told for each behavior."""

from collections.abc import Mapping

from m2pem_plugin_ros.drivers.nav2.errands.backing import Reverse
from m2pem_plugin_ros.drivers.nav2.errands.errand import Errand, Job
from m2pem_plugin_ros.drivers.nav2.errands.going import Follow, Goto
from m2pem_plugin_ros.drivers.nav2.errands.routing import Route
from m2pem_plugin_ros.drivers.nav2.errands.standing_still import Hold, Stop, Teleop

ERRANDS: Mapping[str, type[Errand]] = {
    "single_vehicle_routing": Route,
    "goto": Goto,
    "follow": Follow,
    "reverse": Reverse,
    "hold": Hold,
    "drive_stop": Stop,
    "teleop": Teleop,
}
"""By behavior's name."""

__all__ = ["ERRANDS", "Errand", "Job"]
