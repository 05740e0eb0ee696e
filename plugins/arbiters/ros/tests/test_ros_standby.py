"""A standby takes over while vehicles drive that steer themselves: by the topics and the action of
an m2pem node, and by Nav2, over DDS. A listener of the tests' own counts what they begin."""

import signal
from collections.abc import Mapping
from typing import Any

import pytest
from ros_e2e_programs import Program, Programs
from ros_e2e_watch import Watch
from ros_e2e_world import ALL_WAYS, convoy, fleet_file

from tests.postgres_server import postgres, postgres_url

__all__ = ["postgres", "postgres_url"]

SPEED = 4.0
LENGTH_M = 250.0
END_M = 15.0
"""Nearer to its end, a vehicle that brakes too late on a busy computer may come back to it."""

WATCHED: Mapping[str, Mapping[str, Any]] = {
    name: way for name, way in ALL_WAYS.items() if name != "base"
}


def serve(m2pem: Programs, journal: str, *words: str, **environment: str) -> Program:
    """Start an executive; it serves, or stands by."""
    program = m2pem.m2pem(
        "serve", "--fleet", m2pem.folder / "fleet.yaml", "--speed", f"{SPEED:g}", "--ocu", "none",
        "--format", "json", "--journal", journal, *words, M2PEM_LEASE_S="3", **environment,
    )  # fmt: skip
    program.until_line("standing by for" if words else "serving")
    return program


def driving(m2pem: Programs, watch: Watch, journal: str, **elsewhere: str) -> tuple[Program, ...]:
    """Vehicles on their ways, the executive that drives them, and its standby."""
    fleet = fleet_file(m2pem.folder, WATCHED, LENGTH_M, lost_after="20 s", on_error="incident")
    m2pem.simulate(fleet, SPEED)
    watch.until_heard()
    owner = serve(m2pem, journal)
    standby = serve(m2pem, journal, "--standby", **elsewhere)
    start = m2pem.m2pem("start", convoy(m2pem.folder, WATCHED), "--journal", journal)
    assert start.rest() == 0, start.said
    owner.until_record("BehaviorProgressed", len(WATCHED), state="RUNNING")
    watch.until(lambda: all(track.north_m > 10.0 for _, track in watch.items()))
    return owner, standby


def assert_undisturbed(standby: Program, watch: Watch) -> None:
    """Each vehicle has got one goal, and has never stood on its way to the end."""
    assert standby.until_record("RunEnded")["outcome"] == "completed", standby.said
    for name, track in watch.items():
        assert not track.stood_on_the_way(5.0, LENGTH_M - END_M), name
        assert track.begun_before(LENGTH_M - END_M) == 1, (name, track.begun_m)
    (accepted,) = watch["topics"].accepted()
    assert set(watch["topics"].starts) <= {accepted}  # the first may have been too soon to hear
    assert len(watch["action"].goals) == len(watch["nav"].goals) == 1


@pytest.mark.long
@pytest.mark.parametrize("kills", [True, False])
def test_a_standby_takes_over_robots_from_a_killed_executive_or_at_a_switchover(
    m2pem: Programs, watch: Watch, kills: bool
) -> None:
    owner, standby = driving(m2pem, watch, "journal.db")
    if kills:
        owner.kill()
    else:
        assert m2pem.m2pem("switchover", "--journal", "journal.db").rest() == 0
        assert owner.rest() == 0, owner.said
    standby.until_record("RunClaimed", epoch=2)
    assert_undisturbed(standby, watch)


@pytest.mark.long
def test_a_stopped_executive_whose_robots_drive_for_another_one_moves_them_no_more(
    m2pem: Programs, watch: Watch, postgres_url: str
) -> None:
    elsewhere = m2pem.folder / "elsewhere"
    elsewhere.mkdir()
    another_host = {"M2PEM_RUNTIME_DIR": str(elsewhere), "HOME": str(elsewhere)}
    owner, standby = driving(m2pem, watch, postgres_url, **another_host)
    owner.process.send_signal(signal.SIGSTOP)
    try:
        standby.until_record("RunClaimed", epoch=2)
        reached_m = {name: track.north_m + 30.0 for name, track in watch.items()}
        watch.until(lambda: all(watch[name].north_m > m for name, m in reached_m.items()))
    finally:
        owner.process.send_signal(signal.SIGCONT)
    assert owner.rest() == 1, owner.said
    said = "\n".join(owner.errors)
    assert f"process {standby.process.pid} on" in said
    assert "this executive commands no vehicle any more" in said
    assert_undisturbed(standby, watch)
