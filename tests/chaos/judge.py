"""The judge of a round: what its journal, its vehicles and its operators' screens must agree on."""

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import TYPE_CHECKING

from m2pem.cli.replay import Verification
from m2pem.engine import records as r
from m2pem.journal import Journal, RunInfo, open_journal
from m2pem.journal.codec import record_line
from m2pem.mission.catalogue import BehaviorState

if TYPE_CHECKING:
    from tests.chaos.rounds import Evidence

End = tuple[str, Counter[str]]
"""How a run ended, and how its tokens left its elements."""


@dataclass
class Verdict:
    """What came of a round. `faults`: what must not be; `ends`: of each mission.

    `asked`: questions after a restart, which a policy or an unexplained hold had asked. `begun`:
    what vehicles began; `requested`: behaviors that the journal requested.
    """

    faults: list[str] = field(default_factory=list)
    ends: dict[str, End] = field(default_factory=dict)
    asked: int = 0
    begun: int = 0
    requested: int = 0


@dataclass
class _Run:
    info: RunInfo
    records: list[r.Record] = field(default_factory=list)
    lines: list[str] = field(default_factory=list)
    difference: str = ""


async def judge(evidence: "Evidence", expected: Mapping[str, End] | None) -> Verdict:
    """Judge a round. `expected`: how each mission ends undisturbed; None: that is not known."""
    verdict = Verdict()
    journal = open_journal(str(evidence.journal))
    try:
        runs = [await _read(journal, info) for info in await journal.runs()]
    finally:
        await journal.close()
    begun = [run for run in runs if run.records]  # others were created, and never began
    for run in begun:
        verdict.faults += _run_faults(run, evidence)
    verdict.faults += _lost_faults(begun, evidence)
    verdict.faults += _vehicle_faults(begun, evidence, verdict)
    by_mission: dict[str, list[_Run]] = {each.name: [] for each in evidence.world.missions}
    for run in begun:
        by_mission[run.info.header.mission_name].append(run)
    for name, some in by_mission.items():
        if evidence.stopped and not some:
            continue
        if len(some) != 1:
            verdict.faults.append(
                f"{name} has {len(some)} runs: {[each.info.run for each in some]}"
            )
            continue
        verdict.ends[name] = end = _end(some[0])
        if expected is not None and end != expected[name]:
            verdict.faults.append(f"{name} ended as {_difference(end, expected[name])}")
    verdict.asked = sum(
        isinstance(record, r.BehaviorUnsettled) for run in begun for record in run.records
    )
    if "Traceback" in evidence.errors:
        verdict.faults.append(f"an exception: {evidence.errors[-2000:]}")
    return verdict


async def _read(journal: Journal, info: RunInfo) -> _Run:
    """Read a run: its hashes are compared on the way, and its inputs decided again."""
    run, verification = _Run(info), Verification(info)
    async for entry in journal.read(info.run):
        if not run.difference and not verification.agrees(entry):
            run.difference = verification.as_text()
        for seq, record in enumerate(entry.records, entry.seq):
            run.records.append(record)
            run.lines.append(record_line(info.run, seq, entry.t_us, record).decode())
    return run


def _run_faults(run: _Run, evidence: "Evidence") -> list[str]:
    faults = []
    if run.info.loss is not None:
        faults.append(f"{run.info.run}: {run.info.loss}")
    if run.info.outcome is None:
        faults.append(f"{run.info.run} has not ended")
    if run.difference:
        faults.append(run.difference)
    left = [each.element for each in run.records if isinstance(each, r.TokenLeft)]
    mission = next(e for e in evidence.world.missions if e.name == run.info.header.mission_name)
    for order in () if evidence.stopped else mission.orders:
        places = [left.index(each) for each in order if each in left]
        if len(places) != len(order) or any(a > b for a, b in pairwise(places)):
            faults.append(f"{run.info.run}: not in the order {' '.join(order)}: {' '.join(left)}")
    return faults


def _lost_faults(runs: Sequence[_Run], evidence: "Evidence") -> list[str]:
    """What an operator has seen must be in the journal, unchanged."""
    journaled = {line for run in runs for line in run.lines}
    faults = [
        f"printed, and not in the journal: {line}"
        for line in evidence.printed
        if "record" in json.loads(line) and line not in journaled
    ]
    known = {run.info.run: run for run in runs}
    for mission, acknowledged in evidence.acknowledged.items():
        for number in acknowledged:
            if number not in known:
                faults.append(f"{mission} was started as {number}, and the journal has no such run")
    for number, prompt in evidence.answered:
        answers = known[number].records if number in known else []
        if not any(
            isinstance(each, r.PromptAnswered) and each.prompt == prompt for each in answers
        ):
            faults.append(f"the answer to {number}.{prompt} was acknowledged, and is not there")
    return faults


def _vehicle_faults(runs: Sequence[_Run], evidence: "Evidence", verdict: Verdict) -> list[str]:
    """Vehicles do what the journal has requested, once, and one thing at a time."""
    records = [each for run in runs for each in run.records]
    requested = {each.behavior: each for each in records if isinstance(each, r.BehaviorRequested)}
    again = Counter(each.behavior for each in records if isinstance(each, r.BehaviorRestarted))
    ended = [each for each in records if isinstance(each, r.BehaviorEnded)]
    done = {each.behavior for each in ended if each.state is BehaviorState.SUCCEEDED}
    by_element = {each.element: each.behavior for each in requested.values()}
    begun = [
        each
        if each.behavior
        else replace(
            each,
            behavior=by_element.get(each.element, each.element),
            overlaps=by_element.get(each.overlaps, each.overlaps),
        )
        for each in evidence.world.begun()
    ]
    counts = Counter(each.behavior for each in begun)
    verdict.begun, verdict.requested = len(begun), len(requested)
    faults = []
    for each in begun:
        known = requested.get(each.behavior)
        if known is None:
            faults.append(
                f"{each.vehicle} began {each.behavior}, which the journal did not request"
            )
        elif each.overlaps and each.overlaps not in known.preempts:
            faults.append(f"{each.vehicle} began {each.behavior} while it did {each.overlaps}")
    for behavior, count in counts.items():
        if count > 1 + again[behavior]:
            faults.append(f"{behavior} was begun {count} times, and restarted {again[behavior]}")
    faults += [f"{each} succeeded, and was never begun" for each in done if not counts[each]]
    return faults


def _end(run: _Run) -> End:
    left = [each for each in run.records if isinstance(each, r.TokenLeft)]
    outcome = run.info.outcome.value if run.info.outcome is not None else "none"
    return outcome, Counter(f"{each.element} {each.outcome.value}" for each in left)


def _difference(end: End, expected: End) -> str:
    return (
        f"{end[0]}, not {expected[0]}; more: {end[1] - expected[1]}, less: {expected[1] - end[1]}"
    )
