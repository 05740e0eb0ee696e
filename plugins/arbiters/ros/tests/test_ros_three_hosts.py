"""A mission of a copter and a rover on hosts of their own: links are cut, programs are killed.

Three network namespaces have the executive, the host of a simulated MAVLink copter, and the host of
a simulated ROS 2 rover, with TLS between them and DDS on the loopback of the rover's. Everything is
a process; the vehicles are, too, so that they go on when their hosts are killed.
"""

import json
import os
import sqlite3
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from bench.network import Network, make_keys
from tests.executive.conftest import flow, mission, task

pytestmark = [pytest.mark.long, pytest.mark.timeout(900)]
M2PEM = (sys.executable, "-m", "m2pem")
COPTER, ROVER = (Path(__file__).with_name(f"ros_hosts_{each}.py") for each in ("copter", "rover"))
STATION, AIR, GROUND = "station", "copter-pi", "rover-pi"
WITHIN_S = 180.0
PARTITION_S = 60.0
LOST_AFTER_S = 20
FIRST_PORT = 14_000
"""Of the ROS domain 0. A computer's vehicles are locked by addresses that no test beside has."""

FLEET = """
version: 1
name: mixed
origin: {{lat: 38.1075, lon: -77.3192, alt: 60.0}}
hosts:
  copter-pi: {{connect: ["tls/{air}:{port}"], tls: {tls}}}
  rover-pi: {{connect: ["tls/{ground}:{port}"], tls: {tls}}}
vehicles:
  uav1: {{domain: air, arbiter: mavlink, host: copter-pi, lost_after: {lost_after} s, sitl: true,
    connection: {{url: "udpout://127.0.0.1:{port}", system_id: 1}},
    when_cut_off: {{action: hold, after: 30 s}}}}
  ugv1: {{domain: ground, arbiter: ros, host: rover-pi, lost_after: {lost_after} s, sitl: true,
    connection: {{namespace: /ugv1, domain_id: {domain}}},
    when_cut_off: {{action: continue}}}}
"""


def _step(element: str, behavior: str, vehicle: str, **parameters: str) -> str:
    inside = "".join(
        f'<m2pem:property name="{key}" value="{value}"/>' for key, value in parameters.items()
    )
    return task(element, f"vehicle='{vehicle}'", behavior, inside)


def _lost(element: str) -> str:
    """What follows when the vehicle of a task is lost: its branch is over."""
    return (
        f'<boundaryEvent id="{element}Lost" attachedToRef="{element}">'
        '<errorEventDefinition errorRef="Gone"/></boundaryEvent>'
        f'<endEvent id="No{element}"/>{flow(f"{element}Lost", f"No{element}")}'
    )


def _path(*names: str) -> str:
    return "".join(flow(one, other) for one, other in pairwise(names))


MISSION = mission(
    '<error id="Gone" errorCode="LINK_LOST"/><process id="P" isExecutable="true">'
    '<startEvent id="S"/><parallelGateway id="Fork"/>'
    + _step("Up", "takeoff", "uav1", altitude="20")
    + _step("Fly", "goto", "uav1", target="[38.1102, -77.3192]", speed="4 m/s")
    + _lost("Fly")
    + _step("Down", "land", "uav1")
    + _step("Drive", "goto", "ugv1", target="[38.1098, -77.3180]", speed="4 m/s")
    + _lost("Drive")
    + '<endEvent id="Flown"/><endEvent id="Driven"/>'
    + _path("S", "Fork", "Up", "Fly", "Down", "Flown")
    + _path("Fork", "Drive", "Driven")
    + "</process>"
)
"""Copter and rover are under way for more than a minute. One that is lost does nothing more for the
mission, which goes on with the other."""


