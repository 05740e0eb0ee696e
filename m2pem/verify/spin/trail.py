"""Trails: from the steps that Spin prints to the transitions that fired.

Each trail is checked by firing its transitions again.

`TrailSystem` gives the states along a trail as a `LabelledSystem`, without an exploration.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from m2pem.errors import InternalError
from m2pem.verify.ltl.formula import Proposition
from m2pem.verify.ltl.model_check import Run
from m2pem.verify.net.encoding import Encoding
from m2pem.verify.net.petri_net import Kind, outcomes_of
from m2pem.verify.requirements.propositions import Labels

_STEP = re.compile(r"^\s*(\d+):\s+proc\s+0 \(\S+\) \S+?:(\d+) \(state ")
_CYCLE = "<<<<<START OF CYCLE>>>>>"
_RANK = {Kind.INTERNAL: 0, Kind.JOIN: 1, Kind.EXTERNAL: 2}


@dataclass(frozen=True, slots=True)
class Trail:
    """Transitions that fire one after the other, then those of `cycle` again and again.

    An empty cycle: the trail ends, or nothing more happens after it.
    """

    prefix: tuple[int, ...]
    cycle: tuple[int, ...] = ()


def read(text: str, transition_at: Mapping[int, int]) -> Trail:
    """Parse the transitions of a trail from the output of `spin -t -p`.

    A transition takes two steps, its test and its effect; Spin prints each part of the second. A
    cycle may begin between the two.
    """
    fired: list[int] = []
    tested = False
    last_step = 0
    back_to: int | None = None
    for line in text.splitlines():
        if _CYCLE in line:
            # In the midst of a transition, the cycle begins with it.
            back_to = len(fired) - tested
            continue
        step = _STEP.match(line)
        if step is None or int(step[1]) == last_step:
            continue
        last_step = int(step[1])
        if (transition := transition_at.get(int(step[2]))) is not None:
            if not tested:
                fired.append(transition)
            tested = not tested
    if back_to is None:
        return Trail(tuple(fired))
    if tested:
        fired.pop()
    return Trail(tuple(fired[:back_to]), tuple(fired[back_to:]))


def may_fire(encoding: Encoding, state: int) -> list[int]:
    """The transitions that may fire in a state: those of the first kind that has any enabled."""
    transitions = encoding.net.transitions
    enabled = [
        transition.index for transition in transitions if encoding.enabled(transition.index, state)
    ]
    first = min((_RANK[transitions[each].kind] for each in enabled), default=0)
    return [each for each in enabled if _RANK[transitions[each].kind] == first]


def replay(encoding: Encoding, transitions: Sequence[int], start: int | None = None) -> list[int]:
    """Return the states that transitions lead through, the first one included.

    Raises:
        InternalError: one of them cannot fire where Spin says that it does.
    """
    state = encoding.initial if start is None else start
    states = [state]
    for number in transitions:
        transition = encoding.net.transitions[number]
        if number not in may_fire(encoding, state):
            raise InternalError(
                f"Spin lets transition {number} ({transition.name}) fire where it cannot: "
                f"after {len(states) - 1} steps"
            )
        state, _ = encoding.fire(number, state)
        states.append(state)
    return states


def check_cycle(encoding: Encoding, trail: Trail) -> None:
    """Check that the cycle of a trail returns to where it began.

    Raises:
        InternalError: it does not.
    """
    states = replay(encoding, trail.prefix + trail.cycle)
    if states[-1] != states[len(trail.prefix)]:
        raise InternalError("Spin's cycle does not come back to where it began")


class TrailSystem:
    """A `LabelledSystem` whose states are those of the encoding."""

    reduced = False

    def __init__(self, encoding: Encoding, labels: Labels) -> None:
        self._encoding = encoding
        self._labels = labels
        self._true_in = labels.of_states(encoding)

    @property
    def propositions(self) -> Sequence[Proposition]:
        return self._labels.propositions

    def initial(self) -> Sequence[int]:
        return (self._encoding.initial,)

    def successors(self, state: int) -> Sequence[tuple[int, int]]:
        """The transitions that can fire in a state, each with the state after it."""
        encoding = self._encoding
        return [
            (transition, encoding.fire(transition, state)[0])
            for transition in may_fire(encoding, state)
        ]

    def is_open(self, state: int) -> bool:
        del state
        return False

    def true_in(self, state: int) -> int:
        """The propositions that are true in a state."""
        return self._true_in(state)

    def true_when(self, transition: int) -> int:
        """The propositions that are true in the moment in which a transition fires."""
        return self._labels.of_transitions[transition]

    def fair(self, run: Run) -> bool:
        """Whether each outcome that is possible in the cycle of a run happens in it; joins only
        wait.
        """
        outcomes = outcomes_of(self._encoding.net)
        possible = {
            outcome
            for move in run.cycle
            for transition, _ in self.successors(move.state)
            for outcome in outcomes[transition]
        }
        return possible <= {outcome for move in run.cycle for outcome in outcomes[move.transition]}
