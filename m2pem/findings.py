"""A finding: one thing that is wrong, or doubtful, in a file that a person wrote."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

MAX_SHOWN = 400
"""Characters of a message, or of a remedy, as it is printed."""

MAX_OF_A_KIND = 20
"""Findings of one rule that are printed; what is beyond is counted."""

_JOINERS = "\u200c\u200d"
"""Format characters that words of some scripts need."""


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
    path into a fleet file ("vehicles.evsg1.arbiter"), or "". `place`: latitude and longitude of
    what is wrong, in degrees (WGS-84), where it has a place.
    """

    severity: Severity
    file: str
    line: int
    element: str
    rule: str
    message: str
    remedy: str = ""
    number: str = ""
    place: tuple[float, float] | None = None

    def __str__(self) -> str:
        file = escaped(self.file)
        where = f"{file}:{self.line}" if self.line else file
        element = f" {_line(self.element)}:" if self.element else ""
        remedy = f"; {_line(self.remedy)}" if self.remedy else ""
        rule = f"[{self.rule} {self.number}]" if self.number else f"[{self.rule}]"
        return f"{where}:{element} {self.severity.value}: {_line(self.message)}{remedy} {rule}"


def unreadable_remedy(error: OSError) -> str:
    """What helps against an error of reading a file."""
    if isinstance(error, IsADirectoryError):
        return "this is a folder: name a file in it"
    if isinstance(error, PermissionError):
        return "check its owner and its permissions"
    return "check the path"


def _line(text: str) -> str:
    """The text on one line that can be read: it may quote whatever stands in a file."""
    line = escaped(" ".join(text.splitlines()))
    if len(line) <= MAX_SHOWN:
        return line
    return f"{line[: MAX_SHOWN // 2]} ... {line[-MAX_SHOWN // 2 :]}"


def escaped(text: str, keep: str = "") -> str:
    """The text with control characters, and those that turn its direction, as `\\u202e`.

    What is printed quotes names from files of any origin; none may steer a terminal, or show
    another name than it is. `keep`: characters that are left as they are.
    """
    if text.isprintable():
        return text
    kept = _JOINERS + keep
    return "".join(
        each if each.isprintable() or each in kept else ascii(each)[1:-1] for each in text
    )


def lines(findings: Iterable[Finding]) -> list[str]:
    """The findings as they are printed: the first of each rule, and how many more there are."""
    count: Counter[tuple[Severity, str]] = Counter()
    shown = []
    for finding in findings:
        kind = (finding.severity, finding.rule)
        count[kind] += 1
        if count[kind] <= MAX_OF_A_KIND:
            shown.append(str(finding))
    for (severity, rule), number in count.items():
        if number > MAX_OF_A_KIND:
            shown.append(f"... and {number - MAX_OF_A_KIND:,} more: {severity.value} [{rule}]")
    return shown


def has_errors(findings: Iterable[Finding]) -> bool:
    """Whether any finding is an error."""
    return any(finding.severity is Severity.ERROR for finding in findings)
