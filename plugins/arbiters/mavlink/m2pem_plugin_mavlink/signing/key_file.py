"""Key files: 32 bytes, as they are, in hex or in base64, or a passphrase.

A passphrase is hashed with SHA-256, as QGroundControl and MAVProxy do, so that the same text can be
given to them. A key never gets into a message: errors name the file.
"""

import base64
import binascii
import os
import re
import secrets
import stat
from hashlib import sha256
from pathlib import Path

from m2pem.errors import PluginError


class SigningError(PluginError):
    """A key, or what is kept of its timestamps, cannot be used. The text never has the key."""


KEY_BYTES = 32
LARGEST_BYTES = 4096
OWNER_ONLY = 0o600
SHORTEST_PASSPHRASE = 16

_HEX = re.compile(r"[0-9A-Fa-f]{64}")
_BASE64 = re.compile(r"[A-Za-z0-9+/]{43}=")


def read_key(path: Path) -> bytes:
    """Return the 32 bytes of the key in a file.

    Raises:
        SigningError: the file cannot be read, others may read it, or it has no key.
    """
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK)
    except OSError as error:
        raise SigningError(f"{path} cannot be read: {error.strerror}") from None
    with os.fdopen(descriptor, "rb") as file:
        found = os.fstat(descriptor)
        if not stat.S_ISREG(found.st_mode):
            raise SigningError(f"{path} is not a file")
        if found.st_uid not in (os.geteuid(), 0):
            raise SigningError(f"{path} belongs to another user: only its owner may know the key")
        if found.st_mode & 0o077:
            mode = stat.S_IMODE(found.st_mode)
            raise SigningError(
                f"others may read or change {path} (mode {mode:04o}): chmod 600 {path}"
            )
        content = file.read(LARGEST_BYTES + 1)
    return _key(path, content)


def _key(path: Path, content: bytes) -> bytes:
    text = _text(content)
    if len(content) == KEY_BYTES and text is None:
        key = content
    elif text is None or len(content) > LARGEST_BYTES:
        raise SigningError(
            f"{path} has no key: write 32 bytes, also in hex or base64, or a passphrase"
        )
    elif _HEX.fullmatch(text):
        key = bytes.fromhex(text)
    elif _BASE64.fullmatch(text) and (decoded := _decoded(text)) is not None:
        key = decoded
    elif len(text) < SHORTEST_PASSPHRASE:
        raise SigningError(
            f"{path} has no key: a passphrase has {SHORTEST_PASSPHRASE} characters or more"
        )
    else:
        key = sha256(text.encode()).digest()
    if not any(key):
        raise SigningError(f"{path}: a key of zeros turns signing off")
    return key


def _text(content: bytes) -> str | None:
    """The content as a line of text, without its end; None if it is something else."""
    try:
        text = content.decode().rstrip("\r\n")
    except UnicodeDecodeError:
        return None
    return text if text.isprintable() else None


def _decoded(text: str) -> bytes | None:
    try:
        return base64.b64decode(text, validate=True)
    except binascii.Error:
        return None


def write_new_key(path: Path) -> None:
    """Write a random passphrase of 256 bits to a new file that its owner alone can read.

    Raises:
        SigningError: the file exists, or cannot be written.
    """
    try:
        descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, OWNER_ONLY)
        with os.fdopen(descriptor, "w", encoding="ascii") as file:
            file.write(secrets.token_urlsafe(KEY_BYTES) + "\n")
            file.flush()
            os.fsync(descriptor)
    except FileExistsError:
        raise SigningError(f"{path} exists: it may be the key of a vehicle") from None
    except OSError as error:
        raise SigningError(f"{path} cannot be written: {error.strerror}") from None


def fingerprint(key: bytes) -> str:
    """Return a name of a key from which it cannot be computed."""
    return sha256(b"m2pem: timestamps of a MAVLink signing key\0" + key).hexdigest()[:32]
