"""Trails: from the steps that Spin prints to the transitions that fired.

Each trail is checked by firing its transitions again.

`Walking` gives the states along a trail as a `LabelledSystem`, without an exploration.
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
_RANK = {Kind.INTERNAL: 0, Kind.JOIN: 1, Kind.OUTSIDE: 2}


@dataclass(frozen=True, slots=True)
class Trail:
    """Rules that fire one after the other, then those of `cycle` again and again.

    An empty cycle: the trail ends, or nothing more happens after it.
    """

    prefix: tuple[int, ...]
    cycle: tuple[int, ...] = ()


def read(text: str, rule_at: Mapping[int, int]) -> Trail:
    """The rules of a trail, as `spin -t -p` tells it.

    A rule takes two steps, its test and what it does; Spin tells each part of the second. A cycle
    may begin between the two.
    """
    fired: list[int] = []
    tested = False
    last_step = 0
    back_to: int | None = None
    for line in text.splitlines():
        if _CYCLE in line:
            # In the midst of a rule, the cycle begins with it.
            back_to = len(fired) - tested
            continue
        told = _STEP.match(line)
        if told is None or int(told[1]) == last_step:
            continue
        last_step = int(told[1])
        if (rule := rule_at.get(int(told[2]))) is not None:
            if not tested:
                fired.append(rule)
            tested = not tested
    if back_to is None:
        return Trail(tuple(fired))
    if tested:
        fired.pop()
    return Trail(tuple(fired[:back_to]), tuple(fired[back_to:]))


def may_fire(encoding: Encoding, state: int) -> list[int]:
    """The rules that may fire in a state: of the first kind that has any."""
    rules = encoding.system.rules
    enabled = [rule.index for rule in rules if encoding.enabled(rule.index, state)]
    first = min((_RANK[rules[each].kind] for each in enabled), default=0)
    return [each for each in enabled if _RANK[rules[each].kind] == first]


def replay(encoding: Encoding, rules: Sequence[int], start: int | None = None) -> list[int]:
    """The states that rules lead through, the first one included.

    Raises:
        InternalError: one of them cannot fire where Spin says that it does.
    """
    state = encoding.initial if start is None else start
    states = [state]
    for number in rules:
        rule = encoding.system.rules[number]
        if number not in may_fire(encoding, state):
            raise InternalError(
                f"Spin lets rule {number} ({rule.name}) fire where it cannot: "
                f"after {len(states) - 1} steps"
            )
        state, _ = encoding.fire(number, state)
        states.append(state)
    return states


def check_cycle(encoding: Encoding, trail: Trail) -> None:
    """See that the cycle of a trail comes back to where it began.

    Raises:
        InternalError: it does not.
    """
    states = replay(encoding, trail.prefix + trail.cycle)
    if states[-1] != states[len(trail.prefix)]:
        raise InternalError("Spin's cycle does not come back to where it began")


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
