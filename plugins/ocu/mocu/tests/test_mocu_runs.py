"""Runs, as operators start, steer and list them over DDS."""

import math
from pathlib import Path

import pytest
from mocu_world import Client, Message, World, until

from m2pem.api import RunStatus
from m2pem.api import records as r
from m2pem.testing import scenarios

STOP, PAUSE, RESUME = 1, 2, 3
RUNNING, PAUSED, COMPLETED, STOPPED = 1, 2, 4, 7
ERROR, WARNING = 1, 2

BAD_FLOW = scenarios.question().replace(b'targetRef="End"', b'targetRef="Nowhere"')


@pytest.fixture
def mission(tmp_path: Path) -> Path:
    path = tmp_path / "ask.bpmn"
    path.write_bytes(scenarios.question())
    return path


def statuses(status: Message) -> list[int]:
    return [each["status"] for each in status["runs"]]


async def started_by(world: World, run: str) -> str:
    (record,) = [
        each.record
        for each in await world.control.records(run)
        if isinstance(each.record, r.RunStarted)
    ]
    return record.by


async def test_a_mission_starts_from_a_path_a_url_or_its_bytes(
    world: World, client: Client, mission: Path
) -> None:
    by_path = await client.call("start_mission", url=str(mission), by="anna@mocu1")
    by_url = await client.call("start_mission", url=mission.as_uri())
    by_bytes = await client.call("start_mission", bpmn=str(mission), process="SCENARIO")
    assert [each["success"] for each in (by_path, by_url, by_bytes)] == [True] * 3
    assert [each["run"] for each in (by_path, by_url, by_bytes)] == ["r1", "r2", "r3"]
    assert await started_by(world, "r1") == "anna@mocu1"
    assert await started_by(world, "r2") == "mocu"
    runs = (await client.call("list_runs"))["runs"]
    assert [each["mission"] for each in runs] == [str(mission), str(mission), "mission.bpmn"]


async def test_data_is_there_before_the_mission_begins(
    world: World, client: Client, mission: Path
) -> None:
    values = {"mission.speed": "5.5", "mission.name": '"alpha"', "mission.list": "[1, true, null]"}
    data = [{"key": key, "value": value} for key, value in values.items()]
    response = await client.call("start_mission", url=str(mission), data=data)
    assert response["success"]
    written = {
        each.record.key: each.record.value
        for each in await world.control.records(response["run"])
        if isinstance(each.record, r.DataWritten)
    }
    assert written == {
        "mission.speed": 5.5,
        "mission.name": "alpha",
        "mission.list": [1, True, None],
    }


async def test_warnings_of_a_mission_that_started_are_told(
    world: World, client: Client, tmp_path: Path
) -> None:
    path = tmp_path / "doubtful.bpmn"
    path.write_bytes(scenarios.service("NoSuchService"))
    for source in ({"url": str(path)}, {"bpmn": str(path)}):
        response = await client.call("start_mission", **source)
        assert response["success"]
        (finding,) = response["findings"]
        assert (finding["severity"], finding["rule"]) == (WARNING, "unknown-service")
        assert (finding["element"], finding["line"]) == ("Service", 1)


async def test_a_mission_that_is_not_well_is_refused_with_all_findings(
    world: World, client: Client, tmp_path: Path
) -> None:
    path = tmp_path / "broken.bpmn"
    path.write_bytes(BAD_FLOW)
    response = await client.call("start_mission", bpmn=str(path))
    assert not response["success"]
    assert response["run"] == ""
    errors = [each for each in response["findings"] if each["severity"] == ERROR]
    assert "Nowhere" in errors[0]["message"]
    assert "Nowhere" in response["message"]
    assert await world.control.runs() == []


async def test_what_is_no_mission_is_refused(world: World, client: Client, tmp_path: Path) -> None:
    path = tmp_path / "mission.bpmn"
    for content, says in (
        (b"this is no XML", "XML"),
        (b"\0\1\2\3\xff\xfe" * 50, "utf-8"),
        (b"<html><body/></html>", "BPMN"),
        (scenarios.question()[:300], "XML"),
        (b"", "neither"),
        (b"x" * 10_000_001, "10,000,001 bytes; 10,000,000 are the most"),
    ):
        path.write_bytes(content)
        response = await client.call("start_mission", bpmn=str(path))
        assert (response["success"], response["run"]) == (False, "")
        assert says in response["message"]
    assert await world.control.runs() == []


async def test_a_start_that_cannot_be_is_refused(
    world: World, client: Client, mission: Path
) -> None:
    for fields, says in (
        ({"url": "/no/such/file.bpmn"}, "cannot be read"),
        ({"url": "http://127.0.0.1:1/m.bpmn"}, "cannot be read"),
        ({"process": "NO_SUCH"}, "NO_SUCH"),
        ({"by": "x" * 201}, "by has 201 characters"),
        ({"data": [{"key": "a", "value": "red"}]}, "data['a'] is not JSON"),
    ):
        response = await client.call("start_mission", **{"url": str(mission), **fields})
        assert not response["success"]
        assert says in response["message"]
    assert await world.control.runs() == []


