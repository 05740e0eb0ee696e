"""Data mappings and scripts of Camunda that mean what m2pem has: they are carried out.

`zeebe:ioMapping` and `camunda:inputOutput` give an activity values of its own, and pass some on
when it has completed. Each mapping reads what those before it have set.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass

from lxml import etree

from m2pem.bpmn.children import Children
from m2pem.bpmn.context import KEY, ReadingContext, text_of
from m2pem.bpmn.foreign_elements import ENGINES, EXPRESSIONS
from m2pem.bpmn.foreign_syntax import expression_remedy
from m2pem.bpmn.rules.data import BAD_KEY
from m2pem.bpmn.rules.extensions import FOREIGN_EFFECT
from m2pem.bpmn.xml import CAMUNDA, ZEEBE, local
from m2pem.errors import ExpressionSyntaxError
from m2pem.mission.behavior import Assignment, Mapping, Mappings, Script
from m2pem.mission.elements import Activity, Event, ReceiveTask, ScriptTask, ServiceTask
from m2pem.mission.expression import Expression, literal, template

_WRAPPERS = (ZEEBE + "ioMapping", CAMUNDA + "inputOutput")
_INPUTS = (ZEEBE + "input", CAMUNDA + "inputParameter")
_OUTPUTS = (ZEEBE + "output", CAMUNDA + "outputParameter")
_TARGET = re.compile(r"[^\W\d]\w*(?:[. ]\w+)*")
"""A name of the data; one with spaces FEEL can read."""

_SCRIPT = ZEEBE + "script"


def read_foreign_mappings(
    context: ReadingContext, found: Children, node: Activity | Event
) -> Mappings | None:
    """The mappings of an activity or event that other engines' elements say; None: none does.

    The targets of inputs become data of the activity's own. Where Camunda 8 has outputs, the result
    of a service, message or script passes on by these alone.
    """
    wrappers = [each for each in found.extensions() if each.tag in _WRAPPERS]
    if not wrappers:
        return None
    inputs = tuple(_mappings(context, found, node, wrappers, _INPUTS))
    outputs = tuple(_mappings(context, found, node, wrappers, _OUTPUTS))
    local_result = bool(outputs) and any(each.tag.startswith(ZEEBE) for each in wrappers)
    if isinstance(node, Activity):
        own = {mapping.target.partition(".")[0] for mapping in inputs}
        script = foreign_script(found)
        if local_result and isinstance(node, ScriptTask) and script is not None:
            own.add(script.key)
        object.__setattr__(node, "own_data", node.own_data | own)
    keeps = local_result and isinstance(node, ReceiveTask | ServiceTask)
    return Mappings(inputs, outputs, ordered=True, keeps_result=keeps)


def _mappings(
    context: ReadingContext,
    found: Children,
    node: Activity | Event,
    wrappers: list[etree._Element],
    tags: tuple[str, ...],
) -> Iterator[Mapping]:
    for element in (each for wrapper in wrappers for each in wrapper if each.tag in tags):
        target = (element.get("target") or element.get("name") or "").strip()
        source = element.get("source") if element.tag.startswith(ZEEBE) else text_of(element)
        because, remedy = "", "write an expression, or a script task before it"
        expression = literal(None)
        if not _TARGET.fullmatch(target):
            because = "that is no name of the data"
        elif len(element):
            because = f"a {local(element[0].tag)} is not read"
        elif source:
            try:
                expression = template(source)
            except ExpressionSyntaxError as error:
                because, remedy = str(error), expression_remedy(source)
        if because:
            what = f"'{target}' gets no value from {local(element.tag)}: {because}"
            context.findings.warning(element, node.id, FOREIGN_EFFECT, what, remedy)
            continue
        if element.tag in _OUTPUTS and isinstance(node, Activity):
            _warn_of_collection(context, found, element, expression)
        yield Mapping(expression, target, context.findings.line(element))


def _warn_of_collection(
    context: ReadingContext, found: Children, element: etree._Element, source: Expression
) -> None:
    """An instance passes its outputs on before the others have given theirs."""
    marks = found.of("multiInstanceLoopCharacteristics")
    for each in (inner for mark in marks for inner in mark.iter(ZEEBE + "loopCharacteristics")):
        name = each.get("outputCollection", "").strip()
        if name and name in source.names:
            context.findings.warning(
                element,
                found.id,
                FOREIGN_EFFECT,
                f"each instance passes this output on, and '{name}' is written after them all",
                f"read {name} in a task after the activity",
            )


# --- scripts --------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class ForeignScript:
    """An expression whose value another engine stores."""

    where: etree._Element
    text: str
    key: str
    language: str


def foreign_script(found: Children) -> ForeignScript | None:
    """What a script task stores by `zeebe:script`, or by an expression with a result variable."""
    for each in found.extensions():
        if each.tag == _SCRIPT:
            text, key = each.get("expression", ""), each.get("resultVariable", "")
            return ForeignScript(each, text, key.strip(), "FEEL")
    language = found.element.get("scriptFormat", "").strip()
    names = (found.element.get(engine + "resultVariable", "").strip() for engine in ENGINES)
    key = next(filter(None, names), "")
    for each in found.of("script") if key and language.lower() in EXPRESSIONS else ():
        return ForeignScript(each, text_of(each), key, language)
    return None


def read_foreign_script(
    context: ReadingContext, found: Children, script: ForeignScript
) -> Script | None:
    """The assignment that such a script is."""
    if not KEY.fullmatch(script.key):
        context.findings.error(
            script.where,
            found.id,
            BAD_KEY,
            f"the script's result variable, '{script.key}', is no name of the data",
            'write for example resultVariable="mission.speed"',
        )
        return None
    expression = context.expression(script.where, found.id, script.text, script.language)
    if expression is None:
        return None
    return Script((Assignment(script.key, expression, context.findings.line(script.where)),))