class World:
    """The hosts and what runs on them."""

    def __init__(self, folder: Path, network: Network, domain: int) -> None:
        self.network = network
        self.folder = folder
        self.records: list[dict[str, Any]] = []
        self._programs: list[subprocess.Popen[str]] = []
        self._readers: list[threading.Thread] = []
        make_keys(folder, *map(network.address, (STATION, AIR, GROUND)))
        tls = "{ca: ca.pem, certificate: link.pem, key: link.key}"
        addresses = {"air": network.address(AIR), "ground": network.address(GROUND)}
        port = FIRST_PORT + domain
        fleet = FLEET.format(
            **addresses, tls=tls, lost_after=LOST_AFTER_S, port=port, domain=domain
        )
        (folder / "fleet.yaml").write_text(fleet)
        (folder / "m.bpmn").write_bytes(MISSION)
        self.copter = self._start(AIR, sys.executable, COPTER, port)
        self.rover = self._start(GROUND, sys.executable, ROVER, domain)
        for vehicle in (self.copter, self.rover):
            self._line(vehicle)
        self.hosts = {name: self.host(name) for name in (AIR, GROUND)}

    def _start(self, where: str, *words: object) -> "subprocess.Popen[str]":
        program = subprocess.Popen(
            [*self.network.inside(where), *map(str, words)],
            cwd=self.folder,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=(self.folder / f"{where}.err").open("a"),
            text=True,
            env={**os.environ, "HOME": str(self.folder / where), "PYTHONUNBUFFERED": "1"},
        )
        self._programs.append(program)
        return program

    def _line(self, program: "subprocess.Popen[str]") -> str:
        assert program.stdout is not None
        return program.stdout.readline()

    def host(self, name: str) -> "subprocess.Popen[str]":
        """Start the program of a host; it may need a while."""
        words = (
            "arbiter-host",
            "--fleet",
            "fleet.yaml",
            "--host",
            name,
            "--state",
            f"state-{name}",
        )
        return self._start(name, *M2PEM, *words)

    def executive(self, *words: str) -> "subprocess.Popen[str]":
        """Start m2pem with a mission; what it records goes to `records`."""
        options = ("--ocu", "none", "--format", "json", "--journal", "journal.db")
        program = self._start(STATION, *M2PEM, *words, *options)

        def read() -> None:
            for line in program.stdout or ():
                self.records.append(json.loads(line))

        self._readers.append(threading.Thread(target=read))
        self._readers[-1].start()
        return program

    def begin(self) -> "subprocess.Popen[str]":
        """Start the mission; returns when both vehicles are under way."""
        for name in (AIR, GROUND):
            self.until(lambda name=name: "listens" in self.said(name))  # type: ignore[misc]
        program = self.executive("run", "m.bpmn", "--fleet", "fleet.yaml")
        self.until(lambda: {"Fly", "Drive"} <= self.running())
        return program

    def stop(self) -> None:
        words = ("stop", "r1", "--journal", "journal.db")
        self._start(STATION, *M2PEM, *words).wait(WITHIN_S)

    def said(self, where: str) -> str:
        """What the programs of a host have said to people."""
        file = self.folder / f"{where}.err"
        return file.read_text() if file.exists() else ""

    def of(self, name: str) -> list[dict[str, Any]]:
        """The records of a name so far."""
        return [each for each in list(self.records) if each["record"] == name]

    def running(self) -> set[str]:
        """The tasks whose behaviors have been reported as RUNNING."""
        elements = {each["behavior"]: each["element"] for each in self.of("BehaviorRequested")}
        told = [each for each in self.of("BehaviorProgressed") if each["state"] == "RUNNING"]
        return {elements[each["behavior"]] for each in told}

    def ends(self) -> dict[str, tuple[str, str]]:
        """State and code of the ends of behaviors, by their task."""
        return {each["element"]: (each["state"], each["code"]) for each in self.of("BehaviorEnded")}

    def flown(self) -> tuple[int, int, int, float]:
        """Takeoffs, motions and missions that the copter has begun, and its speed in m/s."""
        takeoffs, motions, missions, speed = self._ask(self.copter)
        return int(takeoffs), int(motions), int(missions), float(speed)

    def driven(self) -> tuple[int, float]:
        """How often the rover has begun to move, and its speed in m/s."""
        motions, speed = self._ask(self.rover)
        return int(motions), float(speed)

    def _ask(self, vehicle: "subprocess.Popen[str]") -> list[str]:
        assert vehicle.stdin is not None
        vehicle.stdin.write("\n")
        vehicle.stdin.flush()
        return self._line(vehicle).split()

    def until(self, true: Callable[[], Any], within_s: float = WITHIN_S) -> None:
        """Wait for something that happens in other processes."""
        deadline_s = time.monotonic() + within_s
        while not true():
            if time.monotonic() > deadline_s:
                names = [(each["record"], each.get("element")) for each in self.records[-30:]]
                said = {name: self.said(name)[-3000:] for name in (STATION, AIR, GROUND)}
                pytest.fail(f"{names}\n{self.flown()}\n{self.driven()}\n{said}")
            time.sleep(0.05)

    def ended(self, outcome: str) -> None:
        """Wait for the end of the run; check that all was begun and reported once."""
        self.until(lambda: self.of("RunEnded"))
        assert self.of("RunEnded")[0]["outcome"] == outcome, self.of("RunEnded")
        with sqlite3.connect(self.folder / "journal.db") as journal:
            assert journal.execute("PRAGMA integrity_check").fetchone() == ("ok",)
        told = Counter((each["behavior"], each["number"]) for each in self.of("BehaviorProgressed"))
        ended = Counter(each["behavior"] for each in self.of("BehaviorEnded"))
        assert set(told.values()) | set(ended.values()) == {1}, (told, ended)
        assert self.flown()[:3] == (1, 1, 0), "takeoff and goto are begun once"
        assert self.driven()[0] == 1, "goto is begun once"

    def close(self) -> None:
        for program in reversed(self._programs):
            program.kill()
            program.wait()
        for reader in self._readers:
            reader.join()
        for program in self._programs:
            for pipe in (program.stdin, program.stdout):
                assert pipe is not None
                pipe.close()


