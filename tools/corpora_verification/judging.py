"""What a check says of one file: refused, or a verdict for each property."""

import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from m2pem.bpmn import parse_mission
from m2pem.errors import MissionError
from m2pem.executive.loading import findings_for
from m2pem.findings import Severity
from m2pem.plugins import PluginManager
from m2pem.verify.assumptions import NO_FAILURES
from m2pem.verify.check import Report, check
from m2pem.verify.properties.results import Verdict
from m2pem.verify.search.explore import Limits
from m2pem.verify.translate import Options
from tools.corpora_verification.sketches import UNREACHABLE, WORK, read_sketch

FOR_THE_CHECK = 0.9
"""Of the time for a file: the check is told so much, and all that is done has the rest."""
TOKENS = 3
"""On one place, as `m2pem verify` has it."""


@dataclass(frozen=True, slots=True)
class Judgement:
    """`refused`: rules of the findings that are errors; then there are no verdicts.

    `filled`: rules of what a sketch left unsaid. `violated`, `undecided`: by property, what was
    said first; what is in neither holds. `cpu_s`, `wall_s`: of reading and checking.
    """

    refused: tuple[str, ...] = ()
    filled: tuple[str, ...] = ()
    violated: Mapping[str, str] = field(default_factory=dict)
    undecided: Mapping[str, str] = field(default_factory=dict)
    states: int = 0
    rules: int = 0
    wall_s: float = 0.0
    cpu_s: float = 0.0

    @property
    def decided(self) -> bool:
        """Whether every property holds or is violated."""
        return not self.refused and not self.undecided


@dataclass(frozen=True, slots=True)
class Terms:
    """How files are judged: the limits of each, and what is assumed.

    `as_drawn`: as `m2pem verify` does, by itself. Else what a sketch leaves unsaid is filled in,
    what no start event reaches is no reason to refuse it, and `open_world` says whether messages
    and signals may come from anywhere.
    """

    seconds: float = 2.0
    memory_mb: float = 500.0
    as_drawn: bool = False
    open_world: bool = True


def judge(path: Path, terms: Terms) -> Judgement:
    """Read a file, and check every property."""
    began, cpu = time.monotonic(), time.process_time()

    def took() -> tuple[float, float]:
        return time.monotonic() - began, time.process_time() - cpu

    data = path.read_bytes()
    filled: tuple[str, ...] = ()
    try:
        if terms.as_drawn:
            mission = parse_mission(data, str(path))
        else:
            mission, filled = read_sketch(data, str(path))
    except MissionError as error:
        return Judgement(_rules(error), (), {}, {}, 0, 0, *took())
    wrong = [
        f.rule
        for f in findings_for(mission, None, _plugins())
        if f.severity is Severity.ERROR and (terms.as_drawn or f.rule != UNREACHABLE)
    ]
    if wrong:
        return Judgement(tuple(dict.fromkeys(wrong)), filled, {}, {}, 0, 0, *took())
    left = max(0.05, FOR_THE_CHECK * terms.seconds - (time.monotonic() - began))
    report = check(
        mission,
        options=_options(terms),
        limits=Limits(seconds=left, memory_mb=terms.memory_mb, tokens=TOKENS),
    )
    return Judgement(
        (),
        filled,
        _said(report, Verdict.VIOLATED),
        _said(report, Verdict.UNDECIDED),
        report.states,
        len(report.net.transitions),
        *took(),
    )


def _options(terms: Terms) -> Options:
    if terms.as_drawn:
        return Options()
    return Options(open_world=terms.open_world, service_writes={WORK: ()}, assumed=NO_FAILURES)


def _rules(error: MissionError) -> tuple[str, ...]:
    rules = [f.rule for f in error.findings if f.severity is Severity.ERROR]
    return tuple(dict.fromkeys(rules))


def _said(report: Report, verdict: Verdict) -> dict[str, str]:
    return {
        each.property: each.violations[0].message if each.violations else each.covered
        for each in report.results
        if each.verdict is verdict
    }


@cache
def _plugins() -> PluginManager:
    """Nothing but what m2pem brings along."""
    return PluginManager(block=("all",))
