"""Where a page that is served can be found by its user: its address, with the token that is valid.

A file a page, in a folder of this user's own.
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
    """A page that is served. `token` "": people sign in with names."""

    pid: int
    port: int
    address: str
    token: str

    @property
    def url(self) -> str:
        """What to open."""
        return f"{self.address}?token={self.token}" if self.token else self.address


def folder(environment: Mapping[str, str] = os.environ) -> Path:
    """Where they are: in the user's runtime directory, else in their directory of state.

    Raises:
        NotPrivateError: it cannot be made, or is another's.
    """
    runtime = environment.get("XDG_RUNTIME_DIR", "")
    if runtime and Path(runtime).is_dir():
        return private_folder(Path(runtime) / "m2pem-web")
    state = environment.get("XDG_STATE_HOME", "")
    return private_folder((Path(state) if state else Path.home() / ".local/state") / "m2pem-web")


def file_of(where: Path, port: int) -> Path:
    """The file of the page at a port."""
    return where / f"page-{port}.json"


def sessions_of(where: Path, port: int) -> Path:
    """The file of who has signed in at a port."""
    return where / f"sessions-{port}.json"


def announce(where: Path, page: Page) -> None:
    """Make a page known.

    Raises:
        NotPrivateError: it cannot be written.
    """
    write_private(file_of(where, page.port), msgspec.json.encode(page).decode())


def withdraw(where: Path, port: int) -> None:
    """The page is served no more."""
    with suppress(OSError):
        file_of(where, port).unlink()


def pages(where: Path) -> Iterator[Page]:
    """The pages that are served; files of dead ones are removed on the way."""
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
