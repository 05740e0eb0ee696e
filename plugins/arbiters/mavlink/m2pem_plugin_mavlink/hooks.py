"""The hooks of this plugin: the arbiter and the face `mavlink`, commands and host checks, loaded
when used."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from m2pem import hookimpl

if TYPE_CHECKING:
    import click

    from m2pem.api import Arbiter, Face, Fleet, HealthCheck


@hookimpl
def m2pem_register_arbiters(register: "Callable[[str, Callable[..., Arbiter]], None]") -> None:
    """Register `mavlink`."""
    from m2pem_plugin_mavlink.arbiter import MavlinkArbiter  # noqa: PLC0415  # starting up must be fast

    register("mavlink", MavlinkArbiter)


@hookimpl
def m2pem_register_faces(register: "Callable[[str, Callable[..., Face]], None]") -> None:
    """Register `mavlink`."""
    from m2pem_plugin_mavlink.face.face import MavlinkFace  # noqa: PLC0415  # starting up must be fast

    register("mavlink", MavlinkFace)


@hookimpl
def m2pem_register_commands(cli: "click.Group") -> None:
    """Add `sitl` and `sim mavlink`."""
    from m2pem_plugin_mavlink.commands import add_to  # noqa: PLC0415  # starting up must be fast

    add_to(cli.commands)


@hookimpl
def m2pem_check_host(fleet: "Fleet | None") -> "Sequence[HealthCheck]":
    """Check the ports of a fleet's MAVLink vehicles, and whether their autopilots are received."""
    if fleet is None or all(each.arbiter != "mavlink" for each in fleet.vehicles.values()):
        return ()
    from m2pem_plugin_mavlink.host_checks import check_fleet  # noqa: PLC0415  # starting up must be fast

    return check_fleet(fleet)
