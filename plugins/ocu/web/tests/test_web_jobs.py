"""Verifications and rehearsals: ordered, come back for, ended."""

import asyncio
import json
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from m2pem_plugin_web.jobs import AT_ONCE, KEPT, MOST_WAITING
from rest_world import REPOSITORY, VIGNETTE, WITHIN_S, Rest, rest_world

SCHEMA = json.loads((REPOSITORY / "docs" / "verification.schema.json").read_text(encoding="utf-8"))
ANSWERS = (REPOSITORY / "missions/answers/vignette1_detection.yaml").read_text(encoding="utf-8")
LOOPS = 20
LARGE = (
    '<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" targetNamespace="t">'
    '<process id="P" isExecutable="true"><startEvent id="S"/><parallelGateway id="G"/>'
    '<sequenceFlow id="f" sourceRef="S" targetRef="G"/>'
    + "".join(
        f'<sequenceFlow id="a{n}" sourceRef="G" targetRef="X{n}"/><exclusiveGateway id="X{n}"/>'
        f'<sequenceFlow id="b{n}" sourceRef="X{n}" targetRef="U{n}"/><userTask id="U{n}"/>'
        f'<sequenceFlow id="c{n}" sourceRef="U{n}" targetRef="V{n}"/><userTask id="V{n}"/>'
        f'<sequenceFlow id="d{n}" sourceRef="V{n}" targetRef="X{n}"/>'
        for n in range(LOOPS)
    )
    + "</process></definitions>"
)
"""Loops side by side, without an end: a search that does not end within a test."""


async def ordered(rest: Rest, path: str, body: Any) -> str:
    return f"{path}/{(await rest.post(path, body, 202))['id']}"


async def test_a_verification_gives_the_report_of_the_command_line(tmp_path: Path) -> None:
    async with rest_world(tmp_path) as rest:
        await rest.put("/missions/one", {"xml": VIGNETTE, "base": None})
        place = await ordered(rest, "/verifications", {"mission": "one"})
        job = await rest.until_over(place)
        assert job["state"] == "done" and job["by"] == "a commander"
        jsonschema.validate(job["report"], SCHEMA)
        assert job["report"]["verdict"] == "holds" and job["progress"]["states"] > 0
        spec = 'requirements: [{id: never, ltl: "[] !active(Reverse)"}]'
        place = await ordered(rest, "/verifications", {"xml": VIGNETTE, "spec": spec})
        assert (await rest.until_over(place))["report"]["verdict"] == "violated"


async def test_a_verification_assumes_what_it_is_asked_to(tmp_path: Path) -> None:
    async with rest_world(tmp_path) as rest:
        asked = {"xml": VIGNETTE, "assume": ["no-failures"], "all_pools": True}
        job = await rest.until_over(await ordered(rest, "/verifications", asked))
        jsonschema.validate(job["report"], SCHEMA)
        assert job["report"]["assumed"] == "no-failures"
        wrong = {"xml": VIGNETTE, "assume": ["reliable(nothing)"]}
        job = await rest.until_over(await ordered(rest, "/verifications", wrong))
        assert job["state"] == "failed"
        assert "no vehicle, payload or team 'nothing'" in job["findings"][0]["message"]


async def test_a_verification_that_cannot_be_made_says_why(tmp_path: Path) -> None:
    async with rest_world(tmp_path) as rest:
        place = await ordered(rest, "/verifications", {"xml": VIGNETTE, "spec": "zzz: 1"})
        job = await rest.until_over(place)
        assert job["state"] == "failed" and job["findings"] and job["report"] is None
        assert job["findings"][0]["file"] == "requirements.yaml"


