"""Confirmation: the engine executes a counterexample before it is shown.

A net may do more than its mission, or less beyond a bound. So a run that violates a property is
certain only if the engine follows it: with the same inputs, it has the tokens of the net whenever
it waits for an input, and at the end it is where the internal steps of the net lead.
"""

from collections import Counter
from collections.abc import Mapping, Sequence

from m2pem.engine.records import RunOutcome
from m2pem.engine.state import RunState, RunStatus, Token
from m2pem.fleet.fleet import Fleet
from m2pem.mission import elements as e
from m2pem.mission.mission import Mission
from m2pem.verify.conformance_run import ConformanceRun, NotPlayableError
from m2pem.verify.net.petri_net import Kind, PetriNet, Role
from m2pem.verify.report.run_steps import ElementNames, describe_run, encoding_of
from m2pem.verify.translate.options import Options
from m2pem.verify.translate.participants import participants

MOST_STATES = 2_000
"""Most states after internal steps with which the end of a run is compared."""

Tokens = Counter[str]
"""How many tokens are on each element; at a join, on each of its flows."""


class Confirmation:
    """Executes runs of the nets of one mission, each once."""

    def __init__(
        self, mission: Mission, fleet: Fleet, process: str | None, options: Options
    ) -> None:
        self._mission, self._fleet, self._options = mission, fleet, options
        root = mission.process(process)
        self._process = root.id
        together = participants(mission, root) if options.all_pools else ()
        self._together = [each.id for each in together]
        self._names = ElementNames(mission)
        self._followed: dict[int, _Followed] = {}  # by identity of the net
        self._known: dict[tuple[int, ...], str] = {}

    def doubt(self, net: PetriNet, run: Sequence[int]) -> str:
        """Return where the engine does not follow a run; "": it does."""
        key = (id(net), *run)
        if key not in self._known:
            if id(net) not in self._followed:
                self._followed[id(net)] = _Followed(net)
            self._known[key] = self._execute(self._followed[id(net)], run)
        return self._known[key]

    def _execute(self, followed: "_Followed", run: Sequence[int]) -> str:
        net, encoding = followed.net, followed.encoding
        described, _ = describe_run(encoding, self._names, run, for_people=False)
        steps = [each.as_data() for each in described]
        mission, options = self._mission, self._options
        player = ConformanceRun(
            mission,
            self._fleet,
            self._process,
            options.data,
            options.ways,
            steps,
            self._together,
            {each.key for each in net.variables},
        )
        before: list[int] = []
        state = encoding.initial
        for number in run:
            if net.transitions[number].trigger is not None:
                before.append(state)
            state, _ = encoding.fire(number, state)
        waits = iter(before)
        for step in steps:
            if step["trigger"] and not followed.agrees(next(waits), player.run.state):
                return f"before step {step['step']}, {_said(player.run.state)}"
            try:
                player.play(step)
            except NotPlayableError as error:
                return f"step {step['step']}: {error}"
        if followed.ends_like(state, player.run.state, waits=not player.run.wants_continue):
            return ""
        return f"at the end, {_said(player.run.state)}"


class _Followed:
    """A net whose runs the engine follows."""

    def __init__(self, net: PetriNet) -> None:
        self.net = net
        self.encoding = encoding_of(net)
        self._of_kind = {
            kind: [each.index for each in net.transitions if each.kind is kind] for kind in Kind
        }

    def _enabled(self, state: int, kind: Kind) -> list[int]:
        return [each for each in self._of_kind[kind] if self.encoding.enabled(each, state)]

    def agrees(self, state: int, run: RunState) -> bool:
        """Whether a state of the net in which nothing internal happens is that of the engine."""
        net, marked = self.net, self.encoding.marking(state).tokens
        ends = marked.keys() & net.ends
        if run.status is RunStatus.ENDED:
            expected: Mapping[RunOutcome, int] = {
                RunOutcome.COMPLETED: net.completed,
                RunOutcome.TERMINATED: net.terminated,
            }
            if run.detail.startswith("stuck"):
                return not ends and not self._enabled(state, Kind.EXTERNAL)
            return expected.get(run.outcome or RunOutcome.FAILED, net.failed) in ends
        if run.incidents:  # where no operator decides, the run fails
            return net.failed in ends
        tokens: Tokens = Counter()
        for place, count in marked.items():
            each = net.places[place]
            if each.role not in (Role.CONTROL, Role.END, Role.TRIGGERED):
                tokens[each.element] += count
        return not ends and tokens == tokens_of_run(run)

    def ends_like(self, state: int, run: RunState, *, waits: bool) -> bool:
        """Whether internal steps lead from a state to that of the engine; if that never waits,
        whether they never end."""
        encoding = self.encoding
        seen, waiting = {state}, [state]
        while waiting and len(seen) <= MOST_STATES:
            here = waiting.pop()
            enabled = self._enabled(here, Kind.INTERNAL) or self._enabled(here, Kind.JOIN)
            if not enabled and (not waits or self.agrees(here, run)):
                return waits
            after = {encoding.fire(number, here)[0] for number in enabled} - seen
            seen |= after
            waiting += after
        return not waits


def tokens_of_run(run: RunState) -> Tokens:
    """Return where the tokens of a run of the engine are."""
    return Counter(_element(token) for token in run.tokens.values() if not token.is_reopened)


def _element(token: Token) -> str:
    node = token.node
    joins = isinstance(node, e.ComplexGateway) or (
        isinstance(node, e.ParallelGateway | e.InclusiveGateway) and len(node.incoming) > 1
    )
    return token.flow.id if joins and token.flow is not None else node.id


def _said(run: RunState) -> str:
    """Return where a run of the engine is, for people."""
    if run.status is RunStatus.ENDED:
        return f"the run of the engine has {(run.outcome or RunOutcome.FAILED).value}"
    return f"the engine has its tokens at {', '.join(sorted(tokens_of_run(run)))}"
