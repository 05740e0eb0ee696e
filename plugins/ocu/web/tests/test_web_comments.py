"""Comments on the elements of missions, over REST and live."""

from m2pem_plugin_web.access.roles import Role
from web_world import MakeWorld

from m2pem.testing import scenarios

USERS = {
    "carla": Role.COMMANDER,
    "anna": Role.OPERATOR,
    "otto": Role.OPERATOR,
    "vera": Role.VIEWER,
}
PATH = "/api/missions/asks/comments"


async def test_operators_comment_answer_and_resolve_and_all_pages_know_it(
    world: MakeWorld,
) -> None:
    async with world(users=USERS) as here:
        (here.missions / "asks.bpmn").write_bytes(scenarios.question())
        anna, otto, vera = [await here.browser(name) for name in ("anna", "otto", "vera")]
        live = await vera.live()
        await live.watch(None)
        assert (await vera.http.get(PATH)).json() == []
        body = {"element": "Ask", "label": "Ask", "text": " Too slow? "}
        assert (await vera.http.post(PATH, json=body)).status_code == 403
        first = (await anna.http.post(PATH, json=body)).json()
        assert (first["id"], first["text"], first["by"]) == (1, "Too slow?", "anna")
        await live.until(lambda said: said == said | {"type": "comments", "mission": "asks"})
        answer = {"text": "No: the wind.", "parent": 1}
        second = (await otto.http.post(PATH, json=answer)).json()
        assert (second["element"], second["parent"]) == ("Ask", 1)
        nested = await anna.http.post(PATH, json={"text": "Why?", "parent": 2})
        assert nested.status_code == 409 and "is an answer" in nested.json()["detail"]
        resolved = await otto.http.post(f"{PATH}/1/resolve", json={"resolved": True})
        assert resolved.json()["resolved_by"] == "otto"
        await otto.http.post(f"{PATH}/1/resolve", json={"resolved": False})
        seen = (await vera.http.get(PATH)).json()
        assert [(each["id"], each["resolved_by"]) for each in seen] == [(1, ""), (2, "")]


async def test_only_own_comments_are_deleted_and_what_is_wrong_is_said(world: MakeWorld) -> None:
    async with world(users=USERS) as here:
        (here.missions / "asks.bpmn").write_bytes(scenarios.question())
        carla, anna, otto = [await here.browser(name) for name in ("carla", "anna", "otto")]
        for browser, text, parent in ((anna, "a", 0), (otto, "b", 1), (anna, "c", 0)):
            await browser.http.post(PATH, json={"text": text, "parent": parent})
        refused = await otto.http.delete(f"{PATH}/3")
        assert refused.status_code == 409 and "is by anna" in refused.json()["detail"]
        refused = await anna.http.delete(f"{PATH}/1")
        assert "has answers of otto" in refused.json()["detail"]
        assert (await anna.http.delete(f"{PATH}/3")).status_code == 204
        assert (await carla.http.delete(f"{PATH}/1")).status_code == 204
        assert (await carla.http.get(PATH)).json() == []
        assert (await anna.http.delete(f"{PATH}/1")).status_code == 404
        for wrong in ({"text": ""}, {"text": "  "}, {"text": "x" * 2001}, {"text": "x", "by": "z"}):
            assert (await anna.http.post(PATH, json=wrong)).status_code == 422
        other = await anna.http.post("/api/missions/nothing/comments", json={"text": "x"})
        assert other.status_code == 404


async def test_comments_outlive_new_versions_and_change_no_file(world: MakeWorld) -> None:
    async with world(users=USERS) as here:
        file = here.missions / "asks.bpmn"
        file.write_bytes(scenarios.question())
        carla = await here.browser("carla")
        before = (await carla.http.get("/api/missions/asks")).json()
        body = {"element": "Ask", "label": "Ask", "text": "Too slow?"}
        await carla.http.post(PATH, json=body)
        assert (await carla.http.get("/api/missions/asks")).json()["version"] == before["version"]
        assert file.read_bytes() == scenarios.question()
        changed = {"xml": before["xml"].replace("Ask", "Query"), "base": before["version"]}
        answer = await carla.http.put("/api/missions/asks", json=changed)
        assert answer.status_code == 200, answer.text
        (kept,) = (await carla.http.get(PATH)).json()
        assert (kept["element"], kept["version"]) == ("Ask", before["version"])
        assert len((await carla.http.get("/api/missions/asks/versions")).json()) == 2
