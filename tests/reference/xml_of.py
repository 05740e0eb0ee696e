"""Writing a model as BPMN 2.0 XML that m2pem reads."""

from collections.abc import Iterator
from xml.sax.saxutils import quoteattr

from tests.reference.diagram import (
    WAITING_FOR_START,
    Event,
    Flow,
    Is,
    Level,
    Loop,
    Many,
    Node,
    all_nodes,
    levels,
)

_HEAD = (
    '<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"'
    ' xmlns:m2pem="https://m2pem.org/schema/1" id="model" targetNamespace="test">'
)
_TAGS = {
    "start": "startEvent",
    "end": "endEvent",
    "catch": "intermediateCatchEvent",
    "throw": "intermediateThrowEvent",
    "boundary": "boundaryEvent",
    "task": "task",
    "user": "userTask",
    "subprocess": "subProcess",
    "event_subprocess": "subProcess",
    "exclusive": "exclusiveGateway",
    "parallel": "parallelGateway",
    "inclusive": "inclusiveGateway",
    "complex": "complexGateway",
    "event_gateway": "eventBasedGateway",
}
DONE = "done"


def answers(model: Level) -> dict[str, tuple[str, ...]]:
    """The answers that user tasks take: where a condition asks for one, it and another."""
    asked: dict[str, set[str]] = {}
    for condition in _conditions(model):
        if isinstance(condition.value, str):
            asked.setdefault(condition.name, {"other"}).add(condition.value)
    tasks = [node.id for node in all_nodes(model) if node.kind == "user"]
    return {name: tuple(sorted(asked.get(name, {DONE}))) for name in tasks}


def _conditions(model: Level) -> Iterator[Is]:
    for level in levels(model):
        yield from (flow.condition for flow in level.flows if flow.condition is not None)
        for node in level.nodes:
            if isinstance(node.repeat, Loop):
                yield node.repeat.condition


def xml_of(model: Level) -> str:
    """The whole file."""
    lines = [_HEAD, *_roots(model), '  <process id="MAIN" isExecutable="true">']
    lines += _content(model, answers(model), "    ")
    return "\n".join([*lines, "  </process>", "</definitions>"])


def _roots(model: Level) -> list[str]:
    events = [n.event for n in all_nodes(model) if n.event is not None and n.event.name is not None]
    found = []
    for event in dict.fromkeys(events):
        if event.kind != "link":
            code = "" if event.kind == "signal" else f' {event.kind}Code="{event.name}"'
            found.append(f'  <{event.kind} id="{event.name}" name="{event.name}"{code}/>')
    return found


def _content(level: Level, values: dict[str, tuple[str, ...]], margin: str) -> Iterator[str]:
    for node in level.nodes:
        inside = list(_inside(level, node, values, margin + "  "))
        tag = f"{_TAGS[node.kind]}{_attributes(node)}"
        if inside:
            yield f"{margin}<{tag}>"
            yield from inside
            yield f"{margin}</{_TAGS[node.kind]}>"
        else:
            yield f"{margin}<{tag}/>"
    for flow in level.flows:
        head = f'{margin}<sequenceFlow id="{flow.id}" sourceRef="{flow.source}"'
        yield f'{head} targetRef="{flow.target}"{_condition(flow)}'


def _condition(flow: Flow) -> str:
    if flow.condition is None:
        return "/>"
    text = _expression(flow.condition)
    return f"><conditionExpression>{text}</conditionExpression></sequenceFlow>"


def _expression(condition: Is) -> str:
    if condition.name == WAITING_FOR_START:
        return WAITING_FOR_START if condition.value else f"not {WAITING_FOR_START}"
    return f"{condition.name} == '{condition.value}'"


def _attributes(node: Node) -> str:
    given: dict[str, object] = {"id": node.id, "default": node.default}
    if node.kind == "boundary":
        given |= {"attachedToRef": node.attached_to, "cancelActivity": _false(node.interrupting)}
    if node.kind == "start":
        given["isInterrupting"] = _false(node.interrupting)
    if node.kind == "event_subprocess":
        given["triggeredByEvent"] = "true"
    for name, number in (
        ("startQuantity", node.start_quantity),
        ("completionQuantity", node.completion_quantity),
    ):
        given[name] = number if number != 1 else None
    return "".join(f" {k}={quoteattr(str(v))}" for k, v in given.items() if v is not None)


def _false(value: bool) -> str | None:
    """What is true by default is not written."""
    return None if value else "false"


def _inside(
    level: Level, node: Node, values: dict[str, tuple[str, ...]], margin: str
) -> Iterator[str]:
    if node.kind == "user":
        decisions = "".join(f'<m2pem:decision value="{each}"/>' for each in values[node.id])
        yield f"{margin}<extensionElements>"
        yield f'{margin}  <m2pem:userTask store="{node.id}"/>{decisions}'
        yield f"{margin}</extensionElements>"
    for flow in level.incoming[node.id]:
        yield f"{margin}<incoming>{flow.id}</incoming>"
    for flow in level.outgoing[node.id]:
        yield f"{margin}<outgoing>{flow.id}</outgoing>"
    if node.kind == "complex":
        need = f"activationCount &gt;= {node.needed}"
        yield f"{margin}<activationCondition>{need}</activationCondition>"
    if node.repeat is not None:
        yield margin + _repeat(node.repeat)
    if node.event is not None:
        yield margin + _event(node.event)
    if node.inside is not None:
        yield from _content(node.inside, values, margin)


def _event(event: Event) -> str:
    if event.kind == "link":
        return f'<linkEventDefinition name="{event.name}"/>'
    reference = f' {event.kind}Ref="{event.name}"' if event.name is not None else ""
    return f"<{event.kind}EventDefinition{reference}/>"


def _repeat(repeat: Loop | Many) -> str:
    if isinstance(repeat, Loop):
        maximum = f' loopMaximum="{repeat.maximum}"' if repeat.maximum is not None else ""
        return (
            f'<standardLoopCharacteristics testBefore="{str(repeat.before).lower()}"{maximum}>'
            f"<loopCondition>{_expression(repeat.condition)}</loopCondition>"
            "</standardLoopCharacteristics>"
        )
    enough = ""
    if repeat.enough is not None:
        condition = f"numberOfCompletedInstances &gt;= {repeat.enough}"
        enough = f"<completionCondition>{condition}</completionCondition>"
    return (
        f'<multiInstanceLoopCharacteristics isSequential="{str(repeat.sequential).lower()}">'
        f"<loopCardinality>{repeat.count}</loopCardinality>{enough}"
        "</multiInstanceLoopCharacteristics>"
    )
