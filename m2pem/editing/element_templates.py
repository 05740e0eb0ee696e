"""Element templates of a fleet, for Camunda Modeler and bpmn-js (docs/editors.md).

An element template gives a task in the editor a form, whose fields it keeps as properties of
Camunda's. `m2pem.bpmn.template_properties` reads them. There is a template for each behavior of the
fleet, each service, and each common question to operators.
"""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, TypeAlias

from m2pem.bpmn.template_properties import (
    BEHAVIOR,
    OPERATORS,
    PREFIX,
    PROMPT,
    STORE,
    TIMEOUT,
    TYPE,
    property_name,
)
from m2pem.fleet.fleet import Fleet
from m2pem.fleet.parameters import DIMENSIONS, accepted
from m2pem.geo.geojson import kind_of
from m2pem.mission.behavior import BehaviorType, Keep, OnLoss
from m2pem.mission.catalogue import BehaviorSpec, ParameterKind, ParameterSpec
from m2pem.units import UNITS

Json: TypeAlias = dict[str, Any]

QUESTIONS: Sequence[Mapping[str, str]] = (
    {"continue": "Continue", "abort": "Abort"},
    {"yes": "Yes", "no": "No"},
    {"continue": "Continue", "repeat": "Repeat", "abort": "Abort"},
)
"""The decisions of the templates for user tasks: labels by stored values."""

_ABSENT = "(not given)"
_SCHEMA = "urn:@camunda/{}element-templates-json-schema"
"""An editor knows by the name of the schema's package that a template is for Camunda 8; it loads no
schema from this address."""


class Editor(StrEnum):
    """The editors that templates are made for."""

    CAMUNDA = "camunda"
    """Camunda Modeler, diagrams for Camunda 8: `zeebe:property`."""

    BPMN_IO = "bpmn-io"
    """bpmn-js with `ElementTemplatesPropertiesProviderModule`, and Camunda Modeler's diagrams for
    Camunda 7: `camunda:property`."""


def element_templates(
    fleet: Fleet,
    offers: Mapping[str, Sequence[BehaviorSpec]],
    services: Sequence[str],
    editor: Editor,
) -> list[Json]:
    """Return the templates. `offers`: behaviors by vehicle, payload or team."""
    performers: dict[BehaviorSpec, list[str]] = {}
    manned = {vehicle.id for vehicle in fleet.vehicles.values() if vehicle.manned}
    for resource, offered in offers.items():
        for spec in () if resource in manned else offered:
            if (spec.type is BehaviorType.TEAM) == (resource in fleet.teams):
                performers.setdefault(spec, []).append(resource)
    behaviors = sorted(performers, key=lambda spec: (spec.type, spec.name))
    variants = Counter((spec.type, spec.name) for spec in behaviors)
    made = [
        _behavior(fleet, spec, performers[spec], editor, variants[spec.type, spec.name] == 1)
        for spec in behaviors
    ]
    made += [_service(fleet, name, editor) for name in services]
    made += [_question(fleet, decisions, editor) for decisions in QUESTIONS]
    return [each.as_json() for each in made]


