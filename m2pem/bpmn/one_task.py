"""A mission of one task, for a behavior that is commanded from outside of a mission."""

import json
from collections.abc import Mapping
from typing import Any

from lxml import etree

from m2pem.bpmn.context import MARK
from m2pem.bpmn.xml import BPMN, M2PEM
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.mission import Mission
from m2pem.mission.values import Value

PROCESS = "ONE_TASK"
TASK = "Task"
"""Ids of the process and of its task."""

_PREFIXES: Any = {None: BPMN[1:-1], "m2pem": M2PEM[1:-1]}  # None: the default
_PARAMETER = "parameter_"


def one_task(
    kind: BehaviorType, resource: ResourceId, behavior: str, parameters: Mapping[str, Value]
) -> tuple[bytes, dict[str, Value]]:
    """Return the BPMN of a mission with one script task, and the data that a run of it needs.

    `parameters`: as in a mission file: a text with a unit or the name of a geometry, a number, a
    list (`[latitude, longitude]`), or a GeoJSON object. A text that a mission file would read as an
    expression becomes data.
    """
    data: dict[str, Value] = {}
    root = etree.Element(f"{BPMN}definitions", nsmap=_PREFIXES)
    root.set("targetNamespace", "https://m2pem.org/one-task")
    process = etree.SubElement(root, f"{BPMN}process", id=PROCESS, isExecutable="true")
    process.set("name", f"{behavior} of {resource}")
    etree.SubElement(process, f"{BPMN}startEvent", id="Start")
    task = etree.SubElement(process, f"{BPMN}scriptTask", id=TASK, name=behavior)
    extensions = etree.SubElement(task, f"{BPMN}extensionElements")
    commanded = etree.SubElement(extensions, f"{M2PEM}behavior", type=kind, name=behavior)
    properties = etree.SubElement(commanded, f"{M2PEM}properties")
    for number, (name, value) in enumerate(parameters.items()):
        # Within JSON these are in texts alone, where an escape is the same character.
        text = (
            value
            if isinstance(value, str)
            else json.dumps(value).replace("$", r"\u0024").replace("#", r"\u0023")
        )
        if MARK.search(text) or text.lstrip().startswith("="):
            # By number: a parameter's name may be no name of data.
            data[f"{_PARAMETER}{number}"] = value
            text = f"${{{_PARAMETER}{number}}}"
        etree.SubElement(properties, f"{M2PEM}property", name=name, value=text)
    roles = etree.SubElement(commanded, f"{M2PEM}resources")
    etree.SubElement(roles, f"{M2PEM}role", {"name": "actor", str(kind): str(resource)})
    etree.SubElement(process, f"{BPMN}endEvent", id="End")
    for number, (source, target) in enumerate((("Start", TASK), (TASK, "End"))):
        flow = etree.SubElement(process, f"{BPMN}sequenceFlow", id=f"Flow{number}")
        flow.set("sourceRef", source)
        flow.set("targetRef", target)
    return etree.tostring(root, xml_declaration=True, encoding="UTF-8"), data


def is_one_task(mission: Mission) -> bool:
    """Return whether a mission was made by `one_task`."""
    return [each.id for each in mission.processes] == [PROCESS]
