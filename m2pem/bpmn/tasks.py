"""Tasks: services, messages, prompts of user tasks, and scripts (BPMN 2.0.2, clause 10.3.3)."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeVar

from lxml import etree

from m2pem.bpmn.behaviors import BehaviorReader, is_behavior
from m2pem.bpmn.camunda_forms import form_definition, form_name, form_remedy
from m2pem.bpmn.children import Children, own_extensions
from m2pem.bpmn.context import KEY, MessageUse, PendingPrompt, ReadingContext, association, text_of
from m2pem.bpmn.events import look_up
from m2pem.bpmn.extensions import unknown_content
from m2pem.bpmn.foreign_data import foreign_script, read_foreign_script
from m2pem.bpmn.foreign_elements import ENGINES
from m2pem.bpmn.foreign_syntax import script_remedy, statement_remedy, time_remedy
from m2pem.bpmn.rules.activities import (
    BAD_SCRIPT,
    DECISION_VALUE,
    EMPTY_SCRIPT,
    FOREIGN_FORM,
    SCRIPT_LANGUAGE,
)
from m2pem.bpmn.rules.behaviors import DUPLICATE_PROPERTY, NO_SERVICE, TWO_BEHAVIORS, TWO_SERVICES
from m2pem.bpmn.rules.data import BAD_KEY
from m2pem.bpmn.rules.events import TIMER_TIME
from m2pem.bpmn.rules.extensions import UNKNOWN_EXTENSION
from m2pem.bpmn.rules.rule import Rule
from m2pem.bpmn.times import wrong_time
from m2pem.bpmn.xml import (
    BPMN,
    CAMUNDA,
    M2PEM,
    ZEEBE,
    XmlError,
    attribute_names,
    kind,
    local,
    parse_xml,
)
from m2pem.mission.behavior import Behavior, Decision, Parameter, Prompt, Script, ServiceCall
from m2pem.mission.elements import (
    BusinessRuleTask,
    ManualTask,
    ReceiveTask,
    ScriptTask,
    SendTask,
    ServiceTask,
    Task,
    UserTask,
)
from m2pem.mission.events import Message, TimerKind
from m2pem.mission.expression import Expression
from m2pem.mission.expression.literals import shorten
from m2pem.mission.script import parse_script

_SERVICE = frozenset({"behavior", "service", "property", "role"})
_CLASSES = tuple(engine + name for engine in ENGINES for name in ("class", "topic"))
"""What other engines call the name of who does the work."""

_JOB = ZEEBE + "taskDefinition"


def read_plain_task(context: ReadingContext, found: Children) -> Task:
    """A task without a type."""
    return Task(*context.head(found.element, found.id))


def read_manual_task(context: ReadingContext, found: Children) -> ManualTask:
    """A manual task."""
    return ManualTask(*context.head(found.element, found.id))


def read_service_task(context: ReadingContext, found: Children) -> ServiceTask:
    """A service task: a registered service, or a behavior."""
    return _service_task(context, found, ServiceTask)


def read_business_rule_task(context: ReadingContext, found: Children) -> BusinessRuleTask:
    """Read a business rule task: a registered service, or a behavior."""
    return _service_task(context, found, BusinessRuleTask)


Serving = TypeVar("Serving", bound=ServiceTask)


def _service_task(context: ReadingContext, found: Children, task: type[Serving]) -> Serving:
    extensions = own_extensions(found, _SERVICE)
    carried = extensions.get("behavior", [])
    behavior: Behavior | None = read_carried(context, found, carried) if carried else None
    call = _service_call(context, found, extensions)
    if carried and call is not None:
        _both(context, found, f"the service class '{call.service}'", "delete one of the two")
    elif not carried and call is None and not extensions.get("service"):
        context.findings.warning(
            found.element,
            found.id,
            NO_SERVICE,
            f"the {kind(found.element.tag)} names no service{_bound_elsewhere(found)}; it does "
            "nothing",
        )
    return task(*context.head(found.element, found.id), call, behavior)


def _both(context: ReadingContext, found: Children, other: str, remedy: str) -> None:
    what = f"the task has both m2pem:behavior and {other}"
    context.findings.error(found.element, found.id, TWO_BEHAVIORS, what, remedy)


def _service_call(
    context: ReadingContext, found: Children, extensions: dict[str, list[etree._Element]]
) -> ServiceCall | None:
    element = found.element
    reader = BehaviorReader(context, found.id, context.findings.line)
    calls = [reader.service(each) for each in extensions.get("service", [])]
    named = [call for call in calls if call is not None]
    line = context.findings.line(element)
    keys = ("class", M2PEM + "class", M2PEM + "service", *_CLASSES)
    names = [element.get(key) or "" for key in keys]
    names += [each.get("type") or "" for each in found.extensions() if each.tag == _JOB]
    named += [ServiceCall(name.strip(), line) for name in names if name.strip()]
    classes = {call.service for call in named}
    if len(classes) > 1:
        context.findings.error(
            element,
            found.id,
            TWO_SERVICES,
            f"the task names several service classes: {', '.join(sorted(classes))}",
        )
    if not named:
        return None
    first = named[0]
    loose = _loose_properties(reader, found, extensions)
    reader.refuse_repeated(loose, DUPLICATE_PROPERTY, first.properties)
    roles = (*first.roles, *reader.roles(extensions.get("role", [])))
    return ServiceCall(first.service, first.line, roles, (*first.properties, *loose))


def _bound_elsewhere(found: Children) -> str:
    """Return a note for the message on how another engine binds the task."""
    for key in attribute_names(found.element):
        if key.startswith(ENGINES) and local(key) in ("expression", "delegateExpression", "type"):
            value = found.element.get(key) or ""
            return f" (its {local(key)} '{shorten(value)}' is another engine's)"
    return ""


def _loose_properties(
    reader: BehaviorReader, found: Children, extensions: dict[str, list[etree._Element]]
) -> list[Parameter]:
    """Properties beside the service: `m2pem:property`, and Camunda's `camunda:properties`."""
    loose = list(extensions.get("property", []))
    for each in found.extensions():
        if each.tag == CAMUNDA + "properties":
            loose += [child for child in each if local(child.tag) == "property"]
    return [parameter for each in loose for parameter in reader.one_parameter(each)]


