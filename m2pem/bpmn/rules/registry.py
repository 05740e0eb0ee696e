"""All rules of mission files, and the checks of a file's XML tree; time is linear in the file."""

from lxml import etree

from m2pem.bpmn.file_findings import FileFindings
from m2pem.bpmn.rules import (
    activities,
    attributes,
    behaviors,
    collaboration,
    compensation,
    data,
    definitions,
    events,
    extensions,
    files,
    gateways,
    loops,
    references,
    sequence_flows,
    subprocesses,
)
from m2pem.bpmn.rules.rule import Rule, declared
from m2pem.bpmn.rules.tree import Check, Checks, Tree
from m2pem.bpmn.xml import BPMN

_FAMILIES = (
    activities,
    attributes,
    behaviors,
    collaboration,
    compensation,
    data,
    definitions,
    events,
    extensions,
    files,
    gateways,
    loops,
    references,
    sequence_flows,
    subprocesses,
)

RULES: tuple[Rule, ...] = tuple(
    sorted(
        {rule for family in _FAMILIES for rule in declared(vars(family))},
        key=lambda rule: rule.number,
    )
)
"""Every rule once, by number."""

_CHECKS: tuple[Checks, ...] = (
    definitions.CHECKS,
    references.CHECKS,
    collaboration.CORRELATION,
    activities.SERVICES,
    sequence_flows.CHECKS,
    gateways.CHECKS,
    gateways.EVENT_BASED,
    activities.CHECKS,
    loops.CHECKS,
    subprocesses.CHECKS,
    events.CHECKS,
    events.DEFINITIONS,
    compensation.CHECKS,
    data.CHECKS,
    data.ASSOCIATIONS,
    collaboration.CHECKS,
    collaboration.MESSAGE_FLOWS,
    collaboration.LANES,
    attributes.VALUES,
    attributes.TRUTHS,
    attributes.SHAPES,
    extensions.CHECKS,
)
"""In the order in which they look at an element."""


def _of_root(check: Check) -> Check:
    """Restrict a check to root elements: a script's behavior may have elements of the same name."""

    def checked(tree: Tree, element: etree._Element) -> None:
        if element.getparent() is tree.root:
            check(tree, element)

    return checked


def _by_tag() -> dict[str, list[Check]]:
    found: dict[str, list[Check]] = {}
    for checks in _CHECKS:
        for name, check in checks.by_name.items():
            added = _of_root(check) if name == "resource" else check
            found.setdefault(BPMN + name, []).append(added)
    return found


_BY_TAG = _by_tag()


def check_rules(root: etree._Element, findings: FileFindings, source: bytes) -> None:
    """Add what the checks find in a file, with its bytes `source`, to what the readers found."""
    tree = Tree(root, findings, source)
    for element in root.iter(*_BY_TAG):
        for check in _BY_TAG[element.tag]:
            check(tree, element)
    for checks in _CHECKS:
        for whole in checks.whole:
            whole(tree)