@dataclass(slots=True)
class _Template:
    """One template; its fields are added by the methods."""

    fleet: Fleet
    editor: Editor
    category: str
    name: str
    element: str
    doc: str = ""
    groups: dict[str, str] = field(default_factory=dict)
    properties: list[Json] = field(default_factory=list)

    def hidden(self, binding: Mapping[str, str], value: str) -> None:
        """Add a value that the form does not show."""
        self.properties.append({"type": "Hidden", "value": value, "binding": binding})

    def bound(self, name: str) -> Json:
        """Return the binding to a property."""
        kind = "zeebe" if self.editor is Editor.CAMUNDA else "camunda"
        return {"type": f"{kind}:property", "name": name}

    def ask(
        self,
        group: str,
        name: str,
        label: str,
        *,
        value: str = "",
        doc: str = "",
        required: bool = False,
        choices: Sequence[str] = (),
        lines: bool = False,
    ) -> None:
        """Add a field to the group of that name. A field left empty gives nothing."""
        self.groups.setdefault(_slug(group), group)
        area = lines and self.editor is Editor.CAMUNDA  # camunda:property has no field of lines
        kind = "Dropdown" if choices else "Text" if area else "String"
        asked: Json = {"type": kind, "label": label, "group": _slug(group)}
        if doc:
            asked["description"] = doc
        if choices:
            listed = [{"name": choice, "value": choice} for choice in choices]
            asked["choices"] = listed if required else [{"name": _ABSENT, "value": ""}, *listed]
        if value:
            asked["value"] = value
        if required:
            asked["constraints"] = {"notEmpty": True}
        elif self.editor is Editor.CAMUNDA:
            asked["optional"] = True
        self.properties.append({**asked, "binding": self.bound(name)})

    def as_json(self) -> Json:
        """Return the template by the schema of bpmn-io."""
        zeebe = "zeebe-" if self.editor is Editor.CAMUNDA else ""
        category = f"m2pem: {self.category}"
        return {
            "$schema": _SCHEMA.format(zeebe),
            "name": self.name,
            "id": ".".join(map(_slug, ("m2pem", self.fleet.name, self.category, self.name))),
            "description": self.doc,
            "version": 1,
            "category": {"id": _slug(category), "name": category},
            "appliesTo": ["bpmn:Task", self.element],
            "elementType": {"value": self.element},
            "groups": [{"id": id_, "label": label} for id_, label in self.groups.items()],
            "properties": self.properties,
        }


def _slug(text: str) -> str:
    return re.sub(r"[^\w-]+", "-", text.lower()).strip("-")


def _behavior(
    fleet: Fleet, spec: BehaviorSpec, performers: Sequence[str], editor: Editor, only: bool
) -> _Template:
    """The template of a behavior; unless it is the `only` one of its name, it names its performers:
    two arbiters may take different parameters for one behavior."""
    name = spec.name if only else f"{spec.name} ({', '.join(performers)})"
    template = _Template(fleet, editor, f"{spec.type} behaviors", name, "bpmn:ScriptTask")
    template.doc = spec.doc
    if spec.required_one_of:
        groups = (" and ".join(group) for group in spec.required_one_of)
        template.doc += f" It needs {', or '.join(groups)}."
    if editor is Editor.CAMUNDA:  # else the editor warns that the task has no implementation
        template.hidden({"type": "zeebe:taskDefinition", "property": "type"}, f"m2pem:{spec.name}")
    template.hidden(template.bound(BEHAVIOR), spec.name)
    template.hidden(template.bound(TYPE), spec.type.value)
    template.ask(
        "Who does it",
        property_name(spec.type.value, spec.type.value),
        spec.type.value,
        value=performers[0] if len(performers) == 1 else "",
        doc="Empty: it is chosen when the task starts, by what it requires.",
        choices=performers,
    )
    for attribute, doc in _NEEDS.items():
        if attribute != "count" or spec.type is BehaviorType.TEAM:
            name = property_name(attribute, spec.type.value)
            template.ask("Chosen when it starts", name, attribute, doc=doc)
    if spec.type is not BehaviorType.TEAM:  # the fleet file says what a team does
        template.ask(
            "When it is lost",
            property_name("onLoss", spec.type.value),
            "onLoss",
            doc="reassign: another one does the rest, if none is named. ask: an operator decides.",
            choices=tuple(OnLoss),
        )
    template.ask(
        "Between tasks",
        property_name("keep", spec.type.value),
        "keep",
        doc="process, subprocess: the run keeps it until that ends. task: no longer.",
        choices=tuple(Keep),
    )
    for parameter in {**spec.by_name, **accepted(spec)}.values():
        template.ask(
            "Parameters",
            property_name("property", parameter.name),
            parameter.name,
            value=_default(parameter),
            doc=_described(parameter),
            required=parameter.required,
            choices=_choices(fleet, parameter),
        )
    return template


