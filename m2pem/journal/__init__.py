"""Where inputs and records are kept: memory, SQLite, PostgreSQL."""

import os
from importlib.util import find_spec
from pathlib import Path
from urllib.parse import quote, unquote, urlsplit

from m2pem.errors import JournalError, JournalUrlError
from m2pem.journal.base import Entry as Entry
from m2pem.journal.base import Journal as Journal
from m2pem.journal.base import RunHeader as RunHeader
from m2pem.journal.base import RunInfo as RunInfo
from m2pem.journal.memory import MemoryJournal as MemoryJournal
from m2pem.journal.postgres_address import (
    SCHEMES,
    SUFFIX,
    PostgresAddress,
    address_of,
    read_address,
    without_password,
)


def open_journal(url: str) -> Journal:
    """Open the journal that `url` names: `memory:`, `sqlite:///absolute/path`, a path, or
    `postgresql://user@host/database`.

    Raises:
        JournalError: it cannot be opened, or nothing opens such a URL.
    """
    if is_postgres(url):
        return _open_postgres(url)
    path = file_of(url)
    return MemoryJournal() if path is None else _open_file(path)


def is_postgres(url: str) -> bool:
    """Whether a URL or path names a journal in PostgreSQL."""
    return urlsplit(url).scheme in SCHEMES or url.endswith(SUFFIX)


def file_of(url: str) -> Path | None:
    """The file of the journal that `url` names; None for one in memory.

    Of a journal in PostgreSQL it has the URL, and names the journal, too: other files of this host
    are beside it.

    Raises:
        JournalUrlError: nothing opens such a URL.
    """
    if url == "memory:":
        return None
    parts = urlsplit(url)
    if parts.scheme == "sqlite":
        if parts.netloc or parts.query or parts.fragment or not parts.path.strip("/"):
            raise JournalUrlError(
                f"{url} is not a journal's URL: write sqlite:///absolute/path, or the path alone"
            )
        return Path(unquote(parts.path))
    if parts.scheme in SCHEMES:
        return address_of(url, _state_folder()).file
    if "://" in url or not url:
        raise JournalUrlError(
            f"{without_password(url)!r} is not a journal's URL: "
            "write a path, sqlite:///absolute/path, postgresql://user@host/database or memory:"
        )
    return Path(url).expanduser()


def default_url() -> str:
    """The URL of the user's own journal: `${XDG_STATE_HOME:-~/.local/state}/m2pem/journal.db`.

    Makes its folder, for its owner alone, where it is missing.

    Raises:
        JournalError: the folder cannot be made.
    """
    return f"sqlite://{quote(str(_state_folder() / 'journal.db'))}"


def _state_folder() -> Path:
    configured = os.environ.get("XDG_STATE_HOME", "")
    # The XDG specification: a relative path is to be ignored.
    state = Path(configured) if Path(configured).is_absolute() else Path("~/.local/state")
    folder = state.expanduser() / "m2pem"
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    except OSError as error:
        raise JournalError(f"{folder} cannot be made: {error.strerror}") from error
    return folder


def postgres_address(url: str) -> PostgresAddress:
    """Return the address of a journal in PostgreSQL, which a URL or the path of its file names.

    Raises:
        JournalError: it is no such URL, or the file cannot be read; or psycopg is missing.
    """
    if find_spec("psycopg") is None:
        raise JournalError(
            f"{without_password(url)}: a journal in PostgreSQL needs psycopg: "
            "pip install 'm2pem[postgres]'"
        )
    if urlsplit(url).scheme in SCHEMES:
        return address_of(url, _state_folder())
    return read_address(Path(url).expanduser())


def _open_postgres(url: str) -> Journal:
    address = postgres_address(url)
    from m2pem.journal.postgres import PostgresJournal  # noqa: PLC0415

    return PostgresJournal.open(address)


def _open_file(path: Path) -> Journal:
    # Half of the import time of this package, which most commands don't need.
    from m2pem.journal.sqlite import SqliteJournal  # noqa: PLC0415

    return SqliteJournal.open(path)
