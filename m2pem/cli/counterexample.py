"""Plays a run that `m2pem verify` reported to the engine, and prints what the engine does."""

import json
import sys
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from m2pem.cli.options import UnusableError
from m2pem.findings import unreadable_remedy

if TYPE_CHECKING:
    from collections.abc import Sequence

    from m2pem.cli.story import Story
    from m2pem.engine.run import Step
    from m2pem.mission.mission import Mission

VERSIONS = (1,)


def replay_counterexample(
    file: Path, mission_file: str | None, fleet_file: str | None, number: int, output: str
) -> int:
    """Play violation `number` (from 1) of a JSON report. 0: the engine did all of the run."""
    from m2pem.cli.given import get_fleet
    from m2pem.cli.output import wants_colour
    from m2pem.cli.story import Story
    from m2pem.verify.conformance_run import NotPlayableError, Player

    report = _read(file)
    violation = _violation(file, report, number)
    mission = _mission(file, report, mission_file)
    fleet = get_fleet(fleet_file or "sim", mission)
    player = Player(mission, fleet, report["process"], report["data"])
    story = Story(lambda _: mission, colour=wants_colour(sys.stdout))
    _say(output, f"{violation['property']}: {violation['text']}")
    _show(player.steps, story, output)
    problem = ""
    for step in [*violation["steps"], *violation["loop"]]:
        _say(output, f"step {step['step']}: {step['text']}")
        try:
            _show(player.play(step), story, output)
        except NotPlayableError as error:
            problem = str(error)
            break
    if not problem and player.undone:
        problem = f"the engine did not take {', '.join(player.undone)}"
    if problem:
        click.echo(f"the engine does not follow: {problem}", err=True)
        return 1
    left = ", ".join(player.where)
    _say(output, f"the engine did all of it; {f'tokens are at {left}' if left else 'it is over'}")
    return 0


def _say(output: str, text: str) -> None:
    from m2pem.cli.story import printable

    if output == "text":
        click.echo(printable(text))


def _show(steps: "Sequence[Step]", story: "Story", output: str) -> None:
    from m2pem.api.control import StampedRecord
    from m2pem.cli.output import US_PER_S
    from m2pem.journal.codec import record_line

    for step in steps:
        for seq, record in enumerate(step.records, step.seq):
            if output == "json":
                click.echo(record_line("r1", seq, step.t_us, record).decode())
            elif told := story.tell(StampedRecord("r1", seq, step.t_us / US_PER_S, record)):
                click.echo(told)


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
