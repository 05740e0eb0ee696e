"""Small missions and fleets for the tests of plugins: `run_mission(one_behavior(...), fleet(...))`.

Missions are BPMN, as `MissionControl.start` and `run_mission` take them. In each, the elements have
the ids that its docstring names; values of parameters are written as in a mission file ("2 m/s").
"""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from string import ascii_uppercase
from typing import Any
from xml.sax.saxutils import escape, quoteattr

import msgspec

from m2pem.fleet.fleet import Domain, Fleet, Payload, Vehicle
from m2pem.geo.geojson import as_geojson
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.geometry import Geometry, VehiclePosition

ORIGIN = (38.1075, -77.3192, 60.0)


def fleet(
    arbiter: str,
    connections: Mapping[str, Mapping[str, Any]],
    domain: str = "ground",
    geometries: Mapping[str, Geometry] | None = None,
) -> Fleet:
    """Vehicles, and payloads ("uav1/camera", after their vehicle), all of one arbiter.

    `connections`: what a fleet file says in `connection:`, by vehicle or payload. The origin of the
    local frame is `ORIGIN`.
    """
    vehicles: dict[ResourceId, Vehicle] = {}
    payloads: dict[ResourceId, Payload] = {}
    for name, settings in connections.items():
        resource, carrier = ResourceId(name), ResourceId(name.partition("/")[0])
        if carrier == name:
            mounted = tuple(ResourceId(key) for key in connections if key.startswith(f"{name}/"))
            vehicles[resource] = Vehicle(
                resource, Domain(domain), arbiter, settings, payloads=mounted
            )
        else:
            payloads[resource] = Payload(resource, carrier, arbiter, settings)
    return Fleet("scenario", "scenario.yaml", vehicles, payloads, {}, geometries or {}, ORIGIN)


def one_behavior(behavior: str, resource: str, **parameters: object) -> bytes:
    """Start, Task (the behavior), End."""
    return _mission(_behavior("Task", behavior, resource, parameters), "Start Task End")


def in_sequence(behavior: str, resource: str, *each: Mapping[str, object]) -> bytes:
    """Start, Task1, Task2, ..., End: the same behavior with other parameters."""
    return one_after_another(resource, *((behavior, parameters) for parameters in each))


def one_after_another(resource: str, *steps: tuple[str, Mapping[str, object]]) -> bytes:
    """Start, Task1, Task2, ..., End: behaviors with their parameters."""
    names = [f"Task{number}" for number in range(1, len(steps) + 1)]
    tasks = [
        _behavior(name, behavior, resource, parameters)
        for name, (behavior, parameters) in zip(names, steps, strict=True)
    ]
    return _mission("".join(tasks), " ".join(["Start", *names, "End"]))


def in_parallel(behavior: str, first: str, second: str, **parameters: object) -> bytes:
    """Start, Fork, Task1 and Task2 (the behavior, on two resources), Join, End."""
    tasks = _behavior("Task1", behavior, first, parameters)
    tasks += _behavior("Task2", behavior, second, parameters)
    gateways = '<parallelGateway id="Fork"/><parallelGateway id="Join"/>'
    return _mission(tasks + gateways, "Start Fork Task1 Join End", "Fork Task2 Join")


def side_by_side(*branches: tuple[str, Sequence[tuple[str, Mapping[str, object]]]]) -> bytes:
    """Start, Fork, branches, Join, End. A branch is a resource and its behaviors, one after the
    other: A1, A2, ... in the first branch, B1, B2, ... in the second."""
    elements = '<parallelGateway id="Fork"/><parallelGateway id="Join"/>'
    paths = ["Start Fork", "Join End"]
    for letter, (resource, steps) in zip(ascii_uppercase, branches, strict=False):
        names = [f"{letter}{number}" for number in range(1, len(steps) + 1)]
        for name, (behavior, parameters) in zip(names, steps, strict=True):
            elements += _behavior(name, behavior, resource, parameters)
        paths.append(" ".join(["Fork", *names, "Join"]))
    return _mission(elements, *paths)


def caught_error(behavior: str, resource: str, code: str, **parameters: object) -> bytes:
    """Start, Task, End; when Task fails with `code`, it ends at Handled instead."""
    boundary = (
        '<boundaryEvent id="Caught" attachedToRef="Task"><errorEventDefinition errorRef="Error"/>'
        '</boundaryEvent><endEvent id="Handled"/>'
    )
    error = f'<error id="Error" errorCode={quoteattr(code)}/>'
    task = _behavior("Task", behavior, resource, parameters)
    return _mission(task + boundary, "Start Task End", "Caught Handled", roots=error)


