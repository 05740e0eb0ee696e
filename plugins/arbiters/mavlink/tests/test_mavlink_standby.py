"""A standby takes over while a copter flies a route: the copter is in a process of its own, over
UDP, and notes what it begins.

Copter and executives are connected by a router (`mavlink_router`), and an executive that is to be
cut off from its database has a proxy before it (`tests.faults.tcp_proxy`).
"""

import json
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from mavlink_copters import simulated, task, write
from mavlink_router import Router

from tests.command_line import CommandLine, Program, command_line
from tests.executive.conftest import mission, sequence
from tests.faults.tcp_proxy import TcpProxy
from tests.postgres_server import PostgresServer, postgres, postgres_url

__all__ = ["postgres", "postgres_url"]

SPEED = "10"
WITHIN_S = 60.0
LEASE_S = 2.0

MISSION = mission(
    sequence(
        task("Up", "takeoff", "vehicle='uav1'", altitude="20"),
        task("Fly", "single_vehicle_routing", "vehicle='uav1'", route="around", speed="8 m/s"),
        task("Down", "land", "vehicle='uav1'"),
    )
)

COPTER = """
import json, runpy, sys
from m2pem_plugin_mavlink.simulator.autopilot import Autopilot

notes = open("copter.jsonl", "a", buffering=1)
log_event = Autopilot.log_event

def noted(self, kind, detail=""):
    notes.write(json.dumps([kind, detail]) + "\\n")
    log_event(self, kind, detail)

Autopilot.log_event = noted
sys.argv = ["m2pem", *{words!r}]
runpy.run_module("m2pem", run_name="__main__", alter_sys=True)
"""

ELSEWHERE = """
import ctypes, runpy, socket, sys

NEW_UTS = 0x04000000
assert ctypes.CDLL(None, use_errno=True).unshare(NEW_UTS) == 0, ctypes.get_errno()
socket.sethostname("elsewhere")
sys.argv = ["m2pem", *{words!r}]
runpy.run_module("m2pem", run_name="__main__", alter_sys=True)
"""
"""An executive on a host of another name, as root: a process with a UTS namespace of its own."""


class World:
    """The copter, the router, and executives of this host, and of another one."""

    def __init__(
        self, m2pem: CommandLine, journal: str, *, speed: str = SPEED, lost_after: str = "20 s"
    ) -> None:
        self.journal = journal
        self.router = Router()
        self._m2pem = m2pem
        self._elsewhere = {
            "M2PEM_RUNTIME_DIR": str(m2pem.folder / "elsewhere"),
            "HOME": str(m2pem.folder / "elsewhere"),
        }
        (m2pem.folder / "elsewhere").mkdir()
        self.mission, self.fleet = write(
            m2pem.folder, self.router.ground, MISSION, lost_after=lost_after, rounds=2
        )
        text = self.fleet.read_text()
        self.fleet.write_text(text.replace("udpin:", "udpout:") + "on_error: incident\n")
        self._speed = speed
        words = simulated(self.router.port, speed)
        m2pem.start("-c", COPTER.format(words=words))

    def serve(self, *words: str, journal: str = "", elsewhere: bool = False) -> Program:
        """Start an executive; it is on its way, or stands by."""
        command = (
            "serve", "--fleet", self.fleet, "--speed", self._speed, "--ocu", "none",
            "--format", "json", "--journal", journal or self.journal, *words,
        )  # fmt: skip
        lease = {"M2PEM_LEASE_S": f"{LEASE_S:g}"}
        if elsewhere:
            code = ELSEWHERE.format(words=[str(each) for each in command])
            program = self._m2pem.start("-c", code, **lease, **self._elsewhere)
        else:
            program = self._m2pem.start(*command, **lease)
        program.until_said("standing by for" if words else "serving")
        return program

    def fly(self, owner: Program, journal: str = "") -> None:
        """Start the mission; returns when the copter is on its route."""
        status, _, errors = self._m2pem.run(
            "start", self.mission, "--journal", journal or self.journal
        )
        assert status == 0, errors
        owner.until(lambda line: bool(json.loads(line).get("remaining")))
        self.until(lambda: ("reached", "2") in self.noted())

    def answer(self, prompt: str, decision: str) -> None:
        """Answer a prompt, on the other host."""
        words = ("answer", "r1", prompt, decision, "--journal", self.journal)
        status, _, errors = self._m2pem.run(*words, **self._elsewhere)
        assert status == 0, errors

    def noted(self) -> list[tuple[str, str]]:
        """What the copter has begun and done, in order."""
        text = (self._m2pem.folder / "copter.jsonl").read_text()
        return [(kind, detail) for kind, detail in map(json.loads, text.splitlines())]

    def until(self, true: Callable[[], Any]) -> None:
        """Wait for something that the copter does."""
        deadline_s = time.monotonic() + WITHIN_S
        while not true():
            assert time.monotonic() < deadline_s, (self.noted(), self.router.sent)
            time.sleep(0.02)

    def close(self) -> None:
        self._m2pem.end()
        self.router.close()

    def assert_undisturbed(self) -> None:
        """The copter has taken off, flown its route and landed once, and did nothing else."""
        begun = [each for each in self.noted() if each[0] in ("takeoff", "mission", "motion")]
        assert [kind for kind, _ in begun] == ["takeoff", "mission"], self.noted()
        modes = [detail for kind, detail in self.noted() if kind == "mode"]
        assert modes == ["GUIDED", "AUTO", "LAND"], self.noted()
        assert self.noted()[-1][0] == "disarmed"


