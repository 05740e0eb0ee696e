"""From the steps that Spin tells to the rules that fired, checked by firing them again."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from m2pem.errors import InternalError
from m2pem.verify.encoding import Encoding
from m2pem.verify.system import Kind

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
