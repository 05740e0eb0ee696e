"""An executive is stopped (SIGSTOP), its run is claimed by another, and it goes on: real UDP.

The journal is SQLite, whose lock a stopped process keeps: here the lock is ignored, as a lease that
has ended would be.
"""

import asyncio
import json
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
from mavlink_relay import Relay, free_port

from m2pem.journal.run_locks import RunLocks
from m2pem.journal.sqlite import SqliteJournal

WITHIN_S = 60
SPEED = "10"

FLEET = """
version: 1
origin: {{lat: 38.1075, lon: -77.3192, alt: 60.0}}
vehicles:
  uav1:
    domain: air
    arbiter: mavlink
    connection: {{url: "udpin://127.0.0.1:{port}", system_id: 1}}
    lost_after: 1000 s
    sitl: true
  evsg1: {{domain: ground, arbiter: sim}}
routes: {{around: around.geojson}}
"""
ROUND = [[-77.3192, 38.1080], [-77.3182, 38.1080], [-77.3182, 38.1090], [-77.3192, 38.1090]]
AROUND = {"type": "LineString", "coordinates": ROUND * 20}


def task(element: str, name: str, vehicle: str, **properties: str) -> str:
    inside = "".join(
        f'<m2pem:property name="{key}" value="{value}"/>' for key, value in properties.items()
    )
    return (
        f'<scriptTask id="{element}"><extensionElements>'
        f'<m2pem:behavior type="vehicle" name="{name}">'
        f"<m2pem:properties>{inside}</m2pem:properties><m2pem:resources>"
        f'<m2pem:role name="driver" vehicle="{vehicle}"/></m2pem:resources></m2pem:behavior>'
        "</extensionElements></scriptTask>"
    )


FLOWS = [("S", "F"), ("F", "Drive"), ("F", "Up"), ("Up", "Follow"), ("Follow", "E"), ("Drive", "E")]
MISSION = (
    '<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" targetNamespace="urn:t" '
    'xmlns:m2pem="https://m2pem.org/schema/1"><process id="P" isExecutable="true">'
    '<startEvent id="S"/><parallelGateway id="F"/><endEvent id="E"/>'
    + task("Drive", "single_vehicle_routing", "evsg1", route="around", speed="4 m/s")
    + task("Up", "takeoff", "uav1", altitude="20")
    + task("Follow", "follow", "uav1", target="evsg1")
    + "".join(f'<sequenceFlow id="{a}{b}" sourceRef="{a}" targetRef="{b}"/>' for a, b in FLOWS)
    + "</process></definitions>"
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
    fleet = FLEET.format(port=relay.ground)
    (tmp_path / "fleet.yaml").write_text(fleet, encoding="utf-8")
    (tmp_path / "around.geojson").write_text(json.dumps(AROUND), encoding="utf-8")
    (tmp_path / "m.bpmn").write_text(MISSION, encoding="utf-8")
    with ExitStack() as stack, errors.open("a") as out:

        def start(*words: object) -> "subprocess.Popen[bytes]":
            command = [sys.executable, "-m", "m2pem", *map(str, words)]
            program = subprocess.Popen(command, stdout=out, stderr=out)
            stack.callback(program.wait)
            stack.callback(program.kill)
            return program

        start(
            *("sim", "mavlink", "--copters", 1, "--speed", SPEED, "--ekf", "6s"),
            *("--home", "38.1075,-77.3192,60", "--to", f"udp://127.0.0.1:{relay.port}"),
            *("--set", "FS_GCS_ENABLE=0"),
        )
        executive = start(
            *("run", tmp_path / "m.bpmn", "--fleet", tmp_path / "fleet.yaml", "--speed", SPEED),
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
