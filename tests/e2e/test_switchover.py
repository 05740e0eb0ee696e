"""`m2pem switchover`: the standby takes the runs up, and their vehicles go on meanwhile."""

import json
import signal
from pathlib import Path

from tests.command_line import CommandLine, fleet_with_state
from tests.e2e.test_standby import (
    answer,
    assert_each_behavior_began_once,
    journal,
    postgres,
    postgres_url,
    prompted,
    serve,
    start_mission,
)

__all__ = ["journal", "postgres", "postgres_url"]


def test_a_switchover_leaves_the_runs_to_the_standby(
    m2pem: CommandLine, tmp_path: Path, journal: str
) -> None:
    fleet, state = fleet_with_state(tmp_path)
    owner = serve(m2pem, fleet, journal)
    owner.until_said("serving")
    standby = serve(m2pem, fleet, journal, "--standby")
    standby.until_said("standing by for")
    start_mission(m2pem, journal)
    answer(m2pem, journal, prompted(owner), "continue")
    owner.until_record("BehaviorProgressed", state="RUNNING")
    status, _, errors = m2pem.run("switchover", "--journal", journal, "--by", "anna")
    assert status == 0
    assert f"process {standby.process.pid} on" in errors
    assert f"takes over; process {owner.process.pid} ends" in errors
    standby.until_record("RunClaimed", epoch=2)
    status, errors = owner.rest()
    assert status == 0, errors
    assert "switchover: anna asked for it" in errors
    status, _, errors = m2pem.run("stop", "r1", "--journal", journal)
    assert status == 0, errors
    standby.until_record("RunEnded", outcome="stopped")
    status, out, _ = m2pem.run("replay", "r1", "--format", "json", "--journal", journal)
    assert_each_behavior_began_once(state, [json.loads(line) for line in out.splitlines()])
    assert m2pem.run("replay", "r1", "--verify", "--journal", journal)[0] == 0


def test_without_a_standby_a_switchover_changes_nothing(m2pem: CommandLine, tmp_path: Path) -> None:
    fleet, _ = fleet_with_state(tmp_path)
    owner = serve(m2pem, fleet, "journal.db")
    owner.until_said("serving")
    start_mission(m2pem, "journal.db")
    prompt = prompted(owner)
    status, _, errors = m2pem.run("switchover", "--journal", "journal.db")
    assert status == 1
    assert "no executive stands by for" in errors
    assert "m2pem serve --standby" in errors
    answer(m2pem, "journal.db", prompt, "continue")
    owner.until_record("BehaviorProgressed", state="RUNNING")
    owner.send(signal.SIGTERM)
    assert owner.rest()[0] == 0
