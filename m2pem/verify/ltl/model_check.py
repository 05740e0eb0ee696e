"""Checking a formula of all runs of a system: the search for a run that violates it.

    verdict = check(system, formula)
    verdict.result                      # holds, violated, undecided
    verdict.run                         # the counterexample: steps, and steps that repeat for ever

The system is anything with a finite number of states (`LabelledSystem`). The search builds the
product of the system and the automaton of the negated formula, nearest nodes first. So a violation
that no continuation can mend is found by a shortest run. For violations that only an infinite run
shows, the search looks for accepting cycles each time the product has grown fourfold, and when it
is complete. Each counterexample is replayed and evaluated before it is returned (`breaks`).
"""

import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum

from m2pem.errors import InternalError
from m2pem.verify.ltl import Observer, negated
from m2pem.verify.ltl.automaton import components
from m2pem.verify.ltl.formula import Formula, needs_steps
from m2pem.verify.ltl.lasso import Moment, holds
from m2pem.verify.ltl.product import QUIET, STUTTER, LabelledSystem, Product
from m2pem.verify.search.explore import Limits


class Stopped(StrEnum):
    """Why a search is incomplete."""

    STATES = "the limit of states"
    TIME = "the limit of time"
    MEMORY = "the limit of memory"
    SYSTEM = "states beyond which the mission was not searched"
    INTERRUPTED = "an interruption by hand"


class Result(StrEnum):
    HOLDS = "holds"
    VIOLATED = "violated"
    UNDECIDED = "undecided"


@dataclass(frozen=True, slots=True)
class Move:
    """A transition fires, and leads to a state."""

    transition: int
    state: int


@dataclass(frozen=True, slots=True)
class Run:
    """A run from `start`: the moves of `prefix`, then those of `cycle` for ever.

    Without a cycle the run is over after the prefix; or, where `whatever_follows`, the formula is
    violated by then, whatever comes later.
    """

    start: int
    prefix: tuple[Move, ...]
    cycle: tuple[Move, ...] = ()
    whatever_follows: bool = False

    @property
    def length(self) -> int:
        """The number of moves."""
        return len(self.prefix) + len(self.cycle)


@dataclass(frozen=True, slots=True)
class Verdict:
    """The answer of a search, and what it cost. `run` violates the formula; only if violated."""

    result: Result
    run: Run | None
    states: int
    moves: int
    seconds: float
    stopped: Stopped | None = None


class Fairness:
    """The transitions that must not be passed over for ever: those that are enabled again and
    again.

    `transitions`: by transition, its outcome; transitions of one outcome count as one.
    """

    def __init__(self, product: Product, transitions: dict[int, int] | None) -> None:
        self.transitions = transitions
        self._product = product
        self._possible: dict[int, frozenset[int]] = {}

    def possible(self, node: int) -> frozenset[int]:
        """The outcomes that are possible in a node."""
        if self.transitions is None or self._product.is_quiet(node):
            return frozenset()
        state = self._product.states[node]
        known = self._possible.get(state)
        if known is None:
            steps = self._product.successors(state)
            known = frozenset(
                self.transitions[transition]
                for transition, _ in steps
                if transition in self.transitions
            )
            self._possible[state] = known
        return known

    def outcome(self, transition: int) -> int | None:
        """The outcome of a transition, if it is one that counts."""
        return self.transitions.get(transition) if self.transitions is not None else None


class AcceptingComponent:
    """Nodes among which an accepted run can stay for ever; `wanted`: what it must pass.

    A move fulfils promise n by not postponing it, and outcome o by being one of its transitions.
    """

    def __init__(self, product: Product, nodes: frozenset[int], outcomes: frozenset[int]) -> None:
        self.product = product
        self.nodes = nodes
        self.outcomes = outcomes

    def moves(self, node: int) -> Iterator[tuple[int, int, int]]:
        """The moves from a node that stay in the component."""
        return (move for move in self.product.moves[node] if move[1] in self.nodes)


def accepting_components(product: Product, fairness: Fairness) -> Iterator[AcceptingComponent]:
    """Return all accepting components of the expanded part."""
    expanded = len(product.moves)
    waiting = [frozenset(range(expanded))]
    while waiting:
        nodes = waiting.pop()
        for part in _parts(product, nodes):
            together = _postponed_always(product, part)
            if together is None or together:
                continue
            possible = frozenset[int]().union(*(fairness.possible(node) for node in part))
            passed = {
                fairness.outcome(transition)
                for node in part
                for transition, target, _ in product.moves[node]
                if target in part
            }
            missing = possible - passed
            if not missing:
                yield AcceptingComponent(product, part, possible)
                continue
            # Who stays here must not be where a missing outcome could come.
            left = frozenset(node for node in part if not fairness.possible(node) & missing)
            if left:
                waiting.append(left)


