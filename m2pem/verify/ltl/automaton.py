"""Büchi automata that accept the runs of which a formula holds, and their construction.

A run is accepted if some path reads its letters and fulfils each promise again and again: an edge
*postpones* a promise (`a U b`, b still to come) or does not, and a path on which one is postponed
for ever accepts nothing.

A state of the constructed automaton is a formula: what the rest of the run must fulfil. `a U b` is
"b, or else a and `a U b` next", and the second choice postpones its promise; `a R b` is "b, and
either a or `a R b` next". States are made when they are reached.
"""

from dataclasses import dataclass

from m2pem.errors import M2pemError
from m2pem.verify.ltl.normal_form import FALSE, TRUE, Forms, Op


@dataclass(frozen=True, slots=True)
class Edge:
    """Reads letters that have all bits of `set_` and none of `unset`. `postponed`: promises."""

    set_: int
    unset: int
    target: int
    postponed: int = 0

    def reads(self, letter: int) -> bool:
        return letter & self.set_ == self.set_ and not letter & self.unset

    def covers(self, other: "Edge") -> bool:
        """Whether it reads all that the other one reads, to the same state, with no
        more postponed.
        """
        return (
            self.target == other.target
            and self.set_ & other.set_ == self.set_
            and self.unset & other.unset == self.unset
            and self.postponed & other.postponed == self.postponed
        )


@dataclass(frozen=True, slots=True)
class Automaton:
    """States are numbered; a path begins in `initial`. `promises`: how many there are.

    `accepting_all`: the state that accepts whatever comes, if there is one, else -1. Without any
    state but the first and without edges, nothing is accepted.
    """

    edges: tuple[tuple[Edge, ...], ...]
    initial: int
    promises: int
    accepting_all: int = -1

    def __len__(self) -> int:
        return len(self.edges)


def reduced(automaton: Automaton) -> Automaton:
    """The same automaton without useless states and edges, and with equivalent states merged."""
    trimmed = _trim(automaton)
    while True:
        merged = _merge(trimmed)
        if len(merged) == len(trimmed):
            return _with_all(merged)
        trimmed = merged


def _trim(automaton: Automaton) -> Automaton:
    """Remove edges that lead to no accepted run; promises count only on cycles."""
    component = components([[edge.target for edge in each] for each in automaton.edges])
    every = (1 << automaton.promises) - 1
    postponed_by_all = [every] * (max(component, default=0) + 1)
    round_: set[int] = set()
    for state, edges in enumerate(automaton.edges):
        for edge in edges:
            if component[state] == component[edge.target]:
                round_.add(component[state])
                postponed_by_all[component[state]] &= edge.postponed
    good = {each for each in round_ if not postponed_by_all[each]}
    useful = {state for state in range(len(automaton)) if component[state] in good}
    sources: list[list[int]] = [[] for _ in automaton.edges]
    for state, edges in enumerate(automaton.edges):
        for edge in edges:
            sources[edge.target].append(state)
    waiting = list(useful)
    while waiting:
        for source in sources[waiting.pop()]:
            if source not in useful:
                useful.add(source)
                waiting.append(source)
    kept = tuple(
        tuple(
            edge
            if component[state] == component[edge.target] and component[state] in good
            else Edge(edge.set_, edge.unset, edge.target)
            for edge in edges
            if edge.target in useful
        )
        if state in useful
        else ()
        for state, edges in enumerate(automaton.edges)
    )
    bad = {state for state in useful if component[state] in round_ - good}
    every_edge = [
        # Going round in a component that accepts nothing must not look like accepting.
        tuple(
            Edge(edge.set_, edge.unset, edge.target, every)
            if state in bad and component[state] == component[edge.target]
            else edge
            for edge in edges
        )
        for state, edges in enumerate(kept)
    ]
    return Automaton(tuple(every_edge), automaton.initial, automaton.promises)


def _merge(automaton: Automaton) -> Automaton:
    """Merge states that no run distinguishes, and remove unreachable ones."""
    block = [0] * len(automaton)
    count = 1
    while True:
        signatures: dict[tuple[int, frozenset[Edge]], int] = {}
        new = []
        for state, edges in enumerate(automaton.edges):
            moved = frozenset(Edge(e.set_, e.unset, block[e.target], e.postponed) for e in edges)
            new.append(signatures.setdefault((block[state], moved), len(signatures)))
        block = new
        if len(signatures) == count:
            break
        count = len(signatures)
    order: dict[int, int] = {block[automaton.initial]: 0}
    result: list[tuple[Edge, ...]] = []
    waiting = [automaton.initial]
    while waiting:
        state = waiting.pop(0)
        found: list[Edge] = []
        for edge in automaton.edges[state]:
            target = block[edge.target]
            if target not in order:
                order[target] = len(order)
                waiting.append(edge.target)
            found.append(Edge(edge.set_, edge.unset, order[target], edge.postponed))
        result.append(_without_covered(found))
    return Automaton(tuple(result), 0, automaton.promises)


def _without_covered(edges: list[Edge]) -> tuple[Edge, ...]:
    kept: list[Edge] = []
    for edge in dict.fromkeys(edges):
        if not any(other.covers(edge) for other in kept):
            kept = [other for other in kept if not edge.covers(other)]
            kept.append(edge)
    return tuple(kept)


def _with_all(automaton: Automaton) -> Automaton:
    for state, edges in enumerate(automaton.edges):
        if Edge(0, 0, state) in edges:
            return Automaton(automaton.edges, automaton.initial, automaton.promises, state)
    return automaton


