"""The commands of this plugin."""

from collections.abc import MutableMapping

import click

from m2pem.api import LazyCommand, command_group, simulator_group

_SIGNING = {
    "setup": "Give a vehicle the signing key that its fleet file names.",
    "remove": "Turn the signing of a vehicle off.",
    "keygen": "Write a new signing key.",
}


def add_to(commands: MutableMapping[str, click.Command]) -> None:
    """Add `sitl`, `sim mavlink` and `mavlink signing`."""
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
    mavlink = command_group(commands, "mavlink", "Set up MAVLink vehicles.")
    signing = command_group(mavlink.commands, "signing", "Set up the signing of messages.")
    for name, summary in _SIGNING.items():
        module = "m2pem_plugin_mavlink.signing.command_line"
        signing.add_command(LazyCommand(name, module, summary))
