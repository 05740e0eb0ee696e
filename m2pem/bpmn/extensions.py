"""m2pem's elements and attributes in BPMN files: their places and meanings.

The reader of missions refuses all others. The descriptor of the web page's editor and
docs/extensions.md are generated from this table (`pages`).
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from functools import lru_cache

from lxml import etree

from m2pem.bpmn.xml import BPMN, M2PEM, a, attribute_names, kind, local
from m2pem.suggestions import nearest, suggest_or


class Type(StrEnum):
    """The kind of text that an attribute has."""

    TEXT = "text"
    NAME = "name"
    EXPRESSION = "expression"
    DURATION = "duration"
    BOOLEAN = "true or false"


@dataclass(frozen=True, slots=True)
class Attribute:
    """An attribute of m2pem's. `doc`: its meaning."""

    name: str
    type: Type
    doc: str


@dataclass(frozen=True, slots=True)
class OwnElement:
    """An element of m2pem's.

    `places`: the BPMN elements in whose extension elements it has an effect. `children`: m2pem's
    elements that it may contain. `text`: what its text is, "" when it has none. `prefixed`: its
    attributes may have m2pem's prefix.
    """

    name: str
    doc: str
    attributes: tuple[Attribute, ...] = ()
    children: tuple[str, ...] = ()
    text: str = ""
    places: tuple[str, ...] = ()
    prefixed: bool = True


@dataclass(frozen=True, slots=True)
class OwnAttributes:
    """m2pem's attributes of some BPMN elements; `name` is their type in the editor."""

    name: str
    places: tuple[str, ...]
    attributes: tuple[Attribute, ...]


_ASKING = ("userTask", "globalUserTask")
_DATA = ("dataObject", "dataObjectReference", "dataStore", "dataStoreReference", "property")
_SERVING = ("serviceTask", "businessRuleTask", "globalBusinessRuleTask")
_COMMANDING = ("scriptTask", "globalScriptTask", "sendTask", *_SERVING)

_PROMPT = (
    Attribute("store", Type.NAME, "the name under which the answer is stored"),
    Attribute("role", Type.TEXT, "the role of the operators who may answer"),
    Attribute(
        "timeout",
        Type.DURATION,
        "the time to answer; afterwards the task fails with PROMPT_TIMEOUT",
    ),
)
_MAPPING = (
    Attribute("source", Type.EXPRESSION, "the value to pass"),
    Attribute("target", Type.NAME, "its name at the receiver"),
)
_CLASS = Attribute("class", Type.NAME, "the service's class")

