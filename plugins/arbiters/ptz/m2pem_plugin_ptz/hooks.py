"""The hooks of this plugin: the arbiter `ptz`, the commands `sim onvif` and `sim ros-cameras`."""

from collections.abc import Callable, MutableMapping
from typing import TYPE_CHECKING

from m2pem import hookimpl

if TYPE_CHECKING:
    import click

    from m2pem.api import Arbiter


@hookimpl
def m2pem_register_arbiters(register: "Callable[[str, Callable[..., Arbiter]], None]") -> None:
    """Register the arbiter `ptz`."""
    from m2pem_plugin_ptz.arbiter import PtzArbiter  # noqa: PLC0415  # starting up must be fast

    register("ptz", PtzArbiter)


@hookimpl
def m2pem_register_commands(cli: "click.Group") -> None:
    """Add `sim onvif` and `sim ros-cameras`. The group `sim` may have commands of other plugins."""
    add_commands(cli.commands)


def add_commands(commands: "MutableMapping[str, click.Command]") -> None:
    """Add the commands. The module of a command is imported only when it is called."""
    from m2pem.api import LazyCommand, simulator_group  # noqa: PLC0415  # click

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
