"""The hooks. A plugin is a distribution with an entry point in group `m2pem` to a module that
marks functions of these names with `@m2pem.hookimpl`. Hooks are sync and hand in objects; traffic
goes through the objects. Import your libraries inside the functions: starting up must stay fast.
"""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import pluggy

if TYPE_CHECKING:
    import click

    from m2pem.api.arbiter import Arbiter
    from m2pem.api.exporter import Exporter
    from m2pem.api.face import Face
    from m2pem.api.health import HealthCheck
    from m2pem.api.ocu import Ocu
    from m2pem.api.service import Service
    from m2pem.engine.records import Record
    from m2pem.findings import Finding
    from m2pem.fleet.fleet import Fleet
    from m2pem.mission.mission import Mission

hookspec = pluggy.HookspecMarker("m2pem")
hookimpl = pluggy.HookimplMarker("m2pem")


@hookspec
def m2pem_register_arbiters(register: "Callable[[str, Callable[..., Arbiter]], None]") -> None:
    """Register arbiters: `register("mavlink", MavlinkArbiter)`."""


@hookspec
def m2pem_register_ocus(register: "Callable[[str, Callable[..., Ocu]], None]") -> None:
    """Register operator control units: `register("terminal", TerminalOcu)`."""


@hookspec
def m2pem_register_faces(register: "Callable[[str, Callable[..., Face]], None]") -> None:
    """Register faces for programs of other protocols: `register("mavlink", MavlinkFace)`."""


@hookspec
def m2pem_register_exporters(register: "Callable[[str, Callable[..., Exporter]], None]") -> None:
    """Register formats of `m2pem export`: `register("kml", KmlExporter)`."""


@hookspec
def m2pem_register_services(register: "Callable[[str, Callable[[], Service]], None]") -> None:
    """Register service-task classes: `register("Detector", Detector)`."""


@hookspec
def m2pem_register_commands(cli: "click.Group") -> None:
    """Add sub-commands to the command line."""


@hookspec
def m2pem_check_mission(mission: "Mission", fleet: "Fleet | None") -> "Sequence[Finding]":
    """Return findings of your own for `m2pem check`."""
    return ()


@hookspec
def m2pem_records_committed(run_id: str, records: "Sequence[Record]") -> None:
    """Observe records after they were committed."""


@hookspec
def m2pem_check_host(fleet: "Fleet | None") -> "Sequence[HealthCheck]":
    """Return what of this host is right for the plugin, and what is not, for `m2pem doctor`."""
    return ()
