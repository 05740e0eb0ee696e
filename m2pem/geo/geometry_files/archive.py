"""Archives (ZIP) of untrusted origin: bounded in members and in what is unpacked."""

import zlib
from io import BytesIO
from zipfile import BadZipFile, ZipFile

from m2pem.geo.geojson import GeometryError

MAX_MEMBERS = 1_000
MAX_UNPACKED_BYTES = 50_000_000
"""Of all members that are read: what is beyond is never unpacked, whatever the archive says of its
size."""


class Archive(ZipFile):
    """An archive. `left_bytes`: how much of it may still be unpacked."""

    left_bytes = MAX_UNPACKED_BYTES


def archive_of(content: bytes) -> Archive:
    """Return an archive.

    Raises:
        GeometryError: it is none, or has too many members.
    """
    try:
        archive = Archive(BytesIO(content))
    except (BadZipFile, ValueError, NotImplementedError, OSError) as error:
        raise GeometryError(f"is no ZIP archive: {error}") from None
    if len(archive.infolist()) > MAX_MEMBERS:
        raise GeometryError(
            f"has more than {MAX_MEMBERS} members", "put only the geometries into it"
        )
    return archive


def member(archive: Archive, name: str) -> bytes:
    """Unpack a member.

    Raises:
        GeometryError: it is damaged, encrypted, or with what was unpacked before larger than
            `MAX_UNPACKED_BYTES`.
    """
    try:
        with archive.open(name) as file:
            content = file.read(archive.left_bytes + 1)
    except (BadZipFile, EOFError, OSError, ValueError, zlib.error) as error:
        raise GeometryError(f"{name} is damaged: {error}") from None
    except (RuntimeError, NotImplementedError) as error:  # encrypted; a method that is not known
        raise GeometryError(f"{name} cannot be unpacked: {error}") from None
    if len(content) > archive.left_bytes:
        before = " with what was read before it" if archive.left_bytes < MAX_UNPACKED_BYTES else ""
        archive.left_bytes = 0
        limit = f"{MAX_UNPACKED_BYTES / 1_000_000:g} MB"
        raise GeometryError(f"{name} is larger than {limit} unpacked{before}", "split it")
    archive.left_bytes -= len(content)
    return content
