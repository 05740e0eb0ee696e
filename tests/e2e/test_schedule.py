"""The schedule of a real executive: kills, restarts, the queue, and the commands for it."""

import json
import time
from collections.abc import Mapping
from datetime import UTC, datetime, timedelta
from pathlib import Path
from types import MappingProxyType
from typing import Any

import pytest

from m2pem.control_socket.client import ask
from m2pem.control_socket.paths import live_sockets
from m2pem.testing import scenarios
from tests.command_line import FLEET, MISSION, CommandLine, Program, install_plugin
from tests.each_case import failures
from tests.faults import Faults

JOURNAL = ("--journal", "journal.db")
SPEED = "20"

DYING = """
import os, signal

from m2pem.engine.inputs import StartRun
from m2pem.journal.sqlite import SqliteJournal

create, append = SqliteJournal.create, SqliteJournal.append

def die_at(place):
    if os.environ.get("DIE_AT") == place:
        os.kill(os.getpid(), signal.SIGKILL)

async def creating(self, header, started=None):
    die_at("before the run is created")
    run = await create(self, header, started)
    die_at("after the run is created")
    return run

async def appending(self, entries):
    await append(self, entries)
    if any(isinstance(each.input, StartRun) for each in entries):
        die_at("after the run has begun")

SqliteJournal.create, SqliteJournal.append = creating, appending
"""


READS_LATE = """
import asyncio, os

from m2pem.executive.executive import Executive

load = Executive.load_schedule

async def late(self):
    while not os.path.exists("read"):
        await asyncio.sleep(0.01)
    await load(self)

Executive.load_schedule = late
"""
"""A plugin whose executive serves operators, and reads its schedule when a file is there."""


def serving(
    m2pem: CommandLine,
    *more: str,
    fleet: Path = FLEET,
    environment: Mapping[str, str] = MappingProxyType({}),
) -> Program:
    program = m2pem.start(
        "serve", "--fleet", fleet, "--ocu", "none", *JOURNAL, *more, **environment
    )
    while "serving" not in program.stderr.readline():
        assert program.process.poll() is None
    return program


def told(program: Program, wanted: str) -> str:
    """Wait until the executive says it."""
    for line in program.stderr:
        if wanted in line:
            return line
    raise AssertionError(f"it ended before it said {wanted!r}")


def entry(m2pem: CommandLine, number: str) -> dict[str, Any]:
    status, printed, errors = m2pem.run("schedule", "show", number, *JOURNAL, "--format", "json")
    assert status == 0, errors
    found: dict[str, Any] = json.loads(printed)
    return found


def runs(m2pem: CommandLine) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = json.loads(m2pem.run("runs", *JOURNAL, "--format", "json")[1])
    return found


@pytest.mark.parametrize(
    ("place", "run"),
    [
        ("before the run is created", "r1"),
        ("after the run is created", "r2"),
        ("after the run has begun", "r1"),
    ],
)
def test_an_executive_that_is_killed_as_it_starts_a_mission_starts_it_once(
    m2pem: CommandLine, tmp_path: Path, place: str, run: str
) -> None:
    dying = install_plugin(tmp_path, "dying", DYING)
    server = serving(m2pem, "--speed", SPEED, environment={"DIE_AT": place, **dying})
    # The executive may be killed before its answer is sent.
    answered = m2pem.run("start", MISSION, *JOURNAL, "--when", "free")[:2]
    assert answered in ((0, "s1\n"), (1, ""))
    assert server.process.wait() == -9
    again = serving(m2pem, "--speed", SPEED)
    while "asks" not in m2pem.run("replay", run, *JOURNAL)[1]:
        assert again.process.poll() is None
    assert [each["run"] for each in runs(m2pem)] == [run]
    found = entry(m2pem, "s1")
    assert (found["status"], found["run"]) == ("ended", run)
    assert [each["settlement"] for each in found["times"]] == ["started"]