_TABLE = (
    OwnElement(
        "behavior",
        "A behavior that vehicles, payloads or teams perform.",
        (
            Attribute("type", Type.NAME, "`vehicle`, `payload` or `team`"),
            Attribute("name", Type.NAME, "the behavior's name in the catalogue"),
        ),
        ("property", "properties", "resources"),
        places=_COMMANDING,
    ),
    OwnElement("properties", "The parameters of a behavior or service.", (), ("property",)),
    OwnElement(
        "property",
        "One parameter.",
        (
            Attribute("id", Type.NAME, "an identifier for editors"),
            Attribute("name", Type.NAME, "the parameter's name"),
            Attribute("value", Type.EXPRESSION, "its value"),
        ),
        text="the value, where there is no `value`",
        places=_SERVING,
    ),
    OwnElement(
        "resources",
        "The vehicles, payloads and teams that perform a behavior or service.",
        (),
        ("role",),
    ),
    OwnElement(
        "role",
        "One vehicle, payload or team, or what is needed of it, and its role.",
        (
            Attribute("name", Type.NAME, "the role's name"),
            Attribute("vehicle", Type.NAME, "a vehicle of the fleet"),
            Attribute("payload", Type.NAME, "a payload of the fleet, `vehicle/payload`"),
            Attribute("team", Type.NAME, "a team of the fleet"),
            Attribute("optional", Type.BOOLEAN, "whether the fleet need not have it"),
            Attribute(
                "requires",
                Type.EXPRESSION,
                "what a vehicle or payload must be or have to fill it; chosen as the task starts",
            ),
            Attribute("same", Type.NAME, "the data with the resources of an earlier role"),
            Attribute("count", Type.TEXT, "how many fill it: `2`, or `1..3`"),
            Attribute("prefer", Type.EXPRESSION, "seconds of travel time that one is worth"),
            Attribute("store", Type.NAME, "the name under which the chosen ones are stored"),
            Attribute("wait", Type.DURATION, "how long the task waits for them, or `unlimited`"),
            Attribute("priority", Type.TEXT, "the greatest number is served first; 0"),
            Attribute("onLoss", Type.TEXT, "when it is lost: `fail`, `reassign` or `ask`; `fail`"),
            Attribute(
                "keep",
                Type.TEXT,
                "until what ends the run keeps it, also between tasks: `process`, `subprocess`, or "
                "`task` for no longer",
            ),
        ),
        places=_SERVING,
    ),
    OwnElement(
        "service",
        "The service that a task calls.",
        (_CLASS,),
        ("property", "role", "properties", "resources"),
        places=_SERVING,
    ),
    OwnElement(
        "userTask",
        "A question to operators, with its settings.",
        _PROMPT,
        ("prompt", "decision"),
        places=(*_ASKING, *_DATA),
    ),
    OwnElement("prompt", "The question.", _PROMPT, text="the question", places=(*_ASKING, *_DATA)),
    OwnElement(
        "decision",
        "One answer.",
        (
            Attribute("value", Type.TEXT, "the stored value"),
            Attribute("label", Type.TEXT, "the text for operators"),
        ),
        text="the value, where there is no `value`",
        places=(*_ASKING, *_DATA),
    ),
    OwnElement(
        "in",
        "A value that a call passes into the called process.",
        _MAPPING,
        places=("callActivity",),
        prefixed=False,
    ),
    OwnElement(
        "out",
        "A value that a call passes back.",
        _MAPPING,
        places=("callActivity",),
        prefixed=False,
    ),
    OwnElement(
        "requirement",
        "A requirement that `m2pem verify` proves or refutes.",
        (
            Attribute("id", Type.NAME, "its name in reports"),
            Attribute("ltl", Type.TEXT, "a formula of linear temporal logic"),
            Attribute("pattern", Type.NAME, "a pattern of requirements"),
            Attribute("text", Type.TEXT, "the requirement in words"),
            Attribute("fair", Type.BOOLEAN, "whether decisions are assumed to be fair"),
            Attribute(
                "assume",
                Type.TEXT,
                "what is [assumed](requirements.md#assumptions), such as `no-failures`",
            ),
            Attribute("monitor", Type.BOOLEAN, "`false`: runs are not monitored for it"),
            Attribute("onViolation", Type.NAME, "what a violation in a run throws"),
        ),
        ("arg",),
        places=("process",),
        prefixed=False,
    ),
    OwnElement(
        "arg",
        "An argument of a requirement's pattern.",
        (
            Attribute("name", Type.NAME, "the pattern's name for it"),
            Attribute("value", Type.TEXT, "its value"),
        ),
        prefixed=False,
    ),
    OwnElement(
        "geometry",
        "A route, area or point of the mission, which parameters name.",
        (
            Attribute("name", Type.NAME, "its name, instead of the fleet's of that name"),
            Attribute(
                "survey",
                Type.TEXT,
                "the [survey pattern](survey-patterns.md) that a route was made by, as JSON; "
                "editors make it again by that",
            ),
            Attribute(
                "surveyor",
                Type.NAME,
                "the vehicle whose part of the survey the route is, if the pattern names vehicles",
            ),
        ),
        text="GeoJSON, as in a [fleet's files](fleets.md#routes-areas-and-points)",
        places=("process",),
        prefixed=False,
    ),
)

ELEMENTS = {element.name: element for element in _TABLE}
"""m2pem's elements by name."""

EXTENSIONS = (
    OwnAttributes("AskingTask", _ASKING, _PROMPT),
    OwnAttributes(
        "ServingTask", _SERVING, (_CLASS, Attribute("service", Type.NAME, "the same as `class`"))
    ),
    OwnAttributes(
        "Instances",
        ("multiInstanceLoopCharacteristics",),
        (
            Attribute("collection", Type.EXPRESSION, "the list with an item for each instance"),
            Attribute(
                "elementVariable", Type.NAME, "the name under which an instance reads its item"
            ),
        ),
    ),
    OwnAttributes(
        "Errors",
        ("process",),
        (
            Attribute(
                "onError",
                Type.NAME,
                "`incident`: an error that no event catches opens an incident; `end`: it ends the "
                "run; otherwise what the caller, else the fleet file says",
            ),
            Attribute(
                "incidentRole",
                Type.TEXT,
                "the role of the operators who may decide about incidents; otherwise what the "
                "caller, else the fleet file says",
            ),
        ),
    ),
    OwnAttributes(
        "Checked",
        ("process",),
        (
            Attribute(
                "assume",
                Type.TEXT,
                "what `m2pem verify` [assumes](requirements.md#assumptions) of all runs that begin "
                "with this process, such as `no-failures`",
            ),
        ),
    ),
    OwnAttributes(
        "Pools",
        ("collaboration",),
        (
            Attribute(
                "allPools",
                Type.BOOLEAN,
                "`true`: `m2pem verify` [begins all pools together](verification.md#pools)",
            ),
        ),
    ),
    OwnAttributes(
        "Choice",
        ("adHocSubProcess",),
        (Attribute("activeElements", Type.EXPRESSION, "the list of ids to begin"),),
    ),
    OwnAttributes(
        "Sent",
        ("signal",),
        (
            Attribute("from", Type.NAME, "`operator`: operators throw it"),
            Attribute("returned", Type.NAME, "the resource whose return throws it"),
        ),
    ),
    OwnAttributes(
        "Posted",
        ("message",),
        (
            Attribute("from", Type.NAME, "`operator`: operators send it"),
            Attribute("correlationKey", Type.EXPRESSION, "the key of sender and receiver"),
        ),
    ),
)
"""m2pem's attributes of BPMN elements."""

