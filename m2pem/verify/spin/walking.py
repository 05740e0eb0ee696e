"""The runs of a system step by step, where nothing was searched: to look at one that Spin found."""

from collections.abc import Sequence

from m2pem.verify.encoding import Encoding
from m2pem.verify.labels import Labels
from m2pem.verify.ltl.formula import Proposition
from m2pem.verify.outcomes import outcomes_of
from m2pem.verify.product import Run
from m2pem.verify.spin.trail import may_fire


class Walking:
    """A `LabelledSystem` whose states are those of the encoding."""

    reduced = False

    def __init__(self, encoding: Encoding, labels: Labels) -> None:
        self._encoding = encoding
        self._labels = labels
        self._true_in = labels.of_states(encoding)

    @property
    def propositions(self) -> Sequence[Proposition]:
        """What the bits stand for."""
        return self._labels.propositions

    def initial(self) -> Sequence[int]:
        """The first state."""
        return (self._encoding.initial,)

    def successors(self, state: int) -> Sequence[tuple[int, int]]:
        """The rules that can fire in a state, each with the state after it."""
        encoding = self._encoding
        return [(rule, encoding.fire(rule, state)[0]) for rule in may_fire(encoding, state)]

    def is_open(self, state: int) -> bool:
        """Nothing is left out."""
        del state
        return False

    def true_in(self, state: int) -> int:
        """The propositions that are true in a state."""
        return self._true_in(state)

    def true_when(self, rule: int) -> int:
        """The propositions that are true in the moment in which a rule fires."""
        return self._labels.of_rules[rule]

    def fair(self, run: Run) -> bool:
        """Whether all that can come in the cycle of a run comes in it; joins only wait."""
        outcomes = outcomes_of(self._encoding.system)
        possible = {
            outcome
            for move in run.cycle
            for rule, _ in self.successors(move.state)
            for outcome in outcomes[rule]
        }
        return possible <= {outcome for move in run.cycle for outcome in outcomes[move.rule]}
