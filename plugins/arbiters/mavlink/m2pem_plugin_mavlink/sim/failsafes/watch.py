"""Noticing that something has become wrong, and that it is well again."""

import math
from enum import Enum


class Change(Enum):
    """What has changed."""

    NONE = 0
    WRONG = 1
    WELL = 2


class Watch:
    """Something that is wrong or well."""

    def __init__(self) -> None:
        self.wrong = False

    def look(self, wrong: bool) -> Change:
        """How it is now; what has changed since the last look."""
        before, self.wrong = self.wrong, wrong
        if wrong == before:
            return Change.NONE
        return Change.WRONG if wrong else Change.WELL


class Lasting(Watch):
    """It is wrong only after having been so for some time."""

    def __init__(self) -> None:
        super().__init__()
        self._since_s = math.inf

    def look_for(self, wrong: bool, seconds: float, now_s: float) -> Change:
        """Whether it has been wrong for that long."""
        self._since_s = min(self._since_s, now_s) if wrong else math.inf
        return self.look(wrong and now_s - self._since_s >= seconds)


class Heartbeats:
    """When the ground station was heard last; one that was never heard is not missed."""

    def __init__(self) -> None:
        self._heard_s: float | None = None

    def heard(self, now_s: float) -> None:
        """Just now."""
        self._heard_s = now_s

    def missed(self, seconds: float, now_s: float) -> bool:
        """For longer than that."""
        return self._heard_s is not None and now_s - self._heard_s > seconds
