"""Hashes of passwords: Argon2id, which takes time and memory on purpose."""

import asyncio
import secrets

from argon2 import PasswordHasher
from argon2.exceptions import InvalidHashError, VerificationError

SHORTEST = 8
LONGEST = 1000
AT_ONCE = 2
"""Passwords that are checked at once: more would slow the engine down."""

WAITING = 8


class BusyError(Exception):
    """Too many passwords are being checked."""


def hash_password(password: str) -> str:
    """Return the hash of a password.

    Raises:
        ValueError: the password is too short or too long.
    """
    if not SHORTEST <= len(password) <= LONGEST:
        raise ValueError(f"a password has {SHORTEST} to {LONGEST} characters")
    return _hasher().hash(password)


class PasswordChecker:
    """Checks passwords in threads, few at once. An unknown name takes as long as a known one."""

    def __init__(self) -> None:
        self._hasher = _hasher()
        self._hash_of_no_password = ""
        """Verified for unknown names; computed at the first use."""
        self._turn = asyncio.Semaphore(AT_ONCE)
        self._waiting = 0

    async def matches(self, hashed: str | None, password: str) -> bool:
        """Return whether a password has this hash; None: no user has that name.

        Raises:
            BusyError: too many passwords are being checked.
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
        self._hash_of_no_password = self._hash_of_no_password or self._hasher.hash(
            secrets.token_urlsafe()
        )
        try:
            return self._hasher.verify(hashed or self._hash_of_no_password, password)
        except (VerificationError, InvalidHashError):
            return False


def _hasher() -> PasswordHasher:
    """Return a hasher with 46 MiB and one pass (OWASP's first choice), on one processor only."""
    return PasswordHasher(time_cost=1, memory_cost=46 * 1024, parallelism=1)
