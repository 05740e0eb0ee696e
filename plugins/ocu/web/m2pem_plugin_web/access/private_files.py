"""Files that only their owner may read: password hashes, tokens, sessions."""

import os
import stat
from contextlib import suppress
from pathlib import Path

from m2pem.errors import PluginError

OTHERS = stat.S_IRWXG | stat.S_IRWXO


class NotPrivateError(PluginError):
    """A file with secrets can be read by other users, or cannot be protected from them."""

    exit_status = 2


def private_folder(path: Path) -> Path:
    """Create a folder that only its owner may enter, if it is missing.

    Raises:
        NotPrivateError: it belongs to another user, or cannot be created.
    """
    try:
        path.mkdir(mode=0o700, parents=True, exist_ok=True)
        found = path.lstat()
        if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.geteuid():
            raise NotPrivateError(f"{path} is not a folder of this user's own")
        path.chmod(0o700)
    except OSError as error:
        raise NotPrivateError(f"{path}: {error.strerror}") from error
    return path


def write_private(path: Path, text: str) -> None:
    """Write a file whole, or not at all; only its owner may read it.

    Raises:
        NotPrivateError: it cannot be written.
    """
    new = path.with_name(f".{path.name}.{os.getpid()}.new")
    try:
        new.unlink(missing_ok=True)
        descriptor = os.open(new, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        try:
            with os.fdopen(descriptor, "w", encoding="utf-8") as file:
                file.write(text)
                file.flush()
                os.fsync(file.fileno())
            new.replace(path)
        except OSError:
            with suppress(OSError):
                new.unlink()
            raise
    except OSError as error:
        raise NotPrivateError(f"{path}: {error.strerror}") from error


def read_private(path: Path) -> str:
    """Return the text of a file that only its owner may read.

    Raises:
        FileNotFoundError: the file does not exist.
        NotPrivateError: other users may read or write it, or it cannot be read.
    """
    try:
        with path.open(encoding="utf-8") as file:
            found = os.fstat(file.fileno())
            if found.st_uid != os.geteuid() or found.st_mode & OTHERS:
                raise NotPrivateError(
                    f"other users can read or write {path}: `chmod 600 {path}`, and make the "
                    "user who starts the executive its owner"
                )
            return file.read()
    except FileNotFoundError:
        raise
    except (OSError, UnicodeDecodeError) as error:
        raise NotPrivateError(f"{path} cannot be read: {error}") from error