def read_send_task(context: ReadingContext, found: Children) -> SendTask:
    """A send task: a message, or a behavior."""
    carried = own_extensions(found, BEHAVIOR).get("behavior", [])
    behavior = read_carried(context, found, carried) if carried else None
    message = _message(context, found)
    if carried and message is not None:
        _both(context, found, "a message to send", "draw a task for each")
    head = context.head(found.element, found.id)
    task = SendTask(*head, message, behavior)
    if not carried:
        context.message_uses.append(MessageUse(task, *head, False, message))
    return task


def read_receive_task(context: ReadingContext, found: Children) -> ReceiveTask:
    """A receive task."""
    message = _message(context, found)
    head = context.head(found.element, found.id)
    instantiate = context.boolean(found.element, "instantiate", False, found.id)
    task = ReceiveTask(*head, message, instantiate)
    context.message_uses.append(MessageUse(task, *head, True, message))
    return task


def _message(context: ReadingContext, found: Children) -> Message | None:
    own = Message(found.id, "", context.findings.line(found.element))
    return look_up(context, found.element, context.messages, own)


_USED = frozenset({"userTask", "prompt", "decision"})
_SETTINGS = ("store", "role", "timeout")
_DEFAULT_STORE = "user.decision"
_DONE = (Decision("done", "Done"),)


def read_user_task(context: ReadingContext, found: Children) -> UserTask:
    """A user task; its prompt follows in `resolve_prompts`."""
    task = UserTask(*context.head(found.element, found.id))
    context.prompts.append(
        PendingPrompt(
            task,
            found.element,
            own_extensions(found, _USED),
            found.documentation(),
            [association(each) for each in found.of("dataInputAssociation")],
        )
    )
    return task


def resolve_prompts(context: ReadingContext) -> None:
    """Give every user task its prompt, now that all data objects are known."""
    for pending in context.prompts:
        asked = _Asked(context, pending.task.id)
        asked.settings(pending.element, prefixed=True)
        for group in pending.extensions.values():
            for element in group:
                asked.read(element)
        own = len(asked.decisions)
        for each in pending.inputs:
            for source in each.source_refs:
                asked.data_object(source, own_decisions=own > 0)
        definition = form_definition(pending.element)
        if definition is not None and not (asked.text or asked.decisions):
            context.findings.warning(
                definition,
                pending.task.id,
                FOREIGN_FORM,
                f"the form ({form_name(definition)}) is Camunda's, and is not shown: the operator "
                f"reads '{shorten(pending.documentation or pending.task.label)}' and answers Done",
                form_remedy(definition),
            )
        prompt = Prompt(
            asked.text or pending.documentation or pending.task.label,
            tuple(asked.decisions) or _DONE,
            asked.found.get("store", _DEFAULT_STORE),
            asked.found.get("role", ""),
            asked.timeout,
        )
        object.__setattr__(pending.task, "prompt", prompt)


