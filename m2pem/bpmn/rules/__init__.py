"""Static rules: what BPMN 2.0.2 forbids, checked on the XML tree of a file, rule by rule.

Each module is a topic with its rules and checks; `registry` has all of them. docs/rules.md is
made from it. A check looks at single elements, or at the whole file; time is linear in the file.
"""

from typing import TYPE_CHECKING

from lxml import etree

from m2pem.bpmn.names import BPMN
from m2pem.bpmn.rules.registry import TOPICS
from m2pem.bpmn.rules.rule import Check
from m2pem.bpmn.rules.tree import Tree

if TYPE_CHECKING:
    from m2pem.bpmn.report import Report


def _of_root(check: Check) -> Check:
    """A check of root elements only: a script's behavior may have elements of the same name."""

    def checked(tree: Tree, element: etree._Element) -> None:
        if element.getparent() is tree.root:
            check(tree, element)

    return checked


_CHECKS: dict[str, list[Check]] = {}
for _topic in TOPICS:
    for _name, _check in _topic.by_name.items():
        _added = _of_root(_check) if _name == "resource" else _check
        _CHECKS.setdefault(BPMN + _name, []).append(_added)


def check_rules(root: etree._Element, report: "Report", source: bytes) -> None:
    """Add what the rules find in a file, and its bytes, to what its readers have found."""
    tree = Tree(root, report, source)
    for element in root.iter(*_CHECKS):
        for check in _CHECKS[element.tag]:
            check(tree, element)
    for topic in TOPICS:
        for whole in topic.whole:
            whole(tree)
