"""Tasks other than script tasks and user tasks."""

from typing import TypeVar

from lxml import etree

from m2pem.bpmn.behavior_xml import BehaviorReader
from m2pem.bpmn.definitions import look_up
from m2pem.bpmn.names import (
    ACTIVITI,
    CAMUNDA,
    FLOWABLE,
    M2PEM,
    ZEEBE,
    attribute_names,
    kind,
    local,
)
from m2pem.bpmn.reading import MessageUse, Reading
from m2pem.bpmn.rules.behaviors import DUPLICATE_PROPERTY, NO_SERVICE, TWO_BEHAVIORS, TWO_SERVICES
from m2pem.bpmn.scan import Scan, own_extensions
from m2pem.bpmn.scripts import BEHAVIOR, read_carried
from m2pem.mission.behavior import Behavior, Parameter, ServiceCall
from m2pem.mission.elements import (
    BusinessRuleTask,
    ManualTask,
    ReceiveTask,
    SendTask,
    ServiceTask,
    Task,
)
from m2pem.mission.events import Message
from m2pem.mission.expression.literals import shorten

_SERVICE = frozenset({"behavior", "service", "property", "role"})
_ENGINES = (CAMUNDA, FLOWABLE, ACTIVITI)
_CLASSES = tuple(engine + name for engine in _ENGINES for name in ("class", "topic"))
"""What other engines call the name of who does the work."""

_JOB = ZEEBE + "taskDefinition"


def read_plain_task(reading: Reading, found: Scan) -> Task:
    """A task without a type."""
    return Task(found.id, found.element.get("name", ""), reading.report.line(found.element))


def read_manual_task(reading: Reading, found: Scan) -> ManualTask:
    """A manual task."""
    return ManualTask(found.id, found.element.get("name", ""), reading.report.line(found.element))


def read_service_task(reading: Reading, found: Scan) -> ServiceTask:
    """A service task: a registered service, or a behavior."""
    return _service_task(reading, found, ServiceTask)


def read_business_rule_task(reading: Reading, found: Scan) -> BusinessRuleTask:
    """A business rule task: likewise."""
    return _service_task(reading, found, BusinessRuleTask)


Serving = TypeVar("Serving", bound=ServiceTask)


def _service_task(reading: Reading, found: Scan, task: type[Serving]) -> Serving:
    extensions = own_extensions(found, _SERVICE)
    carried = extensions.get("behavior", [])
    behavior: Behavior | None = read_carried(reading, found, carried) if carried else None
    call = _service_call(reading, found, extensions)
    if carried and call is not None:
        reading.report.error(
            found.element,
            found.id,
            TWO_BEHAVIORS,
            f"the task has both m2pem:behavior and the service class '{call.service}'",
            "delete one of the two",
        )
    elif not carried and call is None and not extensions.get("service"):
        reading.report.warning(
            found.element,
            found.id,
            NO_SERVICE,
            f"the {kind(found.element.tag)} names no service{_bound_elsewhere(found)}; it does "
            "nothing",
            'add <m2pem:service class="Detector"/> to its extension elements, or make it a plain '
            "task",
        )
    line = reading.report.line(found.element)
    return task(found.id, found.element.get("name", ""), line, call, behavior)


def _service_call(
    reading: Reading, found: Scan, extensions: dict[str, list[etree._Element]]
) -> ServiceCall | None:
    element = found.element
    reader = BehaviorReader(reading, found.id, reading.report.line)
    calls = [reader.service(each) for each in extensions.get("service", [])]
    named = [call for call in calls if call is not None]
    line = reading.report.line(element)
    keys = ("class", M2PEM + "class", M2PEM + "service", *_CLASSES)
    names = [element.get(key) or "" for key in keys]
    names += [each.get("type") or "" for each in found.extensions() if each.tag == _JOB]
    named += [ServiceCall(name.strip(), line) for name in names if name.strip()]
    classes = {call.service for call in named}
    if len(classes) > 1:
        reading.report.error(
            element,
            found.id,
            TWO_SERVICES,
            f"the task names several service classes: {', '.join(sorted(classes))}",
            "keep one",
        )
    if not named:
        return None
    first = named[0]
    properties = [*first.properties, *_loose_properties(reader, found, extensions)]
    roles = [*first.roles, *reader.roles(extensions.get("role", []))]
    reader.refuse_repeated(properties, DUPLICATE_PROPERTY)
    return ServiceCall(first.service, first.line, tuple(roles), tuple(properties))


def _bound_elsewhere(found: Scan) -> str:
    """What another engine would do here, for the message."""
    for key in attribute_names(found.element):
        if key.startswith(_ENGINES) and local(key) in ("expression", "delegateExpression", "type"):
            value = found.element.get(key) or ""
            return f" (its {local(key)} '{shorten(value)}' is another engine's)"
    return ""


def _loose_properties(
    reader: BehaviorReader, found: Scan, extensions: dict[str, list[etree._Element]]
) -> list[Parameter]:
    """Properties beside the service: `m2pem:property`, and Camunda's `camunda:properties`."""
    loose = list(extensions.get("property", []))
    for each in found.extensions():
        if each.tag == CAMUNDA + "properties":
            loose += [child for child in each if local(child.tag) == "property"]
    return [parameter for each in loose for parameter in reader.one_parameter(each)]


def read_send_task(reading: Reading, found: Scan) -> SendTask:
    """A send task: a message, or a behavior."""
    carried = own_extensions(found, BEHAVIOR).get("behavior", [])
    behavior = read_carried(reading, found, carried) if carried else None
    message = _message(reading, found)
    if carried and message is not None:
        reading.report.error(
            found.element,
            found.id,
            TWO_BEHAVIORS,
            "the task has both m2pem:behavior and a message to send",
            "draw a task for each",
        )
    name = found.element.get("name", "")
    line = reading.report.line(found.element)
    task = SendTask(found.id, name, line, message, behavior)
    if not carried:
        reading.message_uses.append(MessageUse(task, found.id, name, line, False, message))
    return task


def read_receive_task(reading: Reading, found: Scan) -> ReceiveTask:
    """A receive task."""
    message = _message(reading, found)
    name = found.element.get("name", "")
    line = reading.report.line(found.element)
    instantiate = reading.boolean(found.element, "instantiate", False, found.id)
    task = ReceiveTask(found.id, name, line, message, instantiate)
    reading.message_uses.append(MessageUse(task, found.id, name, line, True, message))
    return task


def _message(reading: Reading, found: Scan) -> Message | None:
    own = Message(found.id, "", reading.report.line(found.element))
    return look_up(reading, found.element, reading.messages, own)
