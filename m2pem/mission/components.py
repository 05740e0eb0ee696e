"""Strongly connected components of a directed graph."""

from collections.abc import Collection, Hashable, Mapping
from typing import TypeVar

N = TypeVar("N", bound=Hashable)


def components(successors: Mapping[N, Collection[N]]) -> dict[N, int]:
    """Return a number for each node; nodes that can reach each other have the same one.

    Kosaraju's algorithm, without recursion. Successors that are no keys are not in the graph.
    """
    before: dict[N, list[N]] = {node: [] for node in successors}
    for node, following in successors.items():
        for each in following:
            if each in before:
                before[each].append(node)
    finished: list[N] = []
    seen: set[N] = set()
    for start in successors:
        waiting = [(start, False)]
        while waiting:
            node, done = waiting.pop()
            if done:
                finished.append(node)
            elif node not in seen:
                seen.add(node)
                waiting.append((node, True))
                waiting += [(each, False) for each in successors[node] if each in before]
    number: dict[N, int] = {}
    for count, last in enumerate(reversed(finished)):
        members = [last]
        while members:
            node = members.pop()
            if node not in number:
                number[node] = count
                members += before[node]
    return number
