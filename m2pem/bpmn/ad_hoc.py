"""Ad-hoc subprocesses (BPMN 2.0.2, clause 10.3.5, table 10.22)."""

from lxml import etree

from m2pem.bpmn.names import BPMN, M2PEM, ZEEBE
from m2pem.bpmn.reading import Reading, text_of
from m2pem.bpmn.rules.subprocesses import AD_HOC_ORDERING
from m2pem.mission.elements import AdHocOrdering, AdHocSubProcess
from m2pem.mission.expression import Expression


def read_ad_hoc(reading: Reading, element: etree._Element, identifier: str) -> AdHocSubProcess:
    """An ad-hoc subprocess; what is in it is read with the content of all subprocesses."""
    ordering = element.get("ordering", AdHocOrdering.PARALLEL.value)
    if ordering not in [each.value for each in AdHocOrdering]:
        reading.report.error(
            element,
            identifier,
            AD_HOC_ORDERING,
            f"ordering='{ordering}' is none that BPMN knows",
            'write ordering="Parallel" or ordering="Sequential"',
        )
        ordering = AdHocOrdering.PARALLEL.value
    return AdHocSubProcess(
        identifier,
        element.get("name", ""),
        reading.report.line(element),
        ordering=AdHocOrdering(ordering),
        completion=_completion(reading, element, identifier),
        cancel_remaining=reading.boolean(element, "cancelRemainingInstances", True, identifier),
        active_elements=_active_elements(reading, element, identifier),
    )


def _completion(reading: Reading, element: etree._Element, identifier: str) -> Expression | None:
    for condition in element.iterchildren(BPMN + "completionCondition"):
        text = text_of(condition)
        if text:
            return reading.expression(condition, identifier, text, condition.get("language"))
    return None


def _active_elements(
    reading: Reading, element: etree._Element, identifier: str
) -> Expression | None:
    text = element.get(M2PEM + "activeElements", "")
    where = element
    for extensions in element.iterchildren(BPMN + "extensionElements"):
        for each in extensions.iterchildren(ZEEBE + "adHoc"):
            text = text or each.get("activeElementsCollection", "")
            where = each
    return reading.expression(where, identifier, text) if text.strip() else None
