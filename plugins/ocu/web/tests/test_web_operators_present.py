"""Pages announce who is present; operators ask each other for vehicles over REST."""

from m2pem_plugin_web.access.roles import Role
from web_world import VEHICLE, MakeWorld

USERS = {"anna": Role.OPERATOR, "otto": Role.OPERATOR, "vera": Role.VIEWER}


async def test_a_page_is_present_until_it_is_closed(world: MakeWorld) -> None:
    async with world(users=USERS) as here:
        prompt = await here.asked()
        anna, vera = await here.browser("anna"), await here.browser("vera")
        live = await vera.live()
        await live.watch(None)
        page = await anna.live()
        await page.watch(prompt.run)
        await live.until(lambda said: said["type"] == "operators")
        found = (await vera.http.get("/api/operators")).json()["operators"]
        seen = [(each["by"], each["unit"], each["role"], each["run"]) for each in found]
        assert ("anna", "page", "operator", prompt.run) in seen
        before = len(live.said)
        await page.close()
        await live.until(lambda said: said["type"] == "operators", before)
        found = (await vera.http.get("/api/operators")).json()["operators"]
        assert [each["by"] for each in found] == ["vera"]


async def test_an_operator_asks_another_for_a_vehicle(world: MakeWorld) -> None:
    async with world(users=USERS) as here:
        anna, otto, vera = [await here.browser(name) for name in USERS]
        live = await anna.live()
        await live.watch(None)
        path = f"/api/resources/{VEHICLE}"
        assert (await otto.http.post(f"{path}/request")).status_code == 409
        await anna.http.post(f"{path}/take")
        assert (await vera.http.post(f"{path}/request")).status_code == 403
        assert (await otto.http.post(f"{path}/request")).status_code == 204
        (request,) = (await anna.http.get("/api/operators")).json()["control_requests"]
        assert (request["by"], request["holder"], request["mine"], request["own"]) == (
            "otto",
            "anna",
            True,
            False,
        )
        assert not request["holder_gone"]
        give = {"give": True}
        assert (await otto.http.post(f"{path}/hand-over", json=give)).status_code == 409
        assert (await anna.http.post(f"{path}/hand-over", json=give)).status_code == 204
        assert (await here.control.holders())[VEHICLE] == "otto"
        await live.until(lambda said: "anna has given" in said.get("text", ""))


async def test_who_edits_a_mission_is_known_to_others(world: MakeWorld) -> None:
    users = {"carla": Role.COMMANDER, "otto": Role.OPERATOR}
    async with world(users=users) as here:
        carla, otto = await here.browser("carla"), await here.browser("otto")
        live, page = await otto.live(), await carla.live()
        await live.watch(None)
        await page.watch(None)

        async def editing() -> list[tuple[str, str]]:
            found = (await otto.http.get("/api/operators")).json()["operators"]
            return [(each["by"], each["editing"]) for each in found]

        before = len(live.said)
        await page.send(type="edit", mission="patrol")
        await live.until(lambda said: said["type"] == "operators", before)
        assert await editing() == [("carla", "patrol"), ("otto", "")]
        await live.send(type="edit", mission="patrol")  # an operator edits nothing
        before = len(live.said)
        await page.send(type="edit", mission=None)
        await live.until(lambda said: said["type"] == "operators", before)
        assert await editing() == [("carla", ""), ("otto", "")]


async def test_what_one_has_who_is_there_goes_back_only_by_them(world: MakeWorld) -> None:
    async with world(users=USERS) as here:
        anna, otto, vera = [await here.browser(name) for name in USERS]
        page = await anna.live()
        await page.watch(None)
        path = f"/api/resources/{VEHICLE}"
        await anna.http.post(f"{path}/take")
        for body in (None, {"reason": "I want it"}):
            answer = await otto.http.post(f"{path}/give-back", json=body)
            assert answer.status_code == 409
            assert "is with anna, who gives it back" in answer.json()["detail"]
        many = {"resources": [VEHICLE], "reason": "I want it"}
        answer = await otto.http.post("/api/fleet/give-back", json=many)
        assert "is with anna" in answer.json()["results"][0]["problem"]
        assert (await vera.http.post("/api/fleet/request", json=many)).status_code == 403
        wanted = {"resources": [VEHICLE]}
        assert (await otto.http.post("/api/fleet/request", json=wanted)).json()["results"] == [
            {"resource": VEHICLE, "run": "", "problem": ""}
        ]
        assert (await anna.http.post(f"{path}/give-back")).status_code == 204
        assert (await here.control.holders())[VEHICLE] == ""


async def test_a_note_is_in_the_log_of_every_page(world: MakeWorld) -> None:
    async with world(users=USERS) as here:
        prompt = await here.asked()
        anna, otto, vera = [await here.browser(name) for name in USERS]
        live = await vera.live()
        await live.watch(prompt.run)
        path = f"/api/runs/{prompt.run}/notes"
        assert (await vera.http.post(path, json={"text": "x"})).status_code == 403
        assert (await otto.http.post(path, json={"text": "wind picks up"})).status_code == 204
        said = await live.until(
            lambda said: (
                said["type"] == "log"
                and any(each["record"] == "OperatorNote" for each in said["records"])
            )
        )
        note = next(each for each in said["records"] if each["record"] == "OperatorNote")
        assert (note["sentence"], note["by"]) == ("otto: wind picks up", "otto")
        assert (await anna.http.post("/api/runs/r9/notes", json={"text": "x"})).status_code == 404
