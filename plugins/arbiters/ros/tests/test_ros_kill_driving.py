"""An executive is killed while vehicles drive; the next one finds them, whatever steers them."""

import signal
import time

import pytest
from ros_e2e_programs import Program, Programs
from ros_e2e_watch import Watch
from ros_e2e_world import ALL_WAYS, convoy, fleet_file

SPEED = 4.0
FAR_M, NEAR_M = 350.0, 60.0
"""While they drive the longer one, the next executive can begin also on a busy computer."""

END_M = 15.0
"""Nearer to its end, whoever brakes too late on a busy computer may come back to it."""

WATCHED = ALL_WAYS
ON_BOARD = ("topics", "action", "nav")
"""Those that are steered on board, and need no executive for that."""

DYING = """
import os, signal

def die(*arguments, **options):
    os.kill(os.getpid(), signal.SIGKILL)

def look(self, run_id, records):
    if any(type(record).__name__ == "BehaviorRequested" for record in records):
        die()

if "DIE_AT_REQUEST" in os.environ:
    from m2pem.executive.control_events import RecordObservers

    RecordObservers.put = look

if "DIE_WHEN_TOLD" in os.environ:
    from m2pem_plugin_ros.vehicle import Vehicle

    setattr(Vehicle, os.environ["DIE_WHEN_TOLD"], die)
"""
"""Observers are handed what was requested after the commit, before anything is dispatched; and
what a vehicle tells of is not in the journal yet when `Vehicle` hears of it."""


def drive(
    m2pem: Programs, watch: Watch, length_m: float, speed: float = SPEED, **settings: str
) -> Program:
    """Vehicles, and an executive that runs a mission in which all drive.

    `settings`: of the fleet; in capitals, variables for the executive.
    """
    environment = {key: value for key, value in settings.items() if key.isupper()}
    of_fleet = {key: value for key, value in settings.items() if key not in environment}
    file = fleet_file(m2pem.folder, ALL_WAYS, length_m, **of_fleet)
    m2pem.simulate(file, speed)
    watch.until_heard()
    return m2pem.run(convoy(m2pem.folder, ALL_WAYS), file, speed, **environment)


def resume(m2pem: Programs) -> Program:
    return m2pem.m2pem("resume", "r1", "--ocu", "plain", "--format", "json")


def assert_all_driven(m2pem: Programs, program: Program) -> None:
    """The run completes, and each vehicle has done its part once."""
    assert program.until_record("RunEnded")["outcome"] == "completed", program.said
    replay = m2pem.m2pem("replay", "r1", "--format", "json")
    assert replay.rest() == 0
    assert len(replay.those("BehaviorRequested")) == len(ALL_WAYS)
    ends = replay.those("BehaviorEnded", state="SUCCEEDED")
    assert len({end["behavior"] for end in ends}) == len(ends) == len(ALL_WAYS)
    assert m2pem.m2pem("replay", "r1", "--verify").rest() == 0


def assert_begun_once(watch: Watch, length_m: float) -> None:
    """Each vehicle that is steered on board has got one goal, and has never stood on its way."""
    for name in ON_BOARD:
        track = watch[name]
        assert not track.stood_on_the_way(5.0, length_m - END_M), name
        assert track.begun_before(length_m - END_M) == 1, (name, track.begun_m)
    (accepted,) = watch["topics"].accepted()
    assert set(watch["topics"].starts) <= {accepted}  # the first may have been too soon to hear
    assert len(watch["action"].goals) == len(watch["nav"].goals) == 1


def test_vehicles_drive_on_while_nobody_is_there_and_nothing_is_begun_twice(
    m2pem: Programs, watch: Watch
) -> None:
    first = drive(m2pem, watch, FAR_M)
    first.until_record("BehaviorProgressed", count=len(ALL_WAYS), state="RUNNING")
    watch.until(lambda: all(watch[name].north_m > 10.0 for name in ALL_WAYS))
    first.kill()
    base = watch["base"]
    watch.until(lambda: base.stands)  # nobody drives it any more
    assert all(watch[name].moves for name in ON_BOARD)
    stood_m, begun = base.north_m, len(base.begun_m)
    second = resume(m2pem)
    prompt = second.until_record("PromptOpened")
    assert prompt["element"] == "Drive_base"
    assert [each["value"] for each in prompt["decisions"]] == ["resume", "skip", "abort"]
    assert (base.stands, len(base.begun_m)) == (True, begun)
    assert second.those("BehaviorEnded") == []  # the others were found on their way
    second.type("resume")
    assert_all_driven(m2pem, second)
    assert second.rest() == 0
    assert len(second.those("PromptOpened")) == 1
    assert_begun_once(watch, FAR_M)
    assert base.begun_before(FAR_M - END_M) == begun + 1
    since = [each.north_m for each in base.odometry]
    assert min(since[since.index(stood_m) :]) > stood_m - 1.0  # it did not go back


