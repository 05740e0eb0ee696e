"""`m2pem geometries`: routes, areas and points of a fleet, its operators and a mission.

Reading takes the journal. Changes are asked of the executive that serves the fleet on this host, so
that its runs and operators have them at once; without one, they are written to the journal, which
the next executive reads.
"""

import asyncio
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from m2pem.cli.options import as_json, example, format_option, journal_option
from m2pem.cli.run_control import by_option, journal_file
from m2pem.errors import OperatorError

if TYPE_CHECKING:
    from m2pem.executive.drawings import Drawings
    from m2pem.fleet.fleet import Fleet
    from m2pem.geo.geometry_files import NamedGeometry
    from m2pem.mission.geometry import Area, Point, Route
    from m2pem.mission.values import Value

FORMATS = ("geojson", "kml", "csv", "plan", "waypoints")

name_argument = click.argument("name", metavar="NAME")
fleet_option = click.option(
    "--fleet", "fleet_file", metavar="FLEET", required=True, help="The fleet file."
)
mission_option = click.option(
    "--mission", metavar="MISSION", help="Also those that this mission file has drawn itself."
)
simulate_option = click.option(
    "--simulate", is_flag=True, help="Those of `m2pem serve --simulate`, which are kept apart."
)
force_option = click.option("--force", is_flag=True, help="Also replace what running missions use.")


@click.group(epilog=example("m2pem geometries list --fleet fleet_configs/vignette1.yaml"))
def geometries() -> None:
    """List routes, areas and points; show, export, import, delete and restore them."""


@geometries.command("list", epilog=example("m2pem geometries list --fleet north.yaml"))
@fleet_option
@mission_option
@simulate_option
@journal_option
@format_option
def list_(
    fleet_file: str, mission: str | None, simulate: bool, journal: str | None, output: str
) -> None:
    """List what missions may name: of the fleet file, of operators, and of a mission.

    Of one name, a mission's own is before an operator's, and that before the fleet file's.
    """
    from m2pem.cli.table import table
    from m2pem.geo.geojson import kind_of

    found = _read(fleet_file, simulate, journal, mission)
    if output == "json":
        shown = [
            {
                "name": each.name,
                "kind": kind_of(each.geometry),
                "from": each.source,
                "by": each.by,
                "at_us": each.at_us,
            }
            for each in found.values()
        ]
        click.echo(as_json(shown))
        return
    rows = [
        (each.name, kind_of(each.geometry), each.source, each.by or "-", _moment(each.at_us))
        for each in found.values()
    ]
    header = ("NAME", "IS A", "FROM", "BY", "AT")
    click.echo(table(header, rows) if rows else "there are no routes, areas and points")


@geometries.command(epilog=example("m2pem geometries show route_alpha --fleet north.yaml"))
@name_argument
@fleet_option
@mission_option
@simulate_option
@journal_option
def show(
    name: str, fleet_file: str, mission: str | None, simulate: bool, journal: str | None
) -> None:
    """Print one as GeoJSON."""
    from m2pem.geo.geojson import as_geojson

    found = _chosen(_read(fleet_file, simulate, journal, mission), (name,))
    feature = as_geojson(found[0].geometry)
    feature["properties"] = {"name": name, **feature["properties"]}
    click.echo(as_json(feature))


@geometries.command(epilog=example("m2pem geometries versions gate --fleet north.yaml"))
@name_argument
@fleet_option
@simulate_option
@journal_option
@format_option
def versions(name: str, fleet_file: str, simulate: bool, journal: str | None, output: str) -> None:
    """List the versions of a drawing: who handed each over, and when.

    `m2pem geometries restore` hands one over again. The last 20 are kept.
    """
    from m2pem.cli.table import table
    from m2pem.geo.geojson import kind_of, parse_geojson

    drawings = asyncio.run(_drawings(_fleet(fleet_file, simulate), journal))
    found = drawings.versions(name)
    if not found:
        raise _unknown(name, drawings.names, "a geometry that operators have handed over")
    if output == "json":
        click.echo(as_json(found))
        return
    rows = [
        (
            str(each.number),
            "deleted" if each.geometry is None else kind_of(parse_geojson(each.geometry)),
            each.by or "-",
            _moment(each.at_us),
        )
        for each in found
    ]
    click.echo(table(("VERSION", "IS A", "BY", "AT"), rows))


