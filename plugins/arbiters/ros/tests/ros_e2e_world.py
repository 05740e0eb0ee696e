"""Fleets and missions of the tests with whole programs: vehicles side by side drive north."""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from m2pem_plugin_ros.frames import to_geodetic

ORIGIN = (38.1075, -77.3192, 60.0)
APART_M = 20.0
SPEED_M_S = 5.0
BY_NAME = 'vehicle="NAME"'

NODES: Mapping[str, Mapping[str, Any]] = {
    "topics": {},
    "action": {"via": "action"},
}
ALL_WAYS: Mapping[str, Mapping[str, Any]] = {
    **NODES,
    "nav": {"driver": "nav2"},
    "base": {"driver": "base", "bounds": {"speed": "6 m/s", "acceleration": "3 m/s2"}},
}
"""A vehicle for each way in which one can be reached, by its name."""


@dataclass(frozen=True, slots=True)
class Lane:
    """Where a vehicle drives: from its home, so many metres to the north."""

    east_m: float
    length_m: float

    def position(self, north_m: float) -> tuple[float, float]:
        """Latitude and longitude, in degrees."""
        place = to_geodetic(self.east_m, north_m, 0.0, ORIGIN)
        return place.latitude_deg, place.longitude_deg


def fleet_file(
    folder: Path,
    vehicles: Mapping[str, Mapping[str, Any]],
    length_m: float,
    name: str = "fleet",
    first: int = 0,
    lost_after: str = "10 s",
    **settings: Any,
) -> Path:
    """A fleet of simulated vehicles, each at the beginning of the route that is called like it.

    `first`: the lane of the first one. `lost_after`: in simulated time; a computer with much to do
    may be busy otherwise for a second. `settings`: of the fleet.
    """
    content: dict[str, Any] = {
        "version": 1,
        "name": name,
        "origin": dict(zip(("lat", "lon", "alt"), ORIGIN, strict=True)),
        **settings,
        "vehicles": {},
        "routes": {},
    }
    for number, (vehicle, connection) in enumerate(vehicles.items(), first):
        lane = Lane(APART_M * number, length_m)
        sim = {
            "home": list(lane.position(0.0)),
            "heading": "0 deg",
            "max_speed": "6 m/s",
            "acceleration": "3 m/s2",
        }
        content["vehicles"][vehicle] = {
            "domain": "ground",
            "arbiter": "ros",
            "sitl": True,
            "lost_after": lost_after,
            "connection": {"namespace": f"/{vehicle}", "sim": sim, **connection},
        }
        content["routes"][f"route_{vehicle}"] = f"{vehicle}.geojson"
        ends = [lane.position(north_m) for north_m in (0.0, length_m)]
        line = {"type": "LineString", "coordinates": [[lon, lat] for lat, lon in ends]}
        feature = {"type": "Feature", "properties": {}, "geometry": line}
        (folder / f"{vehicle}.geojson").write_text(json.dumps(feature))
    file = folder / f"{name}.yaml"
    file.write_text(json.dumps(content))  # which is YAML, too
    return file


def convoy(
    folder: Path,
    vehicles: Iterable[str],
    *,
    again: str = "",
    name: str = "convoy",
    role: str = BY_NAME,
) -> Path:
    """A mission in which all drive their routes at the same time: `Drive_NAME` of each.

    `role`: the attributes of each role, in which NAME is that of the vehicle.
    `again`: an ISO 8601 duration; whose link is lost waits for so long (`Wait_NAME`), and then
    drives its route once more (`Again_NAME`).
    """
    parts, flows = "", [("Start", "Fork"), ("Join", "End")]
    for each in vehicles:
        parts += _drive(f"Drive_{each}", each, role) + f'<exclusiveGateway id="Merge_{each}"/>'
        flows += [("Fork", f"Drive_{each}"), (f"Drive_{each}", f"Merge_{each}")]
        flows += [(f"Merge_{each}", "Join")]
        if again:
            parts += (
                f'<boundaryEvent id="Lost_{each}" attachedToRef="Drive_{each}">'
                '<errorEventDefinition errorRef="LinkLost"/></boundaryEvent>'
                f'<intermediateCatchEvent id="Wait_{each}"><timerEventDefinition><timeDuration>'
                f"{again}</timeDuration></timerEventDefinition></intermediateCatchEvent>"
            )
            parts += _drive(f"Again_{each}", each, role)
            flows += [(f"Lost_{each}", f"Wait_{each}"), (f"Wait_{each}", f"Again_{each}")]
            flows += [(f"Again_{each}", f"Merge_{each}")]
    lines = "".join(
        f'<sequenceFlow id="{source}_{target}" sourceRef="{source}" targetRef="{target}"/>'
        for source, target in flows
    )
    file = folder / f"{name}.bpmn"
    file.write_text(
        '<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"'
        ' xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="https://m2pem.org/scenarios">'
        '<error id="LinkLost" errorCode="LINK_LOST"/>'
        '<process id="CONVOY" isExecutable="true"><startEvent id="Start"/>'
        f'<parallelGateway id="Fork"/>{parts}<parallelGateway id="Join"/><endEvent id="End"/>'
        f"{lines}</process></definitions>"
    )
    return file


def _drive(element: str, vehicle: str, role: str) -> str:
    return (
        f'<scriptTask id="{element}"><extensionElements>'
        '<m2pem:behavior type="vehicle" name="single_vehicle_routing"><m2pem:properties>'
        f'<m2pem:property name="route" value="route_{vehicle}"/>'
        f'<m2pem:property name="speed" value="{SPEED_M_S:g} m/s"/></m2pem:properties>'
        f'<m2pem:resources><m2pem:role name="driver" {role.replace("NAME", vehicle)}/>'
        "</m2pem:resources></m2pem:behavior></extensionElements></scriptTask>"
    )