def _parts(product: Product, nodes: frozenset[int]) -> Iterator[frozenset[int]]:
    """The strongly connected components of some nodes, nearest to the beginning first."""
    order = sorted(nodes)
    place = {node: at for at, node in enumerate(order)}
    targets = [
        [place[target] for _, target, _ in product.moves[node] if target in place] for node in order
    ]
    members: dict[int, list[int]] = {}
    for at, number in enumerate(components(targets)):
        members.setdefault(number, []).append(order[at])
    for each in members.values():
        yield frozenset(each)


def _postponed_always(product: Product, nodes: frozenset[int]) -> int | None:
    """The promises that every move inside postpones; None when there is no move inside."""
    together: int | None = None
    for node in nodes:
        for _, target, postponed in product.moves[node]:
            if target in nodes:
                together = postponed if together is None else together & postponed
    return together


_Step = tuple[int, int, int, int]
"""From which node, by which transition, to which node, with which promises postponed."""


def run_to(product: Product, node: int) -> Run:
    """The run to a node after which every continuation is accepted."""
    start, prefix = _prefix(product, node)
    return Run(start, prefix, whatever_follows=True)


def run_around(round_: AcceptingComponent, fairness: Fairness) -> Run:
    """A shortest run to a component, and a cycle in it that fulfils all that it must."""
    product = round_.product
    cycle = _cycle(round_, fairness, min(round_.nodes))
    nearest = min(range(len(cycle)), key=lambda at: cycle[at][0])
    cycle = cycle[nearest:] + cycle[:nearest]
    start, prefix = _prefix(product, cycle[0][0])
    return Run(
        start, prefix, _moves([(transition, product.states[to]) for _, transition, to, _ in cycle])
    )


def _prefix(product: Product, node: int) -> tuple[int, tuple[Move, ...]]:
    steps: list[tuple[int, int]] = []
    while product.parent[node] >= 0:
        steps.append((product.via[node], product.states[node]))
        node = product.parent[node]
    return product.states[node], _moves(steps[::-1])


def _moves(steps: list[tuple[int, int]]) -> tuple[Move, ...]:
    """Return the transitions of the system, without quiet moments."""
    return tuple(
        Move(transition, state) for transition, state in steps if transition not in (QUIET, STUTTER)
    )


def _cycle(round_: AcceptingComponent, fairness: Fairness, start: int) -> list[_Step]:
    promises = round_.product.observer.promises
    outcomes = set(round_.outcomes)
    at = start
    steps: list[_Step] = []
    while promises or outcomes:

        def helps(step: _Step, promises: int = promises, outcomes: set[int] = outcomes) -> bool:
            return bool(promises & ~step[3]) or fairness.outcome(step[1]) in outcomes

        for step in _path(round_, at, helps):
            steps.append(step)
            promises &= step[3]
            outcomes.discard(fairness.outcome(step[1]))
        at = steps[-1][2]
    if not steps or at != start:
        steps += _path(round_, at, lambda step: step[2] == start)
    return steps


def _path(round_: AcceptingComponent, start: int, wanted: Callable[[_Step], bool]) -> list[_Step]:
    """The shortest path, of one step at least, whose last step is wanted."""
    came: dict[int, _Step] = {}
    waiting = deque([start])
    seen = {start}
    while waiting:
        node = waiting.popleft()
        for transition, target, postponed in round_.moves(node):
            step = (node, transition, target, postponed)
            if wanted(step):
                path = [step]
                while node != start:
                    path.append(came[node])
                    node = came[node][0]
                return path[::-1]
            if target not in seen:
                seen.add(target)
                came[target] = step
                waiting.append(target)
    raise AssertionError("nodes of a round reach each other")


def breaks(system: LabelledSystem, formula: Formula, run: Run, *, steps: bool) -> bool:
    """Whether a run is one of the system's, and violates the formula.

    A run that violates it whatever follows is evaluated with an arbitrary continuation.
    """
    run = _continued(system, run) if run.whatever_follows else run
    last = run.start
    for move in (*run.prefix, *run.cycle):
        if (move.transition, move.state) not in system.successors(last):
            return False
        last = move.state
    prefix = [_moment(system, run.start, None)]
    prefix += _moments(system, run.prefix, steps=steps)
    back_to = run.prefix[-1].state if run.prefix else run.start
    if run.cycle:
        if last != back_to:
            return False
        cycle = _moments(system, run.cycle, steps=steps)
    else:
        if system.successors(last):
            return False
        cycle = [_moment(system, last, None)]
    return not holds(formula, prefix, cycle)


