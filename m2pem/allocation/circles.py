"""Circles of waiting: requests of which none can be met, because each waits for what is not free
until another one is met.

What a run has is free by then if the run has nothing else to do: no question, service, timer or
message is open, and its behaviors end only when the run goes on. What is kept for a request is free
when that one is met. An operator has to end one of them.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

Until = frozenset[str]
"""The requests of which one must be met until something is free; none: it becomes free by itself,
is lost, or is with an operator."""


@dataclass(frozen=True, slots=True)
class Waiting:
    """A request that waits. `needed`: of each thing that it lacks, how many more than are free, and
    how many are not free until one of some requests is met."""

    request: str
    needed: tuple[tuple[int, Mapping[Until, int]], ...]

    def can_be_met(self, stuck: Collection[str]) -> bool:
        """Whether it gets all that it lacks though some requests are never met."""
        return all(
            sum(n for until, n in held.items() if not until or not until.issubset(stuck)) >= count
            for count, held in self.needed
        )

    def waits_for(self) -> set[str]:
        """Return the requests on which it depends."""
        return {request for _, held in self.needed for until in held for request in until}


def circles(waiting: Sequence[Waiting]) -> list[frozenset[str]]:
    """Return the sets of requests that wait for each other for ever."""
    stuck = {each.request: each for each in waiting}
    while met := [each.request for each in stuck.values() if each.can_be_met(stuck)]:
        for request in met:
            del stuck[request]
    before = {request: each.waits_for() & stuck.keys() for request, each in stuck.items()}
    # What waits for a circle is not in it, nor is what waits for more than there is.
    while True:
        awaited = set[str]().union(*before.values())
        off = {each for each, others in before.items() if not others or each not in awaited}
        if not off:
            return _connected(before)
        before = {each: others - off for each, others in before.items() if each not in off}


def _connected(before: Mapping[str, Collection[str]]) -> list[frozenset[str]]:
    """Return the requests in groups that wait for each other, directly or not. `before`: by each,
    those on which it depends."""
    neighbours: dict[str, set[str]] = {request: set() for request in before}
    for request, others in before.items():
        for other in others:
            neighbours[request].add(other)
            neighbours[other].add(request)
    found = []
    while neighbours:
        group = queue = {next(iter(neighbours))}
        while queue:
            queue = set[str]().union(*(neighbours.pop(each) for each in queue)) - group
            group = group | queue
        found.append(frozenset(group))
    return found
