"""The propositions of formulas on a net: which hold in a marking, and when a transition fires.

`ExploredRuns` is an exploration as a `LabelledSystem`, for `m2pem.verify.ltl.model_check`.
"""

from collections.abc import Callable, Mapping, Sequence

from m2pem.errors import ExpressionError
from m2pem.fleet.allocation import spelled_out
from m2pem.fleet.fleet import Fleet
from m2pem.mission.elements import IntermediateCatchEvent, Process, ReceiveTask, SequenceFlow
from m2pem.mission.mission import Mission
from m2pem.verify.ltl.formula import (
    Active,
    Commanded,
    Completed,
    Data,
    Ended,
    Proposition,
)
from m2pem.verify.net.encoding import Encoding
from m2pem.verify.net.petri_net import Action, PetriNet, Place, Role, Step, Transition, outcomes_of
from m2pem.verify.search.explore import Exploration
from m2pem.verify.translate.domains import tells_apart

Test = Callable[[int], bool]
_NO_TOKEN = frozenset({Role.CONTROL, Role.END})


class UnknownDataError(Exception):
    """The net does not follow the data that a formula reads; the message says why."""


class Labels:
    """The labelling of a net: which propositions are true in its states, and when
    transitions fire.
    """

    def __init__(
        self, net: PetriNet, mission: Mission, fleet: Fleet, propositions: Sequence[Proposition]
    ) -> None:
        self.net = net
        self.propositions = tuple(propositions)
        self._mission = mission
        self._fleet = fleet
        self._places = [frozenset(self._places_of(each)) for each in self.propositions]
        self._variables = [frozenset(self._variables_of(each)) for each in self.propositions]
        self.of_transitions = [self._of_transition(transition) for transition in net.transitions]
        """By transition, the propositions that are true in the moment in which it fires."""

    def of_states(self, encoding: Encoding) -> Callable[[int], int]:
        """Return a function that gives the propositions that are true in a state."""
        tests: list[tuple[int, int, dict[int, bool] | None, Data | None]] = []
        for bit, each in enumerate(self.propositions):
            if isinstance(each, Data):
                mask = 0
                for variable in self._variables[bit]:
                    count = len(self.net.variables[variable].values)
                    mask |= ((1 << count) - 1) << encoding.value_bit[variable]
                tests.append((1 << bit, mask, {}, each))
            elif not isinstance(each, Completed):
                tests.append((1 << bit, encoding.places_mask(self._places[bit]), None, None))

        def true_in(state: int) -> int:
            found = 0
            for bit, mask, known, data in tests:
                seen = state & mask
                if known is None:
                    found |= bit if seen else 0
                    continue
                if seen not in known:
                    assert data is not None
                    known[seen] = self._holds(data, encoding, state)
                found |= bit if known[seen] else 0
            return found

        return true_in

    def places_of(self, number: int) -> frozenset[int]:
        """The places of which one has a token where a proposition is true, if it is about places.

        `number`: of the proposition, in `propositions`.
        """
        return self._places[number]

    def variables_of(self, number: int) -> frozenset[int]:
        """The variables that a proposition reads."""
        return self._variables[number]

    def visible_transitions(self) -> frozenset[int]:
        """The transitions that may change a proposition, or that one is about."""
        places = frozenset[int]().union(*self._places)
        variables = frozenset[int]().union(*self._variables)
        return frozenset(
            transition.index
            for transition, now in zip(self.net.transitions, self.of_transitions, strict=True)
            if now
            or places & _touched(transition)
            or any(v in variables for v, _ in transition.assign)
        )

    def visible_places(self) -> frozenset[int]:
        """The places that propositions read."""
        return frozenset[int]().union(*self._places)

    # --- propositions ---------------------------------------------------------------------------

    def _places_of(self, each: Proposition) -> list[int]:
        places = self.net.places
        match each:
            case Active(element):
                return [p.index for p in places if self._stands_on(p, element)]
            case Commanded(resource, behavior):
                team = self._fleet.teams.get(resource)
                wanted = set(spelled_out(team)) if team else {resource}
                return [
                    p.index
                    for p in places
                    if p.resources and wanted <= set(p.resources) and behavior in ("", p.behavior)
                ]
            case Ended(outcome):
                ends = {
                    "completed": self.net.completed,
                    "terminated": self.net.terminated,
                    "failed": self.net.failed,
                }
                return [ends[outcome]] if outcome else list(ends.values())
            case _:
                return []

    def _stands_on(self, place: Place, element: str) -> bool:
        if element == self.net.process:
            # The process that the run begins with is active from its beginning to its end.
            return place.role is Role.CONTROL and place.name.endswith(":running")
        if place.role in _NO_TOKEN:
            return False
        if place.role is Role.FLOW:
            flow = self._mission.elements.get(place.element)
            target = flow.target.id if isinstance(flow, SequenceFlow) else ""
            return target == element or self._is_in_process(place, element)
        return place.element == element or self._is_in_process(place, element)

    def _is_in_process(self, place: Place, process: str) -> bool:
        if not isinstance(self._mission.elements.get(process), Process):
            return False
        return process in self.net.scopes[place.scope].path

    def _variables_of(self, each: Proposition) -> list[int]:
        if not isinstance(each, Data):
            return []
        by_name = {variable.name: variable.index for variable in self.net.variables}
        for name in sorted(each.expression.names):
            if name not in by_name:
                raise UnknownDataError(
                    f"the value of '{name}' is not known from the mission: give its first value "
                    "(--data), or write it in a task"
                )
        return [by_name[name] for name in sorted(each.expression.names)]

    def _holds(self, data: Data, encoding: Encoding, state: int) -> bool:
        values = encoding.marking(state).values
        by_name = {variable.name: variable for variable in self.net.variables}
        exact = True
        read = {}
        for name in data.expression.names:
            variable = by_name[name]
            number = values[variable.index]
            read[name] = variable.values[number]
            exact = exact and variable.exact[number]
        if not exact and not tells_apart(data.expression.tree):
            raise UnknownDataError(
                f"whether {data.expression.text.strip()} is true is not known: it is more than "
                "comparisons of single names with values"
            )
        try:
            return data.expression.holds(lambda name: read[name])
        except ExpressionError:
            return False

    def _of_transition(self, transition: Transition) -> int:
        completed = {step.element for step in transition.steps if self._completes(step, transition)}
        return sum(
            1 << bit
            for bit, each in enumerate(self.propositions)
            if isinstance(each, Completed) and each.element in completed
        )

    def _completes(self, step: Step, transition: Transition) -> bool:
        """Whether a token leaves the element of a step as completed.

        One that waits at a catch event leaves it as soon as that is triggered, by the flows that it
        has; where no flow can be taken, the activity or gateway fails.
        """
        if step.action is Action.TRIGGERED:
            element = self._mission.elements.get(step.element)
            if not isinstance(element, IntermediateCatchEvent | ReceiveTask):
                return False
            if not element.outgoing:
                stays = (self.net.places[place].element for place, _ in transition.produce)
                return step.element not in stays
            flows = {flow.id for flow in element.outgoing}
            taken = (each.element for each in transition.steps if each.action is Action.TAKEN)
            return any(each in flows for each in taken)
        if step.action is not Action.COMPLETED:
            return False
        failed = Step(step.element, Action.THROWN, "NO_FLOW")
        return failed not in transition.steps


