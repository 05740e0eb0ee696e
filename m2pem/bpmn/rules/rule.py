"""A rule: one thing that BPMN, or m2pem, forbids, with its number, clause and sentences."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from lxml import etree

from m2pem.findings import Severity

if TYPE_CHECKING:
    from m2pem.bpmn.rules.tree import Tree

E = Severity.ERROR
W = Severity.WARNING

_FIRST_OF_BPMN = 1000


@dataclass(frozen=True, slots=True)
class Rule:
    """What is forbidden, and what is right.

    Numbers are never used again: those of BPMN's rules are a section of the specification (10.6)
    and two digits (10601), smaller ones are m2pem's own. `clause` is one of BPMN 2.0.2, or a page
    of the docs. `same_as`: slugs of readers' findings that say the same of the same element; where
    one of them stands, this rule says nothing.
    """

    number: int
    slug: str
    clause: str
    severity: Severity
    wrong: str
    right: str
    same_as: tuple[str, ...] = ()

    @property
    def code(self) -> str:
        """The number as findings show it: B10601, M101."""
        return f"{'B' if self.number > _FIRST_OF_BPMN else 'M'}{self.number}"


Check = Callable[["Tree", etree._Element], None]


@dataclass(frozen=True, slots=True)
class Topic:
    """The rules of one topic: checks of single elements by local name, and of the whole file."""

    rules: tuple[Rule, ...]
    by_name: Mapping[str, Check]
    whole: tuple[Callable[["Tree"], None], ...] = ()


def declared(names: Mapping[str, object]) -> tuple[Rule, ...]:
    """The rules among the names of a module."""
    return tuple(each for each in names.values() if isinstance(each, Rule))