_NEEDS = {
    "requires": "Instead of a name: a condition on the candidate, as vehicle.domain == 'air'.",
    "same": "Instead of a name: the data under which an earlier task stored its choice.",
    "count": "How many: 2, or 1..3 for as many as are free.",
    "prefer": "How many seconds of travel time the candidate is worth.",
    "store": "The name under which the choice is stored.",
    "wait": "How long it waits until it is free: PT10M, or unlimited.",
    "priority": "A whole number; what has the greatest is served first.",
}
"""The attributes of a role by need (docs/allocation.md), and what each means."""


def _choices(fleet: Fleet, parameter: ParameterSpec) -> Sequence[str]:
    """The texts of which one is right; none where others are right, too."""
    match parameter.kind:
        case ParameterKind.ROUTE | ParameterKind.AREA as kind:
            named = [name for name, each in fleet.geometries.items() if kind_of(each) == kind.value]
            return list(dict.fromkeys((*named, *fleet.handed_over)))
        case ParameterKind.VEHICLE:
            return list(fleet.vehicles)
        case ParameterKind.BOOLEAN:
            return ("true", "false")
        case _:
            return parameter.choices


def _default(parameter: ParameterSpec) -> str:
    """The default as people write it, with its SI unit; "" if there is none."""
    match parameter.default:
        case None:
            return ""
        case bool() as truth:
            return str(truth).lower()
        case float() | int() as number:
            return f"{number:g}{_unit(parameter)}"
        case text:
            return text


def _unit(parameter: ParameterSpec) -> str:
    dimension = DIMENSIONS.get(parameter.kind)
    return "" if dimension is None else f" {next(iter(UNITS[dimension]))}"


def _described(parameter: ParameterSpec) -> str:
    """Return sentences: what the parameter means, its units and bounds."""
    sentences = [parameter.doc] if parameter.doc else []
    unit = _unit(parameter)
    if unit:
        sentences.append(f"With its unit: {', '.join(UNITS[DIMENSIONS[parameter.kind]])}.")
    elif parameter.kind in _NAMES:
        sentences.append(_NAMES[parameter.kind])
    if parameter.minimum is not None:
        sentences.append(f"At least {parameter.minimum:.4g}{unit}.")
    if parameter.maximum is not None:
        sentences.append(f"At most {parameter.maximum:.4g}{unit}.")
    return " ".join(sentences)


_NAMES = {
    ParameterKind.POSITION: "A point or vehicle of the fleet, or [latitude, longitude, altitude].",
    ParameterKind.ROUTE: "A route of the fleet.",
    ParameterKind.AREA: "An area of the fleet.",
    ParameterKind.OFFSETS: "[[behind, left], ...] in metres.",
}


def _service(fleet: Fleet, name: str, editor: Editor) -> _Template:
    template = _Template(fleet, editor, "services", name, "bpmn:ServiceTask")
    template.doc = f"Call the service {name}."
    if editor is Editor.CAMUNDA:
        template.hidden({"type": "zeebe:taskDefinition", "property": "type"}, name)
    else:
        template.hidden({"type": "property", "name": "camunda:class"}, name)
    for kind, resources in (("vehicle", fleet.vehicles), ("payload", fleet.payloads)):
        if resources:
            template.ask("Whom it is for", property_name(kind, kind), kind, choices=list(resources))
    return template


def _question(fleet: Fleet, decisions: Mapping[str, str], editor: Editor) -> _Template:
    labels = ", ".join(decisions.values())
    template = _Template(fleet, editor, "questions to operators", f"Ask: {labels}", "bpmn:UserTask")
    template.doc = f"Ask an operator, who answers one of: {labels}."
    template.ask("Question", PROMPT, "question", required=True, lines=True)
    for value, label in decisions.items():
        template.ask(
            "Answers",
            property_name("decision", value),
            value,
            value=label,
            doc=f"What operators read for the answer '{value}'; empty: it is not offered.",
        )
    for name, doc in _SETTINGS.items():
        template.ask("Settings", name, name.removeprefix(PREFIX), doc=doc)
    return template


_SETTINGS = {
    STORE: "The name under which the answer is stored; user.decision if absent.",
    OPERATORS: "The role of the operators who may answer; all if absent.",
    TIMEOUT: "The time to answer, such as PT5M; afterwards the task fails with PROMPT_TIMEOUT.",
}
