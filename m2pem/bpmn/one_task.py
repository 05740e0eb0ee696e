"""Missions of tasks in a row: of one task, for a behavior that is commanded from outside of a
mission, and of several, such as the plan of a ground station."""

import json
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

from lxml import etree

from m2pem.bpmn.context import MARK
from m2pem.bpmn.xml import BPMN, M2PEM
from m2pem.geo.geojson import as_geojson
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.geometry import Area, Point, Route
from m2pem.mission.mission import Mission
from m2pem.mission.values import Value

PROCESS = "ONE_TASK"
TASK = "Task"
"""Ids of the process and of its task."""

_PREFIXES: Any = {None: BPMN[1:-1], "m2pem": M2PEM[1:-1]}  # None: the default
_PARAMETER = "parameter_"


class TaskOf(NamedTuple):
    """A task: a behavior of one vehicle or payload. `parameters`: see `one_task`."""

    name: str
    kind: BehaviorType
    resource: ResourceId
    behavior: str
    parameters: Mapping[str, Value]


def one_task(
    kind: BehaviorType, resource: ResourceId, behavior: str, parameters: Mapping[str, Value]
) -> tuple[bytes, dict[str, Value]]:
    """Return the BPMN of a mission with one script task, and the data that a run of it needs.

    `parameters`: as in a mission file: a text with a unit or the name of a geometry, a number, a
    list (`[latitude, longitude]`), or a GeoJSON object. A text that a mission file would read as an
    expression becomes data.
    """
    task = TaskOf(behavior, kind, resource, behavior, parameters)
    return _mission(PROCESS, f"{behavior} of {resource}", {TASK: task}, {})


def tasks_in_a_row(
    name: str, tasks: Sequence[TaskOf], geometries: Mapping[str, Point | Route | Area]
) -> tuple[bytes, dict[str, Value]]:
    """Return the same of a mission with script tasks one after the other, `Task1`, `Task2` and so
    on. `geometries`: the mission's own, by the names by which parameters call them."""
    numbered = {f"{TASK}{number}": task for number, task in enumerate(tasks, start=1)}
    return _mission("TASKS_IN_A_ROW", name, numbered, geometries)


def _mission(
    id_: str,
    name: str,
    tasks: Mapping[str, TaskOf],
    geometries: Mapping[str, Point | Route | Area],
) -> tuple[bytes, dict[str, Value]]:
    data: dict[str, Value] = {}
    root = etree.Element(f"{BPMN}definitions", nsmap=_PREFIXES)
    root.set("targetNamespace", "https://m2pem.org/one-task")
    process = etree.SubElement(root, f"{BPMN}process", id=id_, isExecutable="true")
    process.set("name", name)
    if geometries:
        own = etree.SubElement(process, f"{BPMN}extensionElements")
        for each, geometry in geometries.items():
            drawn = etree.SubElement(own, f"{M2PEM}geometry", name=each)
            drawn.text = json.dumps(as_geojson(geometry))
    etree.SubElement(process, f"{BPMN}startEvent", id="Start")
    for task_id, task in tasks.items():
        _add_task(process, task_id, task, data)
    etree.SubElement(process, f"{BPMN}endEvent", id="End")
    for number, (source, target) in enumerate(pairwise(("Start", *tasks, "End"))):
        flow = etree.SubElement(process, f"{BPMN}sequenceFlow", id=f"Flow{number}")
        flow.set("sourceRef", source)
        flow.set("targetRef", target)
    return etree.tostring(root, xml_declaration=True, encoding="UTF-8"), data


def _add_task(process: Any, id_: str, of: TaskOf, data: dict[str, Value]) -> None:
    task = etree.SubElement(process, f"{BPMN}scriptTask", id=id_, name=of.name)
    extensions = etree.SubElement(task, f"{BPMN}extensionElements")
    commanded = etree.SubElement(extensions, f"{M2PEM}behavior", type=of.kind, name=of.behavior)
    properties = etree.SubElement(commanded, f"{M2PEM}properties")
    for name, value in of.parameters.items():
        # Within JSON these are in texts alone, where an escape is the same character.
        text = (
            value
            if isinstance(value, str)
            else json.dumps(value).replace("$", r"\u0024").replace("#", r"\u0023")
        )
        if MARK.search(text) or text.lstrip().startswith("="):
            # By number: a parameter's name may be no name of data.
            key = f"{_PARAMETER}{len(data)}"
            data[key] = value
            text = f"${{{key}}}"
        etree.SubElement(properties, f"{M2PEM}property", name=name, value=text)
    roles = etree.SubElement(commanded, f"{M2PEM}resources")
    role = {"name": "actor", str(of.kind): str(of.resource)}
    etree.SubElement(roles, f"{M2PEM}role", role)


def is_one_task(mission: Mission) -> bool:
    """Return whether a mission was made by `one_task`."""
    return [each.id for each in mission.processes] == [PROCESS]
