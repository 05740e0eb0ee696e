"""Which operators are present: as their control units announce it again and again."""

import asyncio
import math
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
    counts by the event loop's. `changed`: is called when it is no more what it was.

    An operator who commands something is there, though at no unit that announces it: how long one
    is gone counts from the last command, too.
    """

    def __init__(self, now_us: Callable[[], int], changed: Callable[[], None]) -> None:
        self._now_us = now_us
        self._changed = changed
        self._units: dict[str, _Announced] = {}
        self._seen_s: dict[str, float] = {}

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
        left = self._units.pop(client, None)
        if left is not None:
            self.seen(left.presence.by)
            self._changed()

    def seen(self, by: str) -> None:
        """An operator has commanded something, or left a unit just now."""
        self._note(by, asyncio.get_running_loop().time())

    def _note(self, by: str, at_s: float) -> None:
        """Note when an operator was there; of more than `MOST_UNITS`, the one before all others is
        forgotten: its vehicles can be given back at once."""
        person = person_of(by)
        at_s = max(at_s, self._seen_s.pop(person, at_s))
        while len(self._seen_s) >= MOST_UNITS:
            del self._seen_s[next(iter(self._seen_s))]
        self._seen_s[person] = at_s

    def present(self) -> list[OperatorPresence]:
        """Return who is present, in the order of their names."""
        self._forget(asyncio.get_running_loop().time())
        found = [each.presence for each in self._units.values()]
        return sorted(found, key=lambda each: (each.by.casefold(), each.since_us))

    def is_gone(self, by: str) -> bool:
        """Return whether an operator is at no unit."""
        person = person_of(by)
        return all(person_of(each.by) != person for each in self.present())

    def gone_s(self, by: str) -> float:
        """Return for how long an operator is at no unit and has commanded nothing, in seconds; 0
        while one announces it, infinite if that is not known."""
        if not self.is_gone(by):
            return 0.0
        now_s = asyncio.get_running_loop().time()
        return now_s - self._seen_s.get(person_of(by), -math.inf)

    def _forget(self, now_s: float) -> None:
        gone = [key for key, each in self._units.items() if now_s - each.at_s > ABSENT_AFTER_S]
        for key in gone:
            left = self._units.pop(key)
            self._note(left.presence.by, left.at_s)
        if gone:
            self._changed()
