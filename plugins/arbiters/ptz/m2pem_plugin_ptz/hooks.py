"""The hooks of this plugin: the arbiter `ptz`, the commands `sim onvif` and `sim ros-cameras`."""

from collections.abc import Callable
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
    from m2pem_plugin_ptz.commands import add_commands  # noqa: PLC0415  # starting up must be fast

    add_commands(cli.commands)
