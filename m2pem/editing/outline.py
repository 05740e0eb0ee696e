"""What is in a file, for pickers, trees and completion: as far as it can be read."""

from collections.abc import Iterator, Mapping, Sequence

from lxml import etree

from m2pem.api.authoring import (
    DataName,
    Outline,
    OutlineElement,
    OutlineProcess,
    OutlineTrigger,
)
from m2pem.bpmn import read_partly
from m2pem.bpmn.context import KEY, ReadingContext
from m2pem.bpmn.data_names import read_by
from m2pem.bpmn.files import open_part
from m2pem.diagram.layout.model import DATA, Element, children, is_node, referred_id, tag
from m2pem.mission.elements import Activity
from m2pem.mission.events import Message, Signal
from m2pem.mission.library import Library
from m2pem.mission.loops import INSTANCE_COUNTS, LOOP_COUNTER, MultiInstance, StandardLoop
from m2pem.verify.requirements.names import written_by

_LISTED = (*DATA, "sequenceFlow")


def outline(
    source: bytes,
    library: Library | None = None,
    service_writes: Mapping[str, Sequence[str]] | None = None,
) -> Outline:
    """What a file has. `service_writes`: what services write, by class.

    Raises:
        MissionError: it is no BPMN 2.0.
    """
    root = open_part(source, "mission.bpmn").document.root
    context = read_partly(source, "mission.bpmn", library)
    return Outline(
        tuple(_processes(root)),
        tuple(_elements(root)),
        tuple(_names(context, service_writes or {})),
        tuple(map(_trigger, context.signals.values())),
        tuple(map(_trigger, context.messages.values())),
    )


def _processes(root: Element) -> Iterator[OutlineProcess]:
    found = [each for each in children(root, "process") if each.get("id")]
    called = {
        referred_id(each.get("calledElement")) for each in root.iter("{*}callActivity") if tag(each)
    }
    executable = [each for each in found if each.get("isExecutable") in ("true", "1")]
    candidates = executable or found
    first = next((each for each in candidates if each.get("id") not in called), None)
    if first is None and candidates:
        first = candidates[0]
    for each in found:
        yield OutlineProcess(
            str(each.get("id")), each.get("name") or "", each in executable, each is first
        )


def _elements(root: Element) -> Iterator[OutlineElement]:
    for process in children(root, "process"):
        owner = process.get("id") or ""
        for element in process.iter(etree.Element):
            name, parent = element.get("id"), element.getparent()
            if name and parent is not None and (is_node(element) or tag(element) in _LISTED):
                yield OutlineElement(
                    name, element.get("name") or "", tag(element), owner, parent.get("id") or ""
                )


def _names(context: ReadingContext, services: Mapping[str, Sequence[str]]) -> Iterator[DataName]:
    """Yield the names that are written, with their writers; then those that are only read."""
    written: dict[tuple[str, str], None] = {}
    read: set[str] = set()
    for _, data in context.declared:
        written[data.key, data.id] = None
    for node in context.nodes:
        for name in [*written_by(node, services), *_of_instances(node)]:
            written[name, node.id] = None
        read |= read_by(node)
    for ends in context.flows:
        if ends.flow.condition is not None:
            read |= ends.flow.condition.names
    known = {name for name, _ in written}
    read |= context.written_keys
    for name, source in sorted(written):
        if KEY.fullmatch(name):
            yield DataName(name, source)
    for name in sorted(read - known):
        if KEY.fullmatch(name):
            yield DataName(name, "")


def _of_instances(node: object) -> Iterator[str]:
    """Yield the names that only instances of an activity have."""
    loop = node.loop if isinstance(node, Activity) else None
    if isinstance(loop, StandardLoop):
        yield LOOP_COUNTER
    elif isinstance(loop, MultiInstance):
        yield from (LOOP_COUNTER, *INSTANCE_COUNTS, loop.item, loop.output_item)


def _trigger(root: Signal | Message) -> OutlineTrigger:
    return OutlineTrigger(root.id, root.name, root.from_operator)
