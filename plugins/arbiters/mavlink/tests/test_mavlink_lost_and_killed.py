"""A copter is cut off, its executive is killed, and it is back, flying on: real UDP.

Between the simulated autopilot and m2pem is a relay (`mavlink_relay`).
"""

import json
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from mavlink_copters import simulated, task, write
from mavlink_relay import Relay
from mavlink_sitl import free_port

from tests.executive.conftest import mission, sequence

SPEED = "10"
WITHIN_S = 40
AUTO = 3
"""The mode of a copter that flies its uploaded mission."""

MISSION = mission(
    sequence(
        task("Up", "takeoff", "vehicle='uav1'", altitude="20"),
        task(
            "Fly",
            "single_vehicle_routing",
            "requires='true' onLoss='reassign' wait='unlimited'",
            route="around",
            speed="4 m/s",
        ),
    )
)
"""The copter takes off and flies its route; when it is lost, it is to do the rest itself."""


class World:
    """The copter, the relay, and one executive after the other."""

    def __init__(self, folder: Path, lost_after: str) -> None:
        port = free_port()
        self.folder = folder
        write(folder, port, MISSION, lost_after=lost_after, rounds=6)
        self.relay = Relay(port)
        self.records: list[dict[str, Any]] = []
        self.errors = folder / "errors.txt"
        self._readers: list[threading.Thread] = []
        self._programs: list[subprocess.Popen[Any]] = []
        self.start(*simulated(self.relay.port, SPEED))

    def start(self, *words: object) -> subprocess.Popen[Any]:
        """Start a command of m2pem."""
        with self.errors.open("a") as errors:
            program = subprocess.Popen(
                [sys.executable, "-m", "m2pem", *map(str, words)],
                stdout=subprocess.PIPE,
                stderr=errors,
                text=True,
            )
        self._programs.append(program)
        return program

    def executive(self, *words: object) -> subprocess.Popen[Any]:
        """Start m2pem; what it prints goes to `records`."""
        options = ("--ocu", "none", "--format", "json", "--journal", self.folder / "journal.db")
        program = self.start(*words, *options)

        def read() -> None:
            for line in program.stdout or ():
                self.records.append(json.loads(line))

        self._readers.append(threading.Thread(target=read))
        self._readers[-1].start()
        return program

    def until(self, true: Callable[[], Any]) -> Any:
        """Wait for something that happens in other processes."""
        deadline_s = time.monotonic() + WITHIN_S
        while not (value := true()):
            if time.monotonic() > deadline_s:
                names = " ".join(each["record"] for each in self.records[-20:])
                said = self.errors.read_text()[-4000:]
                pytest.fail(f"{names}\n{self.relay.seen}\n{said}")
            time.sleep(0.02)
        return value

    def until_record(self, name: str, **fields: object) -> dict[str, Any]:
        """Wait until such a record is printed."""

        def those() -> list[dict[str, Any]]:
            wanted = {"record": name, **fields}.items()
            return [each for each in list(self.records) if wanted <= each.items()]

        self.until(those)
        return those()[-1]

    def close(self) -> None:
        for program in reversed(self._programs):
            program.kill()
            program.wait()
        for reader in self._readers:
            reader.join()
        for program in self._programs:
            if program.stdout is not None:
                program.stdout.close()
        self.relay.close()


@pytest.fixture
def world(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[World]:
    made = World(tmp_path, request.param)
    try:
        yield made
    finally:
        made.close()


def cut_off_and_killed(world: World, *, noticed: bool) -> int:
    """The copter is cut off on its route, and the executive killed, before or after it has noticed
    that. The next one begins while the copter is silent. Returns how much was seen by then."""
    first = world.executive("run", world.folder / "m.bpmn", "--fleet", world.folder / "fleet.yaml",
                            "--speed", SPEED)  # fmt: skip
    world.until(lambda: any(each.get("remaining") for each in world.records))
    world.relay.cut = True
    if noticed:
        world.until_record("AllocationDelayed")
    first.kill()
    first.wait()
    world.executive("resume", "r1")
    world.until_record("RunClaimed")
    if not noticed:
        world.until_record("BehaviorUnsettled")
    assert world.relay.mode == AUTO
    seen = len(world.relay.seen)
    world.relay.cut = False
    return seen


@pytest.mark.long
@pytest.mark.parametrize("deleted", [False, True])
@pytest.mark.parametrize("world", ["20 s"], indirect=True)
def test_a_copter_that_no_run_is_resumed_for_is_stopped_when_it_is_back(
    world: World, deleted: bool
) -> None:
    """Its run was stopped while it was out of reach; or its executive was killed, and the run
    deleted."""
    fleet = ("--fleet", world.folder / "fleet.yaml", "--speed", SPEED)
    first = world.executive("run", world.folder / "m.bpmn", *fleet)
    world.until(lambda: any(each.get("remaining") for each in world.records))
    world.relay.cut = True
    journal = ("--journal", world.folder / "journal.db")
    if deleted:
        first.kill()
        first.wait()
        assert world.start("runs", "--delete", "r1", "--force", *journal).wait(WITHIN_S) == 0
    else:
        world.until_record("AllocationDelayed")
        assert world.start("stop", "r1", *journal).wait(WITHIN_S) == 0
        first.wait(WITHIN_S)
    world.executive("serve", *fleet)
    world.until(lambda: "it is stopped when it is received" in world.errors.read_text())
    assert world.relay.mode == AUTO
    before = len(world.relay.seen)
    world.relay.cut = False
    world.until(lambda: "it has ended what it did before, and is free" in world.errors.read_text())
    first_seen, *_ = world.relay.seen[before:]
    assert str(first_seen[1]).startswith("mode "), world.relay.seen
    assert is_stopped(world.relay.seen[before:])
    shown = world.start("fleet", "--running", *journal)
    assert shown.stdout is not None
    assert "returned: held" in shown.stdout.read()


def is_stopped(seen: list[tuple[str, object]]) -> bool:
    """Whether the copter has left its old mission."""
    return any(what == "mode" and value != AUTO for what, value in seen)


@pytest.mark.long
@pytest.mark.parametrize("world", ["20 s"], indirect=True)
def test_a_copter_whose_loss_was_journaled_is_stopped_before_anything_else(world: World) -> None:
    before = cut_off_and_killed(world, noticed=True)
    returned = world.until_record("ResourceReturned")
    assert (returned["resource"], returned["code"]) == ("uav1", "LINK_LOST")
    first, *_ = world.relay.seen[before:]
    assert str(first[1]).startswith("mode "), world.relay.seen
    assert is_stopped(world.relay.seen[before:])
    again = world.until_record("BehaviorRequested", element="Fly", behavior="r1.b3")
    (lost,) = [each for each in world.records if each["record"] == "WorkReassigned"]
    assert again["parameters"] == lost["parameters"]
    assert world.records.index(returned) < world.records.index(again)


@pytest.mark.long
@pytest.mark.parametrize("world", ["1000 s"], indirect=True)
def test_a_copter_whose_loss_nothing_had_noticed_is_held_until_an_operator_decides(
    world: World,
) -> None:
    before = cut_off_and_killed(world, noticed=False)
    world.until(lambda: is_stopped(world.relay.seen[before:]))
    sent = [value for what, value in world.relay.seen[before:] if what == "sent"]
    assert all(str(each).startswith("mode ") for each in sent), world.relay.seen
