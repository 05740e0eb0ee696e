"""Poses as goals of Nav2 say them, in the frame `map`."""

from typing import Any

from geometry_msgs.msg import PoseStamped

from m2pem_plugin_ros.frames import quaternion_of_yaw
from m2pem_plugin_ros.pose import Pose

MAP = "map"


def stamped(pose: Pose) -> Any:
    """A geometry_msgs/PoseStamped. Its stamp is 0, "whenever": clocks need not agree."""
    message = PoseStamped()
    message.header.frame_id = MAP
    message.pose.position.x = pose.east_m
    message.pose.position.y = pose.north_m
    turned = quaternion_of_yaw(pose.yaw_rad)
    message.pose.orientation.z = turned.z
    message.pose.orientation.w = turned.w
    return message
