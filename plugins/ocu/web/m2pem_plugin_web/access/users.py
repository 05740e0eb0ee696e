"""The file of named users: their roles, and hashes of their passwords."""

import os
import re
from pathlib import Path

import msgspec

from m2pem_plugin_web.access.private_files import NotPrivateError, read_private, write_private
from m2pem_plugin_web.access.roles import Person, Role

NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._@-]{0,63}")
NAME_IN_WORDS = "a name has letters, digits and . _ @ -, begins with one of the first, and is short"


class User(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A user. `password`: its Argon2 hash."""

    role: Role
    password: str


class Users:
    """The users of a file, read again when it changes: a removed user is signed out at once."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._seen: tuple[int, int, int] | None = None
        self._users: dict[str, User] = {}

    def all(self) -> dict[str, User]:
        """Return all users by name.

        Raises:
            NotPrivateError: the file is missing, damaged, or can be read by others.
        """
        try:
            found = self.path.stat()
            seen = (found.st_mtime_ns, found.st_size, found.st_ino)
            if seen != self._seen:
                self._users = _parsed(self.path)
                self._seen = seen
        except OSError as error:
            raise NotPrivateError(
                f"{self.path}: {os.strerror(error.errno or 0)}; create it with `m2pem web add-user`"
            ) from error
        return self._users

    def person(self, name: str) -> Person | None:
        """Return the user with a name.

        Raises:
            NotPrivateError: as `all`.
        """
        user = self.all().get(name)
        return Person(name, user.role) if user is not None else None


def _parsed(path: Path) -> dict[str, User]:
    try:
        users = msgspec.json.decode(read_private(path), type=dict[str, User])
    except msgspec.DecodeError as error:
        raise NotPrivateError(f"{path} is not a file of users: {error}") from error
    for name in users:
        if not NAME.fullmatch(name):
            raise NotPrivateError(f"{path}: {name!r}: {NAME_IN_WORDS}")
    return users


def write_users(path: Path, users: dict[str, User]) -> None:
    """Write the file.

    Raises:
        NotPrivateError: it cannot be written.
    """
    encoded = msgspec.json.encode(dict(sorted(users.items())))
    write_private(path, msgspec.json.format(encoded, indent=2).decode() + "\n")
