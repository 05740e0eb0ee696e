"""Examines one file: reads it, judges its findings, and rehearses what loads."""

import re
import traceback
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cache
from pathlib import Path

from m2pem.api.runs import RunStatus, StampedRecord
from m2pem.bpmn import NO_BPMN_RULES
from m2pem.errors import FleetError, MissionError
from m2pem.executive.loading import findings_for, load_source
from m2pem.findings import Finding, Severity, has_errors
from m2pem.fleet.default_fleet import fleet_for
from m2pem.mission.mission import Mission
from m2pem.plugins import PluginManager
from m2pem.rehearsal.rehearsal import rehearse
from tools.corpora.flaws import flaws

MAX_STEPS = 5_000
"""Of a rehearsal. Most models that end do so in far fewer; many others draw endless loops."""


class Outcome(StrEnum):
    """What became of a file."""

    LOADED = "loaded"
    REFUSED = "refused"
    NO_BPMN = "no BPMN"


@dataclass(frozen=True, slots=True)
class Examination:
    """`rules`: those of the errors, each once, with a message. `ends`: how each process ended.

    `problems`: what m2pem did wrong; none, if all is well.
    """

    outcome: Outcome
    rules: dict[str, str] = field(default_factory=dict)
    ends: tuple[str, ...] = ()
    problems: tuple[str, ...] = ()


def examine(path: Path, max_steps: int = MAX_STEPS) -> Examination:
    """Read a file; judge the findings; rehearse it from each of its processes if it loads."""
    try:
        try:
            mission = load_source(path)
        except MissionError as error:
            return _refused(error.findings)
        problems = list(_flaws(findings_for(mission, None, plugins())))
        ends: list[str] = []
        own = [each for each in mission.processes if mission.file_of(each) == str(path)]
        for process in own:
            if process.global_task:
                continue
            end, problem = _rehearse(mission, process.id, max_steps)
            ends.append(end)
            if problem:
                problems.append(f"rehearsed from process '{process.id}': {problem}")
    except Exception:
        return Examination(Outcome.LOADED, problems=(traceback.format_exc(),))
    return Examination(Outcome.LOADED, ends=tuple(ends), problems=tuple(problems))


@cache
def plugins() -> PluginManager:
    """Nothing but what m2pem brings along."""
    return PluginManager(block=("all",))


def _flaws(findings: Sequence[Finding]) -> Iterator[str]:
    """What is wrong with findings, each in the file that it names."""
    for name in {finding.file for finding in findings}:
        here = [finding for finding in findings if finding.file == name]
        yield from flaws(Path(name).read_bytes(), name, here)


def _refused(findings: tuple[Finding, ...]) -> Examination:
    rules = {
        each.rule: f"{each.message}; {each.remedy}"
        for each in reversed(findings)
        if each.severity is Severity.ERROR
    }
    problems = list(_flaws(findings))
    if not rules:
        problems.append("it is refused without an error among the findings")
    outcome = Outcome.NO_BPMN if NO_BPMN_RULES & rules.keys() else Outcome.REFUSED
    return Examination(outcome, rules, problems=tuple(problems))


def _rehearse(mission: Mission, process: str, max_steps: int) -> tuple[str, str]:
    """How the rehearsal ended, in a few words; and what was wrong with that, or ""."""
    seqs: list[int] = []

    def listen(stamped: StampedRecord) -> None:
        seqs.append(stamped.seq)

    try:
        result = rehearse(
            mission,
            fleet_for(mission),
            plugins=plugins(),
            process=process,
            max_steps=max_steps,
            on_record=listen,
        )
    except (MissionError, FleetError) as error:
        return "refused", "" if has_errors(error.findings) else f"no error among {error.findings}"
    summary = result.summary
    return _end(summary.status, summary.detail), "\n".join(
        _oddities(summary.status, summary.detail, seqs, summary.records)
    )


def _end(status: RunStatus, detail: str) -> str:
    if status is not RunStatus.FAILED:
        return status.value
    if detail.startswith("it has taken"):
        return "failed: it took too many steps"
    uncaught = re.match(r"error (\S+) from", detail)
    return f"failed: error {uncaught[1]}" if uncaught else f"failed: {re.split('[:;]', detail)[0]}"


def _oddities(status: RunStatus, detail: str, seqs: list[int], records: int) -> Iterator[str]:
    if status not in (RunStatus.COMPLETED, RunStatus.TERMINATED, RunStatus.FAILED):
        yield f"it ended as {status}"
    if status is RunStatus.FAILED and not detail:
        yield "it failed without a word"
    if seqs != list(range(seqs[0] if seqs else 0, len(seqs) + (seqs[0] if seqs else 0))):
        yield "its records are not numbered in a row"
    if len(seqs) != records:
        yield f"it told of {len(seqs)} records, and counted {records}"
