"""Registers the built-in services through the same hook as any plugin."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from m2pem.hookspecs import hookimpl

if TYPE_CHECKING:
    from m2pem.api.service import Service


@hookimpl
def m2pem_register_services(register: "Callable[[str, Callable[[], Service]], None]") -> None:
    """Register the paper's Detector."""
    from m2pem.services.detector import Detector  # noqa: PLC0415  # starting up must stay fast

    register("Detector", Detector)
