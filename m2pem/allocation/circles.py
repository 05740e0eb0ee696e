"""Circles of waiting: runs of which none can go on, because each waits for what another one holds.

A run in a circle has nothing else to do: no question, service, timer or message is open, and its
behaviors end only when the run goes on. An operator has to end one of them.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Waiting:
    """A request that waits. `needed`: by each role, how many more resources it needs than are free,
    and how many each run holds for as long as it does not go on; None stands for holders that will
    release their resources by themselves, and for resources that are lost or with an operator."""

    request: str
    run: str
    needed: tuple[tuple[int, Mapping[str | None, int]], ...]

    def can_be_met(self, stuck: Collection[str]) -> bool:
        """Whether its roles can be filled though some runs hold what they have for ever."""
        return all(
            sum(n for holder, n in holders.items() if holder is None or holder not in stuck)
            >= count
            for count, holders in self.needed
        )


def circles(waiting: Sequence[Waiting]) -> list[frozenset[str]]:
    """Return the sets of runs that wait for each other for ever.

    `waiting`: the requests of runs that nothing but these requests can make go on.
    """
    asked: dict[str, list[Waiting]] = {}
    for each in waiting:
        asked.setdefault(each.run, []).append(each)
    stuck = set(asked)
    while goes_on := {run for run in stuck if any(each.can_be_met(stuck) for each in asked[run])}:
        stuck -= goes_on
    return _connected(stuck, asked)


def _connected(stuck: set[str], asked: Mapping[str, Sequence[Waiting]]) -> list[frozenset[str]]:
    """Return the stuck runs in groups that wait for each other, directly or not."""
    left, found = set(stuck), []
    while left:
        group, queue = set[str](), [min(left)]
        for run in queue:
            if run in group:
                continue
            group.add(run)
            holders = {
                holder
                for each in asked[run]
                for _, runs in each.needed
                for holder in runs
                if holder in stuck
            }
            queue += [holder for holder in holders if holder is not None]
            queue += [other for other in left - group if _waits_for(asked[other], run)]
        found.append(frozenset(group))
        left -= group
    return found


def _waits_for(requests: Sequence[Waiting], run: str) -> bool:
    return any(run in holders for each in requests for _, holders in each.needed)
