"""Hashes of passwords: Argon2id, which takes time and memory on purpose."""

import asyncio
import secrets

from argon2 import PasswordHasher
from argon2.exceptions import InvalidHashError, VerificationError

SHORTEST = 8
LONGEST = 1000
AT_ONCE = 2
"""More would take the processor from the engine."""

WAITING = 8


class BusyError(Exception):
    """Too many passwords are being checked."""


def hash_password(password: str) -> str:
    """What is kept of a password.

    Raises:
        ValueError: it is too short, or too long.
    """
    if not SHORTEST <= len(password) <= LONGEST:
        raise ValueError(f"a password has {SHORTEST} to {LONGEST} characters")
    return _hasher().hash(password)


class PasswordChecker:
    """Checks passwords in threads, few at once. It takes as long for a name that is not known."""

    def __init__(self) -> None:
        self._hasher = _hasher()
        self._nobody = ""
        """A hash that no password has; made when it is needed first."""
        self._turn = asyncio.Semaphore(AT_ONCE)
        self._waiting = 0

    async def matches(self, hashed: str | None, password: str) -> bool:
        """Whether a password is that of a hash; None: no user has that name.

        Raises:
            BusyError: too many are being checked.
        """
        if self._waiting >= WAITING:
            raise BusyError
        self._waiting += 1
        try:
            async with self._turn:
                found = await asyncio.to_thread(self._verify, hashed, password)
        finally:
            self._waiting -= 1
        return found and hashed is not None

    def _verify(self, hashed: str | None, password: str) -> bool:
        self._nobody = self._nobody or self._hasher.hash(secrets.token_urlsafe())
        try:
            return self._hasher.verify(hashed or self._nobody, password)
        except (VerificationError, InvalidHashError):
            return False


def _hasher() -> PasswordHasher:
    """46 MiB and one pass (OWASP's first choice), on one processor: the others are the engine's."""
    return PasswordHasher(time_cost=1, memory_cost=46 * 1024, parallelism=1)
