"""ROS 2 vehicles: on land and on water (docs/ros.md)."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from m2pem import hookimpl

if TYPE_CHECKING:
    import click

    from m2pem.api import Arbiter


@hookimpl
def m2pem_register_arbiters(register: "Callable[[str, Callable[..., Arbiter]], None]") -> None:
    """Register `ros`."""
    from m2pem_plugin_ros.arbiter import RosArbiter  # noqa: PLC0415  # starting up must be fast

    register("ros", RosArbiter)


@hookimpl
def m2pem_register_commands(cli: "click.Group") -> None:
    """Add what commands.py has."""
    from m2pem_plugin_ros.commands import add_to  # noqa: PLC0415  # starting up must be fast

    add_to(cli.commands)