def interrupted(behavior: str, resource: str, after: str = "PT5S", **parameters: object) -> bytes:
    """Start, Task, End; after a time (ISO 8601), Task is cancelled, and it ends at Late."""
    boundary = (
        '<boundaryEvent id="Timer" attachedToRef="Task"><timerEventDefinition><timeDuration>'
        f'{after}</timeDuration></timerEventDefinition></boundaryEvent><endEvent id="Late"/>'
    )
    task = _behavior("Task", behavior, resource, parameters)
    return _mission(task + boundary, "Start Task End", "Timer Late")


def question(text: str = "Go on?", decisions: Sequence[str] = ("continue", "abort")) -> bytes:
    """Start, Question (a user task), End."""
    return _mission(_question("Question", text, decisions), "Start Question End")


def two_questions(
    first: str = "Is the road clear?",
    second: str = "Is the bridge clear?",
    decisions: Sequence[str] = ("yes", "no"),
) -> bytes:
    """Start, Fork, Question1 and Question2, Join, End: both are asked at once."""
    asked = _question("Question1", first, decisions) + _question("Question2", second, decisions)
    gateways = '<parallelGateway id="Fork"/><parallelGateway id="Join"/>'
    return _mission(asked + gateways, "Start Fork Question1 Join End", "Fork Question2 Join")


def service(class_: str, **properties: object) -> bytes:
    """Start, Service (a service task of that class), End."""
    inside = _properties(properties)
    task = (
        f'<serviceTask id="Service"><extensionElements><m2pem:service class={quoteattr(class_)}>'
        f"{inside}</m2pem:service></extensionElements></serviceTask>"
    )
    return _mission(task, "Start Service End")


def drawn(mission: bytes, **geometries: Geometry) -> bytes:
    """The same mission with geometries of its own, by name."""
    own = "".join(
        f"<m2pem:geometry name={quoteattr(name)}>"
        f"{escape(msgspec.json.encode(as_geojson(geometry)).decode())}</m2pem:geometry>"
        for name, geometry in geometries.items()
        if not isinstance(geometry, VehiclePosition)
    )
    before, start, after = mission.partition(b'<startEvent id="Start"/>')
    extensions = f"<extensionElements>{own}</extensionElements>".encode()
    return before + extensions + start + after


def _mission(elements: str, *paths: str, roots: str = "") -> bytes:
    flows = ""
    for path in paths:
        names = path.split()
        for source, target in pairwise(names):
            ends = f'id="{source}_{target}" sourceRef="{source}" targetRef="{target}"'
            flows += f"<sequenceFlow {ends}/>"
    return (
        '<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"'
        ' xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="https://m2pem.org/scenarios">'
        f'{roots}<process id="SCENARIO" isExecutable="true"><startEvent id="Start"/>{elements}'
        f'<endEvent id="End"/>{flows}</process></definitions>'
    ).encode()


def _behavior(element: str, behavior: str, resource: str, parameters: Mapping[str, object]) -> str:
    kind = "payload" if "/" in resource else "vehicle"
    return (
        f'<scriptTask id="{element}"><extensionElements>'
        f'<m2pem:behavior type="{kind}" name={quoteattr(behavior)}>'
        f"<m2pem:properties>{_properties(parameters)}</m2pem:properties>"
        f'<m2pem:resources><m2pem:role name="actor" {kind}={quoteattr(resource)}/>'
        "</m2pem:resources></m2pem:behavior></extensionElements></scriptTask>"
    )


def _properties(properties: Mapping[str, object]) -> str:
    return "".join(
        f"<m2pem:property name={quoteattr(name)} value={quoteattr(str(value))}/>"
        for name, value in properties.items()
    )


def _question(element: str, text: str, decisions: Sequence[str]) -> str:
    choices = "".join(
        f"<m2pem:decision value={quoteattr(value)} label={quoteattr(value)}/>"
        for value in decisions
    )
    return (
        f'<userTask id="{element}"><extensionElements>'
        f'<m2pem:userTask store="decision.{element}"><m2pem:prompt>{escape(text)}</m2pem:prompt>'
        f"{choices}</m2pem:userTask></extensionElements></userTask>"
    )
