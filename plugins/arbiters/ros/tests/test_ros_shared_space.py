"""A robot over ROS and a rover over MAVLink need one bridge from both sides: over DDS and UDP, in
programs of their own."""

import json
import socket
from pathlib import Path

import pytest
from m2pem_plugin_ros.frames import to_geodetic
from ros_e2e_programs import AMPLE_S, programs

ORIGIN = (38.1075, -77.3192, 60.0)
SPEED = 4.0
BRIDGE = (40.0, 60.0)


def at(east: float, north: float) -> list[float]:
    place = to_geodetic(east, north, 0.0, ORIGIN)
    return [round(place.latitude_deg, 7), round(place.longitude_deg, 7)]


def fleet_file(folder: Path, port: int) -> Path:
    west, east = BRIDGE
    ring = [
        at(*each)[::-1] for each in ((west, -10), (east, -10), (east, 10), (west, 10), (west, -10))
    ]
    (folder / "bridge.geojson").write_text(json.dumps({"type": "Polygon", "coordinates": [ring]}))
    file = folder / "fleet.yaml"
    file.write_text(
        json.dumps(
            {
                "version": 1,
                "origin": dict(zip(("lat", "lon", "alt"), ORIGIN, strict=True)),
                "vehicles": {
                    "robot": {
                        "domain": "ground",
                        "arbiter": "ros",
                        "sitl": True,
                        "lost_after": "20 s",
                        "connection": {
                            "namespace": "/robot",
                            "sim": {"home": at(0, 0), "heading": "90 deg", "max_speed": "5 m/s"},
                        },
                    },
                    "rover": {
                        "domain": "ground",
                        "arbiter": "mavlink",
                        "sitl": True,
                        "lost_after": "20 s",
                        "connection": {"url": f"udpin://127.0.0.1:{port}", "system_id": 1},
                    },
                },
                "areas": {"bridge": "bridge.geojson"},
                "shared_space": {"bridge": 1},
            }
        )
    )
    return file


def task(element: str, vehicle: str, east: float, north: float) -> str:
    return (
        f'<scriptTask id="{element}"><extensionElements>'
        '<m2pem:behavior type="vehicle" name="goto"><m2pem:properties>'
        f'<m2pem:property name="target" value="{at(east, north)}"/>'
        '<m2pem:property name="speed" value="4 m/s"/></m2pem:properties>'
        f'<m2pem:resources><m2pem:role name="doer" vehicle="{vehicle}"/></m2pem:resources>'
        "</m2pem:behavior></extensionElements></scriptTask>"
    )


def flows(*pairs: tuple[str, str]) -> str:
    return "".join(
        f'<sequenceFlow id="{a}_{b}" sourceRef="{a}" targetRef="{b}"/>' for a, b in pairs
    )


MISSION = (
    '<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" '
    'xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="t">'
    '<process id="P" isExecutable="true"><startEvent id="S"/><parallelGateway id="F"/>'
    + task("East", "robot", 110, -8)
    + task("West", "rover", 0, -8)
    + '<parallelGateway id="J"/><endEvent id="E"/>'
    + flows(("S", "F"), ("F", "East"), ("F", "West"), ("East", "J"), ("West", "J"), ("J", "E"))
    + "</process></definitions>"
)


@pytest.mark.long
@pytest.mark.timeout(4 * AMPLE_S)
def test_a_robot_and_a_rover_cross_one_bridge_one_after_the_other(
    tmp_path: Path, ros_domain: int
) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
    fleet = fleet_file(tmp_path, port)
    mission = tmp_path / "mission.bpmn"
    mission.write_text(MISSION)
    with programs(tmp_path, ros_domain) as made:
        made.simulate(fleet, SPEED)
        home = ",".join(map(str, (*at(110, 8), 60)))
        rover = made.m2pem(
            *("sim", "mavlink", "--rovers", 1, "--home", home, "--ekf", 1),
            *("--to", f"udp://127.0.0.1:{port}", "--speed", SPEED),
        )
        rover.until_line("system 1")
        run = made.m2pem(
            *("run", mission, "--fleet", fleet, "--speed", SPEED, "--format", "json"),
            *("--ocu", "none", "--journal", tmp_path / "journal.db"),
        )
        waits = run.until_record("AllocationDelayed")
        assert waits["reason"].startswith(("rover would enter bridge", "robot would enter bridge"))
        run.until_record("BehaviorEnded", count=2)
        assert run.rest() == 0, run.said
        ends = run.those("BehaviorEnded")
        assert [end["state"] for end in ends] == ["SUCCEEDED"] * 2
        first, second = run.those("BehaviorRequested")
        # The second began when the first had left the bridge, before it had ended.
        assert first["t"] + 10 < second["t"] < ends[0]["t"]
