"""Missions in few words: BPMN XML in which flows and the insides of elements are short text.

    <startEvent id="start"/> <exclusiveGateway id="fast" default="no"/> <endEvent id="end"/>
    <scriptTask id="go">do goto uav1 speed=5</scriptTask>
    start -> fast -> go -> end if speed > 3
    no: fast -> end

* A line with `->` is a chain of sequence flows, named f1, f2, ...; a name before a colon is that of
  the first of them, and what follows `if` is the condition of the last.
* A line `a ~> b` is an association (from a compensation boundary event to its handler); a line
  `a => b` a message flow between the processes, which then are pools of a collaboration.
* An event's text says its definition: `signal S`, `message M`, `error E`, `error`, `escalation X`,
  `escalation`, `timer PT5S`, `date 2026-...`, `cycle R3/PT5S`, `conditional x > 3`, `link L`,
  `compensate`, `compensate A`, `compensate A nowait`, `cancel`, `terminate`; several definitions
  stand between `;`.
* `<loop testBefore="true" loopMaximum="5">x < 3</loop>` within an activity makes it a standard
  loop. `<each ATTRIBUTES>3 until x > 1</each>` makes it multi-instance: a cardinality, or `in` and
  `item`, `out` and `result` (ids of data objects, names of the instance's item) among the
  attributes; what follows `until` is the completion condition. Both come last in a task, and before
  its elements in a subprocess.
* A script task's text is `do BEHAVIOR ROLES PARAMETERS` (roles: `uav1`, `evsg1/ptz`, `team:alpha`,
  with `?` optional), or statements separated by `;`. A role `need:ATTRIBUTE=VALUE;...` says what it
  needs; with `count=` it is of a team behavior, and with `vehicle=` it names what it waits for.
* A service task's is `call SERVICE ROLES PARAMETERS`, a user task's `ask DECISIONS`, a call
  activity's `in a as b, out c as d`.
* `A undo B`, on a line of its own, attaches a compensation event (`A_undo`) to A that leads to B.
  Such lines come last in a process or subprocess.

What signals, messages, errors and escalations are referred to is declared by itself.
"""

import re
from collections.abc import Callable
from itertools import pairwise
from xml.sax.saxutils import escape, quoteattr

from m2pem.bpmn import parse_mission
from m2pem.mission.mission import Mission

_BPMN = "http://www.omg.org/spec/BPMN/20100524/MODEL"
_OWN = "https://m2pem.org/schema/1"
_HEAD = f'<definitions xmlns="{_BPMN}" xmlns:m2pem="{_OWN}" id="defs" targetNamespace="test">'

_LOOP = re.compile(r"<loop\b([^<>]*)>(.*?)</loop>", re.S)
_EACH = re.compile(r"<each\b([^<>]*)>(.*?)</each>", re.S)
_LINES = re.compile(r"^\s*(?:([\w-]+):)?\s*([\w-]+)\s*([~=]>)\s*([\w-]+)\s*$", re.M)
_FLOWS = re.compile(r"^\s*(?:([\w-]+):)?\s*([\w-]+(?:\s*->\s*[\w-]+)+)(?:\s+if\s+(.+))?\s*$", re.M)
_UNDO = re.compile(r"(?:^[ \t]*[\w-]+ undo [\w-]+[ \t]*(?:\n|\Z))+", re.M)
_SHORT = re.compile(
    r"<(\w+)\b([^<>]*)(?<!/)>([^<]*[^\s<][^<]*?)(<(\w+)Characteristics\b.*?</\5Characteristics>\s*)?</\1>"
)
_PARTS = re.compile(r"(?<!&lt)(?<!&gt)(?<!&amp);")
_TIMES = {"timer": "timeDuration", "date": "timeDate", "cycle": "timeCycle"}


def mission(text: str) -> Mission:
    """The mission that `text` says: processes, or the inside of a process called MAIN."""
    return parse_mission(xml(text).encode(), "test.bpmn")


def xml(text: str) -> str:
    """The BPMN 2.0 XML of it."""
    if "<process" not in text:
        text = f'<process id="MAIN" isExecutable="true">\n{text}\n</process>'
    text = _EACH.sub(_multi_instance, _LOOP.sub(_standard_loop, text))
    text, pools = _lines(text)
    body = _SHORT.sub(_long, _UNDO.sub(_undo, _flows(text)))
    return f"{_HEAD}{_roots(body + pools)}{pools}{body}</definitions>"


