"""`m2pem replay`: a run from its journal, by applying its records alone."""

import asyncio
import json
import sys
from collections.abc import Callable, Sequence
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from m2pem.cli.completers import runs_of_journal
from m2pem.cli.options import (
    UnusableError,
    as_json,
    example,
    fleet_option,
    format_option,
    journal_option,
)
from m2pem.findings import unreadable_remedy

if TYPE_CHECKING:
    from m2pem.cli.line_formatter import LineFormatter
    from m2pem.engine.run import Step
    from m2pem.journal.base import Entry, Journal, RunInfo
    from m2pem.mission.mission import Mission


@click.command(epilog=example("m2pem replay r1 --verify"))
@click.argument("run_id", metavar="RUN", required=False, shell_complete=runs_of_journal(ended=True))
@journal_option
@click.option(
    "--verify",
    is_flag=True,
    help="Check that all entries are there, decide every input again, and compare.",
)
@click.option("--state", "state_only", is_flag=True, help="Print only the run's state.")
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
    """Print the records of a run, and its state.

    The state is rebuilt by applying the journaled records alone, as after a crash. With --verify
    every input is decided again instead, and the first difference ends it with status 1; so does
    an entry that was changed, or one that was acknowledged and is gone.

    With --counterexample no journal is read: a run that violates a property is played step by
    step, and the engine's records are printed. It ends with 1 if the engine does not follow it.
    """
    if counterexample is not None:
        if run_id is not None or verify or state_only:
            raise click.UsageError("--counterexample goes with no RUN, --verify or --state")

        return replay_counterexample(counterexample, mission, fleet_file, violation, output)
    if run_id is None:
        raise click.UsageError("name a RUN, or a report with --counterexample")
    if verify and state_only:
        raise click.UsageError("--verify and --state do not go together")
    return asyncio.run(_replay(run_id, journal, verify, state_only, output))


async def _replay(run_id: str, url: str | None, verify: bool, state_only: bool, output: str) -> int:
    from m2pem.cli.journals import find_run, journal_to_read
    from m2pem.cli.notes import progress_line, share

    async with journal_to_read(url) as journal:
        line = await find_run(journal, run_id)
        # On a terminal the records themselves are the progress.
        wanted = verify or state_only or not sys.stdout.isatty()
        with progress_line(wanted=wanted) as show:
            read = 0

            def done(records: int) -> None:
                nonlocal read
                read += records
                show(lambda: share(read, line.last_seq, "records"))

            if verify:
                return await _verify(journal, line, output, done)
            return await _print(journal, line, state_only, output, done)


async def _print(
    journal: "Journal", line: "RunInfo", state_only: bool, output: str, done: Callable[[int], None]
) -> int:
    from m2pem.api.runs import StampedRecord
    from m2pem.cli.line_formatter import LineFormatter
    from m2pem.cli.output import wants_colour
    from m2pem.cli.status import RunStatusView
    from m2pem.journal.codec import record_line
    from m2pem.units import US_PER_S

    standing = RunStatusView(line)
    lines = LineFormatter(lambda _: standing.mission, colour=wants_colour(sys.stdout))
    async for entry in journal.read(line.run):
        for seq, record in enumerate(entry.records, entry.seq):
            standing.take(record, entry.input)
            if state_only:
                continue
            if output == "json":
                print(record_line(line.run, seq, entry.t_us, record).decode())
            elif formatted := lines.format(
                StampedRecord(line.run, seq, entry.t_us / US_PER_S, record)
            ):
                print(formatted)
        done(len(entry.records))
    if output == "text":
        print(standing.as_text())
    elif state_only:
        print(as_json(standing.as_data()))
    return 0


async def _verify(
    journal: "Journal", line: "RunInfo", output: str, done: Callable[[int], None]
) -> int:

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


VERSIONS = (1,)
NEVER_COMPLETES = frozenset({"no-deadlock", "can-complete", "completes-if-fair", "no-livelock"})
"""Properties of which no run that completes is a counterexample."""


def replay_counterexample(
    file: Path, mission_file: str | None, fleet_file: str | None, number: int, output: str
) -> int:
    """Play violation `number` (from 1) of a JSON report. 0: the engine did all of the run."""
    from m2pem.cli.line_formatter import LineFormatter
    from m2pem.cli.output import wants_colour
    from m2pem.executive.verification import known_ways
    from m2pem.scripting.sources import DEFAULT_FLEET, fleet_of
    from m2pem.verify.conformance_run import ConformanceRun, NotPlayableError

    report = _read(file)
    violation = _violation(file, report, number)
    mission = _mission(file, report, mission_file)
    fleet = fleet_of(fleet_file or DEFAULT_FLEET, mission)
    ways = known_ways(fleet, mission)
    steps = [*violation["steps"], *violation["loop"]]
    together = report.get("together", ())
    player = ConformanceRun(
        mission, fleet, report["process"], report["data"], ways, steps, together
    )
    lines = LineFormatter(lambda _: mission, colour=wants_colour(sys.stdout))
    _say(output, f"{violation['property']}: {violation['text']}")
    _show(player.steps, lines, output)
    problem = ""
    for step in steps:
        _say(output, f"step {step['step']}: {step['text']}")
        try:
            _show(player.play(step), lines, output)
        except NotPlayableError as error:
            problem = str(error)
            break
    problem = problem or violation.get("doubt", "")
    if not problem and player.undone:
        problem = f"the engine did not take {', '.join(player.undone)}"
    if not problem and violation["property"] in NEVER_COMPLETES and player.completed:
        problem = "its run has completed"
    if problem:
        click.echo(f"the engine does not follow: {problem}", err=True)
        return 1
    left = ", ".join(player.where)
    _say(output, f"the engine did all of it; {f'tokens are at {left}' if left else 'it is over'}")
    return 0


