"""A rule: one thing that BPMN, or m2pem, forbids, with its number, clause and sentences."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial

from m2pem.findings import Finding, Severity

_FIRST_OF_BPMN = 1000


@dataclass(slots=True, eq=False)
class Rule:
    """What is forbidden, and what is right.

    Numbers are never used again: those of BPMN's rules are a section of the specification (10.6)
    and two digits (10601), smaller ones are m2pem's own. `slug` names the rule in findings: it is
    the name of its constant, in small letters. `clause` is one of BPMN 2.0.2, or a page of the
    docs.

    A family declares its rules by `error`, of what is not loaded, and `warning`, of what is
    doubtful. A finding says what is `wrong` and what is `right` unless it says it otherwise.
    """

    severity: Severity
    number: int
    wrong: str
    right: str
    clause: str = "missions.md"
    slug: str = field(default="", init=False)

    def __post_init__(self) -> None:
        if self.number < _FIRST_OF_BPMN:
            self.clause = "missions.md"

    @property
    def code(self) -> str:
        """The number as findings show it: B10601, M101."""
        return f"{'B' if self.number > _FIRST_OF_BPMN else 'M'}{self.number}"

    def finding(
        self,
        file: str,
        line: int,
        element: str,
        message: str = "",
        remedy: str = "",
        severity: Severity | None = None,
    ) -> Finding:
        """Return a finding of this rule; the last three where they are not the rule's."""
        return Finding(
            severity or self.severity,
            file,
            line,
            element,
            self.slug,
            message or self.wrong,
            remedy or self.right,
            self.code,
        )


error = partial(Rule, Severity.ERROR)
warning = partial(Rule, Severity.WARNING)


def family(clause: str) -> tuple["partial[Rule]", "partial[Rule]"]:
    """Return what declares the errors, and the warnings, of a family of rules.

    `clause`: that of its rules of BPMN which name no other.
    """
    return partial(error, clause=clause), partial(warning, clause=clause)


def declared(names: Mapping[str, object]) -> tuple[Rule, ...]:
    """Return the rules among the names of a module, with their slugs."""
    found = {name: each for name, each in names.items() if isinstance(each, Rule)}
    for name, each in found.items():
        each.slug = name.lower().replace("_", "-")
    return tuple(found.values())
