"""Whether the engine and the reference have the same set of possible traces.

A trace is a sequence of inputs, each with what is seen of the reaction to it: how often each
sequence flow was taken, which user tasks are open now and how often, which signals are awaited
now, and whether and how the run has ended.

Both are walked together, input by input. A node of the walk is a trace so far, with all the states
that each side can be in after it: several runs of the engine, where an answer was given to one of
several open prompts of the same task, and several markings of the reference. At every node every
input that is possible is tried in every way, so within the bounds all traces are compared.

**Which traces are possible.** The outside chooses: any open task, any of its answers, any awaited
signal, in any order. Between two inputs the model moves by itself until nothing can move, and for
that BPMN leaves the order of independent steps open. Mostly the order cannot be seen. Where it can
(a branch ends the run while another goes on, a token comes to an inclusive join just before or just
after it was activated), the reference has a trace for every order, and the engine, which has one
queue and one order (docs/architecture.md, section 4, law 2), has one of them.

So, for every reaction of the engine there must be the same one in the reference. And, as long as
no order could be seen on the way, for each thing that the outside can do the engine must show a
reaction that the reference has for it: the two sets of traces are then equal. Fixed for both, as
documented, is what is not left to an order:

- the first true flow in the file's order goes on from an exclusive gateway;
- an occurrence reaches all its catchers before anything else moves, so that an interruption takes
  effect before the next step of the scope it ends; among the catchers the order is open, and who is
  ended by another catches no more;
- a run that waits for nothing, with tokens left, is stuck.

**Bounds**: `Bounds`. A walk is cut at a number of inputs and at a number of nodes, breadth first.
"""

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from tests.reference.catching import TooLargeError
from tests.reference.diagram import Level
from tests.reference.engine_side import Engine, Played
from tests.reference.interpreter import Input, Reference, Seen, seen
from tests.reference.marking import Key, Marking
from tests.reference.xml_of import DONE, answers, xml_of


@dataclass(frozen=True, slots=True)
class Bounds:
    """How far to go.

    `inputs` in a trace, `nodes` of the walk, `states` (runs, and markings) that a node is left
    with; `orders`: states of one reaction of the reference, `budget`: of all of them.
    """

    inputs: int = 5
    nodes: int = 15
    states: int = 5
    orders: int = 200
    budget: int = 1_000


@dataclass(slots=True)
class Counts:
    """What was compared: reactions, and those for which the sets had to be equal.

    `cut`: models of which not all traces were compared, because a bound was reached.
    """

    reactions: int = 0
    equal: int = 0
    cut: int = 0


class DifferenceError(AssertionError):
    """The engine did what the reference cannot, or never does what it must be able to."""

    def __init__(
        self, model: Level, trace: Sequence[Input], got: Iterable[Seen], allowed: Iterable[Seen]
    ) -> None:
        self.trace = tuple(trace)
        lines = [
            "after " + (", ".join(_words(each) for each in trace) or "the start"),
            *(f"  the engine: {each}" for each in got),
            *(f"  allowed:    {each}" for each in allowed),
            xml_of(model),
        ]
        super().__init__("\n".join(lines))


def _words(given: Input) -> str:
    if given.kind == "signal":
        return f"signal {given.name}"
    return f"{given.name} answered {given.value or DONE}"


@dataclass(slots=True)
class _Node:
    trace: tuple[Input, ...]
    seen: Seen
    runs: list[Played]
    markings: list[Marking]
    settled: bool  # no order could be seen so far: the markings are those that the runs are in


@dataclass(slots=True)
class _Walk:
    model: Level
    bounds: Bounds
    counts: Counts = field(default_factory=Counts)

    def children(
        self,
        trace: tuple[Input, ...],
        runs: list[Played],
        reactions: list[list[Marking]],
        settled: bool,
    ) -> list[_Node]:
        """Compare the reactions to one input, and sort them by what is seen."""
        got: dict[Seen, list[Played]] = {}
        for run in runs:
            got.setdefault(run.seen, []).append(run)
        allowed: dict[Seen, dict[Key, Marking]] = {}
        for marking in (marking for reaction in reactions for marking in reaction):
            allowed.setdefault(seen(marking), {})[marking.key()] = marking
        if not got.keys() <= allowed.keys():
            raise DifferenceError(self.model, trace, got, allowed)
        self.counts.reactions += 1
        if settled:
            for reaction in reactions:
                must = {seen(marking) for marking in reaction}
                if not must & got.keys():
                    raise DifferenceError(self.model, trace, got, must)
            self.counts.equal += all(len(reaction) == 1 for reaction in reactions)
        certain = settled and all(len(reaction) == 1 for reaction in reactions)
        return [
            self._kept(_Node(trace, each, same, list(allowed[each].values()), certain))
            for each, same in got.items()
        ]

    def _kept(self, node: _Node) -> _Node:
        node.settled = node.settled or len(node.markings) == 1
        if len(node.runs) > self.bounds.states:
            node.runs = node.runs[: self.bounds.states]
            node.settled = False
            self.counts.cut = 1
        return node


def compare(model: Level, bounds: Bounds) -> Counts:
    """Walk a model on both sides; raises DifferenceError at the first difference.

    TooLargeError: already the start of the run has too many orders, or no end.
    """
    reference = Reference(model, bounds.orders, bounds.budget)
    walk = _Walk(model, bounds)
    values = answers(model)
    begin = reference.begin()
    engine = Engine(model)
    todo = deque(walk.children((), [engine.begin()], [begin], settled=True))
    visited = 0
    while todo:
        node = todo.popleft()
        if node.seen.outcome is not None:
            continue
        if (
            len(node.trace) >= bounds.inputs
            or visited >= bounds.nodes
            or len(node.markings) > bounds.states
        ):
            walk.counts.cut = 1
            continue
        visited += 1
        for given in _inputs(node.seen, values):
            try:
                reactions = [
                    each for marking in node.markings for each in reference.choices(marking, given)
                ]
            except TooLargeError:
                walk.counts.cut = 1
                continue
            runs = [after for run in node.runs for after in engine.choices(run, given)]
            todo += walk.children((*node.trace, given), runs, reactions, node.settled)
    return walk.counts


def _inputs(now: Seen, values: dict[str, tuple[str, ...]]) -> list[Input]:
    found = [Input("signal", signal) for signal in now.awaited]
    for task, _ in now.open_tasks:
        found += [Input("answer", task, None if value == DONE else value) for value in values[task]]
    return found