def _lines(text: str) -> tuple[str, str]:
    """Associations in place, at the ends of their containers; message flows as a collaboration."""
    number = 0
    flows = ""

    def line(match: re.Match[str]) -> str:
        nonlocal number, flows
        number += 1
        name, source, arrow, target = match.groups()
        ends = f'sourceRef="{source}" targetRef="{target}"'
        if arrow == "~>":
            name = name or f"tie{number}"
            return f'<association id="{name}" associationDirection="One" {ends}/>'
        flows += f'<messageFlow id="{name or f"message{number}"}" {ends}/>'
        return ""

    text = _LINES.sub(line, text)
    if not flows:
        return text, ""
    pools = "".join(
        f'<participant id="pool_{process}" name="{process}" processRef="{process}"/>'
        for process in re.findall(r'<process\b[^>]*\bid="([^"]+)"', text)
    )
    return text, f'<collaboration id="pools">{pools}{flows}</collaboration>'


def _standard_loop(match: re.Match[str]) -> str:
    condition = match[2].strip()
    inside = f"<loopCondition>{escape(condition)}</loopCondition>" if condition else ""
    tag = "standardLoopCharacteristics"
    return f"<{tag}{match[1]}>{inside}</{tag}>"


def _multi_instance(match: re.Match[str]) -> str:
    attributes = dict(re.findall(r'([\w:]+)="([^"]*)"', match[1]))
    cardinality, _, until = (part.strip() for part in f" {match[2]} ".partition(" until "))
    inside = f"<loopCardinality>{escape(cardinality)}</loopCardinality>" if cardinality else ""
    for key, tag in (("in", "loopDataInputRef"), ("out", "loopDataOutputRef")):
        if key in attributes:
            inside += f"<{tag}>{attributes.pop(key)}</{tag}>"
    for key, tag in (("item", "inputDataItem"), ("result", "outputDataItem")):
        if name := attributes.pop(key, ""):
            inside += f'<{tag} id="{tag}_{name}_{match.start()}" name="{name}"/>'
    if until:
        inside += f"<completionCondition>{escape(until)}</completionCondition>"
    rest = "".join(f' {key}="{value}"' for key, value in attributes.items())
    tag = "multiInstanceLoopCharacteristics"
    return f"<{tag}{rest}>{inside}</{tag}>"


def _flows(text: str) -> str:
    number = 0

    def elements(match: re.Match[str]) -> str:
        nonlocal number
        name, chain, condition = match.groups()
        nodes = [node.strip() for node in chain.split("->")]
        found = []
        for place, (source, target) in enumerate(pairwise(nodes), 2):
            number += 1
            inside = ""
            if condition and place == len(nodes):
                inside = f"<conditionExpression>{escape(condition)}</conditionExpression>"
            identifier = name if name and place == 2 else f"f{number}"
            found.append(
                f'<sequenceFlow id="{identifier}" sourceRef="{source}" targetRef="{target}">'
                f"{inside}</sequenceFlow>"
            )
        return "".join(found)

    found = _FLOWS.sub(elements, text)
    assert "->" not in found, f"a chain of flows has a line of its own: {found}"
    return found


def _roots(body: str) -> str:
    found = []
    for kind in ("signal", "message", "error", "escalation"):
        for name in dict.fromkeys(re.findall(rf'{kind}Ref="([^"]+)"', body)):
            if f'<{kind} id="{name}"' in body:
                continue
            code = f' {kind}Code="{name}"' if kind in ("error", "escalation") else ""
            found.append(f'<{kind} id="{name}" name="{name}"{code}/>')
    return "".join(found)


def _long(match: re.Match[str]) -> str:
    tag, attributes, text = match[1], match[2], match[3].strip()
    if tag.endswith("Event"):
        inside = "".join(_definition(part.strip()) for part in _PARTS.split(text))
    elif tag in _INSIDES:
        inside = _INSIDES[tag](text)
    else:
        return match[0]
    return f"<{tag}{attributes}>{inside}{match[4] or ''}</{tag}>"


