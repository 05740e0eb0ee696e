"""The commands of this plugin."""

from collections.abc import MutableMapping

import click

from m2pem.api import LazyCommand, simulator_group


def add_commands(commands: MutableMapping[str, click.Command]) -> None:
    """Add `sim onvif` and `sim ros-cameras`. The group `sim` may have commands of other plugins."""
    simulators = simulator_group(commands)
    simulators.add_command(
        LazyCommand(
            "onvif",
            "m2pem_plugin_ptz.simulator.onvif.command_line",
            "Simulate a camera that turns and speaks ONVIF.",
            ("aiohttp", "PIL"),
            "m2pem-plugin-ptz[onvif]",
        )
    )
    simulators.add_command(
        LazyCommand(
            "ros-cameras",
            "m2pem_plugin_ptz.simulator.ros.command_line",
            "Simulate cameras that turn over ROS, on 127.0.0.1.",
            ("m2pem_plugin_ros", "rclpy"),
            "m2pem-plugin-ptz[ros]",
        )
    )
