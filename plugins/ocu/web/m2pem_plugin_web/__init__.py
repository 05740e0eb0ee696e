"""Missions in a browser: the modeler and the operator page (docs/web.md)."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from m2pem import hookimpl

if TYPE_CHECKING:
    import click

    from m2pem.api import HealthCheck
    from m2pem.api.ocu import Ocu


@hookimpl
def m2pem_register_ocus(register: "Callable[[str, Callable[..., Ocu]], None]") -> None:
    """Register `web`."""
    from m2pem_plugin_web.ocu import WebOcu  # noqa: PLC0415  # starting up must be fast

    register("web", WebOcu)


@hookimpl
def m2pem_register_commands(cli: "click.Group") -> None:
    """Add `web`."""
    from m2pem_plugin_web.commands import add_to  # noqa: PLC0415  # starting up must be fast

    add_to(cli.commands)


@hookimpl
def m2pem_check_host() -> "Sequence[HealthCheck]":
    """Check the settings of the page, and its port."""
    from m2pem_plugin_web.host_checks import check_host  # noqa: PLC0415  # starting up must be fast

    return check_host()
