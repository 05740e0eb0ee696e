"""Elements that bpmn-moddle (bpmn-js, Camunda Modeler) writes under the names of their types."""

from lxml import etree

from m2pem.bpmn.names import BPMN

_MEANT = {
    ("complexBehaviorDefinition", "formalExpression"): "condition",
    ("complexBehaviorDefinition", "implicitThrowEvent"): "event",
    ("correlationPropertyBinding", "formalExpression"): "dataPath",
    ("correlationPropertyRetrievalExpression", "formalExpression"): "messagePath",
}
_PLACES = {(BPMN + outer, BPMN + inner): BPMN + meant for (outer, inner), meant in _MEANT.items()}
_TYPES = sorted({inner for _, inner in _PLACES})


def call_by_role(root: etree._Element) -> None:
    """Give each the name that BPMN has for it where it stands; what it says stays."""
    for element in [*root.iter(*_TYPES)]:
        parent = element.getparent()
        meant = None if parent is None else _PLACES.get((parent.tag, element.tag))
        if meant is not None:
            element.tag = meant
