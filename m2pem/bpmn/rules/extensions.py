"""Extension elements: m2pem's own, those that only look like them, and those of other programs."""

from lxml import etree

from m2pem.bpmn.extensions import ELEMENTS, PLACES, looks_like_own, unknown_content
from m2pem.bpmn.foreign_elements import (
    AD_HOC_OUTPUT,
    CHANGING,
    CHANGING_ATTRIBUTES,
    COMPUTED,
    COUNTED,
    ENGINES,
    EXPRESSIONS,
    HARMLESS,
    NOT_OF_A_CALL,
    NOT_SERVING,
    PROPAGATES,
    PROPAGATES_REMEDY,
    SERVING,
)
from m2pem.bpmn.rules.rule import error, warning
from m2pem.bpmn.rules.tree import Check, Checks, Tree, parent
from m2pem.bpmn.xml import BPMN, CAMUNDA, M2PEM, OPERATON, a, attribute_names, kind, local
from m2pem.suggestions import suggest_or

WRONG_NAMESPACE = error(
    218,
    "a prefix or namespace is like m2pem's, but is not",
    "see extensions.md",
)
MISPLACED_EXTENSION = warning(
    304,
    "an m2pem: name has no effect in this place",
    "move it, or delete it",
)
UNKNOWN_EXTENSION = error(
    305,
    "m2pem has no such element or attribute",
    "correct it, or delete it",
)
FOREIGN_EXTENSION = warning(
    312,
    "another program's extension elements have no effect here",
    "see extensions.md",
)

FOREIGN_EFFECT = warning(
    317,
    "another engine's element or attribute changes what is executed there, and has no effect here",
    "see missions.md",
)

_OWN = M2PEM[1:-1]
_EXTENSIONS = BPMN + "extensionElements"
_CALL = BPMN + "callActivity"

_EDITORS = (
    "http://www.omg.org/",
    "http://bpmn.io/",
    "http://camunda.org/schema/modeler/",
    "http://www.signavio.com",
    "http://www.trisotech.com/",
    "http://www.yaoqiang.com/",
    "http://www.sparxsystems.com/",
    "http://sourceforge.net/bpmn/definitions/",
    "http://flowable.org/design",
    "http://www.activiti.com/modeler",
    "http://b3mn.org/",
    "http://www.eclipse.org/bpmn2/",
    "http://org.eclipse.bpmn2/ext",
    "http://www.bizagi.com/",
)
"""How the namespaces of editors begin which keep colours, sizes and the like in a file."""

_SHOWN = 5
"""Names of elements that one finding lists."""


def _extensions(tree: Tree) -> None:
    _declared(tree)
    foreign: dict[str, list[etree._Element]] = {}
    for outer in tree.root.iter(_EXTENSIONS):
        for element in outer:
            tag = element.tag
            if tag.startswith(M2PEM):
                _own(tree, element, parent(outer))
                continue
            namespace = _namespace(tag)
            if namespace in ("", BPMN[1:-1]) and local(tag) in ELEMENTS:
                right = f'did you mean <m2pem:{local(tag)}>, with xmlns:m2pem="{_OWN}"?'
                tree.report(WRONG_NAMESPACE, element, f"<{local(tag)}> has no prefix", right)
            elif namespace and looks_like_own(element.prefix or "", namespace):
                if namespace not in tree.root.nsmap.values():
                    _say_wrong(tree, element, element.prefix or "", namespace)
            elif tag.startswith(ENGINES):
                if not _say_effect(tree, element, parent(outer)):
                    foreign.setdefault(namespace, []).append(element)
            elif parent(outer).tag in PLACES and not namespace.startswith(_EDITORS):
                foreign.setdefault(namespace, []).append(element)
    for namespace, elements in foreign.items():
        _say_foreign(tree, namespace, elements)


def _declared(tree: Tree) -> None:
    for prefix, namespace in tree.root.nsmap.items():
        if looks_like_own(prefix or "", namespace):
            _say_wrong(tree, tree.root, prefix or "", namespace)


def _say_wrong(tree: Tree, element: etree._Element, prefix: str, namespace: str) -> None:
    declared = f"xmlns:{prefix}" if prefix else "xmlns"
    right = f'did you mean xmlns:m2pem="{_OWN}"?'
    tree.report(WRONG_NAMESPACE, element, f'{declared}="{namespace}"', right)


