"""Signing in by a one-time token, or by name and password; repeated failures are delayed."""

import hmac
import logging
import secrets
import time
from collections import deque
from collections.abc import Callable, Hashable, Mapping
from pathlib import Path

from starlette.requests import HTTPConnection

from m2pem_plugin_web.access.passwords import BusyError, PasswordChecker
from m2pem_plugin_web.access.private_files import NotPrivateError
from m2pem_plugin_web.access.roles import Person, Role
from m2pem_plugin_web.access.sessions import Secrets, Session, Sessions, hash_of
from m2pem_plugin_web.access.users import Users

WITHIN_S = 300.0
MOST_KEYS = 10_000


class Throttle:
    """Counts failures by key, such as a name at an address."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._failures: dict[Hashable, deque[float]] = {}

    def wait_s(self, bounds: Mapping[Hashable, int]) -> float:
        """Return the seconds until an attempt is allowed; 0: now. `bounds`: failures by key."""
        now = self._clock()
        waits = [0.0]
        for key, bound in bounds.items():
            times = self._recent(key, now)
            if len(times) >= bound:
                waits.append(times[-bound] + WITHIN_S - now)
        return max(waits)

    def failed(self, bounds: Mapping[Hashable, int]) -> None:
        """Count a failed attempt under these keys."""
        now = self._clock()
        for key, bound in bounds.items():
            times = self._recent(key, now)
            self._failures.pop(key, None)
            self._failures[key] = deque([*times, now], maxlen=bound)
        while len(self._failures) > MOST_KEYS:
            del self._failures[next(iter(self._failures))]

    def succeeded(self, bounds: Mapping[Hashable, int]) -> None:
        """Remove the attempt that was counted last: it has succeeded."""
        for key in bounds:
            if times := self._failures.get(key):
                times.pop()

    def forget(self, key: Hashable) -> None:
        """Forget the failures under this key."""
        self._failures.pop(key, None)

    def _recent(self, key: Hashable, now: float) -> list[float]:
        return [each for each in self._failures.get(key, ()) if now - each < WITHIN_S]


TOKEN_BYTES = 24


class OneTimeToken:
    """A token that is replaced when it was used. `renewed` is called with each new one."""

    def __init__(self, renewed: Callable[[str], None] = lambda _: None) -> None:
        self._renewed = renewed
        self._token = ""
        self._renew()

    @property
    def value(self) -> str:
        """The token that is valid for the next sign-in."""
        return self._token

    def redeem(self, token: str) -> bool:
        """Return whether the token is valid; a valid one is replaced."""
        if not hmac.compare_digest(token.encode(), self._token.encode()):
            return False
        self._renew()
        return True

    def _renew(self) -> None:
        self._token = secrets.token_urlsafe(TOKEN_BYTES)
        self._renewed(self._token)


OF_A_NAME_HERE = 5
OF_AN_ADDRESS = 20
OF_A_NAME = 50
"""Failures within five minutes: of one name at one address, of one address, of one name."""

BUSY_S = 2.0

KEY_HEADER = "M2pem-Key"
SUBPROTOCOL = "m2pem"
KEY_SUBPROTOCOL = f"{SUBPROTOCOL}.key."
"""Scripts of a page cannot set headers of a WebSocket: the key follows this in a subprotocol."""

log = logging.getLogger("m2pem.ocu.web")


class ThrottledError(Exception):
    """Sign-in attempts are refused for a while."""

    def __init__(self, wait_s: float) -> None:
        self.wait_s = wait_s
        super().__init__(f"too many attempts: try again in {wait_s:.0f} s")


class Entry:
    """Either `users` sign in by name, or `owner`, who started the executive, by a token.

    `port` is part of the cookie's name: browsers send a cookie to all ports of a host.
    `renewed` is called with each token. `kept`: a file for sessions.
    """

    def __init__(
        self,
        port: int,
        *,
        secure: bool = False,
        owner: Person | None = None,
        users: Users | None = None,
        kept: Path | None = None,
        renewed: Callable[[str], None] = lambda _: None,
    ) -> None:
        self.cookie = f"m2pem_{port}"
        self.secure = secure
        self.by_name = users is not None
        self._sessions = Sessions(kept)
        self._owner = owner if users is None else None
        self._users = users
        self._token = OneTimeToken(renewed) if self._owner is not None else None
        self._checker = PasswordChecker() if users is not None else None
        self._throttle = Throttle()

    def redeem(self, token: str, address: str) -> tuple[Person, Secrets] | None:
        """Return the owner and a new session; None: the token is not valid.

        Raises:
            ThrottledError: there were too many attempts.
        """
        bounds: dict[Hashable, int] = {("token", address): OF_AN_ADDRESS}
        self._wait(bounds)
        if self._token is None or self._owner is None or not self._token.redeem(token):
            self._throttle.failed(bounds)
            return None
        return self._owner, self._sessions.begin(self._owner.name)

    async def sign_in(
        self, name: str, password: str, address: str
    ) -> tuple[Person, Secrets] | None:
        """Return the user and a new session; None: the name or the password is wrong.

        Raises:
            ThrottledError: there were too many attempts.
            NotPrivateError: the file of users cannot be read.
        """
        if self._users is None or self._checker is None:
            return None
        here = (name, address)
        bounds: dict[Hashable, int] = {
            here: OF_A_NAME_HERE,
            ("address", address): OF_AN_ADDRESS,
            ("name", name): OF_A_NAME,
        }
        self._wait(bounds)
        user = self._users.all().get(name)
        # Counted before the check, so that concurrent attempts are bounded, too.
        self._throttle.failed(bounds)
        try:
            matches = await self._checker.matches(user.password if user else None, password)
        except BusyError:
            raise ThrottledError(BUSY_S) from None
        if user is None or not matches:
            log.warning("%r at %s could not sign in", name, address)
            return None
        self._throttle.succeeded(bounds)
        self._throttle.forget(here)
        return Person(name, user.role), self._sessions.begin(name, hash_of(user.password))

    def leave(self, cookies: Mapping[str, str]) -> None:
        """End the session of a browser: its user signs out."""
        if cookie := cookies.get(self.cookie):
            self._sessions.end(cookie)

    def person(self, cookies: Mapping[str, str], key: str) -> Person | None:
        """Return the user of a request, by the browser's cookies and the page's key."""
        return self._person(self._sessions.find(cookies.get(self.cookie, ""), key))

    def person_of_cookie(self, cookies: Mapping[str, str]) -> Person | None:
        """Return the user of a cookie, which servers at other ports of this host receive, too."""
        return self._person(self._sessions.of_cookie(cookies.get(self.cookie, "")))

    def _person(self, session: Session | None) -> Person | None:
        if session is None:
            return None
        if self._users is None:
            owner = self._owner
            return owner if owner is not None and owner.name == session.name else None
        try:
            user = self._users.all().get(session.name)
        except NotPrivateError as error:
            log.error("no user can sign in: %s", error)
            return None
        if user is None or hash_of(user.password) != session.proof:
            return None
        return Person(session.name, user.role)

    def _wait(self, bounds: Mapping[Hashable, int]) -> None:
        wait_s = self._throttle.wait_s(bounds)
        if wait_s > 0:
            raise ThrottledError(wait_s)


def key_of(connection: HTTPConnection) -> str:
    """Return the key that a request or a WebSocket's handshake has; "" without one."""
    if key := connection.headers.get(KEY_HEADER):
        return key
    offered: list[str] = connection.scope.get("subprotocols", [])
    found = (each for each in offered if each.startswith(KEY_SUBPROTOCOL))
    return next(found, "").removeprefix(KEY_SUBPROTOCOL)


def owner_of(name: str) -> Person:
    """Return the user who started the executive, with all permissions."""
    return Person(name, Role.COMMANDER)
