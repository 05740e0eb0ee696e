"""Where in a product a run can go round for ever and be accepted."""

from collections.abc import Iterator

from m2pem.verify.ltl.automaton import components
from m2pem.verify.product.graph import Product


class Fairness:
    """Which rules must not be passed over for ever: those that can fire again and again do.

    `rules`: by rule, the outcome that it stands for; rules of one outcome are the same to it.
    """

    def __init__(self, product: Product, rules: dict[int, int] | None) -> None:
        self.rules = rules
        self._product = product
        self._possible: dict[int, frozenset[int]] = {}

    def possible(self, node: int) -> frozenset[int]:
        """The outcomes that can come in a node."""
        if self.rules is None or self._product.is_quiet(node):
            return frozenset()
        state = self._product.states[node]
        known = self._possible.get(state)
        if known is None:
            steps = self._product.successors(state)
            known = frozenset(self.rules[rule] for rule, _ in steps if rule in self.rules)
            self._possible[state] = known
        return known

    def outcome(self, rule: int) -> int | None:
        """The outcome that a rule stands for, if it is one that counts."""
        return self.rules.get(rule) if self.rules is not None else None


class Round:
    """Nodes among which an accepted run can stay for ever; `wanted` is what it must pass.

    A move fulfils promise n by not postponing it, and outcome o by being one of its rules.
    """

    def __init__(self, product: Product, nodes: frozenset[int], outcomes: frozenset[int]) -> None:
        self.product = product
        self.nodes = nodes
        self.outcomes = outcomes

    def moves(self, node: int) -> Iterator[tuple[int, int, int]]:
        """The moves from a node that stay."""
        return (move for move in self.product.moves[node] if move[1] in self.nodes)


def accepting_rounds(product: Product, fairness: Fairness) -> Iterator[Round]:
    """All of them in what is expanded so far."""
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
                fairness.outcome(rule)
                for node in part
                for rule, target, _ in product.moves[node]
                if target in part
            }
            missing = possible - passed
            if not missing:
                yield Round(product, part, possible)
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
