"""kill -9, then resume: nothing that was printed is lost, and no vehicle starts anything twice."""

import json
import signal
from collections import Counter
from functools import cache
from pathlib import Path

import pytest

from m2pem.api.runs import StampedRecord
from m2pem.fleet.fleet_file import load_fleet
from m2pem.journal.codec import record_line
from m2pem.plugins import PluginManager
from m2pem.rehearsal.rehearsal import rehearse
from m2pem.simulation.executions import EffectKind
from m2pem.simulation.state_file import recorded_effects
from tests.command_line import (
    ANSWERS,
    FLEET,
    MISSION,
    CommandLine,
    Program,
    Record,
    fleet_with_state,
    install_plugin,
)

SCRIPT = ("--answers", ANSWERS / "vignette1_detection.yaml")
DYING = """
import os, signal

from m2pem.executive.control_events import RecordObservers

seen = 0
put = RecordObservers.put

def die():
    os.kill(os.getpid(), signal.SIGKILL)

def look(self, run_id, records):
    global seen
    put(self, run_id, records)
    seen += len(records)
    if seen >= int(os.environ.get("DIE_AFTER", "1000000")):
        die()
    for record in records:
        here = type(record).__name__, getattr(record, "element", "")
        if " ".join(here) == os.environ.get("DIE_AT"):
            die()

RecordObservers.put = look

if "DIE_IN" in os.environ:
    from m2pem.simulation.arbiters import SimArbiter
    begin = SimArbiter.start

    async def start(self, request):
        await begin(self, request)
        if request.behavior == os.environ["DIE_IN"]:
            die()

    SimArbiter.start = start
"""
"""Records go to observers after the commit, before anything is dispatched or printed; and when an
arbiter has started something, its report is not in the journal yet."""


def elements(records: list[Record]) -> list[tuple[str, ...]]:
    """Where tokens went, and how they left."""
    return [
        (record["record"], record["process"], record["element"], record.get("outcome", ""))
        for record in records
        if record["record"] in ("TokenEntered", "TokenLeft")
    ]


@cache
def undisturbed() -> list[tuple[str, ...]]:
    def as_record(stamped: StampedRecord) -> Record:
        line = record_line(stamped.run, stamped.seq, 0, stamped.record)
        decoded: Record = json.loads(line)
        return decoded

    result = rehearse(MISSION, load_fleet(FLEET), plugins=PluginManager(), answers=SCRIPT[1])
    return elements([as_record(stamped) for stamped in result.records])


def assert_resumed_well(m2pem: CommandLine, state: Path, printed: list[str]) -> None:
    """What a run must be like that was killed after it had printed this."""
    status, journaled, _ = m2pem.run("replay", "r1", "--format", "json")
    assert status == 0
    assert journaled.splitlines()[: len(printed)] == printed
    program = m2pem.start("resume", "r1", *SCRIPT, "--ocu", "none", "--format", "json")
    status, errors = program.rest()
    assert (status, errors) == (0, "")
    everything = m2pem.start("replay", "r1", "--format", "json")
    everything.rest()
    assert everything.lines == [*journaled.splitlines(), *program.lines]
    assert elements(everything.records) == undisturbed()
    starts = Counter(
        effect.behavior for effect in recorded_effects(state) if effect.kind is EffectKind.START
    )
    requested = [
        each["behavior"] for each in everything.records if each["record"] == "BehaviorRequested"
    ]
    assert starts == Counter(requested)
    assert m2pem.run("replay", "r1", "--verify")[0] == 0


def start(m2pem: CommandLine, fleet: Path, **environment: str) -> Program:
    return m2pem.start(
        "run", MISSION, "--fleet", fleet, "--speed", "50", "--format", "json", "--ocu", "none",
        *SCRIPT, **environment,
    )  # fmt: skip


@pytest.mark.parametrize(
    "count",
    [
        24,
        *(pytest.param(count, marks=pytest.mark.long) for count in (1, *range(5, 80, 5), 62)),
    ],
)
def test_a_run_killed_after_a_printed_record_is_resumed(
    m2pem: CommandLine, tmp_path: Path, count: int
) -> None:
    fleet, state = fleet_with_state(tmp_path)
    program = start(m2pem, fleet)
    for _ in range(count):
        program.until(lambda _: True)
    program.kill()
    assert len(program.lines) >= count
    assert_resumed_well(m2pem, state, program.lines)


@pytest.mark.parametrize(
    "moment",
    [
        {"DIE_AT": "BehaviorRequested DriveRoute"},
        {"DIE_IN": "single_vehicle_routing"},
        pytest.param({"DIE_IN": "reverse"}, marks=pytest.mark.long),
        pytest.param({"DIE_AT": "BehaviorRequested DriveStop"}, marks=pytest.mark.long),
        pytest.param({"DIE_AT": "BehaviorRequested Reverse"}, marks=pytest.mark.long),
        pytest.param({"DIE_IN": "drive_stop"}, marks=pytest.mark.long),
        *(
            pytest.param({"DIE_AFTER": str(count)}, marks=pytest.mark.long)
            for count in range(3, 85, 5)
        ),
    ],
    ids=lambda moment: " ".join(f"{key} {value}" for key, value in moment.items()),
)
def test_a_run_killed_between_its_journal_and_its_vehicles_is_resumed(
    m2pem: CommandLine, tmp_path: Path, moment: dict[str, str]
) -> None:
    fleet, state = fleet_with_state(tmp_path)
    installed = install_plugin(tmp_path, "dying", DYING)
    program = start(m2pem, fleet, **moment, **installed)
    assert program.rest()[0] == -signal.SIGKILL
    assert_resumed_well(m2pem, state, program.lines)
