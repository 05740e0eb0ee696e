"""The Nav2 task of each behavior."""

from collections.abc import Mapping

from m2pem_plugin_ros.drivers.nav2.tasks.goto import Follow, Goto
from m2pem_plugin_ros.drivers.nav2.tasks.hold import Hold, Stop, Teleop
from m2pem_plugin_ros.drivers.nav2.tasks.reverse import Reverse
from m2pem_plugin_ros.drivers.nav2.tasks.route import Route
from m2pem_plugin_ros.drivers.nav2.tasks.task import (
    CANCELLED_THERE,
    Nav2GoalTask,
    Nav2Task,
    TaskContext,
)

TASKS: Mapping[str, type[Nav2Task]] = {
    "single_vehicle_routing": Route,
    "goto": Goto,
    "follow": Follow,
    "reverse": Reverse,
    "hold": Hold,
    "drive_stop": Stop,
    "teleop": Teleop,
}
"""By name of the behavior."""

__all__ = ["CANCELLED_THERE", "TASKS", "Nav2GoalTask", "Nav2Task", "TaskContext"]
