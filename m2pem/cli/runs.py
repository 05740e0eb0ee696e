"""`m2pem runs`: what ran, and how it stands."""

import asyncio
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

import click

from m2pem.cli.completers import runs_of_journal
from m2pem.cli.options import as_json, example, format_option, journal_option
from m2pem.units import US_PER_S

if TYPE_CHECKING:
    from m2pem.api.runs import RunSummary
    from m2pem.journal.base import Journal, RunInfo


@click.command(epilog=example("m2pem runs --export r1 > r1.jsonl"))
@click.argument("run_ids", metavar="[RUN]...", nargs=-1, shell_complete=runs_of_journal(ended=True))
@journal_option
@click.option("--export", is_flag=True, help="Print these runs as JSON Lines, to keep them apart.")
@click.option("--versions", is_flag=True, help="List the versions of missions that runs have had.")
@click.option("--delete", is_flag=True, help="Delete these runs, with their tracks and recordings.")
@click.option("--force", is_flag=True, help="Delete runs that were interrupted, too.")
@click.option(
    "--accept-loss",
    metavar="RUN",
    help="You have looked at the vehicles of a run that the journal has lost: new runs may begin.",
)
@format_option
def runs(
    run_ids: tuple[str, ...],
    journal: str | None,
    export: bool,
    versions: bool,
    delete: bool,
    force: bool,
    accept_loss: str | None,
    output: str,
) -> None:
    """List the runs of a journal.

    Lists all, or those that are named. A run that an executive drives is never deleted; one that
    was interrupted only with --force: no executive knows then what its vehicles do.
    """
    if export + delete + versions > 1:
        raise click.UsageError("--export, --versions and --delete do not go together")
    if (export or delete) and not run_ids:
        raise click.UsageError(f"name the runs to {'export' if export else 'delete'}")
    if force and not delete:
        raise click.UsageError("--force goes with --delete")
    if export:
        asyncio.run(_export(journal, run_ids))
        return
    if delete:
        asyncio.run(_delete(journal, run_ids, force=force))
        click.echo(
            as_json({"deleted": run_ids}) if output == "json" else f"deleted: {', '.join(run_ids)}"
        )
        return
    if versions:
        _print_versions(asyncio.run(_versions(journal, run_ids)), output)
        return
    found = asyncio.run(_runs(journal, run_ids, accept_loss))
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


async def _runs(
    url: str | None, run_ids: tuple[str, ...], accept_loss: str | None
) -> "list[RunSummary]":
    from m2pem.cli.journals import accept, existing_journal, find_run, journal_to_read
    from m2pem.executive.run_summary import summary

    async with journal_to_read(url) if accept_loss is None else existing_journal(url) as journal:
        if accept_loss is not None:
            await accept(journal, accept_loss)
        if run_ids:
            return [summary(await find_run(journal, run)) for run in run_ids]
        return [summary(line) for line in await journal.runs()]


async def _versions(url: str | None, run_ids: tuple[str, ...]) -> "list[dict[str, Any]]":
    """Return each version of a mission that a run has had, in the order of the runs."""
    from m2pem.cli.journals import find_run, journal_to_read
    from m2pem.executive.run_summary import summary
    from m2pem.executive.run_versions import versions_of

    found: list[dict[str, Any]] = []
    async with journal_to_read(url) as journal:
        lines = [await find_run(journal, run) for run in run_ids] or await journal.runs()
        for line in lines:
            if line.gone:
                continue
            had = [version for version, _ in await versions_of(journal, line)]
            for each in had:
                found.append(
                    {
                        "run": line.run,
                        "status": summary(line).status.value,
                        "version": each.version,
                        "mission": each.mission,
                        "seq": each.seq,
                        "at_us": each.at_us,
                        "by": each.by,
                        "is_last": each is had[-1],
                    }
                )
    return found


def _print_versions(found: "list[dict[str, Any]]", output: str) -> None:
    if output == "json":
        click.echo(as_json(found))
        return
    from m2pem.cli.table import table
    from m2pem.mission.mission import SHORT

    if not found:
        click.echo("no runs yet")
        return
    header = ("RUN", "STATUS", "VERSION", "", "SINCE (UTC)", "FROM RECORD", "BY", "MISSION")
    rows = [
        (
            each["run"],
            each["status"],
            each["version"][:SHORT],
            "last" if each["is_last"] else "",
            _time(each["at_us"]),
            str(each["seq"]),
            each["by"],
            each["mission"],
        )
        for each in found
    ]
    click.echo(table(header, rows))


async def _export(url: str | None, run_ids: tuple[str, ...]) -> None:
    from m2pem.cli.journals import find_run, journal_to_read
    from m2pem.journal.export import exported_lines

    async with journal_to_read(url) as journal:
        for line in [await find_run(journal, run) for run in run_ids]:
            async for exported in exported_lines(journal, line):
                print(exported.decode())


async def _delete(url: str | None, run_ids: tuple[str, ...], *, force: bool) -> None:
    from m2pem.api.operator import operator_name
    from m2pem.cli.journals import existing_journal, find_run
    from m2pem.errors import OperatorError
    from m2pem.executive.retention import delete_runs

    async with existing_journal(url) as journal:
        for line in [await find_run(journal, run) for run in run_ids]:
            if line.outcome is None and not line.driven:
                left = await _left(journal, line)
                if not force:
                    raise OperatorError(f"not deleted: {left}; --force deletes it all the same")
                click.echo(f"m2pem: deleted although {left}", err=True)
        await delete_runs(journal, run_ids, by=operator_name(), unended=force)


async def _left(journal: "Journal", line: "RunInfo") -> str:
    """Say what an interrupted run was doing, also where its mission cannot be read any more."""
    from m2pem.cli.journals import interruption
    from m2pem.errors import M2pemError

    try:
        return (await interruption(journal, line)).as_text()
    except M2pemError as error:
        return f"{line.run} was interrupted, and what it was doing cannot be read: {error}"


def _time(time_us: int) -> str:
    return f"{datetime.fromtimestamp(time_us / US_PER_S, UTC):%Y-%m-%d %H:%M:%S}"