async def test_either_a_url_or_bytes_are_given(world: World, client: Client, mission: Path) -> None:
    response = await client.call("start_mission", url=str(mission), bpmn=str(mission))
    assert not response["success"]
    assert "not as both" in response["message"]


@pytest.mark.long
async def test_fifty_megabytes_are_refused_and_disturb_nobody(
    world: World, client: Client, clients: list[Client], tmp_path: Path
) -> None:
    path = tmp_path / "huge.bpmn"
    path.write_bytes(scenarios.question() + b" " * 50_000_000)
    run, prompt = await world.asks("Meanwhile?")
    asked = client.send("start_mission", bpmn=str(path))
    answer = await clients[1].call("answer_prompt", run=run, prompt=prompt, decision="continue")
    assert answer["success"]
    (response,) = await client.responses(asked, 1)
    assert not response["success"]
    assert "10,000,000 are the most" in response["message"]
    assert "url" in response["message"]


async def test_a_run_is_paused_resumed_and_stopped(world: World, client: Client) -> None:
    run = await world.drives()
    for verb, status in ((PAUSE, PAUSED), (RESUME, RUNNING)):
        since = len(client.said)
        assert (await client.call("control_run", verb=verb, run=run, by="anna"))["success"]
        await client.hears("status", lambda s, want=status: statuses(s) == [want], since=since)
    told = {"verb": STOP, "run": run, "by": "anna", "reason": "people on the road"}
    assert (await client.call("control_run", **told))["success"]
    ended = await client.hears("status", lambda s: statuses(s) == [STOPPED])
    assert "people on the road" in ended["runs"][0]["detail"]
    assert (await world.control.wait(run)).status is RunStatus.STOPPED


async def test_stop_of_all_stops_every_run(world: World, client: Client) -> None:
    run = await world.drives()
    assert (await client.call("control_run", verb=STOP, run="all", by="anna"))["success"]
    assert (await world.control.wait(run)).status is RunStatus.STOPPED


async def test_what_cannot_be_done_to_a_run_is_refused(world: World, client: Client) -> None:
    run = await world.drives()
    for fields, says in (
        ({"verb": STOP, "run": "r9"}, "r9 is not driven by this executive"),
        ({"verb": PAUSE, "run": ""}, "run is empty"),
        ({"verb": RESUME, "run": run}, run),
        ({"verb": 0, "run": run}, "verb 0 is not known; give one of: STOP (1)"),
        ({"verb": STOP, "run": run, "reason": "x" * 2000}, "reason has 2,000 characters"),
    ):
        response = await client.call("control_run", **fields)
        assert not response["success"]
        assert says in response["message"]
    (summary,) = await world.control.runs()
    assert (summary.run, summary.status) == (run, RunStatus.RUNNING)


async def test_a_run_that_has_ended_can_be_stopped_no_more(world: World, client: Client) -> None:
    run, prompt = await world.asks()
    await world.control.answer(run, prompt, "continue")
    await world.control.wait(run)
    response = await client.call("control_run", verb=STOP, run=run)
    assert not response["success"]
    assert response["message"].startswith("r1 has ended ")
    assert response["message"].endswith("(completed); there was nothing to stop")


async def test_runs_are_listed_the_oldest_first(world: World, client: Client) -> None:
    run, prompt = await world.asks()
    await world.control.answer(run, prompt, "continue")
    await world.control.wait(run)
    await world.drives()
    first, second = (await client.call("list_runs"))["runs"]
    assert (first["run"], first["status"], first["process"]) == ("r1", COMPLETED, "SCENARIO")
    assert first["ended"]["sec"] >= first["started"]["sec"] > 1_700_000_000
    assert math.isnan(first["mission_time_s"])
    assert (second["run"], second["status"], second["ended"]["sec"]) == ("r2", RUNNING, 0)
    assert second["mission_time_s"] >= 0
    open_only = (await client.call("list_runs", open_only=True))["runs"]
    assert [each["run"] for each in open_only] == ["r2"]


async def test_stop_has_a_place_however_many_other_calls_hang(world: World, client: Client) -> None:
    run = await world.drives()
    for method in ("pause", "answer", "signal"):
        world.faults.hang(method)
    client.send("control_run", times=30, verb=PAUSE, run=run)
    client.send("answer_prompt", times=30, run=run, prompt="p1", decision="x")
    await until(lambda: sum("id" in each for each in client.said) >= 20)  # ten of each are refused
    refused = [each["response"]["message"] for each in client.said if "id" in each]
    assert all("20 requests of this kind" in message for message in refused)
    assert (await client.call("control_run", verb=STOP, run=run))["success"]
    assert (await world.control.wait(run)).status is RunStatus.STOPPED
