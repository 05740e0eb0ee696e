"""What the commands of this plugin share: lazy loading, and types of options."""

import math
from collections.abc import MutableMapping
from importlib import import_module
from typing import Any

import click

from m2pem.api import GeoPosition


class LazyCommand(click.Command):
    """A command in the list of commands whose module is imported when the command is called."""

    def __init__(self, name: str, module: str, summary: str) -> None:
        super().__init__(name, help=summary)
        self._module = module

    def make_context(
        self,
        info_name: str | None,
        args: list[str],
        parent: click.Context | None = None,
        **extra: Any,
    ) -> click.Context:
        """Import the command, and return its context, so that click invokes it."""
        command: click.Command = getattr(import_module(self._module), str(self.name))
        return command.make_context(info_name, args, parent, **extra)


def group(commands: MutableMapping[str, click.Command], name: str, summary: str) -> click.Group:
    """Return the group of this name, made if it is missing."""
    found = commands.get(name)
    if not isinstance(found, click.Group):
        found = click.Group(name, help=summary)
        commands[name] = found
    return found


class Place(click.ParamType):  # type: ignore[type-arg]  # older clicks have it bare
    """A position on Earth: LAT,LON or LAT,LON,ALT."""

    name = "lat,lon,alt"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> GeoPosition:
        """Return the position: WGS-84 in degrees, metres above mean sea level."""
        if isinstance(value, GeoPosition):
            return value
        try:
            latitude, longitude, altitude = (*map(float, str(value).split(",")), 0.0)[:3]
        except ValueError:
            self.fail(f"{value!r} is not LAT,LON,ALT, such as 38.1,-77.3,60", param, ctx)
        if not (abs(latitude) <= 90 and abs(longitude) <= 180 and math.isfinite(altitude)):
            self.fail(f"{value!r} is not on Earth", param, ctx)
        return GeoPosition(latitude, longitude, altitude)
