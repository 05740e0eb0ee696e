"""Sessions of signed-in users: two random secrets in the browser, and their hashes here.

One secret is in a cookie. Browsers send cookies to every port of a host, and so to servers of other
programs. The other secret, the key, is known only to the page's origin, which includes the port.
"""

import hashlib
import hmac
import logging
import secrets
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import msgspec

from m2pem_plugin_web.access.private_files import NotPrivateError, read_private, write_private

IDLE_S = 12 * 3600.0
"""A session ends when it was not used for this long."""

LONGEST_S = 7 * 24 * 3600.0
"""A session ends after a week, however much it is used."""

MOST = 1000
"""Most sessions; one more ends the session that was unused for longest."""

KEY_BYTES = 32

log = logging.getLogger("m2pem.ocu.web")


class Secrets(NamedTuple):
    """The secrets of a session in the browser: the value of its cookie, and the key."""

    cookie: str
    key: str


class Session(msgspec.Struct):
    """`name`: who signed in. `proof`: the hash of the secret; a new one ends the session.

    Times are seconds since the Unix epoch. `key_hash` "": an older release began the session
    without a key, and no key is valid.
    """

    name: str
    proof: str
    began: float
    used: float
    key_hash: str = ""


class Sessions:
    """Sessions by the hashes of their cookies: a reader of the file cannot use them.

    `kept`: a file, so that sessions continue after a restart of the executive.
    """

    def __init__(self, kept: Path | None = None, clock: Callable[[], float] = time.time) -> None:
        self._clock = clock
        self._kept = kept
        self._sessions: dict[str, Session] = _read(kept) if kept is not None else {}
        self._tidy()

    def begin(self, name: str, proof: str = "") -> Secrets:
        """Begin a session; return its secrets."""
        made = Secrets(secrets.token_urlsafe(KEY_BYTES), secrets.token_urlsafe(KEY_BYTES))
        now = self._clock()
        session = Session(name, proof, now, now, hash_of(made.key))
        self._sessions[hash_of(made.cookie)] = session
        self._tidy()
        self._keep()
        return made

    def of_cookie(self, cookie: str) -> Session | None:
        """Return the session of a cookie, without its key. This does not prolong the session."""
        session = self._sessions.get(hash_of(cookie))
        return None if session is None or self._is_over(session) else session

    def find(self, cookie: str, key: str) -> Session | None:
        """Return the session of a cookie and its key, and note that it was used now."""
        session = self.of_cookie(cookie)
        if session is None or not hmac.compare_digest(hash_of(key), session.key_hash):
            return None
        session.used = self._clock()
        return session

    def end(self, cookie: str) -> None:
        """End the session of a cookie: its user signs out."""
        if self._sessions.pop(hash_of(cookie), None) is not None:
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
            log.warning("the next start will not know who is signed in: %s", error)


def _read(path: Path) -> dict[str, Session]:
    try:
        return msgspec.json.decode(read_private(path), type=dict[str, Session])
    except FileNotFoundError:
        return {}
    except (NotPrivateError, msgspec.DecodeError) as error:
        log.warning("all users must sign in again: %s", error)
        return {}


def hash_of(secret: str) -> str:
    """Return the hash of a secret."""
    return hashlib.sha256(secret.encode(errors="replace")).hexdigest()