def _own(tree: Tree, element: etree._Element, owner: etree._Element) -> None:
    name = local(element.tag)
    schema = ELEMENTS.get(name)
    if schema is None:
        right = suggest_or(name, ELEMENTS, "delete it")
        tree.report(UNKNOWN_EXTENSION, element, f"m2pem:{name}", right)
        return
    if local(owner.tag) not in schema.places:
        places = [kind(place) for place in schema.places]
        right = f"it is for: {', '.join(places)}" if places else f"put it into {_wrappers(name)}"
        tree.report(MISPLACED_EXTENSION, element, f"m2pem:{name} on {a(kind(owner.tag))}", right)
    for where, message, right in unknown_content(element):
        tree.report(UNKNOWN_EXTENSION, where, message, right)


def _wrappers(name: str) -> str:
    return " or ".join(f"m2pem:{each.name}" for each in ELEMENTS.values() if name in each.children)


def _namespace(tag: str) -> str:
    return tag[1:].partition("}")[0] if tag.startswith("{") else ""


def _say_effect(tree: Tree, element: etree._Element, owner: etree._Element) -> bool:
    """Say what becomes of an engine's element, if it matters. False: the element is not known."""
    name, called = local(element.tag), owner.tag == _CALL
    effect: tuple[str, str] | None = None
    beside = ""
    if name == "properties" and not element.tag.startswith(CAMUNDA):
        return False
    if name in ("in", "out") and called:
        return True
    if name in CHANGING:
        effect = CHANGING[name]
        if name in ("in", "out") and (source := element.get("source")):
            effect = (effect[0], f"{effect[1]}: {element.get('target')} = {source}")
    elif name == "inputOutput" and called:
        effect = NOT_OF_A_CALL
    elif name == "adHoc" and element.get("outputCollection"):
        effect, beside = AD_HOC_OUTPUT, " outputCollection"
    elif name == "taskDefinition" and owner.tag not in SERVING:
        if element.get("type", "").startswith("m2pem:"):  # by the element templates of a fleet
            return True
        effect = NOT_SERVING
    elif name == "loopCharacteristics" and b"loopCounter" in etree.tostring(parent(owner)):
        effect = COUNTED
    elif name == "calledElement":
        left_out = [each for each in PROPAGATES if element.get(each) is None]
        if left_out and "true" not in map(element.get, PROPAGATES):  # that is refused
            effect = ("every value passes there, and here what is listed", PROPAGATES_REMEDY)
            beside = f" without {' and '.join(left_out)}"
    if effect is not None:
        _say_changing(tree, element, f"{element.prefix}:{name}{beside}", effect)
    return effect is not None or name in HARMLESS


def _say_changing(tree: Tree, element: etree._Element, named: str, effect: tuple[str, str]) -> None:
    tree.report(FOREIGN_EFFECT, element, f"{named}: {effect[0]}", effect[1])


def _attributes(tree: Tree) -> None:
    if not any(tree.mentions(engine[1:-1]) for engine in (*ENGINES, OPERATON)):
        return
    for element in tree.root.iter(etree.Element):
        for key in attribute_names(element):
            name = local(key)
            if not key.startswith(ENGINES) or name not in CHANGING_ATTRIBUTES:
                continue
            if element.get(key) == "false" or _is_carried_out(element, name):
                continue
            _say_changing(tree, element, f"{name}='{element.get(key)}'", CHANGING_ATTRIBUTES[name])


def _is_carried_out(element: etree._Element, name: str) -> bool:
    """Whether a script task in FEEL or JUEL stores its value, or a service task names its work."""
    if CHANGING_ATTRIBUTES[name] is NOT_SERVING:
        return element.tag in SERVING
    language = element.get("scriptFormat", "").strip().lower()
    return name == "resultVariable" and language in EXPRESSIONS


def _say_foreign(tree: Tree, namespace: str, elements: list[etree._Element]) -> None:
    names = list(dict.fromkeys(local(element.tag) for element in elements))
    listed = ", ".join(names[:_SHOWN]) + (", ..." if len(names) > _SHOWN else "")
    count = f"{len(elements):,} element" + ("" if len(elements) == 1 else "s")
    whose = f"of the namespace {namespace}" if namespace else "without a namespace"
    tree.report(FOREIGN_EXTENSION, elements[0], f"{count} {whose} from here on: {listed}")


def _computed(attribute: str) -> Check:
    def check(tree: Tree, element: etree._Element) -> None:
        text = element.get(attribute, "").strip()
        if text.startswith("=") or "${" in text or "#{" in text:
            _say_changing(tree, element, f"{attribute}='{text}'", COMPUTED)

    return check


CHECKS = Checks(
    {
        "signal": _computed("name"),
        "message": _computed("name"),
        "error": _computed("errorCode"),
        "escalation": _computed("escalationCode"),
    },
    (_extensions, _attributes),
)
