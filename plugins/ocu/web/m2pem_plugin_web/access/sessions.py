"""Who has signed in: a random key in a cookie of the browser, and its hash here."""

import hashlib
import secrets
import time
from collections.abc import Callable
from dataclasses import dataclass

IDLE_S = 12 * 3600.0
"""A session ends when it was not used for this long."""

LONGEST_S = 7 * 24 * 3600.0
"""However much it is used, somebody has to sign in again after a week."""

MOST = 1000
"""The one that was not used for longest goes, when there are more."""

KEY_BYTES = 32


@dataclass(slots=True)
class Session:
    """`name`: who signed in. Times are of the sessions' own clock, in seconds."""

    name: str
    began: float
    used: float


class Sessions:
    """Sessions by the hashes of their keys: whoever reads this memory cannot use it."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._sessions: dict[str, Session] = {}

    def begin(self, name: str) -> str:
        """A new session; the key that its cookie holds."""
        key = secrets.token_urlsafe(KEY_BYTES)
        now = self._clock()
        self._sessions[hash_of(key)] = Session(name, now, now)
        self._tidy()
        return key

    def find(self, key: str) -> Session | None:
        """The session of a key, which has been used just now."""
        digest = hash_of(key)
        session = self._sessions.get(digest)
        if session is None:
            return None
        if self._is_over(session):
            del self._sessions[digest]
            return None
        session.used = self._clock()
        return session

    def end(self, key: str) -> None:
        """Somebody signs out."""
        self._sessions.pop(hash_of(key), None)

    def _is_over(self, session: Session) -> bool:
        now = self._clock()
        return now - session.used > IDLE_S or now - session.began > LONGEST_S

    def _tidy(self) -> None:
        self._sessions = {
            digest: each for digest, each in self._sessions.items() if not self._is_over(each)
        }
        while len(self._sessions) > MOST:
            del self._sessions[min(self._sessions, key=lambda each: self._sessions[each].used)]


def hash_of(key: str) -> str:
    """What is kept of a key."""
    return hashlib.sha256(key.encode(errors="replace")).hexdigest()
