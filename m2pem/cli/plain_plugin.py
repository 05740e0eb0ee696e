"""Registers the plain operator control unit, through the same hook as any other."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from m2pem import hookimpl

if TYPE_CHECKING:
    from m2pem.api.ocu import Ocu


@hookimpl
def m2pem_register_ocus(register: "Callable[[str, Callable[..., Ocu]], None]") -> None:
    """Register `plain`."""
    from m2pem.cli.plain import PlainOcu

    register("plain", PlainOcu)
