"""`m2pem serve`: the executive as a service; operators start missions."""

import asyncio
import re
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from m2pem.cli.options import (
    example,
    face_option,
    fleet_option,
    format_option,
    journal_option,
    ocu_option,
    path_option,
    simulate_option,
    speed_option,
)

if TYPE_CHECKING:
    from collections.abc import Coroutine, Iterator

    from m2pem.api.clock import SystemClock
    from m2pem.cli.interruption import Interruption
    from m2pem.cli.ocus import Operators
    from m2pem.executive.executive import Executive
    from m2pem.fleet.fleet import Fleet
    from m2pem.journal.base import Journal, RunHeader, RunInfo
    from m2pem.journal.fleet_server import FleetServer
    from m2pem.plugins import PluginManager


class DaysOption(click.ParamType):  # type: ignore[type-arg]  # older clicks have it bare
    """A number of days or hours, in seconds: 30d, 12h."""

    name = "days"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        found = re.fullmatch(r"(\d{1,6}) ?([dh])", str(value))
        if found is None or int(found[1]) == 0:
            self.fail(f"{value!r} is not a number of days or hours, such as 30d or 12h", param, ctx)
        return int(found[1]) * (3600.0 if found[2] == "h" else 86_400.0)


@click.command(epilog=example("m2pem serve --fleet fleet_configs/vignette1.yaml --ocu plain"))
@fleet_option(required=True)
@journal_option
@ocu_option
@face_option
@path_option
@simulate_option
@speed_option
@click.option(
    "--standby",
    is_flag=True,
    help="Wait while another executive on this journal serves the fleet, and take its runs over "
    "when it has died.",
)
@click.option(
    "--keep",
    "keep_s",
    type=DaysOption(),
    metavar="DAYS",
    help="Delete runs that ended longer ago than this, such as 30d or 12h, at the start and each "
    "day  [default: keep all]",
)
@click.option(
    "--backup-to",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    metavar="FOLDER",
    help="Copy the journal there, at the start and then each --backup-every; the last 24 copies "
    "stay.",
)
@click.option(
    "--backup-every",
    "backup_every_s",
    type=DaysOption(),
    default="1h",
    show_default=True,
    metavar="HOURS",
    help="How often --backup-to copies the journal, such as 12h or 1d.",
)
@format_option
def serve(**options: Any) -> int:
    """Serve operators, who start missions, until stopped.

    Takes up runs of the journal that were interrupted, if they had this fleet. Ctrl-C or SIGTERM
    stop the runs, wait until their vehicles are released, and end it with 0.
    """
    from m2pem.cli.interruption import Interruption

    given = click.get_current_context().get_parameter_source("backup_every_s")
    if options["backup_to"] is None and given is not ParameterSource.DEFAULT:
        raise click.UsageError("--backup-every needs --backup-to FOLDER")
    with Interruption() as interruption:
        return asyncio.run(serve_fleet(interruption, **options))


