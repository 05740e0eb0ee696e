"""Addresses of served pages, each with its valid token, for `m2pem web url`.

Each page has a file in a private folder of this user.
"""

import os
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path

import msgspec

from m2pem_plugin_web.access.private_files import (
    NotPrivateError,
    private_folder,
    read_private,
    write_private,
)


class Page(msgspec.Struct, frozen=True):
    """A served page. `token` "": users sign in with names."""

    pid: int
    port: int
    address: str
    token: str

    @property
    def url(self) -> str:
        """The address to open."""
        return f"{self.address}?token={self.token}" if self.token else self.address


def folder(environment: Mapping[str, str] = os.environ) -> Path:
    """Return the folder of page files: the runtime directory of the user, else the state directory.

    Raises:
        NotPrivateError: it cannot be created, or belongs to another user.
    """
    runtime = environment.get("XDG_RUNTIME_DIR", "")
    if runtime and Path(runtime).is_dir():
        return private_folder(Path(runtime) / "m2pem-web")
    state = environment.get("XDG_STATE_HOME", "")
    return private_folder((Path(state) if state else Path.home() / ".local/state") / "m2pem-web")


def file_of(where: Path, port: int) -> Path:
    """Return the file of the page at a port."""
    return where / f"page-{port}.json"


def sessions_of(where: Path, port: int) -> Path:
    """Return the file of the sessions at a port."""
    return where / f"sessions-{port}.json"


def announce(where: Path, page: Page) -> None:
    """Write the file of a page.

    Raises:
        NotPrivateError: it cannot be written.
    """
    write_private(file_of(where, page.port), msgspec.json.encode(page).decode())


def withdraw(where: Path, port: int) -> None:
    """Remove the file of a page that is no longer served."""
    with suppress(OSError):
        file_of(where, port).unlink()


def pages(where: Path) -> Iterator[Page]:
    """Yield the served pages; remove the files of processes that have ended."""
    for path in sorted(where.glob("page-*.json")):
        try:
            page = msgspec.json.decode(read_private(path), type=Page)
        except (FileNotFoundError, NotPrivateError, msgspec.DecodeError):
            continue
        if _is_alive(page.pid):
            yield page
        else:
            path.unlink(missing_ok=True)


def _is_alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True
