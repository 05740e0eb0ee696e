"""What the judges of properties look at, and the graph of states as they need it."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property

from m2pem.model import elements as e
from m2pem.model.events import CompensateEventDefinition
from m2pem.model.mission import Mission
from m2pem.verify.explore import Exploration
from m2pem.verify.report.stuck import Stuck, why_stuck
from m2pem.verify.report.telling import Token, Told, encoding_of, tell, tokens_of
from m2pem.verify.report.words import Words
from m2pem.verify.system import Action, Rule, System

MOST_ALARMS = 5
"""Told of one property; more of them say nothing new."""


def compensates(node: e.FlowNode) -> bool:
    """Whether an event only says how its activity is undone: it is never triggered by itself."""
    kinds = [type(each) for each in node.definitions] if isinstance(node, e.Event) else []
    return CompensateEventDefinition in kinds


@dataclass
class Case:
    """A search, and what follows from it at once. Steps between states must have been kept."""

    mission: Mission
    system: System
    found: Exploration

    @cached_property
    def words(self) -> Words:
        """Names."""
        return Words(self.mission)

    @cached_property
    def good(self) -> frozenset[int]:
        """States in which the run is over and well."""
        wanted = {self.system.completed, self.system.terminated}
        return frozenset(n for n in self.found.terminals if wanted & self.places(n))

    @cached_property
    def failed(self) -> frozenset[int]:
        """States in which the run has failed."""
        return frozenset(n for n in self.found.terminals if self.system.failed in self.places(n))

    @cached_property
    def stuck(self) -> tuple[int, ...]:
        """States in which nothing can happen, and the run is not over."""
        return tuple(n for n in self.found.terminals if not self.system.ends & self.places(n))

    @cached_property
    def before(self) -> list[list[tuple[int, int]]]:
        """By state, those before it with the rule between."""
        lists: list[list[tuple[int, int]]] = [[] for _ in self.found.states]
        for number in range(len(self.found.states)):
            for rule, after in self.found.successors(number):
                lists[after].append((number, rule))
        return lists

    def places(self, number: int) -> set[int]:
        """Places that have a token in a state."""
        return set(self.found.marking(number).tokens)

    def reaching(
        self, goals: Iterable[int], allowed: Callable[[Rule], bool] = lambda _: True
    ) -> set[int]:
        """The states from which one of the goals can be reached by rules that are allowed."""
        seen = set(goals)
        waiting = list(seen)
        while waiting:
            for number, rule in self.before[waiting.pop()]:
                if number not in seen and allowed(self.system.rules[rule]):
                    seen.add(number)
                    waiting.append(number)
        return seen

    def story(self, run: Iterable[int]) -> tuple[tuple[Told, ...], tuple[Token, ...]]:
        """A run in words, and where tokens are after it."""
        told, state = tell(self.system, self.words, [*run])
        return told, tokens_of(encoding_of(self.system), state)

    def why(self, run: Iterable[int]) -> list[Stuck]:
        """What tokens wait for after a run, and why it does not come."""
        return why_stuck(self.words, *self.story(run))

    def run_through(self, element: str) -> tuple[int, ...]:
        """A run whose last rule is the first one to take a step at an element; () for none."""
        ways = [
            (state, rule)
            for rule, state in self.found.fired.items()
            if any(step.element == element for step in self.system.rules[rule].steps)
        ]
        if not ways:
            return ()
        state, rule = min(ways)
        return (*self.found.run_to(state), rule)

    @cached_property
    def reached(self) -> frozenset[str]:
        """Elements and flows that a run gets to."""
        return frozenset(
            step.element
            for rule in self.found.fired
            for step in self.system.rules[rule].steps
            if step.action is not Action.INTERRUPTED
        )

    @cached_property
    def unreached(self) -> frozenset[str]:
        """Nodes and flows that no run gets to, of the processes that any run gets to."""
        begun = {
            node.container.process.id for node in self.mission.nodes if node.id in self.reached
        }
        nodes = {n.id for n in self.mission.nodes if n.container.process.id in begun}
        flows = {f.id for f in self.mission.flows if f.source.container.process.id in begun}
        return frozenset(nodes | flows) - self.reached
