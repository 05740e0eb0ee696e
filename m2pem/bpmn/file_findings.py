"""The findings about one file."""

from collections.abc import Callable
from typing import TypeAlias, Union

from lxml import etree

from m2pem.bpmn.rules.rule import Rule
from m2pem.findings import Finding, Severity

Where: TypeAlias = Union[etree._Element, int]
"""An element, or a line."""


class FileFindings:
    """Findings of one file, `all` in the order they were made; `qualifier` goes before ids."""

    __slots__ = ("all", "file", "line", "qualifier")

    def __init__(
        self, file: str, line: Callable[[etree._Element], int], qualifier: str = ""
    ) -> None:
        self.file = file
        self.qualifier = qualifier
        self.line = line
        self.all: list[Finding] = []

    def error(
        self, where: Where, element: str, rule: Rule, message: str = "", remedy: str = ""
    ) -> None:
        """Note something that stops the mission from being loaded; by default as the rule says."""
        self._add(Severity.ERROR, where, element, rule, (message, remedy))

    def warning(
        self, where: Where, element: str, rule: Rule, message: str = "", remedy: str = ""
    ) -> None:
        """Add a warning; by default as the rule says."""
        self._add(Severity.WARNING, where, element, rule, (message, remedy))

    def _add(
        self, severity: Severity, where: Where, element: str, rule: Rule, said: tuple[str, str]
    ) -> None:
        line = where if isinstance(where, int) else self.line(where)
        if self.qualifier and element:
            element = f"{self.qualifier}:{element}"
        self.all.append(rule.finding(self.file, line, element, *said, severity))

    def sorted(self) -> tuple[Finding, ...]:
        """Return all findings by line; those of one line in the order of their creation."""
        return tuple(sorted(self.all, key=lambda finding: finding.line))
