"""The hooks of this plugin: arbiter and face `ros`, commands `sim ros` and `ros onboard`."""

from collections.abc import Callable, MutableMapping, Sequence
from typing import TYPE_CHECKING

from m2pem import hookimpl

if TYPE_CHECKING:
    import click

    from m2pem.api import Arbiter, Face, Fleet, HealthCheck


@hookimpl
def m2pem_register_arbiters(register: "Callable[[str, Callable[..., Arbiter]], None]") -> None:
    """Register the arbiter `ros`."""
    from m2pem_plugin_ros.arbiter import RosArbiter  # noqa: PLC0415  # starting up must be fast

    register("ros", RosArbiter)


@hookimpl
def m2pem_register_faces(register: "Callable[[str, Callable[..., Face]], None]") -> None:
    """Register the face `ros`."""
    from m2pem_plugin_ros.face.face import RosFace  # noqa: PLC0415  # starting up must be fast

    register("ros", RosFace)


@hookimpl
def m2pem_register_commands(cli: "click.Group") -> None:
    """Add `sim ros` and `ros onboard`. Both groups may have commands of other plugins."""
    add_commands(cli.commands)


def add_commands(commands: "MutableMapping[str, click.Command]") -> None:
    """Add the commands. The module of a command is imported only when it is called."""
    from m2pem.api import LazyCommand, command_group, simulator_group  # noqa: PLC0415  # click

    simulator_group(commands).add_command(
        LazyCommand(
            "ros", "m2pem_plugin_ros.simulator.command_line", "Simulate ROS vehicles on 127.0.0.1."
        )
    )
    command_group(commands, "ros", "Commands for ROS 2 vehicles.").add_command(
        LazyCommand(
            "onboard",
            "m2pem_plugin_ros.onboard.command_line",
            "Run the m2pem node of a vehicle on board.",
        )
    )


@hookimpl
def m2pem_check_host(fleet: "Fleet | None") -> "Sequence[HealthCheck]":
    """Check that there is one ROS 2, and the settings of DDS."""
    from m2pem_plugin_ros.host_checks import check_host  # noqa: PLC0415  # starting up must be fast

    return check_host(fleet)