def components(targets: list[list[int]]) -> list[int]:
    """For each node of a graph, the number of its strongly connected component (Tarjan)."""
    size = len(targets)
    index, low = [-1] * size, [0] * size
    component = [-1] * size
    stack: list[int] = []
    counter = number = 0
    for root in range(size):
        if index[root] >= 0:
            continue
        index[root] = low[root] = counter
        counter += 1
        stack.append(root)
        work = [(root, iter(targets[root]))]
        while work:
            node, rest = work[-1]
            for target in rest:
                if index[target] < 0:
                    index[target] = low[target] = counter
                    counter += 1
                    stack.append(target)
                    work.append((target, iter(targets[target])))
                    break
                if component[target] < 0 and index[target] < low[node]:
                    low[node] = index[target]
            else:
                work.pop()
                if work and low[node] < low[work[-1][0]]:
                    low[work[-1][0]] = low[node]
                if low[node] == index[node]:
                    while True:
                        member = stack.pop()
                        component[member] = number
                        if member == node:
                            break
                    number += 1
    return component


MAX_STATES = 20_000
MAX_CHOICES = 50_000


class FormulaTooLargeError(M2pemError):
    """A formula's automaton has too many states; split the formula."""

    exit_status = 2


@dataclass(frozen=True, slots=True)
class _Choice:
    """One way to fulfil a formula: bits now, formulas next, promises (untils) postponed."""

    set_: int = 0
    unset: int = 0
    next: frozenset[int] = frozenset()
    postponed: frozenset[int] = frozenset()

    def beats(self, other: "_Choice") -> bool:
        return (
            self.set_ & other.set_ == self.set_
            and self.unset & other.unset == self.unset
            and self.next <= other.next
            and self.postponed <= other.postponed
        )


_FREE = (_Choice(),)


def translate(formula: int, forms: Forms) -> Automaton:
    """The automaton of a formula in normal form.

    Raises:
        FormulaTooLargeError: it would have more than `MAX_STATES` states.
    """
    choices = _Choices(forms)
    numbers = {formula: 0}
    order = [formula]
    promises: dict[int, int] = {}
    edges: list[tuple[Edge, ...]] = []
    while len(edges) < len(order):
        made: list[Edge] = []
        for choice in choices.of(order[len(edges)]):
            target = forms.conjunction(tuple(choice.next))
            if target == FALSE:
                continue
            if target not in numbers:
                numbers[target] = len(order)
                order.append(target)
                if len(order) > MAX_STATES:
                    raise FormulaTooLargeError(
                        f"the formula needs an automaton of more than {MAX_STATES:,} states; "
                        "split it into several requirements"
                    )
            postponed = 0
            for until in choice.postponed:
                postponed |= 1 << promises.setdefault(until, len(promises))
            made.append(Edge(choice.set_, choice.unset, numbers[target], postponed))
        edges.append(tuple(made))
    return reduced(Automaton(tuple(edges), 0, len(promises)))


class _Choices:
    """The ways to fulfil formulas; each is computed once."""

    def __init__(self, forms: Forms) -> None:
        self.forms = forms
        self.known: dict[int, tuple[_Choice, ...]] = {TRUE: _FREE, FALSE: ()}

    def of(self, formula: int) -> tuple[_Choice, ...]:
        known = self.known.get(formula)
        if known is None:
            known = self.known[formula] = self._of(formula)
        return known

    def _of(self, formula: int) -> tuple[_Choice, ...]:
        forms = self.forms
        arguments = forms.arguments(formula)
        match forms.op(formula):
            case Op.LITERAL:
                bit = 1 << arguments[0]
                return (_Choice(set_=bit),) if arguments[1] else (_Choice(unset=bit),)
            case Op.NEXT:
                return (_Choice(next=frozenset({arguments[0]})),)
            case Op.OR:
                return _best([each for part in arguments for each in self.of(part)])
            case Op.AND:
                result: tuple[_Choice, ...] = _FREE
                for part in arguments:
                    result = _both(result, self.of(part))
                return result
            case Op.UNTIL:
                later = _Choice(next=frozenset({formula}), postponed=frozenset({formula}))
                waits = _both(self.of(arguments[0]), (later,))
                return _best([*self.of(arguments[1]), *waits])
            case _:  # RELEASE
                later = _Choice(next=frozenset({formula}))
                goes_on = _best([*self.of(arguments[0]), later])
                return _both(self.of(arguments[1]), goes_on)


def _both(left: tuple[_Choice, ...], right: tuple[_Choice, ...]) -> tuple[_Choice, ...]:
    if len(left) * len(right) > MAX_CHOICES:
        raise FormulaTooLargeError(
            "the formula combines too many choices; split it into several requirements"
        )
    found = []
    for one in left:
        for two in right:
            set_, unset = one.set_ | two.set_, one.unset | two.unset
            if not set_ & unset:
                next_, postponed = one.next | two.next, one.postponed | two.postponed
                found.append(_Choice(set_, unset, next_, postponed))
    return _best(found)


def _best(choices: list[_Choice]) -> tuple[_Choice, ...]:
    """Remove choices that another one makes redundant."""
    kept: list[_Choice] = []
    for choice in dict.fromkeys(choices):
        if not any(other.beats(choice) for other in kept):
            kept = [other for other in kept if not choice.beats(other)]
            kept.append(choice)
    return tuple(kept)
