"""Who has signed in: a random key in a cookie of the browser, and its hash here."""

import hashlib
import logging
import secrets
import time
from collections.abc import Callable
from pathlib import Path

import msgspec

from m2pem_plugin_web.access.private_files import NotPrivateError, read_private, write_private

IDLE_S = 12 * 3600.0
"""A session ends when it was not used for this long."""

LONGEST_S = 7 * 24 * 3600.0
"""However much it is used, somebody has to sign in again after a week."""

MOST = 1000
"""The one that was not used for longest goes, when there are more."""

KEY_BYTES = 32

log = logging.getLogger("m2pem.ocu.web")


class Session(msgspec.Struct):
    """`name`: who signed in. `proof`: what they knew; if that has changed, it is over.

    Times are seconds since the Unix epoch.
    """

    name: str
    proof: str
    began: float
    used: float


class Sessions:
    """Sessions by the hashes of their keys: whoever reads them cannot use them.

    `kept`: a file, so that a page that is open goes on after the executive was started again.
    """

    def __init__(self, kept: Path | None = None, clock: Callable[[], float] = time.time) -> None:
        self._clock = clock
        self._kept = kept
        self._sessions: dict[str, Session] = _read(kept) if kept is not None else {}
        self._tidy()

    def begin(self, name: str, proof: str = "") -> str:
        """A new session; the key that its cookie holds."""
        key = secrets.token_urlsafe(KEY_BYTES)
        now = self._clock()
        self._sessions[hash_of(key)] = Session(name, proof, now, now)
        self._tidy()
        self._keep()
        return key

    def find(self, key: str) -> Session | None:
        """The session of a key, which has been used just now."""
        session = self._sessions.get(hash_of(key))
        if session is None or self._is_over(session):
            return None
        session.used = self._clock()
        return session

    def end(self, key: str) -> None:
        """Somebody signs out."""
        if self._sessions.pop(hash_of(key), None) is not None:
            self._keep()

    def _is_over(self, session: Session) -> bool:
        now = self._clock()
        return now - session.used > IDLE_S or now - session.began > LONGEST_S

    def _tidy(self) -> None:
        self._sessions = {
            digest: each for digest, each in self._sessions.items() if not self._is_over(each)
        }
        while len(self._sessions) > MOST:
            del self._sessions[min(self._sessions, key=lambda each: self._sessions[each].used)]

    def _keep(self) -> None:
        if self._kept is None:
            return
        try:
            write_private(self._kept, msgspec.json.encode(self._sessions).decode())
        except NotPrivateError as error:
            log.warning("who has signed in is forgotten at the next start: %s", error)


def _read(path: Path) -> dict[str, Session]:
    try:
        return msgspec.json.decode(read_private(path), type=dict[str, Session])
    except FileNotFoundError:
        return {}
    except (NotPrivateError, msgspec.DecodeError) as error:
        log.warning("everybody has to sign in again: %s", error)
        return {}


def hash_of(key: str) -> str:
    """What is kept of a key."""
    return hashlib.sha256(key.encode(errors="replace")).hexdigest()