def _say(output: str, text: str) -> None:
    from m2pem.api.description import printable

    if output == "text":
        click.echo(printable(text))


def _show(steps: "Sequence[Step]", lines: "LineFormatter", output: str) -> None:
    from m2pem.api.runs import StampedRecord
    from m2pem.journal.codec import record_line
    from m2pem.units import US_PER_S

    for step in steps:
        for seq, record in enumerate(step.records, step.seq):
            if output == "json":
                click.echo(record_line("r1", seq, step.t_us, record).decode())
            elif formatted := lines.format(StampedRecord("r1", seq, step.t_us / US_PER_S, record)):
                click.echo(formatted)


def _read(file: Path) -> dict[str, Any]:
    try:
        report = json.loads(file.read_bytes())
    except OSError as error:
        remedy = unreadable_remedy(error)
        raise UnusableError(f"{file} cannot be read: {error.strerror}; {remedy}") from error
    except (ValueError, RecursionError) as error:
        raise UnusableError(f"{file} is no JSON: {error}") from error
    if not isinstance(report, dict) or report.get("version") not in VERSIONS:
        raise UnusableError(
            f"{file} is no report of `m2pem verify --report FILE.json` of version "
            f"{', '.join(map(str, VERSIONS))}"
        )
    return report


def _violation(file: Path, report: dict[str, Any], number: int) -> dict[str, Any]:
    runs: list[dict[str, Any]] = [each for each in report["violations"] if each["steps"]]
    if number > len(runs):
        known = f"it has {len(runs)}" if runs else "it has none"
        raise UnusableError(f"{file} has no violation {number} with a run: {known}")
    return runs[number - 1]


def _mission(file: Path, report: dict[str, Any], mission_file: str | None) -> "Mission":
    from m2pem.executive.loading import load_source

    mission = load_source(mission_file or report["mission"])
    if sha256(mission.source).hexdigest() != report["sha256"]:
        raise UnusableError(
            f"{mission.file} is not as it was when {file} was written: verify it again"
        )
    return mission


class Verification:
    """`difference` says where the first one is; it is empty as long as there is none."""

    def __init__(self, line: "RunInfo") -> None:
        from m2pem.cli.status import run_of

        self.difference: dict[str, Any] = {}
        self._run_id = line.run
        self._loss = line.loss
        self._run = run_of(line)
        self._inputs = 0
        self._records = 0

    def agrees(self, entry: "Entry") -> bool:
        """Decide the entry's input, and compare what comes of it with the entry's records."""
        step = self._run.receive(entry.input, entry.at_us)
        then = [self._line(entry.seq + n, entry.t_us, each) for n, each in enumerate(entry.records)]
        now = [self._line(step.seq + n, step.t_us, each) for n, each in enumerate(step.records)]
        if then == now:
            self._inputs += 1
            self._records += len(then)
            return True
        place = next(
            (n for n, (one, other) in enumerate(zip(then, now, strict=False)) if one != other),
            min(len(then), len(now)),
        )
        self.difference = {
            "seq": entry.seq + place,
            "input": type(entry.input).__name__,
            "journal": then[place] if place < len(then) else None,
            "decided": now[place] if place < len(now) else None,
        }
        return False

    def _line(self, seq: int, t_us: int, record: Any) -> str:
        from m2pem.journal.codec import record_line

        return record_line(self._run_id, seq, t_us, record).decode()

    def as_data(self) -> dict[str, Any]:
        """Return the comparison as JSON values."""
        return {
            "run": self._run_id,
            "inputs": self._inputs,
            "records": self._records,
            "difference": self.difference or None,
            "loss": str(self._loss) if self._loss is not None else None,
        }

    def as_text(self) -> str:
        """Return the comparison as text."""
        same = f"{self._run_id}: {self._inputs} inputs decided again, {self._records} records"
        loss = f"\n{self._run_id}: {self._loss}" if self._loss is not None else ""
        if not self.difference:
            return f"{same}, all the same{loss}"
        return (
            f"{same} the same; then {self.difference['input']} differs at record "
            f"{self.difference['seq']}\n"
            f"  journal: {self.difference['journal'] or 'no more records'}\n"
            f"  decided: {self.difference['decided'] or 'no more records'}{loss}"
        )