@pytest.fixture
def world(tmp_path: Path, ros_domain: int) -> Iterator[World]:
    with Network(STATION, AIR, GROUND) as network:
        made = World(tmp_path, network, ros_domain)
        try:
            yield made
        finally:
            made.close()


@pytest.mark.parametrize("cut_off", [(AIR,), (GROUND,), (AIR, GROUND)], ids="+".join)
def test_a_partition_ends_the_work_of_who_is_lost_and_of_nobody_else(
    world: World, cut_off: tuple[str, ...]
) -> None:
    world.begin()
    began_s = time.monotonic()
    for host in cut_off:
        world.network.link(STATION, host).cut = True
    lost = {AIR: "Fly", GROUND: "Drive"}
    world.until(lambda: {lost[host] for host in cut_off} <= world.ends().keys())
    for host in cut_off:
        assert world.ends()[lost[host]] == ("LOST", "LINK_LOST")
    world.until(lambda: time.monotonic() - began_s > PARTITION_S)
    for host in cut_off:
        world.network.link(STATION, host).cut = False
    world.ended("completed")
    entered = {each["element"] for each in world.of("TokenEntered")}
    for host, element in lost.items():
        assert (f"No{element}" in entered) == (host in cut_off)
        if host not in cut_off:
            assert world.ends()[element][0] == "SUCCEEDED"
    assert "held" in world.said(AIR) or AIR not in cut_off


@pytest.mark.parametrize("killed", [AIR, GROUND])
def test_a_killed_host_is_started_again_and_its_behavior_goes_on(world: World, killed: str) -> None:
    world.begin()
    world.hosts[killed].kill()
    world.hosts[killed].wait()
    world.host(killed)
    world.ended("completed")
    assert {state for state, _ in world.ends().values()} == {"SUCCEEDED"}, world.ends()


def test_a_killed_executive_is_resumed_and_finds_its_behaviors_going_on(world: World) -> None:
    first = world.begin()
    first.kill()
    first.wait()
    world.executive("resume", "r1")
    world.ended("completed")
    assert {state for state, _ in world.ends().values()} == {"SUCCEEDED"}, world.ends()


@pytest.mark.parametrize("cut_off", [(AIR,), (GROUND,), (AIR, GROUND)], ids="+".join)
def test_a_stop_reaches_who_can_be_reached_and_names_at_once_who_cannot(
    world: World, cut_off: tuple[str, ...]
) -> None:
    world.begin()
    for host in cut_off:
        world.network.link(STATION, host).cut = True
    world.stop()
    vehicles = {AIR: "uav1", GROUND: "ugv1"}
    for host, vehicle in vehicles.items():
        text = f"{vehicle} may not have received the STOP of r1: its arbiter on {host}"
        if host in cut_off:
            world.until(lambda text=text: text in world.said(STATION), 10)  # type: ignore[misc]
        else:
            assert text not in world.said(STATION)
    speed_of = {AIR: lambda: world.flown()[3], GROUND: lambda: world.driven()[1]}
    for host in vehicles.keys() - set(cut_off):
        world.until(lambda host=host: speed_of[host]() < 0.3)  # type: ignore[misc]
    for host in cut_off:
        world.network.link(STATION, host).cut = False
    world.until(lambda: max(speed() for speed in speed_of.values()) < 0.3)
    world.ended("stopped")