async def serve_fleet(
    interruption: "Interruption",
    *,
    fleet_file: str,
    journal: str | None,
    ocu_names: str | None,
    face_names: str | None,
    simulate: bool,
    speed: float,
    output: str,
    search_path: tuple[Path, ...] = (),
    keep_s: float | None = None,
    standby: bool = False,
    backup_to: Path | None = None,
    backup_every_s: float = 3600.0,
    needs_face: bool = False,
) -> int:
    """Serve a fleet until stopped; returns the exit status. `needs_face`: faces are what it is for.

    Raises:
        UsageError: an option is wrong, or there is no face where one is needed.
        M2pemError: the fleet cannot be served.
    """
    from m2pem.api.clock import SystemClock
    from m2pem.cli.faces import Faces
    from m2pem.cli.journals import journal_at, url_of
    from m2pem.cli.notes import note
    from m2pem.cli.ocus import Operators, chosen
    from m2pem.cli.output import output_of
    from m2pem.cli.session import driving, make_executive
    from m2pem.executive.simulated_state import tidy_up
    from m2pem.journal import file_of
    from m2pem.plugins import PluginManager

    plugins = PluginManager()
    operators = Operators(chosen(ocu_names, plugins), plugins)
    url = url_of(journal)
    fleet = _fleet_of(fleet_file, url, speed, simulated=simulate)
    faces = Faces(face_names, fleet, plugins)
    if needs_face and not faces.names:
        raise click.UsageError(
            f"{fleet_file} has no `faces`: add them there, or name one with --face"
        )
    _refuse_memory(url, standby=standby)
    if backup_to is not None:
        _refuse_other_than_file(url)
    interruption.begin()
    async with journal_at(url) as opened:
        if standby:
            await standing_by(opened, fleet, plugins, speed, operators, interruption)
        if interruption.asked.is_set():
            return 0
        mine, _ = await interrupted_runs(opened, fleet, speed)
        clock = SystemClock(speed, await _start_us(opened, mine, speed))
        executive = make_executive(
            fleet, opened, plugins, clock, search_path=search_path, page=operators.page
        )
        faces.make(executive.control)
        executive.announce_schedule()
        executive.supervisor.interrupted.expect([line.run for line in mine])
        with output_of(output) as out:
            async with driving(
                executive, out, operators, file_of(url), interruption, one=False, faces=faces
            ):
                who = ", ".join(operators.names) or "none"
                seen = f"; faces: {', '.join(faces.names)}" if faces.names else ""
                note(f"m2pem: serving {fleet.name}; operators: {who}{seen}")
                await executive.load_schedule()
                # Again: runs that were created for the schedule and never began are gone.
                mine, others = await interrupted_runs(opened, fleet, speed)
                for line in others:
                    click.echo(
                        f"m2pem: {line.run} was interrupted with other vehicles, or at another "
                        f"speed: `m2pem resume {line.run}` takes it up",
                        err=True,
                    )
                await _take_up(executive, mine)
                executive.serve_schedule()
                for each in (await executive.control.scheduled()).lines():
                    note(f"m2pem: schedule: {each}")
                keeping = [
                    asyncio.create_task(work)
                    for work in _housekeeping(opened, clock, keep_s, backup_to, backup_every_s)
                ]
                await interruption.asked.wait()
                for task in keeping:
                    task.cancel()
        tidy_up(executive, file_of(url))
        left = executive.superseded.is_set() and not executive.switchover.by_operator
        return 1 if left else 0


def _fleet_of(fleet_file: str, url: str, speed: float, *, simulated: bool) -> "Fleet":
    from m2pem.cli.session import refuse_speed
    from m2pem.executive.simulated_state import with_shared_state
    from m2pem.fleet.fleet import simulated_fleet
    from m2pem.fleet.fleet_file import load_fleet
    from m2pem.journal import file_of
    from m2pem.scripting.sources import DEFAULT_FLEET

    if fleet_file == DEFAULT_FLEET:
        raise click.UsageError(
            f"--fleet {DEFAULT_FLEET}: a fleet is made up from a mission; name a file"
        )
    written = load_fleet(fleet_file)
    fleet = simulated_fleet(written) if simulated else written
    fleet = with_shared_state(fleet, file_of(url), written)
    refuse_speed(fleet, speed)
    return fleet


def _refuse_memory(url: str, *, standby: bool) -> None:
    from m2pem.journal import file_of

    if standby and file_of(url) is None:
        raise click.UsageError(
            "--standby: a journal in memory ends with its executive; name the file or database of "
            "the executive whose runs are to be taken over with --journal"
        )


def _housekeeping(
    journal: "Journal",
    clock: "SystemClock",
    keep_s: float | None,
    backup_to: Path | None,
    backup_every_s: float,
) -> "Iterator[Coroutine[None, None, None]]":
    """Yield what is done with the journal from time to time."""
    from m2pem.api.operator import operator_name
    from m2pem.executive.backups import keep_backups
    from m2pem.executive.retention import keep_runs

    if keep_s is not None:
        yield keep_runs(journal, keep_s, clock, by=operator_name())
    if backup_to is not None and journal.file is not None:
        yield keep_backups(journal.file, backup_to, backup_every_s, clock)


def _refuse_other_than_file(url: str) -> None:
    from m2pem.journal import file_of, is_postgres

    if file_of(url) is None or is_postgres(url):
        raise click.UsageError(
            "--backup-to copies a journal in a file; one in memory has no copy, and one in "
            "PostgreSQL is copied with `pg_dump` or `pg_basebackup` (docs/journal.md#backup)"
        )


