"""What browsers ask of runs over HTTP, and how refusals are told."""

from typing import Any

import msgspec
import pytest
from m2pem_plugin_web.access.roles import Role
from m2pem_plugin_web.rest import runs
from m2pem_plugin_web.rest.record_pages import RecordPages
from web_world import VEHICLE, MakeWorld

from m2pem.api import RunStatus
from m2pem.errors import JournalError
from m2pem.journal.codec import record_line
from m2pem.testing import scenarios

US = 1_000_000
SIGNALLED = b"""<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"
  targetNamespace="t" id="d">
  <signal id="Go" name="go"/><message id="Mail" name="mail"/>
  <process id="P" isExecutable="true">
    <startEvent id="Start"/><sequenceFlow id="f0" sourceRef="Start" targetRef="Catch"/>
    <intermediateCatchEvent id="Catch"><signalEventDefinition id="s" signalRef="Go"/>
    </intermediateCatchEvent><sequenceFlow id="f1" sourceRef="Catch" targetRef="Post"/>
    <receiveTask id="Post" messageRef="Mail"/><sequenceFlow id="f2" sourceRef="Post" targetRef="E"/>
    <endEvent id="E"/>
  </process>
</definitions>"""


async def test_records_come_by_pages_in_the_form_of_the_command_line(world: MakeWorld) -> None:
    async with world() as here:
        prompt = await here.asked()
        await here.control.answer(prompt.run, prompt.prompt, "abort", by="test")
        await here.control.wait(prompt.run)
        browser = await here.browser()
        told, after, pages = [], 0, 0
        while after is not None:
            path = f"/api/runs/{prompt.run}/records"
            page = await browser.http.get(path, params={"after": after, "limit": 3})
            told += page.json()["records"]
            after = page.json()["next"]
            pages += 1
        assert pages > 1
        kept = await here.control.records(prompt.run)
        assert [each["seq"] for each in told] == [each.seq for each in kept]
        whole = await browser.http.get(f"/api/runs/{prompt.run}/records")
        records = msgspec.json.decode(whole.content, type=dict[str, list[msgspec.Raw] | None])
        for record, each in zip(records["records"] or (), kept, strict=True):
            line = record_line(each.run, each.seq, round(each.t_s * US), each.record)
            assert bytes(record).startswith(line[:-1] + b',"sentence":')


