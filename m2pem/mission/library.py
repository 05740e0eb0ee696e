"""Other files that a mission uses: what it calls there, what it imports, and where they are.

The model asks for them through `Library` and knows no disk (`m2pem.mission.search_path` does). What
it was given is kept with the mission, so that a run can be rebuilt when the files have changed.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeAlias

Question: TypeAlias = tuple[str, str, str]
"""What a file was the answer to: ("call", id, namespace) or ("import", location, importer)."""


@dataclass(frozen=True, slots=True)
class Source:
    """A file of BPMN. `name`: for findings, a path; `answers`: the questions that it answered."""

    name: str
    data: bytes
    answers: tuple[Question, ...] = ()


@dataclass(frozen=True, slots=True)
class MissionFile:
    """A file of a mission. `qualifier`: what the ids of its elements begin with, before a colon."""

    name: str
    qualifier: str
    source: bytes


class LibraryError(Exception):
    """A file that was asked for cannot be given."""

    def __init__(self, message: str, remedy: str) -> None:
        super().__init__(message)
        self.message = message
        self.remedy = remedy


class Library(Protocol):
    """Finds processes in other files."""

    @property
    def places(self) -> Sequence[str]:
        """The places in which `called` looks, for messages."""

    def called(self, element: str, namespace: str) -> Source | None:
        """The file with the process or global task of that id; None: there is none.

        `namespace`: the file's targetNamespace, "" for any.

        Raises:
            LibraryError: there are several.
        """

    def imported(self, location: str, importer: str) -> Source:
        """The file at the `location` of an `import` in the file of that name.

        Raises:
            LibraryError: it cannot be read, or is no local file.
        """


class KeptLibrary:
    """Gives the files that a mission was given before, to the same questions."""

    def __init__(self, sources: Iterable[Source]) -> None:
        self._answers = {question: each for each in sources for question in each.answers}

    @property
    def places(self) -> Sequence[str]:
        """Nowhere else."""
        return ()

    def called(self, element: str, namespace: str) -> Source | None:
        """See `Library.called`."""
        return self._answers.get(("call", element, namespace))

    def imported(self, location: str, importer: str) -> Source:
        """See `Library.imported`."""
        found = self._answers.get(("import", location, importer))
        if found is None:
            raise LibraryError(f"{location} was not kept", "start the mission again")
        return found
