"""An executive is stopped (SIGSTOP), its run is claimed by another, and it goes on: real UDP.

The journal is SQLite, whose lock a stopped process keeps: here the lock is ignored, as a lease that
has ended would be.
"""

import asyncio
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
from mavlink_copters import simulated, task, write
from mavlink_relay import Relay
from mavlink_sitl import free_port

from m2pem.journal.run_locks import RunLocks
from m2pem.journal.sqlite import SqliteJournal
from tests.executive.conftest import flow, mission

WITHIN_S = 60
SPEED = "10"

FLOWS = [("S", "F"), ("F", "Drive"), ("F", "Up"), ("Up", "Follow"), ("Follow", "E"), ("Drive", "E")]
TASKS = [
    task("Drive", "single_vehicle_routing", "vehicle='evsg1'", route="around", speed="4 m/s"),
    task("Up", "takeoff", "vehicle='uav1'", altitude="20"),
    task("Follow", "follow", "vehicle='uav1'", target="evsg1"),
]
MISSION = mission(
    '<process id="P" isExecutable="true"><startEvent id="S"/><parallelGateway id="F"/>'
    f'<endEvent id="E"/>{"".join(xml for _, xml in TASKS)}'
    f"{''.join(flow(*each) for each in FLOWS)}</process>"
)


def until(true: Callable[[], Any], errors: Path) -> None:
    """Wait for something that happens in other processes."""
    deadline_s = time.monotonic() + WITHIN_S
    while not true():
        if time.monotonic() > deadline_s:
            pytest.fail(errors.read_text()[-4000:])
        time.sleep(0.02)


@pytest.fixture
def relay() -> Iterator[Relay]:
    made = Relay(free_port())
    yield made
    made.close()


async def claim(journal: Path) -> int:
    other = SqliteJournal.open(journal)
    epoch = await other.claim("r1")
    await other.close()
    return epoch


@pytest.mark.long
def test_a_stopped_executive_that_lost_its_run_sends_nothing_when_it_goes_on(
    tmp_path: Path, relay: Relay, monkeypatch: pytest.MonkeyPatch
) -> None:
    errors = tmp_path / "errors.txt"
    rover = "evsg1: {domain: ground, arbiter: sim}"
    file, fleet = write(tmp_path, relay.ground, MISSION, rover, lost_after="1000 s", rounds=20)
    with ExitStack() as stack, errors.open("a") as out:

        def start(*words: object) -> "subprocess.Popen[bytes]":
            command = [sys.executable, "-m", "m2pem", *map(str, words)]
            program = subprocess.Popen(command, stdout=out, stderr=out)
            stack.callback(program.wait)
            stack.callback(program.kill)
            return program

        start(*simulated(relay.port, SPEED))
        executive = start(
            *("run", file, "--fleet", fleet, "--speed", SPEED),
            *("--ocu", "none", "--journal", tmp_path / "journal.db"),
        )
        until(lambda: len([what for what, _ in relay.seen if what == "sent"]) > 8, errors)
        os.kill(executive.pid, signal.SIGSTOP)
        monkeypatch.setattr(RunLocks, "acquire", lambda *_: True)
        assert asyncio.run(claim(tmp_path / "journal.db")) == 2
        time.sleep(1.5)  # so long a stop is noticed
        before = len(relay.seen)
        os.kill(executive.pid, signal.SIGCONT)
        assert executive.wait(WITHIN_S) != 0
        assert "another executive" in errors.read_text()
        assert [value for what, value in relay.seen[before:] if what == "sent"] == []
