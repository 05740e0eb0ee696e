"""Automata that accept the runs of which a formula holds.

A run is accepted if some path reads its letters and fulfils each promise again and again: an edge
*postpones* a promise (`a U b`, b still to come) or does not, and a path on which one is postponed
for ever accepts nothing.
"""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Edge:
    """Reads letters that have all bits of `set_` and none of `unset`. `postponed`: promises."""

    set_: int
    unset: int
    target: int
    postponed: int = 0

    def reads(self, letter: int) -> bool:
        """Whether a letter lets it pass."""
        return letter & self.set_ == self.set_ and not letter & self.unset

    def covers(self, other: "Edge") -> bool:
        """Whether it reads all that the other reads, to the same end, with no more postponed."""
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

    @property
    def needs_rounds(self) -> bool:
        """Whether something is accepted only by going round for ever, not once and for all."""
        component = components([[edge.target for edge in each] for each in self.edges])
        every = (1 << self.promises) - 1
        together: dict[int, int] = {}
        for state, edges in enumerate(self.edges):
            for edge in edges:
                if component[state] == component[edge.target] and state != self.accepting_all:
                    number = component[state]
                    together[number] = together.get(number, every) & edge.postponed
        return any(not always for always in together.values())

    def __len__(self) -> int:
        return len(self.edges)


def reduced(automaton: Automaton) -> Automaton:
    """The same without states that lead nowhere, with states that do alike made one."""
    trimmed = _trim(automaton)
    while True:
        merged = _merge(trimmed)
        if len(merged) == len(trimmed):
            return _with_all(merged)
        trimmed = merged


def _trim(automaton: Automaton) -> Automaton:
    """Without edges that lead to no accepted run; promises count only where paths can go round."""
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
    """States that no run can tell apart made one, and what cannot be reached left out."""
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
