"""What a simulated vehicle with `odom_frame: tf` tells on /tf and /tf_static."""

from typing import Any

from geometry_msgs.msg import TransformStamped

from m2pem_plugin_ros.frames import quaternion_of_yaw
from m2pem_plugin_ros.installation import require_interfaces
from m2pem_plugin_ros.pose import Pose
from m2pem_plugin_ros.runtime import qos
from m2pem_plugin_ros.settings import Settings

MAP = "map"


class Transforms:
    """map -> odom is static, from where the odometry began; odom -> base moves.

    Raises:
        RosError: the package tf2_msgs is not installed.
    """

    def __init__(
        self, node: Any, settings: Settings, odom_frame: str, base_frame: str, start: Pose
    ) -> None:
        self._message_type = require_interfaces("tf2_msgs").msg.TFMessage
        self._odom_frame, self._base_frame = odom_frame, base_frame
        topics = settings.topics
        self._static = node.create_publisher(
            self._message_type, topics.tf_static, qos.STATIC_TRANSFORMS
        )
        self._moving = node.create_publisher(self._message_type, topics.tf, qos.EVENTS)
        begins = TransformStamped(child_frame_id=odom_frame)
        begins.header.frame_id = MAP
        place, turn = begins.transform.translation, begins.transform.rotation
        place.x, place.y, place.z = start.east_m, start.north_m, start.up_m
        _, _, turn.z, turn.w = quaternion_of_yaw(start.yaw_rad)
        self._static.publish(self._message_type(transforms=[begins]))

    def publish(self, odometry: Any) -> None:
        """Publish the pose of odometry."""
        moved = TransformStamped(header=odometry.header, child_frame_id=self._base_frame)
        pose, place = odometry.pose.pose, moved.transform.translation
        place.x, place.y, place.z = pose.position.x, pose.position.y, pose.position.z
        moved.transform.rotation = pose.orientation
        self._moving.publish(self._message_type(transforms=[moved]))
