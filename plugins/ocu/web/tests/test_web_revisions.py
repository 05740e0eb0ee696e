"""A running mission goes on with a new version of its file: the plan and the revision by HTTP."""

from m2pem_plugin_web.access.roles import Role
from web_world import MakeWorld

from m2pem.testing import scenarios

OTHER = scenarios.question("Really go on?", ("continue", "abort", "later"))
GONE = scenarios.question().replace(b'"Question"', b'"Another"')
WRONG = b"no BPMN"


async def test_a_plan_is_seen_and_carried_out(world: MakeWorld) -> None:
    async with world() as here:
        asked = await here.asked()
        path = f"/api/runs/{asked.run}/revision"
        (here.missions / "other.bpmn").write_bytes(OTHER)
        browser = await here.browser()
        answer = await browser.http.post(f"{path}/plan", json={"mission": "other"})
        plan = answer.json()
        assert plan["possible"] is True
        assert [(each["kind"], each["element"]) for each in plan["effects"]] == [
            ("restarts", "Question")
        ]
        assert plan["changes"] == ["changed: user task Question (prompt)"]
        wanted = {"mission": "other", "plan": plan["plan"]}
        assert (await browser.http.post(path, json=wanted)).status_code == 204
        (prompt,) = here.control.prompts()
        assert prompt.text == "Really go on?"
        files = (await browser.http.get(f"/api/runs/{asked.run}/mission")).json()["files"]
        assert "Really go on?" in files[0]["xml"]
        records = (await browser.http.get(f"/api/runs/{asked.run}/records")).json()["records"]
        (revised,) = [each for each in records if each["record"] == "MissionRevised"]
        assert revised["version"] == plan["version"]
        # The plan is of the version before, so that it holds no more.
        again = await browser.http.post(path, json=wanted)
        assert again.status_code == 409


async def test_what_is_refused_says_where_the_token_can_go(world: MakeWorld) -> None:
    async with world() as here:
        asked = await here.asked()
        path = f"/api/runs/{asked.run}/revision"
        (here.missions / "gone.bpmn").write_bytes(GONE)
        browser = await here.browser()
        plan = (await browser.http.post(f"{path}/plan", json={"mission": "gone"})).json()
        assert plan["possible"] is False
        (refusal,) = plan["refusals"]
        assert (refusal["element"], refusal["candidates"]) == ("Question", ["End", "Another"])
        assert refusal["labels"] == ["end event End", "user task Another"]
        assert refusal["resources"] == []
        assert refusal["can_end"] is True
        refused = await browser.http.post(path, json={"mission": "gone", "plan": plan["plan"]})
        assert refused.status_code == 409
        assert "a token is on user task Question" in refused.text
        wanted = {"mission": "gone", "moves": {"Question": "Another"}}
        plan = (await browser.http.post(f"{path}/plan", json=wanted)).json()
        done = await browser.http.post(path, json={**wanted, "plan": plan["plan"]})
        assert done.status_code == 204


async def test_a_file_that_is_not_in_the_folder_is_a_new_version(world: MakeWorld) -> None:
    async with world() as here:
        asked = await here.asked()
        path = f"/api/runs/{asked.run}/revision"
        browser = await here.browser()
        wanted = {"mission": "other", "xml": OTHER.decode()}
        plan = (await browser.http.post(f"{path}/plan", json=wanted)).json()
        assert plan["possible"] is True
        done = await browser.http.post(path, json={**wanted, "plan": plan["plan"]})
        assert done.status_code == 204
        assert not (here.missions / "other.bpmn").exists()
        both = {**wanted, "version": "1"}
        assert (await browser.http.post(f"{path}/plan", json=both)).status_code == 422