async def test_the_newest_records_of_a_run_are_worded_without_those_before(
    world: MakeWorld, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with world() as here:
        prompt = await here.asked()
        browser = await here.browser()
        path = f"/api/runs/{prompt.run}/records"
        await (await browser.live()).watch(prompt.run)

        async def read(**wanted: object) -> Any:
            params = {"limit": 3, "changes": False, **wanted}
            return (await browser.http.get(path, params=params)).json()

        # Newest ones: as those with changes, but for these.
        exact = await read(changes=True)
        monkeypatch.setattr(RecordPages, "read", None)  # it reads those before
        page = await read()
        assert page["next"] == exact["next"]
        assert page["records"]
        for record, other in zip(page["records"], exact["records"], strict=True):
            other.pop("changes", None)
            assert record == other
        monkeypatch.undo()
        # Older ones: as before.
        monkeypatch.setattr(runs, "NAMED", 0)
        assert await read() == await read(changes=True)


async def test_records_say_what_they_change_in_the_view(world: MakeWorld) -> None:
    async with world() as here:
        prompt = await here.asked()
        path = f"/api/runs/{prompt.run}/records"
        browser = await here.browser()
        records = (await browser.http.get(path)).json()["records"]
        (opened,) = [each for each in records if each["record"] == "PromptOpened"]
        assert (opened["kind"], opened["urgent"]) == ("prompts", True)
        assert opened["sentence"].endswith(f"asks: {prompt.text}")
        assert opened["changes"]["prompts"][prompt.prompt]["text"] == prompt.text
        assert opened["changes"]["elements"][opened["process"]][opened["element"]]["asking"]
        last = records[-1]["seq"]
        await here.control.answer(prompt.run, prompt.prompt, "abort", by="test")
        await here.control.wait(prompt.run)
        # A page that begins anywhere has the same changes.
        page = (await browser.http.get(path, params={"after": last})).json()["records"]
        (answered,) = [each for each in page if each["record"] == "PromptAnswered"]
        assert answered["changes"]["prompts"] == {prompt.prompt: None}
        (end,) = [each for each in page if each["record"] == "RunEnded"]
        assert end["changes"]["status"] == end["outcome"]


async def test_runs_are_listed_the_newest_last(world: MakeWorld) -> None:
    async with world() as here:
        runs = [(await here.asked()).run for _ in range(3)]
        browser = await here.browser()
        told = (await browser.http.get("/api/runs")).json()
        assert [each["run"] for each in told] == runs
        last = (await browser.http.get("/api/runs", params={"limit": 1})).json()
        assert [each["run"] for each in last] == runs[-1:]
        assert (await browser.http.get(f"/api/runs/{runs[0]}")).json()["status"] == "running"


async def test_a_run_that_is_not_there_is_not_found(world: MakeWorld) -> None:
    async with world() as here:
        browser = await here.browser()
        for path in ("", "/records", "/mission"):
            answer = await browser.http.get(f"/api/runs/r9{path}")
            assert answer.status_code == 404
            assert answer.json() == {
                "type": "about:blank",
                "title": "Not Found",
                "status": 404,
                "detail": "there is no run r9",
            }
        for path, body in (("stop", {}), ("pause", None), ("prompts/p1", {"decision": "x"})):
            answer = await browser.http.post(f"/api/runs/r9/{path}", json=body)
            assert answer.status_code == 404


async def test_the_mission_of_a_run_can_be_drawn(world: MakeWorld) -> None:
    async with world() as here:
        prompt = await here.asked()
        browser = await here.browser()
        told = (await browser.http.get(f"/api/runs/{prompt.run}/mission")).json()
        (file,) = told["files"]
        assert file["qualifier"] == ""
        assert "BPMNShape" in file["xml"]
        assert f'id="{told["process"]}"' in file["xml"]


async def test_a_mission_that_does_not_fit_is_refused_with_findings(world: MakeWorld) -> None:
    async with world() as here:
        (here.missions / "wrong.bpmn").write_bytes(scenarios.one_behavior("fly", VEHICLE))
        browser = await here.browser()
        answer = await browser.http.post("/api/runs", json={"mission": "wrong"})
        assert answer.status_code == 422
        problem = answer.json()
        assert problem["findings"][0]["severity"] == "error"
        assert problem["findings"][0]["element"]
        assert await here.control.runs() == []


async def test_signals_and_messages_reach_a_run(world: MakeWorld) -> None:
    async with world() as here:
        run = await here.control.start(SIGNALLED)
        browser = await here.browser()
        path = f"/api/runs/{run}"
        wrong = await browser.http.post(f"{path}/signals", json={"signal": "stay"})
        assert wrong.status_code == 409
        assert "go" in wrong.json()["detail"]
        assert (await browser.http.post("/api/signals", json={"signal": "go"})).status_code == 204
        answer = await browser.http.post(f"{path}/messages", json={"message": "Mail"})
        assert answer.status_code == 204
        assert (await here.control.wait(run)).status is RunStatus.COMPLETED


async def test_stop_stops_every_run_that_goes_on(world: MakeWorld) -> None:
    async with world() as here:
        ended = await here.asked()
        await here.control.stop(ended.run)
        await here.control.wait(ended.run)
        runs = [(await here.asked()).run for _ in range(2)]
        browser = await here.browser()
        await browser.http.post(f"/api/runs/{runs[0]}/pause")
        answer = await browser.http.post("/api/stop", json={"reason": "enough"})
        assert answer.json() == {"runs": runs}
        for run in runs:
            summary = await here.control.wait(run)
            assert (summary.status, summary.detail) == (RunStatus.STOPPED, "enough")
        assert (await browser.http.post("/api/stop", json={})).json() == {"runs": []}


async def test_a_vehicle_is_taken_and_given_back(world: MakeWorld) -> None:
    async with world(users={"otto": Role.OPERATOR}) as here:
        otto = await here.browser("otto")
        path = f"/api/resources/{VEHICLE}"
        assert (await otto.http.post(f"{path}/take")).status_code == 204
        found = (await otto.http.get("/api/resources")).json()
        assert found == {
            "holders": {VEHICLE: "otto"},
            "labels": {},
            "waiting": [],
            "shared_space": [],
            "unavailable": {VEHICLE: "with otto"},
        }
        again = await otto.http.post(f"{path}/take")
        assert (again.status_code, again.json()["detail"]) == (409, f"{VEHICLE} is with otto")
        assert (await otto.http.post(f"{path}/give-back")).status_code == 204
        assert (await otto.http.post("/api/resources/none/take")).status_code == 404


async def test_a_field_that_is_not_known_is_refused(world: MakeWorld) -> None:
    async with world() as here:
        browser = await here.browser()
        answer = await browser.http.post("/api/stop", json={"reson": "enough"})
        assert answer.status_code == 422
        assert answer.json()["wrong"][0]["where"] == "body.reson"


async def test_a_journal_that_cannot_be_read_is_said_to_be_it(world: MakeWorld) -> None:
    async with world() as here:

        async def broken() -> None:
            raise JournalError("the disk is gone")

        browser = await here.browser()
        here.control.runs = broken  # type: ignore[assignment, method-assign]
        answer = await browser.http.get("/api/runs")
        assert (answer.status_code, answer.json()["detail"]) == (503, "the disk is gone")


async def test_a_bug_is_told_without_its_secrets(world: MakeWorld) -> None:
    async with world() as here:

        async def broken() -> None:
            raise ZeroDivisionError("secret")

        browser = await here.browser()
        here.control.runs = broken  # type: ignore[assignment, method-assign]
        answer = await browser.http.get("/api/runs")
        assert answer.status_code == 500
        assert "secret" not in answer.text
        assert answer.headers["x-content-type-options"] == "nosniff"
