"""A standby, and STOP, while a real copter and a real rover move: `m2pem sitl` and executives as
users start them, with a router between. The autopilots' own logs say what they were commanded."""

import json
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path

import mavlink_sitl
import pytest
from mavlink_kills import read_log
from mavlink_router import Router

from m2pem.api import offset
from tests.chaos.missions import FORK, process
from tests.chaos.worlds import MavlinkVehicles
from tests.command_line import CommandLine, Program
from tests.executive.conftest import task
from tests.postgres_server import postgres, postgres_url

__all__ = ["postgres", "postgres_url"]

pytestmark = [
    pytest.mark.long,
    pytest.mark.timeout(600),
    pytest.mark.sitl("M2PEM_ARDUCOPTER", "M2PEM_ARDUROVER"),
]

SPEED = "5"
LEASE_S = 3.0
WITHIN_S = 120.0
HOME = (38.1075, -77.3192)
HOLDING = {"uav1": "mode 17", "ugv1": "mode 4"}
"""BRAKE of ArduCopter and HOLD of ArduRover, in which a vehicle stays."""

FLEET = """version: 1
name: takeovers
origin: {{lat: 38.1075, lon: -77.3192, alt: 60.0}}
on_error: incident
vehicles:
  uav1: {{domain: air, arbiter: mavlink, sitl: true, lost_after: 30 s,
    connection: {{url: "{url}", system_id: 1, sitl: {{parameters: {{FS_GCS_ENABLE: 0}}}}}}}}
  ugv1: {{domain: ground, arbiter: mavlink, sitl: true, lost_after: 30 s,
    connection: {{url: "{url}", system_id: 2, sitl: {{parameters: {{FS_GCS_ENABLE: 0}}}}}}}}
"""


def _goto(element: str, vehicle: str, east_m: float) -> str:
    latitude, longitude = offset(HOME, east_m, 400.0)
    target = f'<m2pem:property name="target" value="[{latitude:.7f}, {longitude:.7f}]"/>'
    speed = '<m2pem:property name="speed" value="5 m/s"/>'
    return task(element, f"vehicle='{vehicle}'", "goto", target + speed)


MISSION = process(
    FORK
    + task("Up", "vehicle='uav1'", "takeoff", '<m2pem:property name="altitude" value="20"/>')
    + _goto("Fly", "uav1", 0.0)
    + _goto("Drive", "ugv1", 40.0),
    "S Fork Up Fly Join E",
    "Fork Drive Join",
)
"""Both are under way for 80 s, of the vehicles' clocks."""

HANGING = """
import runpy, sys
from pathlib import Path
from tests.chaos import troubles

troubles.install("cancel never returns", {arbiter!r}, Path("hangs"))
sys.argv = ["m2pem", *{words!r}]
runpy.run_module("m2pem", run_name="__main__", alter_sys=True)
"""


class World:
    """The autopilots, the router, and executives of this host, and of another one."""

    def __init__(self, folder: Path, journal: str) -> None:
        self.folder, self.journal = folder, journal
        programs = mavlink_sitl.programs_folder(folder / "bin", "arducopter", "ardurover")
        port = mavlink_sitl.free_port()
        (folder / "sitl.yaml").write_text(FLEET.format(url=f"udpin://127.0.0.1:{port}"))
        words = (
            "--ardupilot",
            programs,
            "--fleet",
            "sitl.yaml",
            "--speed",
            SPEED,
            "--keep",
            "kept",
        )
        self._sitl = subprocess.Popen(
            [sys.executable, "-m", "m2pem", "sitl", *map(str, words)],
            cwd=folder,
            stdout=subprocess.PIPE,
            text=True,
        )
        mavlink_sitl.until_ready(self._sitl)
        self.router = Router(port)
        url = f"udpout://127.0.0.1:{self.router.ground}"
        (folder / "fleet.yaml").write_text(FLEET.format(url=url))
        (folder / "m.bpmn").write_bytes(MISSION)
        self._m2pem = CommandLine(folder, {"M2PEM_LEASE_S": f"{LEASE_S:g}"})
        (folder / "elsewhere").mkdir()

    def serve(self, *more: str, hanging: bool = False) -> Program:
        """Start an executive; it serves, or stands by on another host."""
        words = [
            *("serve", "--fleet", "fleet.yaml", "--speed", SPEED, "--ocu", "none"),
            *("--format", "json", "--journal", self.journal, *more),
        ]
        if hanging:
            words = ["-c", HANGING.format(arbiter=MavlinkVehicles.arbiter, words=words)]
        elsewhere = str(self.folder / "elsewhere")
        host = {"M2PEM_RUNTIME_DIR": elsewhere, "HOME": elsewhere} if more else {}
        program = self._m2pem.start(*words, **host)
        program.until_said("standing by for" if more else "serving")
        return program

    def begin(self, owner: Program) -> None:
        """Start the mission; returns when both vehicles are under way."""
        self.run("start", "m.bpmn")
        elements: dict[str, str] = {}
        moving: set[str] = set()

        def both_move(line: str) -> bool:
            record = json.loads(line)
            if record["record"] == "BehaviorRequested":
                elements[record["behavior"]] = record["element"]
            if record["record"] == "BehaviorProgressed" and record["state"] == "RUNNING":
                moving.add(elements[record["behavior"]])
            return moving >= {"Fly", "Drive"}

        owner.until(both_move)

    def run(self, *words: str) -> None:
        """Run a command to its end."""
        status, _, errors = self._m2pem.run(*words, "--journal", self.journal)
        assert status == 0, errors

    def sent(self, since: int) -> list[object]:
        """What has reached the vehicles, without the first ones."""
        return [what for _, what in self.router.sent[since:]]

    def until_sent(self, what: object, since: int) -> None:
        """Wait until something has reached the vehicles."""
        deadline_s = time.monotonic() + WITHIN_S
        while what not in self.sent(since):
            assert time.monotonic() < deadline_s, self.router.sent
            time.sleep(0.02)

    def commanded(self) -> dict[str, list[str]]:
        """What each vehicle has accepted that moves it, and its modes, in order; ends all."""
        self.close()
        found = {}
        for vehicle in ("uav1", "ugv1"):
            logs = sorted((self.folder / "kept" / vehicle / "logs").glob("*.BIN"))
            seen = [each.what for log in logs for each in read_log(log)]
            found[vehicle] = [each for each, _ in groupby(seen)]
        return found

    def close(self) -> None:
        if self._sitl.poll() is None:
            self._m2pem.end()
            self.router.close()
            self._sitl.send_signal(signal.SIGINT)
            self._sitl.communicate()