async def test_a_file_that_is_wrong_and_a_run_that_is_none(world: MakeWorld) -> None:
    async with world() as here:
        asked = await here.asked()
        (here.missions / "wrong.bpmn").write_bytes(WRONG)
        browser = await here.browser()
        path = f"/api/runs/{asked.run}/revision/plan"
        assert (await browser.http.post(path, json={"mission": "wrong"})).status_code == 422
        assert (await browser.http.post(path, json={"mission": "none"})).status_code == 404
        for more in ({}, {"xml": OTHER.decode()}):  # a name is written without .bpmn
            named = await browser.http.post(path, json={"mission": "a.bpmn", **more})
            assert named.status_code == 422
            assert "a name is written without .bpmn" in named.json()["detail"]
        other = "/api/runs/r99/revision/plan"
        assert (await browser.http.post(other, json={"mission": "wrong"})).status_code == 404


async def test_only_who_starts_missions_revises_them(world: MakeWorld) -> None:
    async with world(users={"otto": Role.OPERATOR, "vera": Role.VIEWER}) as here:
        asked = await here.asked()
        (here.missions / "other.bpmn").write_bytes(OTHER)
        path, wanted = f"/api/runs/{asked.run}/revision", {"mission": "other"}
        operator, viewer = await here.browser("otto"), await here.browser("vera")
        plan = await operator.http.post(f"{path}/plan", json=wanted)
        assert plan.status_code == 200
        body = {**wanted, "plan": plan.json()["plan"]}
        assert (await operator.http.post(path, json=body)).status_code == 403
        assert (await viewer.http.post(f"{path}/plan", json=wanted)).status_code == 403


async def test_versions_are_listed_and_a_run_is_revised_back(world: MakeWorld) -> None:
    async with world(users={"carol": Role.COMMANDER}) as here:
        asked = await here.asked()
        path = f"/api/runs/{asked.run}"
        browser = await here.browser("carol")
        (begun,) = (await browser.http.get(f"{path}/versions")).json()
        assert (begun["seq"], begun["shared_with"]) == (1, [])
        other = await here.asked()
        wanted = {"mission": "other", "xml": OTHER.decode()}
        plan = (await browser.http.post(f"{path}/revision/plan", json=wanted)).json()
        done = await browser.http.post(f"{path}/revision", json={**wanted, "plan": plan["plan"]})
        assert done.status_code == 204
        first, last = (await browser.http.get(f"{path}/versions")).json()
        assert first == {**begun, "shared_with": [other.run]}
        assert (last["version"], last["by"]) == (plan["version"], "carol")
        assert last["seq"] > 1
        assert last["at_us"] >= first["at_us"] > 0

        drawn = await browser.http.get(f"{path}/mission", params={"version": first["version"]})
        (file,) = drawn.json()["files"]
        assert "Really go on?" not in file["xml"]
        back = {"had": first["version"]}
        plan = (await browser.http.post(f"{path}/revision/plan", json=back)).json()
        assert (plan["version"], plan["previous"]) == (first["version"], last["version"])
        done = await browser.http.post(f"{path}/revision", json={**back, "plan": plan["plan"]})
        assert done.status_code == 204
        versions = (await browser.http.get(f"{path}/versions")).json()
        assert [each["version"] for each in versions] == [
            first["version"],
            last["version"],
            first["version"],
        ]


async def test_a_version_that_the_run_has_not_had_is_refused(world: MakeWorld) -> None:
    async with world() as here:
        asked = await here.asked()
        path = f"/api/runs/{asked.run}"
        browser = await here.browser()
        answer = await browser.http.post(f"{path}/revision/plan", json={"had": "0" * 64})
        assert answer.status_code == 409
        assert "has not had version '000000000000'; it has had" in answer.text
        drawn = await browser.http.get(f"{path}/mission", params={"version": "0" * 64})
        assert drawn.status_code == 409
        assert (await browser.http.get("/api/runs/r99/versions")).status_code == 404
        for wrong in ({}, {"mission": "other", "had": "0"}, {"had": "0", "xml": "<a/>"}):
            sent = await browser.http.post(f"{path}/revision/plan", json=wrong)
            assert sent.status_code == 422
