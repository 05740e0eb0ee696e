"""Everything that a report says, worked out once, whatever it is written as."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from m2pem.diagram import Overlays
from m2pem.mission import elements as e
from m2pem.mission.events import CompensateEventDefinition
from m2pem.mission.mission import Mission
from m2pem.mission.values import Value
from m2pem.verify.check import Report
from m2pem.verify.net.petri_net import Action, System
from m2pem.verify.properties.results import Result, Verdict, Violation
from m2pem.verify.report.run_steps import Token, Told, Words, encoding_of, tell, tokens_of
from m2pem.verify.report.stuck import why_stuck

DEADLOCK = "no-deadlock"
FOLLOWING = frozenset({"no-dead-element", "can-complete", "completes-if-fair"})
"""Properties whose violations often follow from those of others."""


@dataclass(frozen=True, slots=True)
class Violated:
    """One way in which a property is violated, with its run told.

    `story`: the run; `loop`: what can then follow again and again. `tokens`: where they are at
    the end. `missing`: flows by which a token is waited for that never comes.
    """

    answer: Result
    found: Violation
    story: tuple[Told, ...]
    loop: tuple[Told, ...]
    tokens: tuple[Token, ...]
    missing: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Coverage:
    """How much was searched. `stopped`: why not all, "" if it was all.

    `engine`: who searched; `notes`: what else is to be told of the answers.
    """

    states: int
    transitions: int
    seconds: float
    stopped: str = ""
    engine: str = "builtin"
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Findings:
    """What was found about a mission. `violations`: those that count, then warnings.

    `unreached`: what no run gets to, as far as that is known. `given`: the data that the run begins
    with.
    """

    mission: Mission
    system: System
    results: tuple[Result, ...]
    verdict: Verdict
    coverage: Coverage
    violations: tuple[Violated, ...]
    unreached: frozenset[str] = frozenset()
    strict: bool = False
    given: Mapping[str, Value] = field(default_factory=dict)

    def counts(self, answer: Result) -> bool:
        """Whether a violation of this property is one, and not a warning."""
        return self.strict or not answer.warning

    @property
    def exit_status(self) -> int:
        """Of the command line."""
        return {Verdict.HOLDS: 0, Verdict.VIOLATED: 1, Verdict.UNDECIDED: 3}[self.verdict]


def findings_of(
    mission: Mission,
    report: Report,
    *,
    strict: bool = False,
    given: Mapping[str, Value] | None = None,
) -> Findings:
    """Tells the runs of all that is violated: causes first, then what follows, then warnings."""
    words = Words(mission)
    told = []
    for result in report.results:
        system = report.rules_of(result)
        told += [_told(system, words, result, each) for each in result.violations]
    told.sort(key=lambda each: (each.answer.warning, _follows(each.answer)))
    found = report.found
    stopped = found.stopped.value if found.stopped is not None else ""
    return Findings(
        mission,
        report.system,
        report.results,
        report.judged(strict=strict),
        Coverage(
            report.states,
            found.transitions,
            found.seconds,
            stopped,
            report.engine,
            report.notes,
        ),
        tuple(told),
        frozenset() if stopped else _unreached(mission, report),
        strict,
        given or {},
    )


def _follows(answer: Result) -> bool:
    return not answer.required and answer.property in FOLLOWING


def _unreached(mission: Mission, report: Report) -> frozenset[str]:
    """Nodes and flows that no run gets to, of the processes that any run gets to."""
    rules = report.system.rules
    reached = {
        step.element
        for rule in report.found.fired
        for step in rules[rule].steps
        if step.action is not Action.INTERRUPTED
    }
    begun = {node.container.process.id for node in mission.nodes if node.id in reached}
    nodes = {n.id for n in mission.nodes if n.container.process.id in begun}
    flows = {f.id for f in mission.flows if f.source.container.process.id in begun}
    undoing = {
        node.id
        for node in mission.nodes
        if isinstance(node, e.BoundaryEvent)
        and any(isinstance(each, CompensateEventDefinition) for each in node.definitions)
    }
    return frozenset(nodes | flows) - reached - undoing


def marks_of(violation: Violated, unreached: frozenset[str] = frozenset()) -> Overlays:
    """What a drawing shows of it."""
    steps: Sequence[Sequence[str]] = [told.passes for told in (*violation.story, *violation.loop)]
    wrong = dict.fromkeys(violation.found.elements, violation.found.message)
    waiting = {
        token.flow or token.element: f"{token.count} token{'s' if token.count > 1 else ''} here"
        for token in violation.tokens
        if token.element not in wrong and not token.flow
    }
    tokens = frozenset(token.flow or token.element for token in violation.tokens)
    return Overlays(steps, wrong, waiting, tokens, frozenset(violation.missing), unreached)


def _told(system: System, words: Words, answer: Result, found: Violation) -> Violated:
    if not found.run and not found.cycle:
        return Violated(answer, found, (), (), ())
    story, state = tell(system, words, found.run)
    loop, state = tell(system, words, found.cycle, begin=len(story), at=state)
    tokens = tokens_of(encoding_of(system), state)
    deadlock = answer.property == DEADLOCK and not answer.required
    stuck = why_stuck(words, story, tokens) if deadlock else []
    missing = tuple(flow for each in stuck for flow in each.missing)
    if stuck:
        found = replace(found, message="; ".join(each.text for each in stuck))
    return Violated(answer, found, story, loop, tokens, missing)
