"""A finding: one thing that is wrong, or doubtful, in a file that a person wrote."""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

MAX_SHOWN = 400
"""Characters of a message, or of a remedy, as it is printed."""


class Severity(StrEnum):
    """An error stops the mission from starting; a warning does not (unless `--strict`)."""

    ERROR = "error"
    WARNING = "warning"


@dataclass(frozen=True, slots=True)
class Finding:
    """What is wrong, where, and what would be right.

    `rule` is a short stable kebab-case name ("dangling-reference"), which docs and tests use;
    `number` is that of the rule in docs/rules.md ("B15301"), if it is one of mission files.
    `line` counts from 1; 0 means that no line applies. `element` is an id of the mission, or a
    path into a fleet file ("vehicles.evsg1.arbiter"), or "".
    """

    severity: Severity
    file: str
    line: int
    element: str
    rule: str
    message: str
    remedy: str = ""
    number: str = ""

    def __str__(self) -> str:
        where = f"{self.file}:{self.line}" if self.line else self.file
        element = f" {_line(self.element)}:" if self.element else ""
        remedy = f"; {_line(self.remedy)}" if self.remedy else ""
        rule = f"[{self.rule} {self.number}]" if self.number else f"[{self.rule}]"
        return f"{where}:{element} {self.severity.value}: {_line(self.message)}{remedy} {rule}"


def _line(text: str) -> str:
    """The text on one line that can be read: it may quote whatever stands in a file."""
    line = " ".join(text.splitlines())
    if len(line) <= MAX_SHOWN:
        return line
    return f"{line[: MAX_SHOWN // 2]} ... {line[-MAX_SHOWN // 2 :]}"


def has_errors(findings: Iterable[Finding]) -> bool:
    """Whether any finding is an error."""
    return any(finding.severity is Severity.ERROR for finding in findings)
