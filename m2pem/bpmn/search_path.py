"""The search path: folders in which missions find the processes of other files.

The mission's own folder comes first, then those that the command line names, then those of the
environment variable `M2PEM_PATH`. Only BPMN files directly in them count. They are looked into when
a mission calls what is not in its own file, and not before.
"""

import os
import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from urllib.parse import unquote, urlsplit

from m2pem.bpmn.xml import BPMN, XmlError, local, max_bytes, parse_xml
from m2pem.mission.library import LibraryError, Source

VARIABLE = "M2PEM_PATH"
"""Names folders, separated as in PATH; those that are not there are passed over."""

_SUFFIXES = (".bpmn", ".bpmn2", ".bpmn20.xml")
_TASK = re.compile(r"global\w*Task")


class SearchPath:
    """`mission`: the file of the mission, None when it came as bytes or from elsewhere."""

    def __init__(self, mission: Path | None = None, folders: Iterable[Path] = ()) -> None:
        own = [mission.parent] if mission is not None else []
        unique: dict[Path, Path] = {}
        for folder in [*own, *folders, *_named_folders()]:
            unique.setdefault(folder.resolve(), folder)
        self._folders = list(unique.values())
        self._mission = mission
        self._given: dict[str, Path] = {}
        self._index: dict[str, list[tuple[Path, str]]] | None = None

    @property
    def places(self) -> Sequence[str]:
        """See `Library.places`."""
        return [str(folder) for folder in self._folders]

    def called(self, element: str, namespace: str) -> Source | None:
        """See `Library.called`."""
        if self._index is None:
            self._index = {}
            for path in _bpmn_files(self._folders):
                for identifier, of in _callable(path):
                    self._index.setdefault(identifier, []).append((path, of))
        known = self._index.get(element, [])
        found = [path for path, of in known if namespace in ("", of)]
        if len(found) > 1:
            raise LibraryError(
                f"'{element}' is in several files: {', '.join(map(str, found))}",
                "give one of the two another id, move it away, or import the file that is meant",
            )
        return self._source(found[0]) if found else None

    def imported(self, location: str, importer: str) -> Source:
        """See `Library.imported`. A mission that did not come from a file may import what is in the
        folders, and nothing else."""
        parts = urlsplit(location)
        if parts.scheme not in ("", "file") or parts.netloc not in ("", "localhost"):
            raise LibraryError(
                f"'{location}' is no local file", "fetch it, and name it by its path from this file"
            )
        path = Path(unquote(parts.path))
        base = self._given.get(importer, self._mission)
        if base is not None:
            return self._source(Path(os.path.normpath(base.parent / path)))
        for folder in self._folders:
            inside = Path(os.path.normpath(folder / path))
            if inside.resolve().is_relative_to(folder.resolve()) and inside.is_file():
                return self._source(inside)
        raise LibraryError(
            f"'{location}' is in no folder of the search path", "put it there, or add its folder"
        )

    def _source(self, path: Path) -> Source:
        try:
            data = _read(path)
        except OSError as error:
            raise LibraryError(
                f"{path} cannot be read: {error.strerror or error}", "check the path"
            ) from error
        self._given[str(path)] = path
        return Source(str(path), data)


def mission_files_in(folders: Iterable[Path]) -> list[Path]:
    """The BPMN files directly in these folders and in those of `M2PEM_PATH` with which a run may
    begin: those with a process, and those that cannot be read, of which a check says why."""
    files = _bpmn_files([*folders, *_named_folders()])
    return [path for path in files if _may_begin(path)]


def _may_begin(path: Path) -> bool:
    try:
        root = parse_xml(_read(path)).root
    except (OSError, XmlError):
        return True
    return root.tag != BPMN + "definitions" or root.find(BPMN + "process") is not None


def _bpmn_files(folders: Iterable[Path]) -> Iterator[Path]:
    """Yield the BPMN files directly in folders, each once; a folder that is not there has none."""
    seen: set[Path] = set()
    for folder in folders:
        try:
            inside = sorted(folder.iterdir())
        except OSError:
            continue
        for path in inside:
            if path.name.lower().endswith(_SUFFIXES) and path.resolve() not in seen:
                seen.add(path.resolve())
                yield path


def _named_folders() -> list[Path]:
    named = os.environ.get(VARIABLE, "").split(os.pathsep)
    return [Path(each) for each in named if each and Path(each).is_dir()]


def _read(path: Path) -> bytes:
    with path.open("rb") as stream:
        return stream.read(max_bytes() + 1)


def _callable(path: Path) -> Iterator[tuple[str, str]]:
    """Ids of what may be called in a file, with its targetNamespace; nothing if it is no BPMN."""
    try:
        root = parse_xml(_read(path)).root
    except (OSError, XmlError):
        return
    if root.tag != BPMN + "definitions":
        return
    for element in root:
        identifier = element.get("id")
        if identifier and element.tag.startswith(BPMN):
            name = local(element.tag)
            if name == "process" or _TASK.fullmatch(name):
                yield identifier, root.get("targetNamespace", "")
