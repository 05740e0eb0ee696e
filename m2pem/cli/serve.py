"""`m2pem serve`: the executive as a service; operators start missions."""

import asyncio
import re
import time
from pathlib import Path
from typing import TYPE_CHECKING

import click

from m2pem.cli.options import (
    example,
    fleet_option,
    format_option,
    journal_option,
    ocu_option,
    path_option,
    simulate_option,
    speed_option,
)

if TYPE_CHECKING:
    from m2pem.executive.executive import Executive
    from m2pem.fleet.fleet import Fleet
    from m2pem.journal.base import Journal, RunHeader, RunInfo


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
@path_option
@simulate_option
@speed_option
@click.option(
    "--keep",
    "keep_s",
    type=DaysOption(),
    metavar="DAYS",
    help="Delete runs that ended longer ago than this, such as 30d or 12h, at the start and each "
    "day  [default: keep all]",
)
@format_option
def serve(
    fleet_file: str,
    journal: str | None,
    ocu_names: str | None,
    search_path: tuple[Path, ...],
    simulate: bool,
    speed: float,
    keep_s: float | None,
    output: str,
) -> int:
    """Serve operators, who start missions, until stopped.

    Takes up runs of the journal that were interrupted, if they had this fleet. Ctrl-C or SIGTERM
    stop the runs, wait until their vehicles are released, and end it with 0.
    """
    return asyncio.run(
        _serve(fleet_file, journal, ocu_names, search_path, simulate, speed, keep_s, output)
    )


async def _serve(
    fleet_file: str,
    journal_url: str | None,
    ocu_names: str | None,
    search_path: tuple[Path, ...],
    simulated: bool,
    speed: float,
    keep_s: float | None,
    output: str,
) -> int:
    from m2pem.api.clock import SystemClock
    from m2pem.api.operator import operator_name
    from m2pem.cli.journals import journal_at, url_of
    from m2pem.cli.notes import note
    from m2pem.cli.ocus import Operators, chosen
    from m2pem.cli.output import output_of
    from m2pem.cli.session import driving, make_executive, refuse_speed
    from m2pem.executive.retention import keep_runs
    from m2pem.executive.simulated_state import tidy_up, with_shared_state
    from m2pem.fleet.fleet import simulated_fleet
    from m2pem.fleet.fleet_file import load_fleet
    from m2pem.journal import file_of
    from m2pem.plugins import PluginManager
    from m2pem.scripting.sources import DEFAULT_FLEET

    if fleet_file == DEFAULT_FLEET:
        raise click.UsageError(
            f"--fleet {DEFAULT_FLEET}: a fleet is made up from a mission; name a file"
        )
    plugins = PluginManager()
    operators = Operators(chosen(ocu_names, plugins), plugins)
    url = url_of(journal_url)
    written = load_fleet(fleet_file)
    fleet = simulated_fleet(written) if simulated else written
    fleet = with_shared_state(fleet, file_of(url), written)
    refuse_speed(fleet, speed)
    async with journal_at(url) as journal:
        mine, _ = await interrupted_runs(journal, fleet, speed)
        clock = SystemClock(speed, await _start_us(journal, mine, speed))
        executive = make_executive(fleet, journal, plugins, clock, search_path=search_path)
        executive.expect_interrupted([line.run for line in mine])
        with output_of(output) as out:
            async with driving(executive, out, operators, file_of(url), one=False) as interruption:
                who = ", ".join(operators.names) or "none"
                note(f"m2pem: serving {fleet.name}; operators: {who}")
                await executive.load_schedule()
                # Again: runs that were created for the schedule and never began are gone.
                mine, others = await interrupted_runs(journal, fleet, speed)
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
                retention: asyncio.Task[None] | None = None
                if keep_s is not None:
                    kept = keep_runs(journal, keep_s, clock, by=operator_name())
                    retention = asyncio.create_task(kept, name="retention of runs")
                await interruption.asked.wait()
                if retention is not None:
                    retention.cancel()
        tidy_up(executive, file_of(url))
    return 0


async def interrupted_runs(
    journal: "Journal", fleet: "Fleet", speed: float
) -> "tuple[list[RunInfo], list[RunInfo]]":
    """The runs that no executive drives: those with the same fleet, and the others."""
    from m2pem.errors import JournalError
    from m2pem.fleet.fleet import dump, restore
    from m2pem.journal.mission import fleet_of

    here = restore(dump(fleet))

    def is_of_this_fleet(header: "RunHeader") -> bool:
        try:
            return header.speed == speed and fleet_of(header) == here
        except JournalError:
            return False

    mine: list[RunInfo] = []
    others: list[RunInfo] = []
    for line in await journal.runs():
        taken_up = line.loss is None or line.loss.resumable
        if line.outcome is None and not line.driven and taken_up:
            (mine if is_of_this_fleet(line.header) else others).append(line)
    return mine, others


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
