"""The hook of this plugin: the link to hosts `zenoh`."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from m2pem import hookimpl

if TYPE_CHECKING:
    from m2pem.api import Arbiter


@hookimpl
def m2pem_register_arbiters(register: "Callable[[str, Callable[..., Arbiter]], None]") -> None:
    """Register `zenoh`, which stands for the arbiters of other hosts."""
    from m2pem_plugin_zenoh.plugin import ZenohHosts  # noqa: PLC0415  # starting up must be fast

    register("zenoh", ZenohHosts())
