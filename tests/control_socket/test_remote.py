"""MissionControl through the socket is the same as in the executive."""

import asyncio
from pathlib import Path

import pytest

from m2pem.api.runs import OpenPrompt, PromptClosed, StampedRecord
from m2pem.api.telemetry import (
    Detection,
    GeoPosition,
    LinkState,
    PayloadState,
    TeamMemberState,
    TeamState,
    Telemetry,
    VehicleState,
)
from m2pem.control_socket.paths import ControlSocketError
from m2pem.control_socket.remote import RemoteControl
from m2pem.errors import BusyError, MissionError, NotDrivenError, OperatorError
from m2pem.executive.loading import load_source
from m2pem.findings import Severity
from m2pem.mission.catalogue import ResourceId
from tests.control_socket.conftest import Served
from tests.executive.conftest import behavior, mission, question, sequence

CALLING = sequence(("Call", '<callActivity id="Call" calledElement="Called"/>'))


async def test_everything_that_is_asked_for_comes_as_it_is(served: Served) -> None:
    run, _ = await served.asked()
    async with RemoteControl(served.path) as remote:
        assert remote.fleet() == served.control.fleet()
        assert remote.catalogue() == served.control.catalogue()
        assert remote.simulated() is served.control.simulated()
        assert remote.speed() == served.control.speed()
        assert remote.journal_file() == served.control.journal_file()
        assert await remote.runs() == await served.control.runs()
        assert await remote.records(run) == await served.control.records(run)
        assert await remote.mission_time_s(run) <= await served.control.mission_time_s(run)
        mission = await remote.mission(run)
        assert mission.source == (await served.control.mission(run)).source
        assert mission.elements["Ask"].label == "Ask"


async def test_a_mission_comes_with_the_files_that_it_calls(
    served: Served, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "s.bpmn").write_bytes(mission('<process id="S"><task id="Look"/></process>'))
    monkeypatch.setenv("M2PEM_PATH", str(tmp_path))
    calling = sequence(("Call", '<callActivity id="Call" calledElement="S"/>'))
    run = await served.control.start(mission(calling))
    (tmp_path / "s.bpmn").unlink()
    async with RemoteControl(served.path) as remote:
        assert "s:Look" in (await remote.mission(run)).elements


async def test_the_remote_control_follows_a_run_to_its_end(served: Served) -> None:
    run, prompt = await served.asked()
    async with RemoteControl(served.path) as remote:
        notices = remote.subscribe(run)
        first = await anext(notices)
        assert isinstance(first, OpenPrompt)
        assert first.prompt == prompt
        await remote.answer(run, prompt, "no", by="bob@gcs2")
        following = [await anext(notices)]
        while not isinstance(following[-1], PromptClosed):
            following.append(await anext(notices))
        assert following[-1] == PromptClosed(run, prompt, "no", "bob@gcs2")
        assert isinstance(following[0], StampedRecord)
        assert (await remote.wait(run)).status == "completed"


async def test_the_second_answer_is_refused_through_it_too(served: Served) -> None:
    run, prompt = await served.asked()
    async with RemoteControl(served.path) as remote:
        answers = await asyncio.gather(
            remote.answer(run, prompt, "no", by="bob@gcs2"),
            served.control.answer(run, prompt, "yes", by="anna@gcs1"),
            return_exceptions=True,
        )
    assert sorted(type(answer).__name__ for answer in answers) == ["NoneType", "OperatorError"]


PTZ = ResourceId("v1/ptz")
SEEN = Detection("car", PTZ, GeoPosition(1.0, 2.0, 3.0), 5)
FOOTPRINT = (GeoPosition(1.0, 2.0, 3.0), GeoPosition(1.5, 2.0, 3.0), GeoPosition(1.5, 2.5, 3.0))
MEMBERS = (TeamMemberState(ResourceId("v1"), -1.5, 0.25, None), TeamMemberState(ResourceId("v2")))


@pytest.mark.parametrize(
    "state",
    [
        VehicleState(ResourceId("v1"), 5, GeoPosition(1.0, 2.0, 3.0), battery_fraction=0.5),
        TeamState("r1.b1", "road_sweep", 5, MEMBERS, 15.0),
        PayloadState(PTZ, 5, 0.5, -0.25, 2.0, (SEEN,), LinkState.DEGRADED, "zoom", FOOTPRINT),
        PayloadState(PTZ, 5),
    ],
)
async def test_telemetry_passes(served: Served, state: Telemetry) -> None:
    async with RemoteControl(served.path) as remote:
        stream = remote.telemetry()
        next_state = asyncio.ensure_future(anext(stream))
        while not next_state.done():
            served.bus.publish(state)
            await asyncio.wait([next_state], timeout=0.01)
        assert next_state.result() == state


async def test_a_call_that_was_given_up_does_not_confuse_the_next(served: Served) -> None:
    run, _ = await served.asked()
    async with RemoteControl(served.path) as remote:
        given_up = asyncio.create_task(remote.records(run))
        await asyncio.sleep(0)
        given_up.cancel()
        assert [each.run for each in await remote.runs()] == [run]


async def test_refusals_are_the_same_errors(served: Served) -> None:
    async with RemoteControl(served.path) as remote:
        with pytest.raises(NotDrivenError):
            await remote.pause("r9")
        with pytest.raises(OperatorError, match="m2pem verify"):
            await remote.verify(b"")
        with pytest.raises(OperatorError, match="MissionFiles"):
            await remote.start("mission.bpmn")


async def test_a_mission_is_started_with_the_files_that_the_caller_has_read(
    served: Served, tmp_path: Path
) -> None:
    called, file = tmp_path / "s.bpmn", tmp_path / "here.bpmn"
    called.write_bytes(mission(sequence(("Ask", question("Ask"))).replace('"P"', '"Called"')))
    file.write_bytes(mission(CALLING))
    async with RemoteControl(served.path, load_source) as remote:
        run = await remote.start(file, by="anna")
        file.unlink()
        called.unlink()
        opened = await anext(remote.subscribe(run))
        assert isinstance(opened, OpenPrompt)
        assert (await remote.mission(run)).file == str(file)
        await remote.answer(run, opened.prompt, "yes")
        assert (await remote.wait(run)).status == "completed"


async def test_a_mission_that_does_not_fit_is_refused_with_its_findings(served: Served) -> None:
    unfit = mission(sequence(("Go", behavior("Go", "drive_stop", "v9"))))
    async with RemoteControl(served.path, load_source) as remote:
        with pytest.raises(MissionError, match="cannot run with fleet") as refused:
            await remote.start(unfit)
        found = await asyncio.to_thread(remote.check, unfit)
        assert refused.value.findings == tuple(found)
        assert any("v9" in each.message for each in found)
        [broken] = await asyncio.to_thread(remote.check, b"<no-bpmn/>")
        assert broken.severity is Severity.ERROR
        assert not await remote.runs()


async def test_a_mission_whose_vehicle_is_busy_is_refused_with_who_has_it(served: Served) -> None:
    await served.control.take("v1", by="bob")
    goes = mission(sequence(("Go", behavior("Go", "drive_stop", "v1"))))
    async with RemoteControl(served.path, load_source) as remote:
        with pytest.raises(BusyError, match="bob has v1") as refused:
            await remote.start(goes)
        assert refused.value.holders == {"v1": "bob"}
        assert await remote.start(goes, even_if_busy=True) == "r1"


async def test_an_executive_that_has_gone_is_told(served: Served) -> None:
    with pytest.raises(ControlSocketError, match="gone"):
        await RemoteControl(served.path.with_name("1.sock")).__aenter__()
