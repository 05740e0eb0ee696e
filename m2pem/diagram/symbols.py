"""What the XML of an element says about its symbol."""

from lxml import etree

from m2pem.diagram.layout.model import SUBPROCESSES, Element, children, local, tag
from m2pem.diagram.picture import Trait

_LOOPS = {
    "standardLoopCharacteristics": Trait.LOOP,
    "multiInstanceLoopCharacteristics": Trait.PARALLEL_INSTANCES,
}
_TRUE = ("true", "1")
_THROWING = ("endEvent", "intermediateThrowEvent")


def flag(element: Element, name: str, default: bool = False) -> bool:
    """An attribute that says true or false."""
    text = element.get(name)
    return default if text is None else text.strip() in _TRUE


def definitions_of(element: Element) -> tuple[str, ...]:
    """What triggers an event, or results from it: `timer`, `message`, ..."""
    ending = "EventDefinition"
    own = [tag(e).removesuffix(ending) for e in element if tag(e).endswith(ending)]
    for reference in children(element, "eventDefinitionRef"):
        wanted = local(reference.text)
        for each in element.getroottree().getroot():
            if each.get("id") == wanted and tag(each).endswith(ending):
                own.append(tag(each).removesuffix(ending))
    return tuple(own)


def name_of_symbol(element: Element) -> str:
    """The text at it, "" for none."""
    if tag(element) == "textAnnotation":
        return "".join((e.text or "").strip() for e in children(element, "text"))
    if tag(element) == "group":
        return _category(element)
    name = element.get("name") or ""
    state = next(children(element, "dataState"), None)
    if state is not None and state.get("name"):
        name = f"{name} [{state.get('name')}]"
    return name


def traits_of(element: Element) -> frozenset[Trait]:
    """What the symbol or line shows beside its kind."""
    kind = tag(element)
    found: set[Trait] = set()
    for each, trait in _LOOPS.items():
        for loop in children(element, each):
            sequential = flag(loop, "isSequential") and trait is Trait.PARALLEL_INSTANCES
            found.add(Trait.SEQUENTIAL_INSTANCES if sequential else trait)
    if flag(element, "isForCompensation"):
        found.add(Trait.COMPENSATION)
    if kind in SUBPROCESSES and flag(element, "triggeredByEvent"):
        found.add(Trait.EVENT_SUBPROCESS)
    if kind in _THROWING:
        found.add(Trait.THROWING)
    if not flag(element, "cancelActivity", True) or not flag(element, "isInterrupting", True):
        found.add(Trait.NON_INTERRUPTING)
    if flag(element, "parallelMultiple"):
        found.add(Trait.PARALLEL_MULTIPLE)
    if flag(element, "instantiate"):
        found.add(Trait.INSTANTIATING)
    if element.get("eventGatewayType") == "Parallel":
        found.add(Trait.PARALLEL)
    if kind == "association" and element.get("associationDirection", "None") != "None":
        found.add(Trait.DIRECTED)
    return frozenset(found | _of_data(element, kind))


def traits_of_flow(flow: Element, source: Element | None) -> frozenset[Trait]:
    """What a sequence flow shows where it begins."""
    if source is None:
        return frozenset()
    if source.get("default") == flow.get("id"):
        return frozenset({Trait.DEFAULT})
    conditional = next(children(flow, "conditionExpression"), None) is not None
    if conditional and not tag(source).endswith("Gateway"):
        return frozenset({Trait.CONDITIONAL})
    return frozenset()


def _of_data(element: Element, kind: str) -> set[Trait]:
    if kind == "dataInput":
        found = {Trait.INPUT}
    elif kind == "dataOutput":
        found = {Trait.OUTPUT}
    elif kind not in ("dataObjectReference", "participant"):
        return set()
    else:
        found = set()
    of = element
    if kind == "dataObjectReference":
        wanted = element.get("dataObjectRef")
        of = next((e for e in _siblings(element) if e.get("id") == wanted), element)
    if kind == "participant":
        return (
            {Trait.PARALLEL_INSTANCES} if [*children(element, "participantMultiplicity")] else set()
        )
    if flag(of, "isCollection"):
        found.add(Trait.COLLECTION)
    return found


def _siblings(element: Element) -> list[Element]:
    parent = element.getparent()
    return [] if parent is None else [*parent]


def _category(group: Element) -> str:
    wanted = local(group.get("categoryValueRef"))
    for each in group.getroottree().getroot().iter(etree.Element):
        if wanted and tag(each) == "categoryValue" and each.get("id") == wanted:
            return each.get("value") or ""
    return ""