@geometries.command(epilog=example("m2pem geometries export site.kml --fleet north.yaml"))
@click.argument("file", type=click.Path(dir_okay=False, path_type=Path))
@click.argument("names", metavar="[NAME]...", nargs=-1)
@fleet_option
@mission_option
@simulate_option
@click.option("--altitude", "altitude_m", type=float, metavar="M", help="Of waypoints without one.")
@journal_option
def export(
    file: Path,
    names: tuple[str, ...],
    fleet_file: str,
    mission: str | None,
    simulate: bool,
    altitude_m: float | None,
    journal: str | None,
) -> None:
    """Write those of these names, or all, to a file.

    The suffix says the format: .geojson, .kml, .csv, .plan or .waypoints.
    """
    from m2pem.geo.geojson import GeometryError
    from m2pem.geo.geometry_files import FileFormat, NamedGeometry, write_geometry_file

    suffix = file.suffix.removeprefix(".").lower()
    if suffix not in FORMATS:
        known = ", ".join(f".{each}" for each in FORMATS)
        raise click.BadParameter(f"{file} has none of these suffixes: {known}")
    found = _read(fleet_file, simulate, journal, mission)
    chosen = _chosen(found, names or tuple(found))
    shapes = [NamedGeometry(each.name, each.geometry) for each in chosen]
    try:
        content = write_geometry_file(FileFormat(suffix), shapes, altitude_m)
    except GeometryError as error:
        raise OperatorError(f"{file}: {error}") from error
    file.write_bytes(content)
    click.echo(f"{len(chosen)} in {file}")


@geometries.command("import", epilog=example("m2pem geometries import site.kml --fleet n.yaml"))
@click.argument("file", type=click.Path(exists=True, dir_okay=False, path_type=Path))
@click.argument("names", metavar="[NAME]...", nargs=-1)
@fleet_option
@simulate_option
@force_option
@journal_option
@by_option
def import_(
    file: Path,
    names: tuple[str, ...],
    fleet_file: str,
    simulate: bool,
    force: bool,
    journal: str | None,
    by: str | None,
) -> None:
    """Hand over what a file has, or those of these names, for all runs of the fleet.

    What the file has is handed over whole or not at all: nothing of it if one cannot be read.
    """
    from m2pem.findings import Severity
    from m2pem.geo.geojson import as_geojson
    from m2pem.geo.geometry_files import read_geometry_file

    read = read_geometry_file(file.name, file.read_bytes())
    for problem in read.problems:
        click.echo(f"{file}: {problem}", err=True)
    if not names and any(each.severity is Severity.ERROR for each in read.problems):
        raise OperatorError(f"{file}: not all of it can be read; name what is to be handed over")
    known = {each.name: each for each in read.geometries}
    chosen = _chosen(known, names or tuple(known))
    fleet = _fleet(fleet_file, simulate)
    given = {each.name: as_geojson(each.geometry) for each in chosen}
    _refuse_far(fleet, chosen)
    asyncio.run(_change(fleet, journal, by, given, force))
    for name in given:
        click.echo(f"{name} is handed over")


@geometries.command(epilog=example("m2pem geometries delete gate --fleet north.yaml"))
@name_argument
@fleet_option
@simulate_option
@journal_option
@by_option
def delete(name: str, fleet_file: str, simulate: bool, journal: str | None, by: str | None) -> None:
    """Delete a geometry that operators have handed over.

    Runs under way keep it; later ones get that of the fleet file, if it has one.
    """
    fleet = _fleet(fleet_file, simulate)
    drawings = asyncio.run(_drawings(fleet, journal))
    if name not in drawings.handed_over:
        raise _unknown(name, drawings.handed_over, "a geometry that operators have handed over")
    asyncio.run(_change(fleet, journal, by, {name: None}, force=True))
    click.echo(f"{name} is deleted")


@geometries.command(epilog=example("m2pem geometries restore gate 3 --fleet north.yaml"))
@name_argument
@click.argument("number", type=int)
@fleet_option
@simulate_option
@force_option
@journal_option
@by_option
def restore(
    name: str,
    number: int,
    fleet_file: str,
    simulate: bool,
    force: bool,
    journal: str | None,
    by: str | None,
) -> None:
    """Hand a former version of a drawing over again, as a new version."""
    fleet = _fleet(fleet_file, simulate)
    found = asyncio.run(_drawings(fleet, journal)).versions(name)
    wanted = next((each.geometry for each in found if each.number == number), None)
    if wanted is None:
        raise OperatorError(
            f"{name} has no version {number} with a geometry; `m2pem geometries versions {name}` "
            "lists them"
        )
    asyncio.run(_change(fleet, journal, by, {name: wanted}, force))
    click.echo(f"version {number} of {name} is handed over again")


# --- reading --------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Known:
    """A geometry, and from where it is: the fleet file, an operator, or the mission."""

    name: str
    geometry: "Point | Route | Area"
    source: str
    by: str = ""
    at_us: int | None = None


def _fleet(file: str, simulate: bool) -> "Fleet":
    from m2pem.fleet.fleet import simulated_fleet
    from m2pem.fleet.fleet_file import load_fleet

    fleet = load_fleet(file)
    return simulated_fleet(fleet) if simulate else fleet


