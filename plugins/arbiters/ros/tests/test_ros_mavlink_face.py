"""A ground station of MAVLink uploads a plan to a ROS rover, and has it driven."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from pymavlink import mavutil
from ros_e2e_programs import Programs

PLACES = ((38.1076, -77.3192), (38.1077, -77.3191))
WITHIN_S = 60.0
FLEET = """
version: 1
origin: {{lat: 38.1075, lon: -77.3192, alt: 60.0}}
faces:
  mavlink: {{url: "udpout://127.0.0.1:{port}", commands: all}}
vehicles:
  rover1:
    domain: ground
    arbiter: ros
    sitl: true
    connection: {{namespace: /rover1, sim: {{home: [38.1075, -77.3192]}}}}
"""


@pytest.fixture
def station() -> Iterator[Any]:
    """pymavlink, as simple programs use it."""
    made = mavutil.mavlink_connection("udpin:127.0.0.1:0", source_system=254)
    yield made
    made.close()


def wait(station: Any, *names: str, **fields: object) -> Any:
    while True:
        found = station.recv_match(type=list(names), blocking=True, timeout=WITHIN_S)
        assert found is not None, (names, fields)
        if all(getattr(found, name) == value for name, value in fields.items()):
            return found


def test_a_plan_of_a_ground_station_is_driven_by_a_ros_rover(
    m2pem: Programs, ros_domain: int, tmp_path: Path, station: Any
) -> None:
    fleet = tmp_path / "fleet.yaml"
    fleet.write_text(FLEET.format(port=station.port.getsockname()[1]))
    m2pem.simulate(fleet, 5)
    m2pem.m2pem("gateway", "--fleet", fleet, "--speed", 5)
    wait(station, "GLOBAL_POSITION_INT")
    station.mav.mission_count_send(1, 1, len(PLACES), 0)
    while (answer := wait(station, "MISSION_REQUEST_INT", "MISSION_ACK")).get_type() != (
        "MISSION_ACK"
    ):
        number = answer.seq
        x, y = (round(each * 1e7) for each in PLACES[number])
        item = (number, 3, 16, number == 0, 1, 0, 0, 0, float("nan"), x, y, 10)
        station.mav.mission_item_int_send(1, 1, *item, 0)
    assert answer.type == 0, wait(station, "STATUSTEXT").text
    station.mav.command_long_send(1, 1, 300, 0, *[0] * 7)
    begun = wait(station, "COMMAND_ACK", command=300)
    assert begun.result == 0, wait(station, "STATUSTEXT").text
    for number in range(len(PLACES)):
        wait(station, "MISSION_ITEM_REACHED", seq=number)
    wait(station, "MISSION_CURRENT", mission_state=5)