def test_two_entries_for_one_rover_run_one_after_the_other_by_priority(
    m2pem: CommandLine, tmp_path: Path
) -> None:
    reverse = tmp_path / "reverse.bpmn"
    reverse.write_bytes(scenarios.in_sequence("reverse", "evsg1", {"distance": "20 m"}))
    server = serving(m2pem, "--speed", SPEED)
    assert m2pem.run("start", MISSION, *JOURNAL)[:2] == (0, "r1\n")
    for number, priority in (("s1", "0"), ("s2", "5")):
        started = m2pem.run(
            "start", reverse, *JOURNAL, "--when", "free", "--priority", priority, "--by", "ada"
        )
        assert started == (0, f"{number}\n", "")
    assert "evsg1: r1 uses it" in m2pem.run("schedule", *JOURNAL)[1]
    assert m2pem.run("stop", "r1", *JOURNAL)[0] == 0
    while [each["status"] for each in runs(m2pem)] != ["stopped", "completed", "completed"]:
        assert server.process.poll() is None
    _, first, second = runs(m2pem)
    assert "started by s2, scheduled by ada" in m2pem.run("replay", "r2", *JOURNAL)[1]
    assert first["ended_us"] <= second["started_us"]


@pytest.mark.parametrize("standby", [False, True], ids=["restart", "standby"])
def test_stop_of_all_counts_before_the_schedule_is_read(
    m2pem: CommandLine, tmp_path: Path, standby: bool
) -> None:
    reverse = tmp_path / "reverse.bpmn"
    reverse.write_bytes(scenarios.in_sequence("reverse", "evsg1", {"distance": "20 m"}))
    late, read = install_plugin(tmp_path, "late", READS_LATE), tmp_path / "read"
    read.touch()
    killed = serving(m2pem, environment=late)
    until_served(tmp_path / "journal.db", killed)
    words = ("serve", "--fleet", FLEET, "--ocu", "none", *JOURNAL)
    if standby:
        server = m2pem.start(*words, "--standby", **late)
        server.until_said("standing by for")
    assert m2pem.run("start", MISSION, *JOURNAL)[:2] == (0, "r1\n")
    assert m2pem.run("start", reverse, *JOURNAL, "--when", "free")[:2] == (0, "s1\n")
    read.unlink()
    killed.kill()
    if not standby:
        server = m2pem.start(*words, **late)
    server.until_said("serving")
    stopped = m2pem.run("stop", "--all", *JOURNAL, "--by", "bob")[1]
    assert stopped.startswith("stopped: r1\nthe schedule is held"), stopped
    read.touch()
    until_served(tmp_path / "journal.db", server)
    while [each["status"] for each in runs(m2pem)] != ["stopped"]:
        assert server.process.poll() is None
    assert entry(m2pem, "s1")["status"] == "held"
    server.kill()
    again = serving(m2pem, environment=late)
    until_served(tmp_path / "journal.db", again)
    assert "held by bob: STOP of all" in m2pem.run("schedule", *JOURNAL)[1]
    assert [each["status"] for each in runs(m2pem)] == ["stopped"]
    assert m2pem.run("schedule", "release", *JOURNAL)[0] == 0
    while len(runs(m2pem)) < 2:
        assert again.process.poll() is None
    assert entry(m2pem, "s1")["run"] == "r2"


def until_served(journal: Path, program: Program) -> None:
    """Wait until an executive starts what is scheduled."""
    while program.process.poll() is None:
        for path in live_sockets(journal):
            if int(path.stem) == program.process.pid and ask(path, "scheduled")["served"]:
                return


NORTH = """\
version: 1
name: north
origin: {{lat: 38.1, lon: -77.3, alt: 0.0}}
vehicles:
  {0}: {{domain: ground, arbiter: sim, connection: {{home: [38.1, -77.3]}}}}
"""


def test_two_executives_of_a_fleet_hold_and_release_its_schedule_together(
    m2pem: CommandLine, tmp_path: Path
) -> None:
    """Their files name other vehicles: else the second one is refused."""
    journal = tmp_path / "journal.db"
    reverse = tmp_path / "reverse.bpmn"
    reverse.write_bytes(scenarios.in_sequence("reverse", "ugv1", {"distance": "20 m"}))
    programs = []
    for vehicle in ("ugv1", "ugv2"):
        (tmp_path / f"{vehicle}.yaml").write_text(NORTH.format(vehicle))
        program = serving(m2pem, "--speed", SPEED, fleet=tmp_path / f"{vehicle}.yaml")
        programs.append(program)
        until_served(journal, program)
        if vehicle == "ugv1":
            cron = ("--cron", "0 8 * * *", "--time-zone", "UTC")
            assert m2pem.run("start", reverse, *JOURNAL, *cron)[:2] == (0, "s1\n")
    sockets = {int(path.stem): path for path in live_sockets(journal)}
    first, second = (sockets[program.process.pid] for program in programs)

    def hold_at(path: Path) -> str:
        hold: str = ask(path, "scheduled")["hold"]
        return hold

    ask(second, "hold_schedule", by="anna", reason="rain")
    while hold_at(first) != "held by anna: rain":
        assert programs[0].process.poll() is None
    ask(first, "release_schedule", by="bob")
    while hold_at(second):
        assert programs[1].process.poll() is None
    assert [each["entry"] for each in ask(second, "scheduled")["entries"]] == ["s1"]
    on = ("--run-on", str(programs[0].process.pid))
    assert m2pem.run("start", reverse, *JOURNAL, "--when", "free", *on)[:2] == (0, "s2\n")
    while len(ask(second, "scheduled")["entries"]) < 2:
        assert programs[1].process.poll() is None
    while (found := entry(m2pem, "s2"))["status"] != "ended":
        assert programs[0].process.poll() is None
    assert [each["run"] for each in runs(m2pem)] == [found["run"]]
    assert [each["settlement"] for each in found["times"]] == ["started"]
    assert m2pem.run("schedule", "hold", *JOURNAL)[0] == 0
    assert m2pem.run("schedule", "release", *JOURNAL)[0] == 0
    ask(second, "unschedule", entry="s1", by="anna")
    while "scheduled" in {each["status"] for each in ask(first, "scheduled")["entries"]}:
        assert programs[0].process.poll() is None


