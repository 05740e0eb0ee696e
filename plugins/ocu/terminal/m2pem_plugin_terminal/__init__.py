"""The terminal operator control unit (docs/operating.md)."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from m2pem import hookimpl

if TYPE_CHECKING:
    from m2pem.api.ocu import Ocu


@hookimpl
def m2pem_register_ocus(register: "Callable[[str, Callable[..., Ocu]], None]") -> None:
    """Register `terminal`."""
    from m2pem_plugin_terminal.ocu import TerminalOcu  # noqa: PLC0415  # starting up must be fast

    register("terminal", TerminalOcu)
