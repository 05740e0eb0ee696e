"""The hooks of this plugin: the link to hosts `zenoh`, and the checks of its files."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from m2pem import hookimpl

if TYPE_CHECKING:
    from m2pem.api import Arbiter, Fleet, HealthCheck


@hookimpl
def m2pem_register_arbiters(register: "Callable[[str, Callable[..., Arbiter]], None]") -> None:
    """Register `zenoh`, which represents the arbiters of other hosts."""
    from m2pem_plugin_zenoh.plugin import ZenohHosts  # noqa: PLC0415  # starting up must be fast

    register("zenoh", ZenohHosts())


@hookimpl
def m2pem_check_host(fleet: "Fleet | None") -> "Sequence[HealthCheck]":
    """Check the files of keys and passwords that the hosts of a fleet need here."""
    if fleet is None or not fleet.hosts:
        return ()
    from m2pem_plugin_zenoh.link import check_hosts  # noqa: PLC0415  # starting up must be fast

    return check_hosts(fleet)