def _read(
    fleet_file: str, simulate: bool, journal: str | None, mission: str | None
) -> dict[str, _Known]:
    """Return all by name, sorted."""
    from m2pem.executive.loading import load_source
    from m2pem.geo.geojson import parse_geojson
    from m2pem.mission.geometry import Area, Point, Route

    fleet = _fleet(fleet_file, simulate)
    of_fleet = [(name, each, "fleet") for name, each in fleet.geometries.items()]
    of_mission = load_source(mission, ()).geometries.items() if mission is not None else ()
    found: dict[str, _Known] = {}
    handed_over = asyncio.run(_drawings(fleet, journal)).handed_over
    drawn = {
        name: _Known(name, parse_geojson(each.geometry), "operator", each.by, each.at_us)
        for name, each in handed_over.items()
    }
    for name, geometry, source in [*of_fleet, *((*each, "mission") for each in of_mission)]:
        is_used = source == "mission" or name not in drawn
        if is_used and isinstance(geometry, Point | Route | Area):
            found[name] = _Known(name, geometry, source)
    return dict(sorted((drawn | found).items()))


async def _drawings(fleet: "Fleet", journal_url: str | None) -> "Drawings":
    from m2pem.cli.journals import journal_to_read
    from m2pem.executive.drawings import Drawings

    async with journal_to_read(journal_url) as journal:
        drawings = Drawings(fleet, journal, _now_us)
        await drawings.load()
        return drawings


def _chosen(known: "Mapping[str, Any]", names: Sequence[str]) -> list[Any]:
    for name in names:
        if name not in known:
            raise _unknown(name, known, "a route, area or point")
    return [known[name] for name in dict.fromkeys(names)]


def _unknown(name: str, known: "Mapping[str, Any] | Sequence[str]", what: str) -> OperatorError:
    from m2pem.suggestions import suggest

    hint = suggest(name, list(known), "those") if known else "there is none"
    return OperatorError(f"{name!r} is not {what}; {hint}")


def _moment(at_us: int | None) -> str:
    from datetime import UTC, datetime

    return "-" if at_us is None else f"{datetime.fromtimestamp(at_us / 1e6, UTC):%Y-%m-%d %H:%M}Z"


def _now_us() -> int:
    return time.time_ns() // 1000


# --- changing -------------------------------------------------------------------------------------


def _refuse_far(fleet: "Fleet", chosen: "Sequence[NamedGeometry]") -> None:
    from m2pem.geo.positions import NO_ORIGIN, geometry_out_of_reach

    for each in chosen:
        wrong = geometry_out_of_reach(each.geometry, fleet.origin)
        if fleet.origin != NO_ORIGIN and wrong:
            raise OperatorError(f"{each.name}: {wrong[0]}; {wrong[1]}")


async def _change(
    fleet: "Fleet",
    journal_url: str | None,
    by: str | None,
    given: "Mapping[str, Mapping[str, Value] | None]",
    force: bool,
) -> None:
    """Hand geometries over; None: delete it. Refuse all if running missions use another one."""
    from m2pem.api.operator import operator_name
    from m2pem.cli.journals import journal_at, url_of
    from m2pem.executive.drawings import Drawings

    who = by or operator_name()
    socket = _executive(journal_file(journal_url), fleet)
    if socket is not None:
        _ask(socket, given, who, force)
        return
    async with journal_at(url_of(journal_url)) as journal:
        drawings = Drawings(fleet, journal, _now_us)
        await drawings.load()
        for name, geometry in given.items():
            drawings.change(name, geometry, who)
        await drawings.write("it is done")


def _ask(
    socket: Path, given: "Mapping[str, Mapping[str, Value] | None]", by: str, force: bool
) -> None:
    from m2pem.control_socket.client import ask

    if not force:
        users = {name: ask(socket, "geometry_users", name=name) for name in given}
        used = [f"{name} ({', '.join(runs)})" for name, runs in users.items() if runs]
        if used:
            raise OperatorError(
                f"missions of these runs name {', '.join(used)}: tasks there that have not begun "
                "would get the new one; --force replaces it all the same"
            )
    for name, geometry in given.items():
        if geometry is None:
            ask(socket, "delete_geometry", name=name, by=by)
        else:
            ask(socket, "set_geometry", name=name, geometry=geometry, by=by)


def _executive(journal: Path, fleet: "Fleet") -> Path | None:
    """Return an executive on the journal that keeps the drawings of this fleet."""
    from base64 import b64decode

    from m2pem.control_socket.client import ask
    from m2pem.control_socket.paths import live_sockets
    from m2pem.fleet.fleet import restore

    for path in live_sockets(journal):
        if restore(b64decode(ask(path, "fleet"))).kept_as == fleet.kept_as:
            return path
    return None
