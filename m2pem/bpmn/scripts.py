"""Script tasks: a behavior as XML, or statements (docs/missions.md)."""

from collections.abc import Callable

from lxml import etree

from m2pem.bpmn.behavior_xml import BehaviorReader, is_behavior
from m2pem.bpmn.names import BPMN, local
from m2pem.bpmn.reading import Reading
from m2pem.bpmn.rewriting import script_remedy, statement_remedy
from m2pem.bpmn.rules.activities import BAD_SCRIPT, EMPTY_SCRIPT, SCRIPT_LANGUAGE
from m2pem.bpmn.rules.behaviors import TWO_BEHAVIORS
from m2pem.bpmn.rules.extensions import UNKNOWN_EXTENSION
from m2pem.bpmn.scan import Scan, own_extensions
from m2pem.bpmn.vocabulary import strangers
from m2pem.bpmn.xml import XmlError, parse_xml
from m2pem.mission.behavior import Behavior, Script
from m2pem.mission.elements import ScriptTask
from m2pem.mission.script import parse_script

_XML_FORMATS = frozenset({"application/xml", "text/xml", "xml"})
_OWN_FORMATS = frozenset({"", "m2pem"})
GLOBAL_SCRIPT = BPMN + "globalScriptTask"
BEHAVIOR = frozenset({"behavior"})


def read_script_task(reading: Reading, found: Scan) -> ScriptTask:
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
            reading.report.error(
                found.element,
                found.id,
                TWO_BEHAVIORS,
                "the task has both m2pem:behavior and a script",
                "delete one of the two",
            )
        behavior = read_carried(reading, found, carried)
    elif script is not None and has_script:
        behavior, statements = _script(reading, found, script)
    else:
        reading.report.warning(
            found.element,
            found.id,
            EMPTY_SCRIPT,
            "the script task has no script; it does nothing",
            "give it a behavior, or make it a plain task",
        )
    line = reading.report.line(found.element)
    return ScriptTask(found.id, found.element.get("name", ""), line, behavior, statements)


def read_carried(reading: Reading, found: Scan, carried: list[etree._Element]) -> Behavior | None:
    """The behavior of a task's extension elements."""
    if len(carried) > 1:
        reading.report.error(
            carried[1],
            found.id,
            TWO_BEHAVIORS,
            "the task has more than one m2pem:behavior",
            "keep one; draw a task for each behavior",
        )
    return BehaviorReader(reading, found.id, reading.report.line).behavior(carried[0])


def _script(
    reading: Reading, found: Scan, script: etree._Element
) -> tuple[Behavior | None, Script | None]:
    written = found.element.get(_language(found), "")
    form = written.strip().lower()
    text = script.text or ""
    if form not in _XML_FORMATS and form not in _OWN_FORMATS:
        reading.report.error(
            found.element,
            found.id,
            SCRIPT_LANGUAGE,
            f"m2pem does not run scripts in '{written}'",
            script_remedy(text, _language(found)),
        )
        return None, None
    if len(script):
        if form == "m2pem":
            _form_differs(reading, found, "XML")
        return _child_behavior(reading, found, script), None
    if form in _XML_FORMATS or (not form and text.lstrip().startswith("<")):
        return _text_behavior(reading, found, script, text), None
    first = reading.report.line(script)
    statements, problems = parse_script(text, first)
    lines = text.replace("\r\n", "\n").split("\n") if problems else []
    for line, message in problems:
        reading.report.error(
            line,
            found.id,
            BAD_SCRIPT,
            f"the script cannot be run: {message}",
            statement_remedy(lines[line - first]),
        )
    return None, statements


def _language(found: Scan) -> str:
    """The attribute that says it (BPMN 2.0.2, tables 10.17 and 10.18)."""
    return "scriptLanguage" if found.element.tag == GLOBAL_SCRIPT else "scriptFormat"


def _form_differs(reading: Reading, found: Scan, actual: str) -> None:
    reading.report.error(
        found.element,
        found.id,
        SCRIPT_LANGUAGE,
        f"the script says {_language(found)}='{found.element.get(_language(found))}', but is "
        f"{actual}",
        f"correct its {_language(found)}",
    )


def _child_behavior(reading: Reading, found: Scan, script: etree._Element) -> Behavior | None:
    child = script[0]
    if len(script) > 1 or not is_behavior(child):
        _no_behavior(reading, found, reading.report.line(child), local(child.tag))
        return None
    return _behavior(reading, found, child, reading.report.line)


def _text_behavior(
    reading: Reading, found: Scan, script: etree._Element, text: str
) -> Behavior | None:
    body = text.lstrip()
    first = reading.report.line(script) + text[: len(text) - len(body)].count("\n")
    try:
        document = parse_xml(body.encode(), declared=False)
    except XmlError as error:
        reading.report.error(
            first + error.line - 1,
            found.id,
            BAD_SCRIPT,
            error.message.replace("the file", "the script"),
            error.remedy,
        )
        return None
    if not is_behavior(document.root):
        _no_behavior(reading, found, first, local(document.root.tag))
        return None

    def line(element: etree._Element) -> int:
        return first + document.line(element) - 1

    return _behavior(reading, found, document.root, line)


def _behavior(
    reading: Reading,
    found: Scan,
    element: etree._Element,
    line: Callable[[etree._Element], int],
) -> Behavior | None:
    for where, message, remedy in strangers(element):
        reading.report.error(line(where), found.id, UNKNOWN_EXTENSION, message, remedy)
    return BehaviorReader(reading, found.id, line).behavior(element)


def _no_behavior(reading: Reading, found: Scan, line: int, name: str) -> None:
    reading.report.error(
        line,
        found.id,
        BAD_SCRIPT,
        f"the script is XML, but <{name}> is no <behavior>",
        "write one <behavior> (docs/missions.md), or statements",
    )
