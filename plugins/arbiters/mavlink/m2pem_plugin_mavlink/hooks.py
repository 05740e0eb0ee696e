"""The hooks of this plugin: the arbiter `mavlink` and the commands; each is loaded when used."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from m2pem import hookimpl

if TYPE_CHECKING:
    import click

    from m2pem.api import Arbiter


@hookimpl
def m2pem_register_arbiters(register: "Callable[[str, Callable[..., Arbiter]], None]") -> None:
    """Register `mavlink`."""
    from m2pem_plugin_mavlink.arbiter import MavlinkArbiter  # noqa: PLC0415  # starting up must be fast

    register("mavlink", MavlinkArbiter)


@hookimpl
def m2pem_register_commands(cli: "click.Group") -> None:
    """Add `sitl` and `sim mavlink`."""
    from m2pem_plugin_mavlink.commands import add_to  # noqa: PLC0415  # starting up must be fast

    add_to(cli.commands)
