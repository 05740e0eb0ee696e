"""What Nav2 is told for each behavior."""

from collections.abc import Mapping

from m2pem_plugin_ros.drivers.nav2.tasks.goto import Follow, Goto
from m2pem_plugin_ros.drivers.nav2.tasks.hold import Hold, Stop, Teleop
from m2pem_plugin_ros.drivers.nav2.tasks.reverse import Reverse
from m2pem_plugin_ros.drivers.nav2.tasks.route import Route
from m2pem_plugin_ros.drivers.nav2.tasks.task import Errand, Job

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