def assert_begun_once(commanded: dict[str, list[str]]) -> None:
    """No vehicle was commanded twice to do the same, and nothing held it on its way."""
    for vehicle, found in commanded.items():
        commands = [each for each in found if each.startswith("command")]
        assert len(commands) == len(set(commands)), (vehicle, found)
        assert HOLDING[vehicle] not in found, (vehicle, found)


@pytest.fixture
def world(tmp_path: Path, postgres_url: str) -> Iterator[World]:
    made = World(tmp_path, postgres_url)
    try:
        yield made
    finally:
        made.close()


def test_a_standby_takes_over_from_a_killed_executive(world: World) -> None:
    owner, standby = world.serve(), world.serve("--standby")
    world.begin(owner)
    owner.kill()
    standby.until_record("RunClaimed", epoch=2)
    assert standby.until_record("RunEnded")["outcome"] == "completed"
    assert_begun_once(world.commanded())


def test_a_stopped_executive_moves_nothing_when_it_goes_on(world: World) -> None:
    owner, standby = world.serve(), world.serve("--standby")
    world.begin(owner)
    (stopped,) = world.router.senders()
    owner.send(signal.SIGSTOP)
    try:
        standby.until_record("RunClaimed", epoch=2)
        before = len(world.router.sent)
    finally:
        owner.send(signal.SIGCONT)
    status, errors = owner.rest()
    assert status == 1, errors
    assert f"process {standby.process.pid} on" in errors
    assert standby.until_record("RunEnded")["outcome"] == "completed"
    assert stopped not in [sender for sender, _ in world.router.sent[before:]]
    assert_begun_once(world.commanded())


def test_an_executive_that_loses_its_vehicles_keeps_them_from_its_standby(world: World) -> None:
    owner, standby = world.serve(), world.serve("--standby")
    world.begin(owner)
    world.router.cut = True
    for _ in range(2):
        owner.until_record("IncidentOpened", code="LINK_LOST")
    world.router.cut = False
    for _ in range(2):
        owner.until_record("ResourceReturned")
    world.run("stop", "r1")
    owner.until_record("RunEnded", outcome="stopped")
    owner.send(signal.SIGTERM)
    assert owner.rest()[0] == 0
    standby.until_said("serving")
    assert not standby.lines  # it has taken no run
    for vehicle, found in world.commanded().items():
        assert HOLDING[vehicle] in found, (vehicle, found)


def test_stop_reaches_a_copter_while_the_arbiter_hangs_for_a_rover(world: World) -> None:
    owner = world.serve(hanging=True)
    world.begin(owner)
    flag = world.folder / "hangs"
    flag.touch()
    before = len(world.router.sent)
    world.run("stop", "r1")
    world.until_sent(HOLDING["uav1"], before)
    assert HOLDING["ugv1"] not in world.sent(before)
    owner.until_said("ugv1 may not have received the STOP of r1")
    assert HOLDING["ugv1"] not in world.sent(before)
    flag.unlink()
    world.until_sent(HOLDING["ugv1"], before)
    owner.until_record("RunEnded", outcome="stopped")
    for vehicle, found in world.commanded().items():
        assert HOLDING[vehicle] in found, (vehicle, found)
