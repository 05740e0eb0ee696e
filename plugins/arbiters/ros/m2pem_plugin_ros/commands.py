"""The commands of this plugin. What they need is loaded only when they are called."""

from collections.abc import MutableMapping

import click


def add_to(commands: MutableMapping[str, click.Command]) -> None:
    """Add them: there are none yet."""