ATTRIBUTES: dict[str, frozenset[str]] = {
    place: frozenset(
        attribute.name
        for each in EXTENSIONS
        if place in each.places
        for attribute in each.attributes
    )
    for place in {place for each in EXTENSIONS for place in each.places}
}
"""Names of m2pem's attributes by the BPMN element's local name."""

ALL_ATTRIBUTES = frozenset().union(*ATTRIBUTES.values())
"""Names of m2pem's attributes of any BPMN element."""

PLACES = frozenset(BPMN + place for element in _TABLE for place in element.places)
"""Tags of the BPMN elements in whose extension elements something of m2pem's has an effect."""

_WRAPPED = {("behavior", "role")}
"""Children that a reader names as misplaced: their wrapper was left out."""


def unknown_content(element: etree._Element) -> Iterator[tuple[etree._Element, str, str]]:
    """Attributes and children that m2pem does not know, in one of its elements, at any depth.

    Each with where it is, what is wrong and what would be right. The element may be one of a
    script, without a namespace or with BPMN's. What has another program's namespace is its own.
    """
    waiting = [element]
    while waiting:
        found = waiting.pop()
        name = local(found.tag)
        schema = ELEMENTS[name]
        yield from _unknown_attributes(found, schema)
        for child in found:
            inner = local(child.tag)
            if child.tag.startswith("{") and not child.tag.startswith((M2PEM, BPMN)):
                continue
            if inner in schema.children:
                waiting.append(child)
            elif (name, inner) not in _WRAPPED:
                otherwise = _one_of("elements", schema.children) or f"{name} contains no elements"
                yield (
                    child,
                    f"'{name}' has no element '{inner}'",
                    suggest_or(inner, schema.children, otherwise),
                )


def _unknown_attributes(
    element: etree._Element, schema: OwnElement
) -> Iterator[tuple[etree._Element, str, str]]:
    known = [attribute.name for attribute in schema.attributes]
    for key in attribute_names(element):
        if key in known:
            continue
        name = key.removeprefix(M2PEM)
        if name in known and not schema.prefixed:
            yield element, f"'{schema.name}' takes '{name}' without a prefix", f"write {name}=..."
        elif name not in known and not name.startswith("{"):
            otherwise = _one_of("attributes", known) or f"{schema.name} has no attributes"
            yield (
                element,
                f"'{schema.name}' has no attribute '{name}'",
                suggest_or(name, known, otherwise),
            )


def _one_of(what: str, names: list[str] | tuple[str, ...]) -> str:
    return f"its {what} are: {', '.join(names)}" if names else ""


def unknown_own_attribute(tag: str, name: str) -> tuple[bool, str, str] | None:
    """What is wrong with an attribute `m2pem:name` of a BPMN element; None: it has an effect.

    The first value is whether m2pem knows the name for other elements.
    """
    known = ATTRIBUTES.get(local(tag), frozenset())
    if name in known:
        return None
    noun = a(kind(tag))
    if name in ALL_ATTRIBUTES:
        places = [kind(place) for place, names in ATTRIBUTES.items() if name in names]
        return True, f"m2pem:{name} has no effect on {noun}", f"it is for: {', '.join(places)}"
    remedy = suggest_or(name, known or ALL_ATTRIBUTES, "delete it")
    return False, f"m2pem has no attribute 'm2pem:{name}' for {noun}", remedy


@lru_cache(maxsize=1024)
def looks_like_own(prefix: str, namespace: str) -> bool:
    """Whether a prefix, or the host of a namespace, is like m2pem's, and the namespace is not."""
    if namespace == M2PEM[1:-1]:
        return False
    host = re.sub(r"^[a-z]+:/*(www\.)?", "", namespace.strip().lower()).split("/")[0]
    labels = [label for label in re.split(r"[.:]", host) if label]
    return any(nearest(name.lower(), ["m2pem"]) for name in (prefix, *labels) if name)