def _continued(system: LabelledSystem, run: Run) -> Run:
    """The run with a continuation: the first transition each time, until a state comes again."""
    state = run.prefix[-1].state if run.prefix else run.start
    seen = {state: 0}
    further: list[Move] = []
    while steps := system.successors(state):
        transition, state = steps[0]
        further.append(Move(transition, state))
        if state in seen:
            at = seen[state]
            return Run(run.start, (*run.prefix, *further[:at]), tuple(further[at:]))
        seen[state] = len(further)
    return Run(run.start, (*run.prefix, *further))


def _moments(system: LabelledSystem, moves: tuple[Move, ...], *, steps: bool) -> list[Moment]:
    found: list[Moment] = []
    for move in moves:
        found.append(_moment(system, move.state, move.transition))
        if system.true_when(move.transition) and not steps:
            found.append(_moment(system, move.state, None))
    return found


def _moment(system: LabelledSystem, state: int, transition: int | None) -> Moment:
    bits = system.true_in(state) | (0 if transition is None else system.true_when(transition))
    return frozenset(each for n, each in enumerate(system.propositions) if bits >> n & 1)


_LOOK_EVERY = 512
"""Nodes between two readings of the clock."""
_FIRST_LOOK = 2_000
"""Nodes after which accepting components are looked for the first time."""
_MOST_ROUNDS = 50
"""Components among which the shortest run is chosen."""


def check(
    system: LabelledSystem,
    formula: Formula,
    *,
    fair: Mapping[int, int] | None = None,
    limits: Limits | None = None,
) -> Verdict:
    """Check whether a formula holds of all runs of a system.

    `limits`: its `states` are pairs of the system's states and the automaton's.

    `fair`: the outcome of each transition; only runs count in which each outcome that is possible
    again and again happens again and again. None: all runs count. KeyboardInterrupt ends the search
    undecided.

    Raises:
        ValueError: the system uses a reduction, but the formula or the fairness allows none.
        FormulaTooLargeError: the formula's automaton would be too large.
    """
    steps = needs_steps(formula)
    if system.reduced and (steps or fair is not None):
        raise ValueError("single steps, and fairness, need a system that leaves no transition out")
    observer = Observer(negated(formula), system.propositions)
    began = time.monotonic()
    product = Product(system, observer, steps=steps)
    search = _Search(product, Fairness(product, None if fair is None else dict(fair)), began)
    try:
        run, stopped = search.run(limits or Limits())
    except KeyboardInterrupt:
        run, stopped = None, Stopped.INTERRUPTED
    if run is not None and not breaks(system, formula, run, steps=steps):
        raise InternalError("the search found a run that does not break the formula")
    if run is not None and stopped is Stopped.SYSTEM:
        stopped = None
    result = Result.VIOLATED if run is not None else Result.UNDECIDED if stopped else Result.HOLDS
    seconds = time.monotonic() - began
    return Verdict(result, run, len(product), product.number_of_moves, seconds, stopped)


class _Search:
    def __init__(self, product: Product, fairness: Fairness, began: float) -> None:
        self.product = product
        self.fairness = fairness
        self.began = began

    def run(self, limits: Limits) -> tuple[Run | None, Stopped | None]:
        product = self.product
        look_at = _FIRST_LOOK
        while len(product.moves) < len(product):
            if product.broken >= 0:
                return run_to(product, product.broken), None
            done = len(product.moves)
            if done % _LOOK_EVERY == 0:
                stopped = self._beyond(limits, time.monotonic() - self.began)
                if stopped is not None:
                    return self._round(), stopped
            if done >= look_at:
                look_at *= 4
                if (run := self._round()) is not None:
                    return run, None
            product.expand()
        if product.broken >= 0:
            return run_to(product, product.broken), None
        return self._round(), Stopped.SYSTEM if product.open else None

    def _beyond(self, limits: Limits, seconds: float) -> Stopped | None:
        if len(self.product) > limits.states:
            return Stopped.STATES
        if seconds > limits.seconds:
            return Stopped.TIME
        return Stopped.MEMORY if self.product.bytes > limits.memory_mb * 1e6 else None

    def _round(self) -> Run | None:
        best: Run | None = None
        for found, round_ in enumerate(accepting_components(self.product, self.fairness)):
            run = run_around(round_, self.fairness)
            if best is None or run.length < best.length:
                best = run
            if found == _MOST_ROUNDS:
                break
        return best