async def test_a_verification_tells_how_far_it_is_and_can_be_ended(tmp_path: Path) -> None:
    async with rest_world(tmp_path) as rest:
        place = await ordered(rest, "/verifications", {"xml": LARGE})
        async with asyncio.timeout(WITHIN_S):
            while (job := await rest.get(place))["progress"]["states"] == 0:
                assert job["state"] == "running", job
                await asyncio.sleep(0.02)
        await rest.delete(place)
        assert (await rest.get(place))["state"] == "cancelled"
        await rest.delete(place)
        await rest.delete("/verifications/none", 404)


async def test_too_many_at_once_are_refused_and_old_ones_forgotten(tmp_path: Path) -> None:
    async with rest_world(tmp_path) as rest:
        places = [
            await ordered(rest, "/verifications", {"xml": LARGE})
            for _ in range(AT_ONCE + MOST_WAITING)
        ]
        await rest.post("/verifications", {"xml": LARGE}, 429)
        for place in places:
            await rest.delete(place)
        last = await ordered(rest, "/verifications", {"xml": VIGNETTE})
        await rest.until_over(last)
        left = [(await rest.http.get(f"/api{place}")).status_code for place in places]
        assert left.count(200) <= KEPT


async def test_a_rehearsal_is_looked_at_like_a_run(tmp_path: Path) -> None:
    async with rest_world(tmp_path) as rest:
        body = {"xml": VIGNETTE, "answers": ANSWERS, "start": "2026-05-01T08:00:00Z"}
        place = await ordered(rest, "/rehearsals", body)
        job = await rest.until_over(place)
        assert job["state"] == "done" and job["summary"]["status"] == "terminated"
        assert job["summary"]["started_us"] == 1_777_622_400_000_000
        first = await rest.get(f"{place}/records?limit=5")
        assert first["records"][0]["record"] == "RunStarted" and first["next"] == 5
        rest_of = await rest.get(f"{place}/records?after=5&limit=5000")
        assert rest_of["records"][-1]["record"] == "RunEnded" and rest_of["next"] is None
        assert len(rest_of["records"]) + 5 == job["summary"]["records"]
        samples = await rest.get(f"{place}/telemetry")
        assert [each["t"] for each in samples[:3]] == [0, 0.5, 1]
        assert samples[0]["vehicles"]["evsg1"]["position"]["latitude_deg"]
        mission = await rest.get(f"{place}/mission")
        assert mission["process"] == "VIGNETTE1" and len(mission["files"]) == 1


async def test_a_rehearsal_that_cannot_be_made_says_why(tmp_path: Path) -> None:
    async with rest_world(tmp_path) as rest:
        place = await ordered(
            rest, "/rehearsals", {"xml": VIGNETTE, "answers": "answers: {No: [x]}"}
        )
        job = await rest.until_over(place)
        assert job["state"] == "failed" and job["findings"][0]["line"] == 1
        await rest.get(f"{place}/records", 409)
        await rest.get("/rehearsals/none/telemetry", 404)


@pytest.mark.parametrize("drafts", [False, pytest.param(True, marks=pytest.mark.long)])
async def test_problems_name_missions_and_not_where_they_are(tmp_path: Path, drafts: bool) -> None:
    async with rest_world(tmp_path) as rest:
        broken = VIGNETTE.replace("route_alpha", "no_such_route")
        called = LARGE.replace('id="S"', 'id="S" name=""').replace("startEvent", "zzz", 1)
        (tmp_path / "broken.bpmn").write_text(called, encoding="utf-8")
        said = []
        saved = {"mission": "broken"}
        bodies = [{"xml": called}, {"xml": broken, "mission": "my"}] if drafts else [saved]
        for kind in ("verifications", "rehearsals"):
            for body in bodies:
                job = await rest.until_over(await ordered(rest, f"/{kind}", body))
                assert str(tmp_path) not in json.dumps([job["problem"], job["findings"]])
                said.append(job["problem"])
        named = [each for each in said if each and each.startswith("broken.bpmn: ")]
        assert bool(named) != drafts
        answer = await rest.post("/runs", {"mission": "broken"}, 422)
        assert str(tmp_path) not in json.dumps(answer)