@dataclass(slots=True)
class _Asked:
    """The parts of one prompt that have been found; the first one of each counts."""

    context: ReadingContext
    task: str
    text: str = ""
    decisions: list[Decision] = field(default_factory=list)
    found: dict[str, str] = field(default_factory=dict)
    timeout: Expression | None = None

    def read(self, element: etree._Element) -> None:
        """An m2pem:prompt, m2pem:decision or m2pem:userTask."""
        name = local(element.tag)
        if name == "decision":
            self._decision(element)
            return
        self.settings(element, prefixed=False)
        if name == "prompt":
            lines = [line.strip() for line in text_of(element).splitlines()]
            self.text = self.text or "\n".join(lines)
            return
        for child in element:
            if child.tag in (M2PEM + "prompt", M2PEM + "decision"):
                self.read(child)

    def data_object(self, identifier: str, *, own_decisions: bool) -> None:
        """Add the prompt of the data object that the task reads."""
        end = self.context.data.get(identifier)
        if end is None:
            return
        carriers = list(end.carriers)
        if end.refers_to in self.context.data:
            carriers += self.context.data[end.refers_to].carriers
        for carrier in carriers:
            for outer in carrier.iterchildren(BPMN + "extensionElements"):
                for element in outer:
                    if element.tag in (M2PEM + "prompt", M2PEM + "userTask") or (
                        element.tag == M2PEM + "decision" and not own_decisions
                    ):
                        self.read(element)

    def settings(self, element: etree._Element, *, prefixed: bool) -> None:
        """The attributes store, role and timeout."""
        for name in _SETTINGS:
            text = element.get(M2PEM + name)
            if text is None and not prefixed:
                text = element.get(name)
            if text is None or name in self.found:
                continue
            self.found[name] = text.strip()
            if name == "store" and not KEY.fullmatch(text.strip()):
                self._error(
                    element,
                    BAD_KEY,
                    f"store='{text}' is no name of the data store",
                    'write a dotted name, for example store="user.decision"',
                )
            elif name == "timeout":
                self._timeout(element, text)

    def _timeout(self, element: etree._Element, text: str) -> None:
        self.timeout = self.context.template(element, self.task, text)
        if self.timeout is not None and (wrong := wrong_time(self.timeout, TimerKind.DURATION)):
            remedy = time_remedy("timeDuration", text)
            self._error(element, TIMER_TIME, f"timeout: {wrong}", remedy)

    def _decision(self, element: etree._Element) -> None:
        value = element.get("value", element.get(M2PEM + "value"))
        value = (value if value is not None else text_of(element)).strip()
        if not value:
            self._error(
                element,
                DECISION_VALUE,
                "a decision has no value",
                'write <m2pem:decision value="continue" label="Continue"/>',
            )
        elif any(value == other.value for other in self.decisions):
            self._error(element, DECISION_VALUE, f"two decisions have the value '{value}'")
        else:
            label = element.get("label", element.get(M2PEM + "label")) or value
            self.decisions.append(Decision(value, label))

    def _error(self, element: etree._Element, rule: Rule, message: str, remedy: str = "") -> None:
        self.context.findings.error(element, self.task, rule, message, remedy)


_XML_FORMATS = frozenset({"application/xml", "text/xml", "xml"})
_OWN_FORMATS = frozenset({"", "m2pem"})
GLOBAL_SCRIPT = BPMN + "globalScriptTask"
BEHAVIOR = frozenset({"behavior"})


