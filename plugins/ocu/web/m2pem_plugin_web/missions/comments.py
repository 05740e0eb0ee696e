"""Comments on the elements of missions, in the hidden folder beside the missions.

They are not in the mission's file: so they change no approval, and outlive every new version of it.
Each names its element by the id, with the label that the element had: one whose element is gone is
still shown.
"""

import threading
import time
from collections.abc import Sequence
from pathlib import Path

import msgspec

from m2pem.api import person_of
from m2pem_plugin_web.missions.folder import FolderError, MissionFolder, locked
from m2pem_plugin_web.missions.versions import FOLDER, write

MOST = 1000
"""Comments of a mission."""
FILE = "comments.json"
_LOCK = ".comments.lock"


class CommentError(Exception):
    """A comment is refused; `missing`: it does not exist."""

    def __init__(self, text: str, *, missing: bool = False) -> None:
        super().__init__(text)
        self.missing = missing


class Comment(msgspec.Struct, frozen=True):
    """A comment, or an answer to one. `parent`: the comment that it answers, 0: none. `element`:
    the id of the element, "" for the mission as a whole; `label`: what that was called. `version`:
    of the mission's file then. `resolved_by`: who has settled it, "": it is open; of an answer
    always "". Times are microseconds since the Unix epoch."""

    id: int
    element: str
    label: str
    text: str
    by: str
    at_us: int
    parent: int = 0
    version: str = ""
    resolved_by: str = ""
    resolved_us: int = 0


class Comments:
    """The comments of the missions of a folder. Calls block: use threads.

    Raises (all methods):
        BadNameError: no mission can have that name.
        FolderError: the disk refuses.
    """

    def __init__(self, folder: MissionFolder) -> None:
        self._folder = folder
        self._lock = threading.Lock()

    def all(self, mission: str) -> Sequence[Comment]:
        """Return all comments of a mission, the oldest first."""
        path = self._path(mission)
        try:
            return msgspec.json.decode(path.read_bytes(), type=list[Comment])
        except FileNotFoundError:
            return ()
        except (OSError, msgspec.MsgspecError) as error:
            raise FolderError(f"{path.name} of {mission}: {error}") from error

    def add(
        self, mission: str, *, element: str, label: str, text: str, by: str, parent: int = 0
    ) -> Comment:
        """Write a comment; with a `parent` an answer to it, about the same element.

        Raises:
            NoMissionError: there is no such mission.
            CommentError: the parent does not exist, or there are too many.
        """
        version = self._folder.read(mission).version
        with locked(self._folder.path, _LOCK, self._lock):
            known = list(self.all(mission))
            if len(known) >= MOST:
                raise CommentError(f"{mission} has {MOST} comments: delete some first")
            if parent:
                first = _find(known, parent)
                if first.parent:
                    raise CommentError(f"comment {parent} is an answer: answer {first.parent}")
                element, label = first.element, first.label
            made = Comment(
                max((each.id for each in known), default=0) + 1,
                element,
                label,
                text,
                by,
                time.time_ns() // 1000,
                parent,
                version,
            )
            self._write(mission, [*known, made])
        return made

    def resolve(self, mission: str, number: int, by: str, *, resolved: bool) -> Comment:
        """Settle a comment, or open it again.

        Raises:
            CommentError: there is no such comment, or it is an answer.
        """
        with locked(self._folder.path, _LOCK, self._lock):
            known = list(self.all(mission))
            found = _find(known, number)
            if found.parent:
                raise CommentError(f"comment {number} is an answer: resolve {found.parent}")
            now_us = time.time_ns() // 1000
            changed = msgspec.structs.replace(
                found, resolved_by=by if resolved else "", resolved_us=now_us if resolved else 0
            )
            self._write(mission, [changed if each.id == number else each for each in known])
        return changed

    def delete(self, mission: str, number: int, by: str, *, of_others: bool) -> None:
        """Delete a comment, with the answers to it. `of_others`: `by` may delete those of others.

        Raises:
            CommentError: there is no such comment, or it is that of another person.
        """
        with locked(self._folder.path, _LOCK, self._lock):
            known = list(self.all(mission))
            found = _find(known, number)
            if not of_others:
                others = [
                    each.by
                    for each in known
                    if number in (each.id, each.parent) and person_of(each.by) != person_of(by)
                ]
                if others:
                    whose = "has answers of" if person_of(found.by) == person_of(by) else "is by"
                    raise CommentError(f"comment {number} {whose} {others[0]}")
            self._write(mission, [each for each in known if number not in (each.id, each.parent)])

    def _path(self, mission: str) -> Path:
        self._folder.file(mission)  # refuses names that lead elsewhere
        return self._folder.path / FOLDER / mission / FILE

    def _write(self, mission: str, comments: Sequence[Comment]) -> None:
        path = self._path(mission)
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            write(path, msgspec.json.encode(comments))
        except OSError as error:
            raise FolderError(f"{path.name} of {mission}: {error.strerror}") from error


def _find(comments: Sequence[Comment], number: int) -> Comment:
    found = next((each for each in comments if each.id == number), None)
    if found is None:
        raise CommentError(f"there is no comment {number}", missing=True)
    return found
