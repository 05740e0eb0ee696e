"""The commands of this plugin. What simulates cameras is loaded only when it is called."""

from collections.abc import MutableMapping
from typing import Any

import click

from m2pem.errors import PluginError


class Onvif(click.Command):
    """Stands for `sim.onvif.command_line.onvif` in the list of commands."""

    def make_context(
        self,
        info_name: str | None,
        args: list[str],
        parent: click.Context | None = None,
        **extra: Any,
    ) -> click.Context:
        """That of the command itself, which then is what is invoked."""
        try:
            from m2pem_plugin_ptz.sim.onvif.command_line import onvif  # noqa: PLC0415
        except ModuleNotFoundError as error:
            if (error.name or "").partition(".")[0] not in ("aiohttp", "PIL"):
                raise
            raise PluginError(
                f"`m2pem sim onvif` needs {error.name}: pip install 'm2pem-plugin-ptz[onvif]'"
            ) from error
        return onvif.make_context(info_name, args, parent, **extra)


def add_to(commands: MutableMapping[str, click.Command]) -> None:
    """Add `sim onvif`; the group `sim` may have commands of other plugins, too."""
    group = commands.get("sim")
    if not isinstance(group, click.Group):
        group = click.Group("sim", help="Simulate vehicles that speak as real ones do.")
        commands["sim"] = group
    group.add_command(Onvif("onvif", help="Simulate a camera that turns and speaks ONVIF."))
