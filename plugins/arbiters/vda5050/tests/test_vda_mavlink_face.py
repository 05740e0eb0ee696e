"""A ground station of MAVLink uploads a plan to an automated guided vehicle, and has it driven."""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pymavlink import mavutil
from ruamel.yaml import YAML
from vda_world import (
    AMPLE_S,
    Judge,
    Mosquitto,
    SimProcess,
    child_environment,
    connection,
    free_port,
    write_fleet,
)

from tests.command_line import CommandLine

SPEED = 6.0
PLACES = ((38.1076, -77.3192), (38.1077, -77.3191))
START, TAKEOFF, WAYPOINT = 300, 22, 16


class Station:
    """A ground station on a port, as simple programs of pymavlink are."""

    def __init__(self, port: int) -> None:
        self._link = mavutil.mavlink_connection(f"udpin:127.0.0.1:{port}", source_system=254)
        self.mav = self._link.mav

    def wait(self, *names: str, that: Callable[[Any], bool] = lambda _: True) -> Any:
        found = self._link.recv_match(
            type=list(names), condition=None, blocking=True, timeout=AMPLE_S
        )
        while found is not None and not that(found):
            found = self._link.recv_match(type=list(names), blocking=True, timeout=AMPLE_S)
        assert found is not None, names
        return found

    def upload(self, *commands: int) -> int:
        """Upload items of these commands; MAV_MISSION_RESULT."""
        self.mav.mission_count_send(1, 1, len(commands), 0)
        while True:
            answer = self.wait("MISSION_REQUEST_INT", "MISSION_ACK")
            if answer.get_type() == "MISSION_ACK":
                return int(answer.type)
            number = answer.seq
            x, y = (round(each * 1e7) for each in PLACES[number])
            item = (number, 3, commands[number], number == 0, 1, 0, 0, 0, float("nan"), x, y, 10)
            self.mav.mission_item_int_send(1, 1, *item, 0)

    def close(self) -> None:
        self._link.close()


def test_a_plan_of_a_ground_station_is_driven_by_an_agv(
    broker: Mosquitto, judge: Judge, tmp_path: Path
) -> None:
    port = free_port()
    fleet = write_fleet(tmp_path / "fleet.yaml", {"agv1": connection(broker.url, "agv1")})
    yaml = YAML()
    contents = yaml.load(fleet)
    contents["faces"] = {"mavlink": {"url": f"udpout://127.0.0.1:{port}", "commands": "all"}}
    yaml.dump(contents, fleet)
    sim, station = SimProcess(fleet, SPEED), Station(port)
    command_line = CommandLine(tmp_path, child_environment(tmp_path))
    words = ("gateway", "--fleet", fleet, "--speed", f"{SPEED:g}")
    command_line.start_other(sys.executable, "-m", "m2pem", *words)
    try:
        station.wait("GLOBAL_POSITION_INT")
        assert station.upload(TAKEOFF, WAYPOINT) == 3  # MAV_MISSION_UNSUPPORTED
        station.wait("STATUSTEXT", that=lambda each: "item 0: agv1 has no takeoff" in each.text)
        assert station.upload(WAYPOINT, WAYPOINT) == 0
        station.mav.command_long_send(1, 1, START, 0, *[0] * 7)
        assert station.wait("COMMAND_ACK", that=lambda each: each.result != 5).result == 0
        for number in range(2):
            station.wait("MISSION_ITEM_REACHED", that=lambda each, n=number: each.seq == n)  # type: ignore[misc]
        station.wait("MISSION_CURRENT", that=lambda each: each.mission_state == 5)
        assert judge.of("order", "agv1")
    finally:
        station.close()
        command_line.end()
        sim.close()
