"""Where the sockets are: in a folder beside the journal, that only its owner may enter.

Who knows a journal finds all executives that write to it, whatever their environment is.
"""

import os
import socket
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from m2pem.errors import M2pemError

LONGEST_PATH_BYTES = 107
"""Of a Unix socket, as the system takes it."""


class ControlSocketError(M2pemError):
    """The socket cannot be made or reached, or who is at its other end does not keep to it."""


def folder_of(journal: Path) -> Path:
    """The folder for the sockets of a journal's executives."""
    return journal.with_name(f"{journal.name}-control")


def make_place(journal: Path) -> Path:
    """Where the executive of this process listens; its folder is made or put right.

    Raises:
        ControlSocketError: the folder cannot be made, or is not this user's own.
    """
    folder = folder_of(journal)
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.lstat()
        if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.geteuid():
            raise ControlSocketError(f"{folder} is not a folder of this user's own")
        folder.chmod(0o700)
    except OSError as error:
        raise ControlSocketError(f"{folder}: {error.strerror}") from error
    return folder / f"{os.getpid()}.sock"


@contextmanager
def address(path: Path) -> Iterator[str]:
    """What to bind or connect to within the block: on Linux, a path may be of any length.

    Raises:
        ControlSocketError: it is longer than a socket's may be here.
        OSError: its folder is not there.
    """
    if len(os.fsencode(path)) <= LONGEST_PATH_BYTES:
        yield str(path)
        return
    descriptors = Path("/proc/self/fd")
    if not descriptors.is_dir():
        raise ControlSocketError(
            f"{path} is longer than the path of a socket may be ({LONGEST_PATH_BYTES} bytes)"
        )
    folder = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY)
    try:
        yield str(descriptors / str(folder) / path.name)
    finally:
        os.close(folder)


def live_sockets(journal: Path) -> Iterator[Path]:
    """The sockets of executives that answer; those of dead ones are removed on the way."""
    for path in sorted(folder_of(journal).glob("*.sock")):
        if _answers(path):
            yield path
        elif not _is_alive(path):
            path.unlink(missing_ok=True)


def _answers(path: Path) -> bool:
    with socket.socket(socket.AF_UNIX) as caller:
        caller.settimeout(1)
        try:
            with address(path) as there:
                caller.connect(there)
        except OSError:
            return False
    return True


def _is_alive(path: Path) -> bool:
    """Whether the process is there: it may be about to listen."""
    if not path.stem.isdigit():
        return True
    try:
        os.kill(int(path.stem), 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True
