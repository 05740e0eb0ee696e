"""A conformance case: given a diagram and data, when this happens, then that."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

from m2pem.mission.values import Value
from tests.cases.when import When

Ending = Literal["completed", "failed", "terminated", "stopped", "running"]
ENDS: tuple[str, ...] = get_args(Ending)


@dataclass(frozen=True, slots=True)
class Expected:
    """What must be so after a step; what is None is not looked at.

    `data`: these entries, among others; an entry that is None is not there. `at`, `prompts`: where
    tokens rest and who is asked, in any order. `throws`: "signal S", "error E" and the like, in
    order.
    """

    at: tuple[str, ...] | None = None
    data: dict[str, Value] | None = None
    prompts: tuple[str, ...] | None = None
    throws: tuple[str, ...] | None = None
    ended: str | None = None
    detail: str | None = None


@dataclass(frozen=True, slots=True)
class Step:
    """One input, and the elements that tokens enter because of it, in order."""

    when: When
    entered: tuple[str, ...]
    expected: Expected


@dataclass(frozen=True, slots=True)
class Case:
    """`element` and `variant` are its row in the table of conformance.

    `extension` says which of m2pem's own extensions of BPMN the case needs, "" when it is plain
    BPMN that every engine should execute. `process`: where to begin, when not at the file's main
    process.
    """

    topic: Path
    line: int
    file: Path
    title: str
    clause: str
    element: str
    variant: str
    given: dict[str, Value]
    steps: tuple[Step, ...]
    then: Expected
    extension: str = ""
    process: str = ""

    @property
    def place(self) -> str:
        """Folder, file and line, as an editor opens it."""
        return f"{self.topic.parent.name}/{self.topic.name}:{self.line}"
