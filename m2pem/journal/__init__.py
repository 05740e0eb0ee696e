"""Where inputs and records are kept: memory, SQLite."""

import os
from pathlib import Path
from urllib.parse import quote, unquote, urlsplit

from m2pem.errors import JournalError, JournalUrlError
from m2pem.journal.base import Entry, Journal, RunHeader, RunInfo
from m2pem.journal.memory import MemoryJournal

__all__ = [
    "Entry",
    "Journal",
    "MemoryJournal",
    "RunHeader",
    "RunInfo",
    "default_url",
    "file_of",
    "open_journal",
]


def open_journal(url: str) -> Journal:
    """Open the journal that `url` names: `memory:`, `sqlite:///absolute/path`, or a path.

    Raises:
        JournalError: it cannot be opened, or nothing opens such a URL.
    """
    path = file_of(url)
    return MemoryJournal() if path is None else _open_file(path)


def file_of(url: str) -> Path | None:
    """The file of the journal that `url` names; None for one in memory.

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
    if parts.scheme in ("postgresql", "postgres"):
        raise JournalUrlError(
            f"{_without_password(url)}: journals in PostgreSQL are reserved for a later version; "
            "use a path or sqlite:///absolute/path"
        )
    if "://" in url or not url:
        raise JournalUrlError(
            f"{_without_password(url)!r} is not a journal's URL: "
            "write a path, sqlite:///absolute/path or memory:"
        )
    return Path(url).expanduser()


def default_url() -> str:
    """The URL of the user's own journal: `${XDG_STATE_HOME:-~/.local/state}/m2pem/journal.db`.

    Makes its folder, for its owner alone, where it is missing.

    Raises:
        JournalError: the folder cannot be made.
    """
    configured = os.environ.get("XDG_STATE_HOME", "")
    # The XDG specification: a relative path is to be ignored.
    state = Path(configured) if Path(configured).is_absolute() else Path("~/.local/state")
    folder = state.expanduser() / "m2pem"
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    except OSError as error:
        raise JournalError(f"{folder} cannot be made: {error.strerror}") from error
    return f"sqlite://{quote(str(folder / 'journal.db'))}"


def _open_file(path: Path) -> Journal:
    # Half of the import time of this package, which most commands don't need.
    from m2pem.journal.sqlite import SqliteJournal  # noqa: PLC0415

    return SqliteJournal.open(path)


def _without_password(url: str) -> str:
    parts = urlsplit(url)
    host = parts.netloc.rpartition("@")[2]
    return parts._replace(netloc=host).geturl()
