"""`m2pem.Executive`: missions executed from Python, with prompts answered there."""

import asyncio
from pathlib import Path

import pytest

import m2pem
from m2pem.api.runs import RunStatus
from m2pem.engine.records import RunEnded, RunStarted
from m2pem.errors import BusyError, OperatorError
from m2pem.fleet.default_fleet import fleet_for
from m2pem.journal import open_journal
from tests.command_line import FLEET, MISSION
from tests.console import REPOSITORY

FAST = 200.0


@pytest.fixture
def fleet() -> m2pem.api.Fleet:
    return m2pem.load_fleet(FLEET)


def executive(fleet: m2pem.api.Fleet, journal: str | Path = "memory:") -> m2pem.Executive:
    return m2pem.Executive(fleet, simulate=True, journal=journal, speed=FAST, by="tester")


async def test_prompts_are_answered_from_python_until_the_run_ends(fleet: m2pem.api.Fleet) -> None:
    async with executive(fleet) as connected:
        run = await connected.start(m2pem.load_mission(MISSION))
        asked = []
        async for prompt in run.prompts():
            asked.append((prompt.element, prompt.decisions))
            with pytest.raises(OperatorError, match="decision"):
                await prompt.answer("perhaps")
            await prompt.answer("abort")
        result = await run.wait()
        assert await run.status() is RunStatus.TERMINATED
    assert asked == [("UserSendRoute", {"continue": "Continue", "abort": "Abort"})]
    assert result.outcome is RunStatus.TERMINATED
    assert [each.seq for each in result.records] == list(range(1, len(result.records) + 1))
    (bar,) = result.gantt
    assert (bar["kind"], bar["what"], bar["note"]) == ("prompt", "abort", "by tester")
    assert "<svg" in result._repr_html_()


async def test_records_come_from_the_first_to_the_end_also_afterwards(
    fleet: m2pem.api.Fleet,
) -> None:
    async with executive(fleet) as connected:
        run = await connected.start(MISSION)
        answering = asyncio.create_task(answer_all(run, "abort"))
        live = [each async for each in run.records()]
        await answering
        again = [each async for each in run.records()]
        assert [each async for each in run.prompts()] == []
    assert live == again
    assert isinstance(live[0].record, RunStarted)
    assert live[0].record.by == "tester"
    assert isinstance(live[-1].record, RunEnded)


async def answer_all(run: m2pem.Run, decision: str) -> None:
    async for prompt in run.prompts():
        await prompt.answer(decision)


async def test_a_run_is_paused_resumed_and_stopped(fleet: m2pem.api.Fleet) -> None:
    async with executive(fleet) as connected:
        run = await connected.start(MISSION)
        await run.pause()
        assert await run.status() is RunStatus.PAUSED
        await run.resume()
        assert await run.status() is RunStatus.RUNNING
        await run.stop("enough")
        result = await run.wait()
    assert result.outcome is RunStatus.STOPPED
    assert not result.ok
    assert "enough" in result.detail


async def test_signals_are_sent_by_name() -> None:
    mission = m2pem.load_mission(REPOSITORY / "examples" / "t05_signal" / "mission.bpmn")
    async with executive(fleet_for(mission)) as connected:
        run = await connected.start(mission)
        await run.signal("Come home")
        result = await run.wait()
    assert "CalledHome" in result.path


async def test_the_end_of_the_block_stops_what_runs_and_the_journal_has_it(
    fleet: m2pem.api.Fleet, tmp_path: Path
) -> None:
    file = tmp_path / "journal.db"
    async with executive(fleet, file) as connected:
        await connected.start(MISSION)
        assert names(tmp_path) >= {"journal.db"}
    with pytest.raises(OperatorError, match="not connected"):
        _ = connected.control
    journal = open_journal(str(file))
    (line,) = await journal.runs()
    await journal.close()
    assert line.outcome is not None
    assert line.outcome.value == "stopped"
    assert [each for each in names(tmp_path) if "-sim-" in each] == []


def names(folder: Path) -> set[str]:
    return {each.name for each in folder.iterdir()}


async def test_what_cannot_start_is_refused(fleet: m2pem.api.Fleet) -> None:
    async with executive(fleet) as connected:
        with pytest.raises(m2pem.MissionError):
            await connected.start(b"nothing")
        first = await connected.start(MISSION)
        await answer_until_driving(first)
        with pytest.raises(BusyError):
            await connected.start(MISSION)


async def answer_until_driving(run: m2pem.Run) -> None:
    async for prompt in run.prompts():
        await prompt.answer("continue")
        break
    async for stamped in run.records():
        if type(stamped.record).__name__ == "BehaviorProgressed":
            return


async def test_real_vehicles_are_never_sped_up(tmp_path: Path) -> None:
    file = tmp_path / "fleet.yaml"
    file.write_text(
        "version: 1\nvehicles: {uav1: {domain: air, arbiter: mavlink, "
        "connection: {url: 'udpin://127.0.0.1:14999', system_id: 1}}}\n"
    )
    with pytest.raises(m2pem.FleetError, match=r"speed 2: uav1 of .* would be real"):
        async with m2pem.Executive(file, journal="memory:", speed=2):
            pass
    file.write_text("version: 1\nvehicles: {a: {domain: ground, arbiter: rso}}\n")
    with pytest.raises(m2pem.FleetError, match=r"fleet\.yaml: there is no arbiter 'rso'"):
        async with m2pem.Executive(file, journal="memory:"):
            pass


async def test_it_is_connected_in_one_task_and_closed_in_another(fleet: m2pem.api.Fleet) -> None:
    """As the cells of a notebook may be."""
    connected = executive(fleet)
    await asyncio.create_task(connected.connect())
    with pytest.raises(OperatorError, match="connected already"):
        await connected.connect()
    run = await asyncio.create_task(connected.start(MISSION))
    watching = asyncio.create_task(run.wait())
    await asyncio.create_task(connected.close())
    assert (await watching).outcome is RunStatus.STOPPED
    with pytest.raises(OperatorError, match="not connected"):
        await connected.start(MISSION)
    await connected.close()
    async with connected:
        assert (await connected.start(MISSION)).id == "r1"  # a journal in memory begins empty


async def test_a_caller_that_gives_up_while_connecting_leaves_nothing_open(
    fleet: m2pem.api.Fleet, tmp_path: Path
) -> None:
    connected = executive(fleet, tmp_path / "journal.db")
    connecting = asyncio.create_task(connected.connect())
    await asyncio.sleep(0)
    connecting.cancel()
    with pytest.raises(asyncio.CancelledError):
        await connecting
    assert [each.get_name() for each in asyncio.all_tasks() if each.get_name() == "executive"] == []
    async with connected:
        assert (await connected.start(MISSION)).id == "r1"