def _definition(text: str) -> str:
    word, _, rest = text.partition(" ")
    if word in _TIMES:
        time = _TIMES[word]
        return f"<timerEventDefinition><{time}>{rest}</{time}></timerEventDefinition>"
    if word == "conditional":
        condition = f"<condition>{rest}</condition>"
        return f"<conditionalEventDefinition>{condition}</conditionalEventDefinition>"
    if word == "link":
        return f'<linkEventDefinition name="{rest}"/>'
    if rest.endswith("nowait"):
        activity = rest.removesuffix("nowait").strip()
        attribute = f' activityRef="{activity}"' if activity else ""
        return f'<compensateEventDefinition{attribute} waitForCompletion="false"/>'
    key = "activity" if word == "compensate" else word
    reference = f' {key}Ref="{rest}"' if rest else ""
    return f"<{word}EventDefinition{reference}/>"


def _undo(match: re.Match[str]) -> str:
    events, associations = "", ""
    for line in match[0].splitlines():
        activity, _, handler = line.split()
        event = f"{activity}_undo"
        events += f'<boundaryEvent id="{event}" attachedToRef="{activity}">compensate'
        events += "</boundaryEvent>"
        associations += (
            f'<association id="{event}s" sourceRef="{event}" targetRef="{handler}" '
            'associationDirection="One"/>'
        )
    return f"{events}{associations}\n"


def _script(text: str) -> str:
    if not text.startswith("do "):
        return "<script>" + text.replace(";", "\n") + "</script>"
    _, name, *words = text.split()
    kind = "vehicle"
    if any(word.startswith("team:") or "count=" in word for word in words):
        kind = "team"
    elif any("/" in word and "=" not in word for word in words):
        kind = "payload"
    properties, roles = _words(words, "property", "role")
    return (
        f'<extensionElements><m2pem:behavior type="{kind}" name="{name}"><m2pem:properties>'
        f"{properties}</m2pem:properties><m2pem:resources>{roles}</m2pem:resources>"
        "</m2pem:behavior></extensionElements>"
    )


def _service(text: str) -> str:
    _, name, *words = text.split()
    properties, roles = _words(words, "property", "role")
    return (
        f'<extensionElements><m2pem:service class="{name}"/>{properties}{roles}</extensionElements>'
    )


def _words(words: list[str], tag: str, role_tag: str) -> tuple[str, str]:
    properties, roles = "", ""
    for number, word in enumerate(words, 1):
        key, equals, value = word.partition("=")
        if word.startswith("need:"):
            roles += _need(word.removeprefix("need:"), role_tag, number)
            continue
        if equals:
            properties += f"<m2pem:{tag} name={quoteattr(key)} value={quoteattr(value)}/>"
            continue
        optional = ' optional="true"' if word.endswith("?") else ""
        resource = word.removesuffix("?")
        kind = "payload" if "/" in resource else "vehicle"
        if resource.startswith("team:"):
            kind, resource = "team", resource.removeprefix("team:")
        roles += f'<m2pem:{role_tag} name="role{number}" {kind}="{resource}"{optional}/>'
    return properties, roles


def _need(word: str, role_tag: str, number: int) -> str:
    optional = ' optional="true"' if word.endswith("?") else ""
    parts = [part.partition("=") for part in word.removesuffix("?").split(";")]
    attributes = "".join(f" {key}={quoteattr(value)}" for key, _, value in parts)
    return f'<m2pem:{role_tag} name="role{number}"{attributes}{optional}/>'


def _prompt(text: str) -> str:
    decisions = "".join(
        f'<m2pem:decision value="{value}"/>' for value in text.removeprefix("ask ").split()
    )
    return f"<extensionElements>{decisions}</extensionElements>"


def _mappings(text: str) -> str:
    found = ""
    for part in text.split(","):
        direction, source, _, target = part.split()
        found += f'<m2pem:{direction} source="{source}" target="{target}"/>'
    return f"<extensionElements>{found}</extensionElements>"


_INSIDES: dict[str, Callable[[str], str]] = {
    "scriptTask": _script,
    "serviceTask": _service,
    "userTask": _prompt,
    "callActivity": _mappings,
}
