"""A requirement, and what is wrong with one that cannot be used."""

from collections.abc import Sequence
from dataclasses import dataclass

from m2pem.errors import FindingsError
from m2pem.findings import Finding, Severity
from m2pem.verify.assumptions import NOTHING, Assumptions
from m2pem.verify.ltl.formula import Formula

_MOST_SHOWN = 90
"""Characters of a formula that are shown around an error."""


@dataclass(frozen=True, slots=True)
class Misread(Finding):
    """An error in a formula; it shows the character at `position`."""

    formula: str = ""
    position: int = 0

    def __str__(self) -> str:
        return f"{Finding.__str__(self)}\n{pointed_at(self.formula, self.position)}"


def misread(
    file: str, line: int, element: str, message: str, formula: str, position: int
) -> Misread:
    """Return the finding. `position` counts from 0, in the whole formula."""
    before = formula[:position]
    column = f"column {len(before.rpartition(chr(10))[2]) + 1}"
    if "\n" in formula.strip():
        column += f" of line {before.count(chr(10)) + 1} of the formula"
    said = f"{message} at {column}"
    where = (Severity.ERROR, file, line, element, "requirement", said)
    return Misread(*where, formula=formula, position=position)


def pointed_at(text: str, position: int) -> str:
    """The line of a text with a position, and a `^` below the position."""
    begin = text.rfind("\n", 0, position) + 1
    line, at = text[begin:].partition("\n")[0], position - begin
    cut = max(at - _MOST_SHOWN // 2, 0) if len(line) > _MOST_SHOWN else 0
    shown = line[cut : cut + _MOST_SHOWN]
    shown = "".join(each if each.isprintable() else " " for each in shown)
    dots = "... " if cut else ""
    return f"    {dots}{shown}\n    {' ' * (len(dots) + at - cut)}^"


class RequirementsError(FindingsError):
    """Requirements cannot be read, or do not fit the mission; it lists all findings."""

    def __init__(self, findings: Sequence[Finding]) -> None:
        super().__init__("the requirements cannot be used:", findings)


@dataclass(frozen=True, slots=True)
class Requirement:
    """A requirement, ready to be checked.

    `text`: the author's description, "" if there is none; `english`: the formula in words.
    `pattern`: the name of its pattern, "" for a formula as written. `resource`: the vehicle it was
    made for, if it was made for each. `fair`: only fair runs count. `line` counts from 1.
    `assumed`: only runs count in which that is so.
    `monitor`: runs are monitored for it. `on_violation`: what a violation in a run throws,
    "error:CODE" or "signal:ID"; "": nothing.
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
    assumed: Assumptions = NOTHING
    monitor: bool = True
    on_violation: str = ""
