"""A case's file as another engine can read it: the same model, expressions in its own language.

Only what BPMN leaves to the engine is changed: the language of expressions and scripts, and which
processes an engine runs by itself (`isExecutable`). What every editor writes and our files leave
out, `incoming` and `outgoing`, is added.
"""

import re
from collections.abc import Callable
from pathlib import Path

from lxml import etree

_BPMN = "{http://www.omg.org/spec/BPMN/20100524/MODEL}"
_CONDITIONS = ("conditionExpression", "activationCondition")
_LOOPS = ("loopCondition", "loopCardinality", "completionCondition", "condition")
_TIMES = ("timeDuration", "timeDate", "timeCycle")
_NOT_BEFORE = ("documentation", "extensionElements")


def main_process(file: Path, asked: str) -> str:
    """The process that a run begins with: the one asked for, else the first that is executable
    and that nothing calls."""
    processes, called = _processes(file)
    candidates = [name for name, executable in processes.items() if executable] or [*processes]
    return asked or next((name for name in candidates if name not in called), candidates[0])


def startable_processes(file: Path, main: str) -> list[str]:
    """Processes that events start: neither the main one nor called ones."""
    processes, called = _processes(file)
    return [name for name in processes if name != main and name not in called]


def _processes(file: Path) -> tuple[dict[str, bool], set[str]]:
    """The processes, each with whether it is executable, and those that are called."""
    root = etree.parse(file).getroot()
    found = root.iter(f"{_BPMN}process")
    called = {c.get("calledElement", "") for c in root.iter(f"{_BPMN}callActivity")}
    return {p.get("id", ""): p.get("isExecutable") == "true" for p in found}, called


def for_spiffworkflow(file: Path, main: str) -> str:
    """Expressions are Python; a time is an expression too."""
    return _rewritten(file, _python, _python, repr, lambda _: "true")


def for_bpmn_elements(file: Path, main: str) -> str:
    """Expressions are what the application makes of them; executable processes all run at once."""
    return _rewritten(
        file,
        lambda text: text,
        lambda text: text if text.isdigit() else f"${{{text}}}",
        lambda text: text,
        lambda process: "true" if process == main else "false",
    )


def _python(text: str) -> str:
    words = {"null": "None", "true": "True", "false": "False"}
    return re.sub(r"\b(null|true|false)\b", lambda match: words[match[0]], text)


def _rewritten(
    file: Path,
    condition: Callable[[str], str],
    loop: Callable[[str], str],
    time: Callable[[str], str],
    executable: Callable[[str], str],
) -> str:
    root = etree.parse(file).getroot()
    for element in root.iter(etree.Element):
        tag = str(element.tag).removeprefix(_BPMN)
        text = (element.text or "").strip()
        if tag in (*_CONDITIONS, "script"):
            element.text = condition(text)
        elif tag in _LOOPS:
            element.text = loop(text)
        elif tag in _TIMES:
            element.text = time(text)
        elif tag == "process":
            element.set("isExecutable", executable(element.get("id", "")))
    _add_ends(root)
    return etree.tostring(root, encoding="unicode")


def _add_ends(root: etree._Element) -> None:
    nodes = {element.get("id"): element for element in root.iter(etree.Element)}
    places: dict[etree._Element, int] = {}
    for end, tag in (("targetRef", "incoming"), ("sourceRef", "outgoing")):
        for flow in root.iter(f"{_BPMN}sequenceFlow"):
            node = nodes[flow.get(end)]
            place = places.setdefault(
                node, sum(str(c.tag).removeprefix(_BPMN) in _NOT_BEFORE for c in node)
            )
            reference = etree.Element(f"{_BPMN}{tag}")
            reference.text = flow.get("id")
            node.insert(place, reference)
            places[node] = place + 1
