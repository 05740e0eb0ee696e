"""One thing that an author requires of a mission."""

from collections.abc import Sequence
from dataclasses import dataclass

from m2pem.errors import FindingsError
from m2pem.findings import Finding
from m2pem.verify.ltl.formula import Formula


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
