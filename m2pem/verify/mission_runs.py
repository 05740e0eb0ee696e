"""The runs of a mission, as the search for broken formulas wants them (`LabelledSystem`)."""

from collections.abc import Mapping, Sequence

from m2pem.verify.explore import Exploration
from m2pem.verify.labels import Labels
from m2pem.verify.ltl.formula import Proposition
from m2pem.verify.outcomes import outcomes_of


class MissionRuns:
    """States are those of an exploration that kept its edges, by their numbers there."""

    def __init__(self, exploration: Exploration, labels: Labels) -> None:
        self._exploration = exploration
        self._terminals = frozenset(exploration.terminals)
        self._labels = labels
        self._true_in = labels.of_states(exploration.encoding)

    @property
    def propositions(self) -> Sequence[Proposition]:
        """What the bits stand for."""
        return self._labels.propositions

    @property
    def reduced(self) -> bool:
        """Whether the exploration left rules out."""
        return self._exploration.reduced

    def initial(self) -> Sequence[int]:
        """The first state."""
        return (0,)

    def successors(self, state: int) -> Sequence[tuple[int, int]]:
        """The rules that can fire in a state, each with the state after it."""
        return tuple(self._exploration.successors(state))

    def is_open(self, state: int) -> bool:
        """Whether the exploration stopped before it looked at what follows."""
        if self._exploration.complete or state in self._terminals:
            return False
        return not self.successors(state)

    def true_in(self, state: int) -> int:
        """The propositions that are true in a state."""
        return self._true_in(self._exploration.states[state])

    def true_when(self, rule: int) -> int:
        """The propositions that are true in the moment in which a rule fires."""
        return self._labels.of_rules[rule]

    def outcomes(self) -> Mapping[int, int]:
        """For fairness: the outcome that each rule stands for; joins, which only wait, for none."""
        found = outcomes_of(self._exploration.system)
        return {rule: outcomes[0] for rule, outcomes in found.items() if outcomes}
