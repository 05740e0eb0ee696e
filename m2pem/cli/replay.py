"""`m2pem replay`: a run from its journal, by applying its records alone."""

import asyncio
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from m2pem.cli.options import as_json, example, fleet_option, format_option, journal_option

if TYPE_CHECKING:
    from m2pem.cli.progress import Progress
    from m2pem.journal.base import Journal, RunInfo


@click.command(epilog=example("m2pem replay r1 --verify"))
@click.argument("run_id", metavar="RUN", required=False)
@journal_option
@click.option(
    "--verify",
    is_flag=True,
    help="Check that all entries are there, decide every input again, and compare.",
)
@click.option("--state", "state_only", is_flag=True, help="Print only how it stands.")
@click.option(
    "--counterexample",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE.json",
    help="Play a run of a report of `m2pem verify` to the engine instead.",
)
@click.option(
    "--violation",
    type=click.IntRange(min=1),
    default=1,
    show_default=True,
    help="Which of the report's violations that have a run.",
)
@click.option("--mission", metavar="MISSION", help="The report's mission, if it is elsewhere now.")
@fleet_option(required=False)
@format_option
def replay(
    run_id: str | None,
    journal: str | None,
    verify: bool,
    state_only: bool,
    counterexample: Path | None,
    violation: int,
    mission: str | None,
    fleet_file: str | None,
    output: str,
) -> int:
    """Print what happened in a run, and how it stands.

    The state is rebuilt by applying the journaled records alone, as after a crash. With --verify
    every input is decided again instead, and the first difference ends it with status 1; so does
    an entry that was changed, or one that was acknowledged and is gone.

    With --counterexample no journal is read: a run that violates a property is played step by
    step, and the engine's records are printed. It ends with 1 if the engine does not follow it.
    """
    if counterexample is not None:
        if run_id is not None or verify or state_only:
            raise click.UsageError("--counterexample goes with no RUN, --verify or --state")
        from m2pem.cli.counterexample import replay_counterexample

        return replay_counterexample(counterexample, mission, fleet_file, violation, output)
    if run_id is None:
        raise click.UsageError("name a RUN, or a report with --counterexample")
    if verify and state_only:
        raise click.UsageError("--verify and --state do not go together")
    return asyncio.run(_replay(run_id, journal, verify, state_only, output))


async def _replay(run_id: str, url: str | None, verify: bool, state_only: bool, output: str) -> int:
    from m2pem.cli.journals import find_run, journal_to_read
    from m2pem.cli.progress import progress

    async with journal_to_read(url) as journal:
        line = await find_run(journal, run_id)
        # On a terminal the records themselves are the progress.
        shown = verify or state_only or not sys.stdout.isatty()
        with progress(f"{run_id}: records", line.last_seq, shown=shown) as done:
            if verify:
                return await _verify(journal, line, output, done)
            return await _print(journal, line, state_only, output, done)


async def _print(
    journal: "Journal", line: "RunInfo", state_only: bool, output: str, done: "Progress"
) -> int:
    from m2pem.api.control import StampedRecord
    from m2pem.cli.output import US_PER_S, wants_colour
    from m2pem.cli.standing import Standing
    from m2pem.cli.story import Story
    from m2pem.journal.codec import record_line

    standing = Standing(line)
    story = Story(lambda _: standing.mission, colour=wants_colour(sys.stdout))
    async for entry in journal.read(line.run):
        for seq, record in enumerate(entry.records, entry.seq):
            standing.take(record)
            if state_only:
                continue
            if output == "json":
                print(record_line(line.run, seq, entry.t_us, record).decode())
            elif told := story.tell(StampedRecord(line.run, seq, entry.t_us / US_PER_S, record)):
                print(told)
        done(len(entry.records))
    if output == "text":
        print(standing.as_text())
    elif state_only:
        print(as_json(standing.as_data()))
    return 0


async def _verify(journal: "Journal", line: "RunInfo", output: str, done: "Progress") -> int:
    from m2pem.cli.verification import Verification

    verification = Verification(line)
    async for entry in journal.read(line.run):
        if not verification.agrees(entry):
            break
        done(len(entry.records))
    if output == "json":
        print(as_json(verification.as_data()))
    else:
        print(verification.as_text())
    return 1 if verification.difference or line.loss else 0
