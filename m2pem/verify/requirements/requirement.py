"""One thing that an author requires of a mission."""

from collections.abc import Sequence
from dataclasses import dataclass

from m2pem.errors import FindingsError
from m2pem.findings import Finding, Severity
from m2pem.verify.ltl.formula import Formula

_MOST_SHOWN = 90
"""Characters of a formula around the one that is pointed at."""


@dataclass(frozen=True, slots=True)
class Misread(Finding):
    """What is wrong with a formula; the character at `position` is pointed at, below it."""

    formula: str = ""
    position: int = 0

    def __str__(self) -> str:
        return f"{Finding.__str__(self)}\n{pointed_at(self.formula, self.position)}"


def misread(
    file: str, line: int, element: str, message: str, formula: str, position: int
) -> Misread:
    """The finding. `position` counts from 0, in the whole formula."""
    before = formula[:position]
    column = f"column {len(before.rpartition(chr(10))[2]) + 1}"
    if "\n" in formula.strip():
        column += f" of line {before.count(chr(10)) + 1} of the formula"
    said = f"{message} at {column}"
    return Misread(
        Severity.ERROR, file, line, element, "requirement", said, "", "", formula, position
    )


def pointed_at(text: str, position: int) -> str:
    """The line of a text that a position is in, with a `^` below the position."""
    begin = text.rfind("\n", 0, position) + 1
    line, at = text[begin:].partition("\n")[0], position - begin
    cut = max(at - _MOST_SHOWN // 2, 0) if len(line) > _MOST_SHOWN else 0
    shown = line[cut : cut + _MOST_SHOWN]
    shown = "".join(each if each.isprintable() else " " for each in shown)
    dots = "... " if cut else ""
    return f"    {dots}{shown}\n    {' ' * (len(dots) + at - cut)}^"


class RequirementsError(FindingsError):
    """Requirements cannot be read, or do not fit the mission; tells all that is wrong with them."""

    def __init__(self, findings: Sequence[Finding]) -> None:
        super().__init__("the requirements cannot be used:", findings)


@dataclass(frozen=True, slots=True)
class Requirement:
    """A requirement, ready to be checked.

    `text` is what its author said of it, "" if nothing; `english` says its formula. `pattern`: the
    name of its pattern, "" for a formula as written. `resource`: for which vehicle it was made, if
    it was for each. `fair`: runs that pass over something possible for ever do not count.
    `line` counts from 1.
    """

    id: str
    formula: Formula
    english: str
    text: str = ""
    pattern: str = ""
    resource: str = ""
    fair: bool = False
    file: str = ""
    line: int = 0