IMPOSSIBLE = [
    (("--when", "tomorrow"), 1, "at (--when): 'tomorrow' is no date and time such as 2026-"),
    (("--when", "25:00"), 1, "at (--when): 25:00 is no time of a day such as 08:00"),
    (("--when", "2020-01-01T08:00"), 1, "give a later one"),
    (("--when", ""), 2, "--when: it is empty: give a value, or leave it out"),
    (("--cron", "99 8 * * *"), 1, "cron: bad minute"),
    (("--cron", "a b c d e"), 1, "write for example '0 8 * * MON-FRI': minute, hour, day"),
    (("--cron", "0 8 * *"), 1, "cron: a cron text has 5, 6 (seconds first) or 7 fields"),
    (("--cron", " "), 2, "--cron: it is empty"),
    (("--cron", "0 8 * * *", "--when", "free"), 2, "--when and --cron: give one of them"),
    (
        ("--when", "08:00", "--time-zone", "Mars/Base"),
        1,
        "time zone: there is no 'Mars/Base'; they",
    ),
    (("--when", "free", "--time-zone", "Mars/Base"), 1, "are named as Europe/Berlin or UTC"),
    (("--when", "2099-02-01T08:00", "--until", "2099-01-01"), 1, "until: nothing can start until"),
    (("--until", "later"), 1, "until: 'later' is no date and time such as 2026-"),
    (("--after", "r99"), 1, "after: there is no run and no entry of the schedule 'r99'"),
    (("--after", "r99", "--cron", "0 8 * * *"), 1, "give a date, or none"),
    (("--outcome", "failed"), 1, "(--outcome) go with after: name the run"),
    (("--outcome", "done"), 2, "'--outcome': 'done' is not one of 'completed', 'terminated'"),
    (("--condition", "vehicle.batery > 0.9"), 1, "condition: 'vehicle.batery' is no fact"),
    (("--condition", "vehicle.battery >"), 1, "write for example vehicle.battery > 0.9"),
    (("--condition", "3"), 1, "condition: a condition takes true or false, not the number 3"),
    (("--condition", "vehicle.tags + 1 == 2"), 1, "condition: '+' takes two numbers"),
    (("--condition", "vehicle.domain == 'air'"), 1, "never holds of evsg1: change it, or name"),
    (("--condition", ""), 2, "--condition: it is empty"),
    (
        ("--condition", "vehicle.armed", "--of", "evsg9"),
        1,
        "vehicles (--of): the fleet has no 'evsg9'",
    ),
    (("--of", "evsg1"), 1, "vehicles (--of) and a time to hold (held_for_s, --held-for) go with"),
    (("--held-for", "30 s"), 1, "go with a condition: give one"),
    (("--held-for", "3 m"), 2, "'--held-for': '3 m' is a distance, not a duration"),
    (
        ("--starting-deadline", "soon"),
        2,
        "'--starting-deadline': 'soon' is not a number with a unit",
    ),
    (("--priority", "1.5"), 2, "'--priority': '1.5' is not a valid integer"),
    (("--missed", "never"), 2, "'--missed': 'never' is not one of 'skip', 'run-once'"),
    (("--concurrency", "queue"), 2, "'--concurrency': 'queue' is not one of 'forbid', 'allow'"),
]
"""Options that make no sense, the exit status, and what is said of it."""