async def standing_by(
    journal: "Journal",
    fleet: "Fleet",
    plugins: "PluginManager",
    speed: float,
    operators: "Operators",
    interruption: "Interruption",
) -> None:
    """Wait until this executive serves the fleet, or SIGINT or SIGTERM ends it before.

    Meanwhile it prints which executive serves it, and units that can say so to operators do.

    Raises:
        FleetError: another fleet of that name is served.
    """
    from m2pem.api.clock import SystemClock
    from m2pem.api.health import ExecutiveAddress
    from m2pem.cli.notes import note
    from m2pem.cli.session import make_executive
    from m2pem.executive.standby import stand_by
    from m2pem.executive.vehicle_locks import VehicleLocks, addresses_of
    from m2pem.scripting.sources import arbiters_of

    # What is wrong with the fleet, an arbiter or a mission is found before it is needed.
    make_executive(fleet, journal, plugins, SystemClock(speed))
    page = operators.page
    locks = VehicleLocks(addresses_of(arbiters_of(fleet, plugins)), journal.file, page)
    served_by: ExecutiveAddress | None = None

    def say(text: str, server: "FleetServer | None") -> None:
        nonlocal served_by
        served_by = None
        if server is not None:
            served_by = ExecutiveAddress(server.host, server.pid, server.page)
        note(f"m2pem: {text}")

    for text in await unreadable(journal, fleet, speed):
        note(f"m2pem: {text}")
    waiting = asyncio.create_task(stand_by(journal, fleet, locks, say, page))
    telling = asyncio.create_task(operators.stand_by(fleet.name, lambda: served_by))
    asked = asyncio.create_task(interruption.asked.wait())
    try:
        await asyncio.wait((waiting, asked), return_when=asyncio.FIRST_COMPLETED)
        if waiting.done():
            waiting.result()
    finally:
        for task in (waiting, telling, asked):
            task.cancel()
        await asyncio.gather(waiting, telling, asked, return_exceptions=True)


async def unreadable(journal: "Journal", fleet: "Fleet", speed: float) -> list[str]:
    """Say which runs that have not ended could not be taken up here, and why."""
    from m2pem.errors import M2pemError
    from m2pem.journal.mission import mission_of

    found: list[str] = []
    for line in await journal.runs():
        if line.outcome is None and is_of_fleet(line.header, fleet, speed):
            try:
                mission_of(line.header)
            except M2pemError as error:
                found.append(f"{line.run} could not be taken over here: {error}")
    return found


async def interrupted_runs(
    journal: "Journal", fleet: "Fleet", speed: float
) -> "tuple[list[RunInfo], list[RunInfo]]":
    """The runs that no executive drives: those with the same fleet, and the others."""
    mine: list[RunInfo] = []
    others: list[RunInfo] = []
    for line in await journal.runs():
        taken_up = line.loss is None or line.loss.resumable
        if line.outcome is None and not line.driven and taken_up:
            (mine if is_of_fleet(line.header, fleet, speed) else others).append(line)
    return mine, others


def is_of_fleet(header: "RunHeader", fleet: "Fleet", speed: float) -> bool:
    """Whether a run has this fleet, whatever its file is named, and this speed."""
    from m2pem.errors import JournalError
    from m2pem.fleet.fleet import dump, restore
    from m2pem.journal.mission import fleet_of

    here = replace(restore(dump(fleet)), file="")
    try:
        return header.speed == speed and replace(fleet_of(header), file="") == here
    except JournalError:
        return False


async def _start_us(journal: "Journal", lines: "list[RunInfo]", speed: float) -> int:
    """Now, or when the last of these runs was, if simulated time has run ahead.

    The schedule of a simulation counts, too: its times would come again.
    """
    from m2pem.cli.journals import last_decided_us

    times = [await last_decided_us(journal, line) for line in lines]
    if speed != 1.0:
        for entry in await journal.entries():
            times += [entry.plan.scheduled_us, *(each.at_us for each in entry.state.times)]
    return max([time.time_ns() // 1000, *times])


async def _take_up(executive: "Executive", lines: "list[RunInfo]") -> None:
    refused = await executive.resume_all([line.run for line in lines])
    for run, error in refused.items():
        click.echo(f"m2pem: {run} cannot be taken up: {error}", err=True)
