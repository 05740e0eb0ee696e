"""`m2pem runs`: what ran, and how it stands."""

import asyncio
from datetime import UTC, datetime
from typing import TYPE_CHECKING

import click

from m2pem.cli.options import as_json, example, format_option, journal_option
from m2pem.units import US_PER_S

if TYPE_CHECKING:
    from m2pem.api.control import RunSummary


@click.command(epilog=example("m2pem runs"))
@journal_option
@click.option(
    "--accept-loss",
    metavar="RUN",
    help="You have looked at the vehicles of a run that the journal has lost: new runs may begin.",
)
@format_option
def runs(journal: str | None, accept_loss: str | None, output: str) -> None:
    """List the runs of a journal."""
    found = asyncio.run(_runs(journal, accept_loss))
    if output == "json":
        import msgspec

        click.echo(as_json([{**msgspec.to_builtins(run), "took_s": run.took_s} for run in found]))
        return
    from m2pem.cli.table import table

    if not found:
        click.echo("no runs yet")
        return
    header = ("RUN", "STATUS", "STARTED (UTC)", "TOOK", "RECORDS", "PROCESS", "MISSION", "DETAIL")
    rows = [
        (
            run.run,
            run.status.value,
            _time(run.began_us or run.started_us),
            "-" if run.took_s is None else f"{run.took_s:.1f} s",
            str(run.records),
            run.process,
            run.mission,
            run.detail,
        )
        for run in found
    ]
    click.echo(table(header, rows))


async def _runs(url: str | None, accept_loss: str | None) -> "list[RunSummary]":
    from m2pem.cli.journals import accept, existing_journal, journal_to_read
    from m2pem.executive.control import summary

    async with journal_to_read(url) if accept_loss is None else existing_journal(url) as journal:
        if accept_loss is not None:
            await accept(journal, accept_loss)
        return [summary(line) for line in await journal.runs()]


def _time(time_us: int) -> str:
    return f"{datetime.fromtimestamp(time_us / US_PER_S, UTC):%Y-%m-%d %H:%M:%S}"
