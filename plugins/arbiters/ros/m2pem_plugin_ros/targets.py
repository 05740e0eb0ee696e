"""Tells a vehicle where another one is, which it goes to or follows: the topic `target`."""

import math
from typing import TYPE_CHECKING

from m2pem.api import VehicleState
from m2pem_plugin_ros.settings import Settings

if TYPE_CHECKING:
    from m2pem_plugin_ros.runtime import RosRuntime

TOPIC = "target"


class TargetTopic:
    """Publishes m2pem_interfaces/TargetState in a vehicle's namespace."""

    def __init__(self, ros: "RosRuntime", settings: Settings) -> None:
        from m2pem_plugin_ros.installation import require_interfaces  # noqa: PLC0415
        from m2pem_plugin_ros.runtime import qos  # noqa: PLC0415  # it needs rclpy

        self._messages = require_interfaces("m2pem_interfaces").msg
        self._publisher = ros.node.create_publisher(
            self._messages.TargetState, settings.topic(TOPIC), qos.TELEMETRY
        )

    def show(self, state: VehicleState) -> None:
        """Publish a vehicle's state; without a position there is nothing to say."""
        if state.position is None:
            return
        message = self._messages.TargetState(vehicle=state.resource)
        message.stamp.sec, rest_us = divmod(state.time_us, 1_000_000)
        message.stamp.nanosec = rest_us * 1000
        message.position.latitude_deg = state.position.latitude_deg
        message.position.longitude_deg = state.position.longitude_deg
        message.position.altitude_m = state.position.altitude_m
        message.yaw_rad = math.nan if state.yaw_rad is None else state.yaw_rad
        velocity = state.velocity_enu_m_s or (math.nan, math.nan, math.nan)
        message.velocity.x, message.velocity.y, message.velocity.z = velocity
        self._publisher.publish(message)
