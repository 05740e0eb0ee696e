"""Which operators are present: as their control units announce it again and again."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, replace

from m2pem.api.people import ABSENT_AFTER_S, OperatorPresence
from m2pem.fleet.approval import person_of

MOST_UNITS = 1000


@dataclass(slots=True)
class _Announced:
    presence: OperatorPresence
    at_s: float


class Presence:
    """The operators who are present. `now_us`: the executive's clock; how long one was silent
    counts by the event loop's. `changed`: is called when it is no more what it was."""

    def __init__(self, now_us: Callable[[], int], changed: Callable[[], None]) -> None:
        self._now_us = now_us
        self._changed = changed
        self._units: dict[str, _Announced] = {}

    def announce(self, client: str, presence: OperatorPresence) -> None:
        """An operator is present at a unit, and was not gone since the last time. `client`: the id
        of the unit."""
        now_s = asyncio.get_running_loop().time()
        self._forget(now_s)
        known = self._units.get(client)
        since_us = known.presence.since_us if known is not None else self._now_us()
        presence = replace(presence, since_us=since_us)
        while len(self._units) >= MOST_UNITS and client not in self._units:
            del self._units[next(iter(self._units))]
        self._units[client] = _Announced(presence, now_s)
        if known is None or known.presence != presence:
            self._changed()

    def leave(self, client: str) -> None:
        """A unit has ended."""
        if self._units.pop(client, None) is not None:
            self._changed()

    def present(self) -> list[OperatorPresence]:
        """Return who is present, in the order of their names."""
        self._forget(asyncio.get_running_loop().time())
        found = [each.presence for each in self._units.values()]
        return sorted(found, key=lambda each: (each.by.casefold(), each.since_us))

    def is_gone(self, by: str) -> bool:
        """Return whether an operator is at no unit."""
        person = person_of(by)
        return all(person_of(each.by) != person for each in self.present())

    def _forget(self, now_s: float) -> None:
        gone = [key for key, each in self._units.items() if now_s - each.at_s > ABSENT_AFTER_S]
        for key in gone:
            del self._units[key]
        if gone:
            self._changed()
