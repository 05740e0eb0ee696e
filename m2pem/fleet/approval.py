"""What persons approve before a mission starts: exactly the content of its files and drawings.

An approval is of a content, by its hash. So a change of any file or drawing leaves nothing of it,
and a content that was approved once is approved wherever it is kept.
"""

import hashlib
import re
import unicodedata
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import PurePath
from xml.sax.saxutils import escape

import msgspec

from m2pem.geo.geojson import kind_of
from m2pem.mission.geometry import Geometry
from m2pem.mission.library import Source

MISSION_PART = "the mission file"
_REFERENCE = re.compile(rb"&#|encoding\s*=\s*[\"'](?!utf-8)", re.IGNORECASE)
"""What may hide a name from a search for its bytes."""


class Approval(msgspec.Struct, frozen=True):
    """A person has approved a content.

    `fleet`: the name of the fleet; `mission`: that of the mission's file, for people. `digest`: of
    the content, and `parts`: the hash of each file and drawing in it. `at_us`: microseconds since
    the Unix epoch, by the executive's clock.
    """

    fleet: str
    mission: str
    digest: str
    by: str
    at_us: int
    parts: dict[str, str] = msgspec.field(default_factory=dict)

    @property
    def person(self) -> str:
        """Who has approved, whatever the host."""
        return person_of(self.by)


class Edit(msgspec.Struct, frozen=True):
    """A person has made a file what it is. `digest`: the SHA-256 of the file, in hexadecimal."""

    digest: str
    by: str
    at_us: int


def person_of(by: str) -> str:
    """Return the person behind the name of an operator: anna@gcs1 and Anna are one."""
    return unicodedata.normalize("NFKC", by).partition("@")[0].strip().casefold()


def file_digest(content: bytes) -> str:
    """Return the hash of a file's content, as edits and approvals name it."""
    return hashlib.sha256(content).hexdigest()


@dataclass(frozen=True, slots=True)
class Content:
    """What is approved. `digest`: of everything. `parts`: the hash of each file and drawing by its
    name; `files`: those of the files alone; `drawings`: the names of the drawings."""

    digest: str
    parts: Mapping[str, str]
    files: tuple[str, ...]
    drawings: tuple[str, ...]

    def changed_since(self, before: Mapping[str, str]) -> tuple[str, ...]:
        """Return the parts that are other than in an earlier content, or are in one of both."""
        names = dict.fromkeys((*before, *self.parts))
        return tuple(name for name in names if before.get(name) != self.parts.get(name))


def content_of(
    mission: bytes, library: Iterable[Source], geometries: Mapping[str, Geometry]
) -> Content:
    """Return the content of a mission: its file, the files that it uses, and those of `geometries`
    whose names are in one of the files."""
    used = sorted(library, key=lambda each: (PurePath(each.name).name, each.data))
    parts = {MISSION_PART: file_digest(mission)}
    for source in used:
        name = file = PurePath(source.name).name
        number = 1
        while name in parts:  # of another folder
            number += 1
            name = f"{file} ({number})"
        parts[name] = file_digest(source.data)
    files = tuple(parts.values())
    texts = [mission, *(source.data for source in used)]
    drawings = tuple(name for name in sorted(geometries) if is_named(name, texts))
    for name in drawings:
        parts[f"drawing {name}"] = _geometry_digest(geometries[name])
    # Which file answers which call is content, too; where an importer is kept is not.
    answers = [sorted(answer[:2] for answer in source.answers) for source in used]
    whole = msgspec.json.encode((list(parts.items()), answers))
    return Content(hashlib.sha256(whole).hexdigest(), parts, files, drawings)


def is_named(name: str, texts: Iterable[bytes]) -> bool:
    """Whether files of missions may name a geometry: whether its name is in one of them."""
    spelled = {name.encode(), escape(name).encode()}
    return any(
        any(each in text for each in spelled) or text[:2] in _UTF_16 or _REFERENCE.search(text)
        for text in texts
    )


_UTF_16 = (b"\xff\xfe", b"\xfe\xff")


def _geometry_digest(geometry: Geometry) -> str:
    return hashlib.sha256(msgspec.json.encode((kind_of(geometry), geometry))).hexdigest()
