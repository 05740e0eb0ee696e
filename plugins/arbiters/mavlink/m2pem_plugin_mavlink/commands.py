"""The commands of this plugin."""

from collections.abc import MutableMapping

import click

from m2pem.api import LazyCommand, simulator_group


def add_to(commands: MutableMapping[str, click.Command]) -> None:
    """Add `sitl` and `sim mavlink`."""
    commands["sitl"] = LazyCommand(
        "sitl",
        "m2pem_plugin_mavlink.sitl.command_line",
        "Start the real autopilots of a fleet, as software in the loop.",
    )
    simulator_group(commands).add_command(
        LazyCommand(
            "mavlink",
            "m2pem_plugin_mavlink.simulator.command_line",
            "Simulate MAVLink vehicles over UDP.",
        )
    )
