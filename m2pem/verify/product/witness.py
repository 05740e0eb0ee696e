"""From a place where runs are accepted to one such run, as short as is easily had."""

from collections import deque
from collections.abc import Callable

from m2pem.verify.product.cycles import Fairness, Round
from m2pem.verify.product.graph import Product
from m2pem.verify.product.labelled import QUIET, STUTTER
from m2pem.verify.product.verdict import Move, Run

_Step = tuple[int, int, int, int]
"""From which node, by which rule, to which node, with which promises postponed."""


def run_to(product: Product, node: int) -> Run:
    """The run that leads to a node after which whatever follows is accepted."""
    start, prefix = _prefix(product, node)
    return Run(start, prefix, whatever_follows=True)


def run_round(round_: Round, fairness: Fairness) -> Run:
    """A run that comes to a round by the shortest way, and fulfils all it must in each."""
    product = round_.product
    cycle = _cycle(round_, fairness, min(round_.nodes))
    nearest = min(range(len(cycle)), key=lambda at: cycle[at][0])
    cycle = cycle[nearest:] + cycle[:nearest]
    start, prefix = _prefix(product, cycle[0][0])
    return Run(start, prefix, _moves([(rule, product.states[to]) for _, rule, to, _ in cycle]))


def _prefix(product: Product, node: int) -> tuple[int, tuple[Move, ...]]:
    steps: list[tuple[int, int]] = []
    while product.parent[node] >= 0:
        steps.append((product.via[node], product.states[node]))
        node = product.parent[node]
    return product.states[node], _moves(steps[::-1])


def _moves(steps: list[tuple[int, int]]) -> tuple[Move, ...]:
    """What happens to the system; moments in which nothing does are left out."""
    return tuple(Move(rule, state) for rule, state in steps if rule not in (QUIET, STUTTER))


def _cycle(round_: Round, fairness: Fairness, start: int) -> list[_Step]:
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


def _path(round_: Round, start: int, wanted: Callable[[_Step], bool]) -> list[_Step]:
    """The shortest way, of one step at least, whose last step is wanted."""
    came: dict[int, _Step] = {}
    waiting = deque([start])
    seen = {start}
    while waiting:
        node = waiting.popleft()
        for rule, target, postponed in round_.moves(node):
            step = (node, rule, target, postponed)
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