@pytest.mark.long
def test_what_has_ended_meanwhile_is_not_done_again(m2pem: Programs, watch: Watch) -> None:
    first = drive(m2pem, watch, NEAR_M)
    first.until_record("BehaviorProgressed", count=len(ALL_WAYS), state="RUNNING")
    first.kill()
    watch.until(lambda: all(watch[name].north_m > NEAR_M - 2.0 for name in ON_BOARD))
    watch.until(lambda: all(watch[name].stands for name in ALL_WAYS))
    fleet = m2pem.folder / "fleet.yaml"
    words = ("--fleet", fleet, "--speed", f"{SPEED:g}", "--ocu", "plain", "--format", "json")
    serving = m2pem.m2pem("serve", *words)
    serving.until_record("BehaviorEnded", count=len(ON_BOARD), state="SUCCEEDED")
    assert serving.until_record("PromptOpened")["element"] == "Drive_base"
    assert len(watch["base"].begun_m) == 1
    serving.type("resume")
    assert_all_driven(m2pem, serving)
    serving.process.send_signal(signal.SIGTERM)
    assert serving.rest() == 0
    assert_begun_once(watch, NEAR_M)


@pytest.mark.long
@pytest.mark.parametrize(
    "moment",
    [
        {"DIE_AT_REQUEST": "1"},
        {"DIE_WHEN_TOLD": "progress"},
        {"DIE_WHEN_TOLD": "ended"},
    ],
    ids=lambda moment: "_".join(map("_".join, moment.items())).lower(),
)
def test_what_the_journal_does_not_know_of_is_neither_lost_nor_done_twice(
    m2pem: Programs, watch: Watch, moment: dict[str, str]
) -> None:
    m2pem.install("dying", DYING)
    first = drive(m2pem, watch, NEAR_M, **moment)
    assert first.rest() == -signal.SIGKILL
    if "DIE_AT_REQUEST" in moment:
        assert watch["topics"].starts == []
        assert not any(track.moves for track in watch.tracks.values())
    second = resume(m2pem)
    second.until(lambda: second.those("RunEnded") or second.those("PromptOpened"))
    if second.those("PromptOpened", element="Drive_base"):
        second.type("resume")
    assert_all_driven(m2pem, second)
    assert_begun_once(watch, NEAR_M)


@pytest.mark.long
def test_after_too_long_an_outage_vehicles_are_held_and_drive_on_when_told_so(
    m2pem: Programs, watch: Watch
) -> None:
    first = drive(m2pem, watch, 2 * NEAR_M, speed=1.0, max_outage="1 s")
    first.until_record("BehaviorProgressed", count=len(ALL_WAYS), state="RUNNING")
    watch.until(lambda: all(watch[name].north_m > 5.0 for name in ALL_WAYS))
    first.kill()
    killed_s = time.monotonic()
    watch.until(lambda: time.monotonic() > killed_s + 2.0)
    assert all(watch[name].moves for name in ON_BOARD)
    second = resume(m2pem)
    second.until_record("PromptOpened", count=len(ALL_WAYS))
    prompts = second.those("PromptOpened")
    assert {each["element"] for each in prompts} == {f"Drive_{name}" for name in ALL_WAYS}
    watch.until(lambda: all(watch[name].stands for name in ALL_WAYS))
    assert all(watch[name].north_m < 2 * NEAR_M - 5.0 for name in ALL_WAYS)
    for prompt in prompts:
        second.type(f"{prompt['prompt']} resume")
    assert_all_driven(m2pem, second)
    assert second.rest() == 0
    for name in ALL_WAYS:
        assert watch[name].begun_before(2 * NEAR_M - END_M) == 2, name
        assert watch[name].north_m > 2 * NEAR_M - 2.0
    assert len(watch["topics"].accepted()) == len(watch["action"].goals) == 1
