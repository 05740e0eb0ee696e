"""The hooks of this plugin: the arbiter `vda5050`, the command `sim vda5050`, and checks."""

from collections.abc import Callable, MutableMapping, Sequence
from typing import TYPE_CHECKING

from m2pem import hookimpl

if TYPE_CHECKING:
    import click

    from m2pem.api import Arbiter, Fleet, HealthCheck


@hookimpl
def m2pem_register_arbiters(register: "Callable[[str, Callable[..., Arbiter]], None]") -> None:
    """Register the arbiter `vda5050`."""
    from m2pem_plugin_vda5050.arbiter import Vda5050Arbiter  # noqa: PLC0415  # starting up is fast

    register("vda5050", Vda5050Arbiter)


@hookimpl
def m2pem_register_commands(cli: "click.Group") -> None:
    """Add `sim vda5050`. The group may have commands of other plugins."""
    add_commands(cli.commands)


def add_commands(commands: "MutableMapping[str, click.Command]") -> None:
    """Add the command. Its module is imported only when it is called."""
    from m2pem.api import LazyCommand, simulator_group  # noqa: PLC0415  # click

    simulator_group(commands).add_command(
        LazyCommand(
            "vda5050",
            "m2pem_plugin_vda5050.simulator.command_line",
            "Simulate vehicles that speak VDA 5050.",
        )
    )


@hookimpl
def m2pem_check_host(fleet: "Fleet | None") -> "Sequence[HealthCheck]":
    """Check the brokers of the fleet, and the files of their passwords and certificates."""
    from m2pem_plugin_vda5050.host_checks import check_brokers  # noqa: PLC0415  # as above

    return () if fleet is None else check_brokers(fleet)