def test_what_makes_no_sense_is_refused_and_nothing_is_scheduled(m2pem: CommandLine) -> None:
    serving(m2pem)

    def is_refused(case: tuple[tuple[str, ...], int, str]) -> None:
        options, wanted, said = case
        status, printed, errors = m2pem.run("start", MISSION, *JOURNAL, *options)
        assert (status, printed) == (wanted, "")
        assert said in errors

    assert failures(is_refused, IMPOSSIBLE) == []
    listed = m2pem.run("schedule", "--all", "--format", "json", *JOURNAL)[1]
    assert [each["entries"] for each in json.loads(listed)] == [[]]
    assert runs(m2pem) == []


def test_a_time_that_came_while_nothing_served_is_said_at_the_start(
    faulty: CommandLine, faults: Faults
) -> None:
    server = serving(faulty)
    soon = (datetime.now(UTC) + timedelta(hours=1)).isoformat()
    scheduled = ("--when", soon, "--starting-deadline", "0 s", "--by", "ada")
    assert faulty.run("start", MISSION, *JOURNAL, *scheduled)[:2] == (0, "s1\n")
    server.kill()
    assert entry(faulty, "s1")["status"] == "scheduled"
    faults.set(f"clock {time.CLOCK_REALTIME} {2 * 3600}")
    again = serving(faulty)
    assert told(again, "missed the start").startswith("m2pem: s1 missed")
    assert runs(faulty) == []
    assert entry(faulty, "s1")["status"] == "ended"


def test_the_commands_of_the_schedule_work_with_an_executive_and_without(
    m2pem: CommandLine,
) -> None:
    server = serving(m2pem)
    for more in (
        ("--cron", "0 8 * * *"),
        ("--when", "08:00"),
        ("--after", "s1"),
        ("--after", "s1"),
    ):
        zone = () if "--after" in more else ("--time-zone", "UTC")
        assert m2pem.run("start", MISSION, *JOURNAL, *more, *zone)[0] == 0
    listed = m2pem.run("schedule", *JOURNAL)[1]
    assert "by cron 0 8 * * * (UTC)" in listed
    assert "after s1 has completed" in listed
    refused = m2pem.run("start", MISSION, *JOURNAL, "--condition", "vehicle.batery > 0.9")
    assert refused[0] == 1
    assert "did you mean 'vehicle.battery'" in refused[2]
    assert m2pem.run("start", MISSION, *JOURNAL, "--when", "free", "--even-if-busy")[0] == 2
    assert m2pem.run("schedule", "start", "s4", "--by", "ada", *JOURNAL)[:2] == (0, "r1\n")
    assert "by s4, started by ada" in m2pem.run("replay", "r1", *JOURNAL)[1]
    assert m2pem.run("schedule", "hold", "s1", "--reason", "rain", "--by", "ada", *JOURNAL)[0] == 0
    assert entry(m2pem, "s1")["reason"] == "held by ada: rain"
    stopped = m2pem.run("stop", "--all", *JOURNAL)[1]
    assert "the schedule is held; `m2pem schedule release` lets it go on" in stopped
    server.kill()
    words = "m2pem schedule cancel --journal journal.db "
    completed = m2pem.run(
        _M2PEM_COMPLETE="bash_complete", COMP_WORDS=words, COMP_CWORD=str(words.count(" "))
    )[1]
    assert completed.split() == ["plain,s3", "plain,s2", "plain,s1"]
    status, _, refused_start = m2pem.run("schedule", "start", "s3", *JOURNAL)
    assert (status, "no executive serves s3 now" in refused_start) == (2, True)
    listed, note = m2pem.run("schedule", *JOURNAL)[1:]
    assert listed.startswith("the schedule is held by")
    assert "no executive serves this schedule now" in note
    for done in (("release",), ("release", "s1"), ("cancel", "s2"), ("hold", "s3")):
        assert m2pem.run("schedule", *done, *JOURNAL)[0] == 0
    found = json.loads(m2pem.run("schedule", "--all", "--format", "json", *JOURNAL)[1])
    assert {each["entry"]: each["status"] for each in found[0]["entries"]} == {
        "s1": "scheduled",
        "s2": "cancelled",
        "s3": "held",
        "s4": "ended",
    }
    assert m2pem.run("schedule", "cancel", "s2", *JOURNAL)[0] == 1
    assert m2pem.run("schedule", "show", "s9", *JOURNAL)[0] == 2
