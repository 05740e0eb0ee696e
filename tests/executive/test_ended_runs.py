"""Requests for a run that has ended: operators read how and when, in words."""

import pytest

from m2pem.api.runs import RunStatus
from m2pem.engine.records import RunOutcome
from m2pem.errors import NotDrivenError, OperatorError
from m2pem.executive.ended_runs import describe_end
from m2pem.journal import MemoryJournal, RunInfo
from m2pem.journal.base import RunHeader

from .conftest import World, mission, question, sequence

ASK = sequence(("Ask", question("Ask")))


async def refused(request) -> str:
    with pytest.raises(OperatorError) as error:
        await request
    return str(error.value)


def test_every_request_says_how_and_when_the_run_has_ended(play) -> None:
    async def story(world: World):
        control = world.executive.control
        run = await control.start(mission(ASK))
        await control.stop(run, by="anna", reason="rain")
        assert (await control.wait(run)).status is RunStatus.STOPPED
        point = {"type": "Point", "coordinates": [7.0, 51.0]}
        return [
            await refused(control.stop(run, by="bob")),
            await refused(control.pause(run, by="bob")),
            await refused(control.resume(run, by="bob")),
            await refused(control.answer(run, "p1", "continue", by="bob")),
            await refused(control.signal("s", run=run, by="bob")),
            await refused(control.message("m", run=run, by="bob")),
            await refused(control.set_geometry("gate", point, run=run, by="bob")),
        ]

    said = play(story)
    assert all(each.startswith("r1 has ended on 20") for each in said)
    assert all(" UTC (stopped: rain); " in each for each in said)
    assert [each.rpartition("; ")[2] for each in said] == [
        "there was nothing to stop",
        "there was nothing to pause",
        "there is nothing to go on with: m2pem start begins its mission anew",
        "no question of it is open",
        "it takes no signals any more",
        "it takes no messages any more",
        "it takes no geometries any more",
    ]


def test_a_run_of_an_earlier_executive_has_ended_as_the_journal_says(play) -> None:
    journal = MemoryJournal()

    async def first(world: World):
        run = await world.executive.control.start(mission(ASK))
        await world.executive.control.stop(run)

    async def second(world: World):
        control = world.executive.control
        with pytest.raises(NotDrivenError):
            await control.stop("r9")
        return await refused(control.stop("r1"))

    play(first, journal=journal)
    assert play(second, journal=journal).endswith("UTC (stopped); there was nothing to stop")


def test_a_run_that_is_not_in_that_state_is_told_so_in_words(play) -> None:
    async def story(world: World):
        control = world.executive.control
        run = await control.start(mission(ASK))
        resumed = await refused(control.resume(run))
        await control.pause(run)
        return resumed, await refused(control.pause(run))

    assert play(story) == ("r1: it is not paused", "r1: it is paused already")


def test_at_another_speed_no_date_is_made_of_mission_time() -> None:
    header = RunHeader("m.bpmn", b"", "P", speed=20.0, created_us=1_000_000)
    line = RunInfo("r1", header, 1, 9, 1_000_000, outcome=RunOutcome.STOPPED, ended_us=41_000_000)
    assert describe_end("stop", "r1", line) == (
        "r1 has ended 40 s after its start, by a clock at 20 times real time (stopped); "
        "there was nothing to stop"
    )


def test_a_stop_that_goes_to_what_is_still_released_says_so() -> None:
    assert describe_end("stop", "r1", None, "ugv1") == (
        "r1 has ended; STOP went to what it is still releasing: ugv1"
    )
    assert describe_end("pause", "r1", None) == "r1 has ended; there was nothing to pause"
