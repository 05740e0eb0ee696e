"""What names a version of a mission: a hash of its files."""

import hashlib
from collections.abc import Iterable

from m2pem.mission.library import Source
from m2pem.mission.mission import Mission

SHORT = 12
"""Digits of a version that people read: no two versions of a mission will have the same."""


def version_of_files(mission: bytes, library: Iterable[Source]) -> str:
    """Return the version of a mission's file with the other files that it uses: 64 hexadecimal
    digits. The names of the files are no part of it, but for those by which the mission asks."""
    whole = hashlib.sha256()
    parts = [mission]
    for source in library:
        parts += [repr(source.answers).encode(), source.data]
    for part in parts:
        whole.update(len(part).to_bytes(8))
        whole.update(part)
    return whole.hexdigest()


def version_of(mission: Mission) -> str:
    """Return the version of a mission that was read."""
    return version_of_files(mission.source, mission.library)
