"""The contents of a report, computed once for all output formats."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from m2pem.diagram import Overlays
from m2pem.mission import elements as e
from m2pem.mission.mission import Mission
from m2pem.mission.values import Value
from m2pem.verify.assumptions import NOTHING, Assumptions
from m2pem.verify.check import Report
from m2pem.verify.net.encoding import Encoding
from m2pem.verify.net.petri_net import Action, PetriNet
from m2pem.verify.properties.results import Result, Verdict, Violation
from m2pem.verify.report.run_steps import (
    ElementNames,
    RunStep,
    Token,
    describe_run,
    encoding_of,
    tokens_of,
)
from m2pem.verify.report.stuck import waits_for_resources, why_stuck

DEADLOCK = "no-deadlock"
ENDS = frozenset({"can-complete", "completes-if-fair"})
"""Properties that a task violates which waits for ever for what others keep."""
FOLLOWING = frozenset({"no-dead-element", "can-complete", "completes-if-fair"})
"""Properties whose violations often follow from those of others."""


@dataclass(frozen=True, slots=True)
class DescribedViolation:
    """A violation, with its run described.

    `run_steps`: the run; `loop`: what can then follow again and again. `tokens`: where they are at
    the end. `missing`: flows by which a token is awaited that never comes.
    """

    answer: Result
    found: Violation
    run_steps: tuple[RunStep, ...]
    loop: tuple[RunStep, ...]
    tokens: tuple[Token, ...]
    missing: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Coverage:
    """How much was searched. `stopped`: why not all, "" if it was all.

    `engine`: what searched; `notes`: remarks on the answers.
    """

    states: int
    transitions: int
    seconds: float
    stopped: str = ""
    engine: str = "builtin"
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Findings:
    """What was found about a mission. `violations`: errors first, then warnings.

    `unreached`: elements that no run reaches, as far as that is known. `given`: the data that the
    run begins with. `assumed`: what the whole check assumes; `without`: the first violation of each
    answer to what assumes something, where nothing is assumed. `together`: ids of processes that
    begin with the run, unlike in a run of the executive.
    """

    mission: Mission
    net: PetriNet
    results: tuple[Result, ...]
    verdict: Verdict
    coverage: Coverage
    violations: tuple[DescribedViolation, ...]
    unreached: frozenset[str] = frozenset()
    strict: bool = False
    given: Mapping[str, Value] = field(default_factory=dict)
    assumed: Assumptions = NOTHING
    without: tuple[DescribedViolation, ...] = ()
    together: tuple[str, ...] = ()

    def violation_without(self, answer: Result) -> DescribedViolation | None:
        """The violation of an answer's property where nothing is assumed."""
        return next((each for each in self.without if each.answer is answer.without), None)

    def counts(self, answer: Result) -> bool:
        """Whether a violation of this property is an error, and not a warning."""
        return self.strict or not answer.warning

    @property
    def exit_status(self) -> int:
        """The exit status of the command line."""
        return {
            Verdict.HOLDS: 0,
            Verdict.VIOLATED: 1,
            Verdict.UNDECIDED: 3,
            Verdict.MAY_BE_VIOLATED: 4,
        }[self.verdict]


def findings_of(
    mission: Mission,
    report: Report,
    *,
    strict: bool = False,
    given: Mapping[str, Value] | None = None,
) -> Findings:
    """Describe the runs of all violations: causes first, then consequences, then warnings."""
    element_names = ElementNames(mission)
    encodings: dict[int, Encoding] = {}
    run_step = []
    for result in report.results:
        net = report.transitions_of(result)
        run_step += [
            _describe(net, element_names, result, each, encodings) for each in result.violations
        ]
    run_step.sort(key=lambda each: (each.answer.warning, _follows(each.answer)))
    found, plain = report.found, report.without or report
    stopped = found.stopped.value if found.stopped is not None else ""
    return Findings(
        mission,
        report.net,
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
        tuple(run_step),
        frozenset() if plain.found.stopped is not None else _unreached(mission, plain),
        strict,
        given or {},
        report.assumed,
        tuple(
            _describe(each.net, element_names, each, each.violations[0], encodings)
            for result in report.results
            if (each := result.without) is not None and each.violations and each.net is not None
        ),
    )


def _follows(answer: Result) -> bool:
    return not answer.required and answer.property in FOLLOWING


def _unreached(mission: Mission, report: Report) -> frozenset[str]:
    """Nodes and flows that no run reaches, of the processes that any run reaches."""
    transitions = report.net.transitions
    reached = {
        step.element
        for transition in report.found.fired
        for step in transitions[transition].steps
        if step.action is not Action.INTERRUPTED
    }
    begun = {node.container.process.id for node in mission.nodes if node.id in reached}
    nodes = {n.id for n in mission.nodes if n.container.process.id in begun}
    flows = {f.id for f in mission.flows if f.source.container.process.id in begun}
    undoing = {node.id for node in mission.nodes if e.undoes(node)}
    return frozenset(nodes | flows) - reached - undoing


def marks_of(violation: DescribedViolation, unreached: frozenset[str] = frozenset()) -> Overlays:
    """Return the marks of a violation in a diagram."""
    steps: Sequence[Sequence[str]] = [
        run_step.passes for run_step in (*violation.run_steps, *violation.loop)
    ]
    wrong = dict.fromkeys(violation.found.elements, violation.found.message)
    waiting = {
        token.flow or token.element: f"{token.count} token{'s' if token.count > 1 else ''} here"
        for token in violation.tokens
        if token.element not in wrong and not token.flow
    }
    tokens = frozenset(token.flow or token.element for token in violation.tokens)
    return Overlays(steps, wrong, waiting, tokens, frozenset(violation.missing), unreached)


def _describe(
    net: PetriNet,
    element_names: ElementNames,
    answer: Result,
    found: Violation,
    encodings: dict[int, Encoding],
) -> DescribedViolation:
    """Describe a violation. `encodings`: by identity of the net, those that were made before."""
    if not found.run and not found.cycle:
        return DescribedViolation(answer, found, (), (), ())
    if id(net) not in encodings:
        encodings[id(net)] = encoding_of(net)
    encoding = encodings[id(net)]
    run_steps, state = describe_run(encoding, element_names, found.run)
    begin = len(run_steps)
    loop, state = describe_run(encoding, element_names, found.cycle, begin=begin, at=state)
    marking = encoding.marking(state)
    tokens = tokens_of(net, marking)
    deadlock = answer.property == DEADLOCK and not answer.required
    waiting = waits_for_resources(net, element_names, marking)
    stuck = why_stuck(element_names, run_steps, tokens, waiting) if deadlock else []
    missing = tuple(flow for each in stuck for flow in each.missing)
    if stuck:
        found = replace(found, message="; ".join(each.text for each in stuck))
    elif answer.property in ENDS and not answer.required:
        waits = [f"{element_names.with_id(each)} {what}" for each, what in waiting.items()]
        found = replace(found, message="; ".join([found.message, *waits]))
    return DescribedViolation(answer, found, run_steps, loop, tokens, missing)