def read_script_task(context: ReadingContext, found: Children) -> ScriptTask:
    """A script task: a behavior of its extension elements or script, or statements."""
    extensions = own_extensions(found, BEHAVIOR)
    carried = extensions.get("behavior", [])
    scripts = found.of("script")
    script = scripts[0] if scripts else None
    has_script = script is not None and (len(script) > 0 or bool((script.text or "").strip()))
    behavior: Behavior | None = None
    statements: Script | None = None
    if carried:
        if has_script:
            _both(context, found, "a script", "delete one of the two")
        behavior = read_carried(context, found, carried)
    elif (foreign := foreign_script(found)) is not None:
        statements = read_foreign_script(context, found, foreign)
    elif script is not None and has_script:
        behavior, statements = _script(context, found, script)
    else:
        context.findings.warning(
            found.element, found.id, EMPTY_SCRIPT, "the script task has no script; it does nothing"
        )
    return ScriptTask(*context.head(found.element, found.id), behavior, statements)


def read_carried(
    context: ReadingContext, found: Children, carried: list[etree._Element]
) -> Behavior | None:
    """The behavior of a task's extension elements."""
    if len(carried) > 1:
        context.findings.error(
            carried[1],
            found.id,
            TWO_BEHAVIORS,
            "the task has more than one m2pem:behavior",
            "keep one; draw a task for each behavior",
        )
    return BehaviorReader(context, found.id, context.findings.line).behavior(carried[0])


def _script(
    context: ReadingContext, found: Children, script: etree._Element
) -> tuple[Behavior | None, Script | None]:
    written = found.element.get(_language(found), "")
    form = written.strip().lower()
    text = script.text or ""
    if form not in _XML_FORMATS and form not in _OWN_FORMATS:
        context.findings.error(
            found.element,
            found.id,
            SCRIPT_LANGUAGE,
            f"m2pem does not run scripts in '{written}'",
            script_remedy(text, _language(found)),
        )
        return None, None
    if len(script):
        if form == "m2pem":
            said = _language(found)
            context.findings.error(
                found.element,
                found.id,
                SCRIPT_LANGUAGE,
                f"the script says {said}='{written}', but is XML",
                f"correct its {said}",
            )
        return _child_behavior(context, found, script), None
    if form in _XML_FORMATS or (not form and text.lstrip().startswith("<")):
        return _text_behavior(context, found, script, text), None
    first = context.findings.line(script)
    statements, problems = parse_script(text, first)
    lines = text.replace("\r\n", "\n").split("\n") if problems else []
    for line, message in problems:
        context.findings.error(
            line,
            found.id,
            BAD_SCRIPT,
            f"the script cannot be run: {message}",
            statement_remedy(lines[line - first]),
        )
    return None, statements


def _language(found: Children) -> str:
    """Return the name of the attribute with the language (BPMN 2.0.2, tables 10.17, 10.18)."""
    return "scriptLanguage" if found.element.tag == GLOBAL_SCRIPT else "scriptFormat"


def _child_behavior(
    context: ReadingContext, found: Children, script: etree._Element
) -> Behavior | None:
    child = script[0]
    if len(script) > 1 or not is_behavior(child):
        _no_behavior(context, found, context.findings.line(child), local(child.tag))
        return None
    return _behavior(context, found, child, context.findings.line)


def _text_behavior(
    context: ReadingContext, found: Children, script: etree._Element, text: str
) -> Behavior | None:
    body = text.lstrip()
    first = context.findings.line(script) + text[: len(text) - len(body)].count("\n")
    try:
        document = parse_xml(body.encode(), declared=False)
    except XmlError as error:
        context.findings.error(
            first + error.line - 1,
            found.id,
            BAD_SCRIPT,
            error.message.replace("the file", "the script"),
            error.remedy,
        )
        return None
    if not is_behavior(document.root):
        _no_behavior(context, found, first, local(document.root.tag))
        return None

    def line(element: etree._Element) -> int:
        return first + document.line(element) - 1

    return _behavior(context, found, document.root, line)


def _behavior(
    context: ReadingContext,
    found: Children,
    element: etree._Element,
    line: Callable[[etree._Element], int],
) -> Behavior | None:
    for where, message, remedy in unknown_content(element):
        context.findings.error(line(where), found.id, UNKNOWN_EXTENSION, message, remedy)
    return BehaviorReader(context, found.id, line).behavior(element)


def _no_behavior(context: ReadingContext, found: Children, line: int, name: str) -> None:
    context.findings.error(
        line,
        found.id,
        BAD_SCRIPT,
        f"the script is XML, but <{name}> is no <behavior>",
        "write one <behavior> (docs/missions.md), or statements",
    )
