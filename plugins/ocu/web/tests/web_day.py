"""The world of an operator's day: a fleet of 20 simulated vehicles and its missions."""

import json
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

HOME = "[38.1075, -77.3192]"
FAR = "[38.3, -77.3]"
"""More than 20 km away: who drives there is on the way all day."""

PERSON = [38.1085, -77.3185]
"""Where a person is, in the field that uav01 surveys."""

ORIGIN = {"lat": 38.1075, "lon": -77.3192, "alt": 60.0}
GROUND = [f"ugv{number:02}" for number in range(1, 13)]
AIR = [f"uav{number:02}" for number in range(1, 9)]
VEHICLES = [*GROUND, *AIR]
LOST = "uav02"
"""Its link is cut while it flies to the place that it shall circle."""

FAULTS = {
    "ugv01": ["goto: fail ROUTE_BLOCKED at 5 s"],
    LOST: ["orbit: cut link at 20 s"],
}

FIELD = {
    "type": "Feature",
    "properties": {"name": "field"},
    "geometry": {
        "type": "Polygon",
        "coordinates": [
            [
                [-77.3206, 38.108],
                [-77.3178, 38.108],
                [-77.3178, 38.11],
                [-77.3206, 38.11],
                [-77.3206, 38.108],
            ]
        ],
    },
}


def write_fleet(folder: Path) -> Path:
    """Write the fleet file; JSON is YAML."""
    (folder / "field.geojson").write_text(json.dumps(FIELD), encoding="utf-8")
    path = folder / "fleet.yaml"
    vehicles = {name: _vehicle(name, place) for place, name in enumerate(VEHICLES)}
    fleet = {
        "version": 1,
        "name": "day",
        "origin": ORIGIN,
        "max_outage": "12 h",
        "on_error": "incident",
        "hand_over": {"answer_within": "1 h"},
        "vehicles": vehicles,
        "areas": {"field": "field.geojson"},
    }
    path.write_text(json.dumps(fleet, indent=1), encoding="utf-8")
    return path


def _vehicle(name: str, place: int) -> Mapping[str, Any]:
    air = name in AIR
    home = [38.1075 - 0.0002 * (place // 5), -77.3192 + 0.0003 * (place % 5)]
    connection: dict[str, Any] = {"home": home, "endurance": "100 h"}
    if faults := FAULTS.get(name):
        connection["faults"] = faults
    made: dict[str, Any] = {
        "domain": "air" if air else "ground",
        "arbiter": "sim",
        "connection": connection,
    }
    if air:
        connection["altitude"] = "30 m"
        made["failsafe"] = "return_to_launch"
    if name == "uav01":
        found = {"type": "person", "position": PERSON}
        camera = {"kind": "camera", "range": "40 m", "targets": [found]}
        made["payloads"] = {"camera": {"detector": True, "connection": camera}}
    return made


def write_missions(folder: Path) -> None:
    """Write the missions of the day."""
    drive = {name: _behavior(name, f"Drive {name}", "goto", name, target=FAR) for name in GROUND}
    missions = {
        "sweep": _sweep(),
        "delivery": _process(drive["ugv01"], "S ugv01 E"),
        "collection": _process(drive["ugv01"], "S ugv01 E"),
        "night watch": _process(
            drive["ugv02"] + drive["ugv03"] + '<parallelGateway id="F"/><endEvent id="E2"/>',
            "S F ugv02 E",
            "F ugv03 E2",
        ),
    }
    for name, text in missions.items():
        (folder / f"{name}.bpmn").write_text(text, encoding="utf-8")


def _sweep() -> str:
    survey = _behavior(
        "Survey", "Survey the field", "area_survey", "uav01", area="field", altitude="30 m"
    )
    look = (
        '<subProcess id="Look" name="Look for persons"><startEvent id="S1"/>'
        f'<parallelGateway id="F1"/>{survey}<endEvent id="Done"><terminateEventDefinition/>'
        '</endEvent><serviceTask id="Watch" name="Watch"><extensionElements>'
        '<m2pem:service class="Detector"><m2pem:resources>'
        '<m2pem:role name="camera" payload="uav01/camera"/></m2pem:resources></m2pem:service>'
        '</extensionElements></serviceTask><endEvent id="Found">'
        '<escalationEventDefinition escalationRef="Person"/></endEvent>'
        f"{_flows('S1 F1 Survey Done', 'F1 Watch Found')}</subProcess>"
        '<boundaryEvent id="Seen" attachedToRef="Look">'
        '<escalationEventDefinition escalationRef="Person"/></boundaryEvent>'
    )
    ask = (
        '<userTask id="Ask" name="Ask about the person"><extensionElements><m2pem:userTask>'
        "<m2pem:prompt>A person is in the field. Fly home?</m2pem:prompt>"
        '<m2pem:decision value="home" label="Fly home"/>'
        '<m2pem:decision value="wait" label="Wait there"/></m2pem:userTask></extensionElements>'
        '</userTask><boundaryEvent id="Late" attachedToRef="Ask"><timerEventDefinition>'
        "<timeDuration>PT2H</timeDuration></timerEventDefinition></boundaryEvent>"
    )
    rest = (
        _behavior("Hold", "Hold at the person", "hold", "uav01")
        + _behavior("Relay", "Relay the radio", "orbit", LOST, target=FAR, altitude="40 m")
        + _behavior("Home", "Fly home", "goto", "uav01", target=HOME)
        + '<parallelGateway id="F"/>'
        + "".join(f'<endEvent id="E{number}"/>' for number in (1, 2, 3))
    )
    return _process(
        look + ask + rest,
        "S F Look E",
        "F Relay E1",
        "Seen Hold Ask Home E2",
        "Late E3",
        roots='<escalation id="Person" name="Person" escalationCode="PERSON"/>',
    )


def _process(elements: str, *paths: str, roots: str = "") -> str:
    return (
        '<?xml version="1.0" encoding="UTF-8"?>'
        '<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"'
        ' xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="https://m2pem.org/day">'
        f'{roots}<process id="DAY" isExecutable="true"><startEvent id="S"/>{elements}'
        f'<endEvent id="E"/>{_flows(*paths)}</process></definitions>'
    )


def _flows(*paths: str) -> str:
    return "".join(
        f'<sequenceFlow id="{source}_{target}" sourceRef="{source}" targetRef="{target}"/>'
        for path in paths
        for source, target in pairwise(path.split())
    )


def _behavior(element: str, title: str, behavior: str, vehicle: str, **parameters: str) -> str:
    properties = "".join(
        f'<m2pem:property name="{name}" value="{value}"/>' for name, value in parameters.items()
    )
    return (
        f'<scriptTask id="{element}" name="{title}"><extensionElements>'
        f'<m2pem:behavior type="vehicle" name="{behavior}">'
        f"<m2pem:properties>{properties}</m2pem:properties><m2pem:resources>"
        f'<m2pem:role name="actor" vehicle="{vehicle}"/></m2pem:resources></m2pem:behavior>'
        "</extensionElements></scriptTask>"
    )
