"""`m2pem export`: runs of a journal in the formats of other programs (docs/recording.md)."""

import asyncio
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, BinaryIO

import click

from m2pem.cli.completers import runs_of_journal
from m2pem.cli.options import UnusableError, example, journal_option, writing
from m2pem.units import US_PER_S

if TYPE_CHECKING:
    from m2pem.api.exporter import Exporter
    from m2pem.journal.base import Journal, RunInfo


@click.command(epilog=example("m2pem export r1 --to xes -o r1.xes"))
@click.argument("run_ids", metavar="[RUN]...", nargs=-1, shell_complete=runs_of_journal(ended=True))
@click.option(
    "--to",
    "format_",
    metavar="FORMAT",
    required=True,
    help="csv, parquet, geojson, kml, xes, mcap, rosbag2, or a format of another plugin.",
)
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="The file to make, or of rosbag2 the folder  [default: standard output]",
)
@click.option("--all", "every", is_flag=True, help="Export all runs of the journal.")
@click.option(
    "--since", metavar="TIME", help="Of --all, those that started then or later (UTC): 2026-05-01."
)
@click.option("--until", metavar="TIME", help="Of --all, those that started before (UTC).")
@click.option(
    "--table",
    type=click.Choice(["records", "telemetry"]),
    default="records",
    show_default=True,
    help="Of csv and parquet: a row for each record, or for each state of a vehicle or payload.",
)
@click.option(
    "--recordings",
    type=click.Path(path_type=Path, file_okay=False, exists=True),
    metavar="FOLDER",
    help="Where recordings are, which have the telemetry  [default: as the fleet file says, or "
    "beside the journal]",
)
@journal_option
def export(
    run_ids: tuple[str, ...],
    format_: str,
    output: Path | None,
    every: bool,
    since: str | None,
    until: str | None,
    table: str,
    recordings: Path | None,
    journal: str | None,
) -> None:
    """Export runs for other programs.

    Records come from the journal, telemetry from recordings, or else from the tracks of the web
    page. A run that goes on is exported up to now.
    """
    from m2pem.api.exporter import ExportOptions
    from m2pem.errors import PluginError
    from m2pem.plugins import PluginManager, how_to_install

    if every == bool(run_ids):
        raise click.UsageError("name the runs to export, or give --all")
    if (since or until) and not every:
        raise click.UsageError("--since and --until go with --all")
    window = _time_us("--since", since), _time_us("--until", until)
    plugins = PluginManager()
    if not plugins.exporters():
        raise UnusableError(
            f"no plugin exports runs: {how_to_install('m2pem-plugin-recorder')} has the formats"
        )
    try:
        factory = plugins.exporter(format_)
    except PluginError as error:
        raise click.UsageError(str(error)) from error
    options = ExportOptions(table, recordings)

    def write(file: BinaryIO | Path) -> Sequence[str]:
        return asyncio.run(_export(journal, run_ids, window, factory(file, options)))

    if getattr(factory, "writes_folder", False):
        if output is None:
            raise click.UsageError(f"{format_} is a folder: name it with -o")
        remarks = _to_folder(output, write)
    elif output is None:
        if sys.stdout.isatty():
            raise click.UsageError("name a file with -o, or send the output to a program")
        remarks = write(sys.stdout.buffer)
        sys.stdout.buffer.flush()
    else:
        remarks = _to_file(output, write)
    for remark in remarks:
        click.echo(f"m2pem: {remark}", err=True)


def _to_file(path: Path, write: Callable[[BinaryIO], Sequence[str]]) -> Sequence[str]:
    """Write a file, which appears when it is whole."""
    part = path.with_name(f".{path.name}.part")
    with writing(path):
        try:
            with part.open("wb") as file:
                remarks = write(file)
            part.replace(path)
        finally:
            with suppress(OSError):
                part.unlink()
    return remarks


def _to_folder(path: Path, write: Callable[[Path], Sequence[str]]) -> Sequence[str]:
    """Make a folder, which appears when it is whole. Its files may be called as it is."""
    with writing(path):
        if path.exists():
            raise UnusableError(f"{path} is there already: name a new folder with -o")
        with TemporaryDirectory(prefix=f".{path.name}.", dir=path.parent) as part:
            remarks = write(Path(part, path.name))
            Path(part, path.name).rename(path)
    return remarks


def _time_us(option: str, text: str | None) -> int | None:
    if text is None:
        return None
    try:
        time = datetime.fromisoformat(text)
    except ValueError:
        raise click.UsageError(
            f"{option} {text!r} is not a time such as 2026-05-01 or 2026-05-01T08:00"
        ) from None
    return round((time if time.tzinfo else time.replace(tzinfo=UTC)).timestamp() * US_PER_S)


async def _export(
    url: str | None,
    run_ids: Sequence[str],
    window: tuple[int | None, int | None],
    exporter: "Exporter",
) -> Sequence[str]:
    from m2pem.cli.journals import find_run, journal_to_read

    async with journal_to_read(url) as journal:
        if run_ids:
            lines = [await find_run(journal, run) for run in run_ids]
        else:
            lines = [line for line in await journal.runs() if _is_within(line, *window)]
            if not lines:
                raise UnusableError("the journal has no such run")
        for line in lines:
            await _add(journal, line, exporter)
        return exporter.close()


def _is_within(line: "RunInfo", since_us: int | None, until_us: int | None) -> bool:
    begun = not line.gone and line.last_seq > 0
    is_later = since_us is None or line.started_us >= since_us
    return begun and is_later and (until_us is None or line.started_us < until_us)


async def _add(journal: "Journal", line: "RunInfo", exporter: "Exporter") -> None:
    from m2pem.api.exporter import ExportedRecord, ExportedRun
    from m2pem.errors import M2pemError
    from m2pem.executive.run_summary import summary
    from m2pem.fleet.fleet_file import load_fleet
    from m2pem.journal.mission import fleet_of, present_mission_of

    records = []
    async for entry in journal.read(line.run):
        for seq, record in enumerate(entry.records, entry.seq):
            records.append(ExportedRecord(seq, entry.at_us, entry.t_us / US_PER_S, record))
    mission, fleet = None, None
    with suppress(M2pemError):
        mission = await present_mission_of(journal, line)
    with suppress(M2pemError):
        fleet = fleet_of(line.header) if line.header.fleet else None
    with suppress(M2pemError, OSError):  # the journal does not keep its faces
        if fleet is not None and fleet.file:
            fleet = replace(fleet, faces=load_fleet(fleet.file).faces)
    exporter.add(ExportedRun(summary(line), records, mission, fleet, journal.file))
