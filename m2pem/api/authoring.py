"""What MissionControl returns to editors of missions."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeAlias, Union

from m2pem.mission.library import Source


@dataclass(frozen=True, slots=True)
class Draft:
    """A mission as if it stood at `path`, where it need not be: that is what it is called.

    It may call and import what is in the folder of `path` and on the search path, no other files.
    """

    path: Path
    source: bytes


@dataclass(frozen=True, slots=True)
class MissionFiles:
    """A mission as another process has read it: its file's name and bytes, and what it calls.

    `library`: the files with the processes that it calls, so that no file is read again.
    """

    file: str
    source: bytes
    library: tuple[Source, ...] = ()


MissionSource: TypeAlias = Union[Path, str, bytes, Draft, MissionFiles]
"""Where a mission is: a path, a path or `file:`/`http:` URL as a text, or the BPMN itself, with the
files that it calls (`MissionFiles`) or without."""


def file_of(mission: MissionSource) -> str:
    """The name of a mission's file; "mission.bpmn" for a mission that came as bytes."""
    if isinstance(mission, MissionFiles):
        return mission.file
    if isinstance(mission, Draft):
        return str(mission.path)
    return "mission.bpmn" if isinstance(mission, bytes) else str(mission)


@dataclass(frozen=True, slots=True)
class Editable:
    """A mission as an editor takes it: UTF-8, with a diagram of everything (docs/missions.md).

    `notes`: what the file has that an editor does not keep, and what was added to it, as sentences
    for people.
    """

    source: bytes
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class OutlineProcess:
    """A process. `starts`: whether a run begins with it by default."""

    id: str
    name: str
    executable: bool
    starts: bool


@dataclass(frozen=True, slots=True)
class OutlineElement:
    """Something that is drawn, or a flow. `type`: its BPMN name (`scriptTask`).

    `process`: the process that it is in, "" outside of all. `parent`: the id of what it is in, a
    subprocess or its process.
    """

    id: str
    name: str
    type: str
    process: str
    parent: str


@dataclass(frozen=True, slots=True)
class DataName:
    """A dotted name of the data store. `source`: the id of what writes it, "" if nothing does."""

    name: str
    source: str


@dataclass(frozen=True, slots=True)
class OutlineTrigger:
    """A signal or message. `operators`: whether operators may send it."""

    id: str
    name: str
    operators: bool


@dataclass(frozen=True, slots=True)
class Outline:
    """The contents of a mission file, as far as it can be read."""

    processes: tuple[OutlineProcess, ...] = ()
    elements: tuple[OutlineElement, ...] = ()
    names: tuple[DataName, ...] = ()
    signals: tuple[OutlineTrigger, ...] = ()
    messages: tuple[OutlineTrigger, ...] = ()


@dataclass(frozen=True, slots=True)
class SearchLimits:
    """Limits at which a verification ends undecided.

    `exhaustive`: a large search goes on after a violation; otherwise it ends soon.
    """

    states: int = 2_000_000
    seconds: float = 600.0
    exhaustive: bool = False


@dataclass(frozen=True, slots=True)
class SearchProgress:
    """Progress of a verification: `waiting` of the `states` found are still to be searched.

    `memory_mb`: about what the search needs. `decided`: by property or requirement whose verdict is
    certain already, `holds`, `violated`, `warning` or `undecided`.
    """

    seconds: float
    states: int = 0
    waiting: int = 0
    memory_mb: float = 0.0
    decided: Mapping[str, str] = field(default_factory=dict)


DEFAULT_LIMITS = SearchLimits()
"""Those of `m2pem verify`."""
