"""The commands of this plugin. What simulates autopilots is loaded only when it is called."""

from collections.abc import MutableMapping
from typing import Any

import click


class Mavlink(click.Command):
    """Stands for `sim.command_line.mavlink` in the list of commands."""

    def make_context(
        self,
        info_name: str | None,
        args: list[str],
        parent: click.Context | None = None,
        **extra: Any,
    ) -> click.Context:
        """That of the command itself, which then is what is invoked."""
        from m2pem_plugin_mavlink.sim.command_line import mavlink  # noqa: PLC0415

        return mavlink.make_context(info_name, args, parent, **extra)


def add_to(commands: MutableMapping[str, click.Command]) -> None:
    """Add `sim mavlink`; the group `sim` may have commands of other plugins, too."""
    group = commands.get("sim")
    if not isinstance(group, click.Group):
        group = click.Group("sim", help="Simulate vehicles that speak as real ones do.")
        commands["sim"] = group
    group.add_command(Mavlink("mavlink", help="Simulate MAVLink vehicles over UDP."))