@pytest.fixture
def m2pem(tmp_path: Path) -> Iterator[CommandLine]:
    yield from command_line(tmp_path)


@pytest.mark.parametrize("kills", [True, pytest.param(False, marks=pytest.mark.long)])
def test_a_standby_takes_over_a_flying_copter_from_a_killed_executive_or_at_a_switchover(
    m2pem: CommandLine, kills: bool
) -> None:
    world = World(m2pem, "journal.db")
    try:
        owner = world.serve()
        standby = world.serve("--standby")
        world.fly(owner)
        if kills:
            owner.kill()
        else:
            assert m2pem.run("switchover", "--journal", world.journal)[0] == 0
            assert owner.rest()[0] == 0
        standby.until_record("RunClaimed", epoch=2)
        assert standby.until_record("RunEnded")["outcome"] == "completed"
        world.assert_undisturbed()
    finally:
        world.close()


@pytest.mark.long
def test_a_stopped_executive_whose_copter_flies_for_another_one_moves_it_no_more(
    m2pem: CommandLine, postgres_url: str
) -> None:
    world = World(m2pem, postgres_url)
    try:
        owner = world.serve()
        standby = world.serve("--standby", elsewhere=True)
        world.fly(owner)
        (stopped,) = world.router.senders()
        owner.send(signal.SIGSTOP)
        try:
            standby.until_record("RunClaimed", epoch=2)
            world.until(lambda: ("reached", "5") in world.noted())  # its link counts as lost by now
            before = len(world.router.sent)
        finally:
            owner.send(signal.SIGCONT)
        status, errors = owner.rest()
        assert status == 1, errors
        assert f"process {standby.process.pid} on" in errors
        assert standby.until_record("RunEnded")["outcome"] == "completed"
        assert stopped not in [sender for sender, _ in world.router.sent[before:]]
        world.assert_undisturbed()
    finally:
        world.close()


@pytest.mark.long
def test_an_executive_that_receives_no_vehicle_leaves_its_copter_to_the_standby_of_another_host(
    m2pem: CommandLine, postgres_url: str
) -> None:
    world = World(m2pem, postgres_url, speed="1", lost_after="5 s")
    try:
        owner = world.serve()
        standby = world.serve("--standby", elsewhere=True)
        world.fly(owner)
        (cut_off,) = world.router.senders()
        world.router.cut_off.add(cut_off)
        standby.until_record("RunClaimed", epoch=2)
        status, errors = owner.rest()
        assert status == 1, errors
        assert "switchover: no vehicle is received here any more" in errors
        assert f"process {standby.process.pid} on elsewhere" in errors
        world.router.cut_off.clear()
        assert standby.until_record("RunEnded")["outcome"] == "completed"
        world.assert_undisturbed()
    finally:
        world.close()


@pytest.mark.long
def test_a_standby_leaves_an_executive_alone_that_has_lost_its_copter(m2pem: CommandLine) -> None:
    world = World(m2pem, "journal.db")
    try:
        owner = world.serve()
        standby = world.serve("--standby")
        world.fly(owner)
        world.router.cut = True
        incident = owner.until_record("IncidentOpened", code="LINK_LOST")
        world.router.cut = False
        owner.until_record("ResourceReturned", resource="uav1")
        assert ("mode", "BRAKE") in world.noted()
        status, _, errors = m2pem.run(
            "resolve", "r1", incident["incident"], "end", "--journal", world.journal
        )
        assert status == 0, errors
        owner.until_record("RunEnded")
        owner.send(signal.SIGTERM)
        assert owner.rest()[0] == 0
        standby.until_said("serving")
        standby.send(signal.SIGTERM)
        assert standby.rest()[0] == 0
        assert not standby.lines  # it has taken no run
    finally:
        world.close()


@pytest.fixture
def proxy(postgres: PostgresServer) -> Iterator[TcpProxy]:
    made = TcpProxy(postgres.folder / ".s.PGSQL.5432")
    yield made
    made.close()


@pytest.mark.long
def test_an_executive_cut_off_from_its_database_holds_its_copter_before_another_one_has_it(
    m2pem: CommandLine, postgres_url: str, proxy: TcpProxy
) -> None:
    world = World(m2pem, postgres_url)
    database = postgres_url.partition("?")[0].rpartition("/")[2]
    through = f"postgresql://m2pem@127.0.0.1:{proxy.port}/{database}"
    try:
        owner = world.serve(journal=through)
        standby = world.serve("--standby", elsewhere=True)
        world.fly(owner, journal=through)
        (cut_off,) = world.router.senders()
        proxy.partitioned = True
        began_s = time.monotonic()
        standby.until_said("taking over")
        assert time.monotonic() - began_s < LEASE_S + 1.0
        before = len(world.router.sent)
        assert ("mode", "BRAKE") in world.noted()  # before the other one may command it
        prompt = standby.until_record("PromptOpened", element="Fly")
        proxy.partitioned = False
        status, errors = owner.rest()
        assert status == 1, errors
        assert "Commanded to hold: uav1" in errors
        assert f"process {standby.process.pid} on" in errors
        assert "this executive commands no vehicle any more" in errors
        assert "Nothing commands it now" not in errors
        world.answer(prompt["prompt"], "resume")
        assert standby.until_record("RunEnded")["outcome"] == "completed"
        assert cut_off not in [sender for sender, _ in world.router.sent[before:]]
        begun = [kind for kind, _ in world.noted() if kind in ("takeoff", "mission", "motion")]
        assert begun == ["takeoff", "mission", "mission"]  # the rest of the route, as was answered
    finally:
        world.close()