def _touched(transition: Transition) -> frozenset[int]:
    pairs = (*transition.moves, *transition.copies)
    return frozenset(
        {place for place, _ in (*transition.consume, *transition.produce)}
        | {place for pair in pairs for place in pair}
        | set(transition.reset)
    )


class ExploredRuns:
    """An exploration that kept its edges, as a `LabelledSystem`. Its states keep their numbers."""

    def __init__(self, exploration: Exploration, labels: Labels) -> None:
        self._exploration = exploration
        self._terminals = frozenset(exploration.terminals)
        self._labels = labels
        self._true_in = labels.of_states(exploration.encoding)

    @property
    def propositions(self) -> Sequence[Proposition]:
        return self._labels.propositions

    @property
    def reduced(self) -> bool:
        """Whether the exploration used a reduction."""
        return self._exploration.reduced

    def initial(self) -> Sequence[int]:
        return (0,)

    def successors(self, state: int) -> Sequence[tuple[int, int]]:
        if state in self._exploration.cut:  # not all of them are known
            return ()
        return tuple(self._exploration.successors(state))

    def is_open(self, state: int) -> bool:
        """Whether the exploration stopped before it expanded a state."""
        if self._exploration.complete or state in self._terminals:
            return False
        return not self.successors(state)

    def true_in(self, state: int) -> int:
        return self._true_in(self._exploration.states[state])

    def true_when(self, transition: int) -> int:
        return self._labels.of_transitions[transition]

    def outcomes(self) -> Mapping[int, int]:
        """For fairness: the outcome of each transition. Joins only wait, and have none."""
        found = outcomes_of(self._exploration.net)
        return {transition: outcomes[0] for transition, outcomes in found.items() if outcomes}
