"""Approvals over REST: named users draw, approve and start."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import replace
from pathlib import Path

from m2pem_plugin_web.access.roles import Role
from m2pem_plugin_web.access.users import User, write_users
from web_world import HASHED, PLUGINS, SPEED, VEHICLE, World, serving

from m2pem.api.clock import SystemClock
from m2pem.executive.executive import Executive
from m2pem.journal import MemoryJournal
from m2pem.testing import scenarios

USERS = {"anna": Role.COMMANDER, "bob": Role.OPERATOR, "vera": Role.VIEWER}


@asynccontextmanager
async def asking(folder: Path, users: dict[str, Role] | None = None) -> AsyncIterator[World]:
    """The page of a fleet that asks for the approval of one person."""
    environment = {}
    if users:
        path = folder / "users.json"
        write_users(path, {name: User(role, HASHED()) for name, role in users.items()})
        environment = {"M2PEM_WEB_USERS": str(path)}
    fleet = replace(scenarios.fleet("sim", {VEHICLE: {}}), approval_persons=1)
    running = Executive(fleet, MemoryJournal(), PLUGINS, SystemClock(SPEED), speed=SPEED)
    async with running, serving(running.control, folder, environment) as world:
        yield world


async def test_who_draws_a_mission_starts_it_when_another_has_approved_it(tmp_path: Path) -> None:
    async with asking(tmp_path, USERS) as here:
        anna, bob, vera = [await here.browser(name) for name in USERS]
        xml = scenarios.question().decode()
        saved = await anna.http.put("/api/missions/asks", json={"xml": xml, "base": None})
        start = {"mission": "asks"}
        refused = await anna.http.post("/api/runs", json=start)
        assert (refused.status_code, refused.json()["missing"]) == (409, 1)
        shown = (await vera.http.get("/api/missions/asks/approval")).json()
        assert shown["editors"] == ["anna"]
        assert shown["who"] == "1 person other than anna, who edited it"
        wanted = {"digest": shown["digest"]}
        for browser, status in ((vera, 403), (anna, 409), (bob, 200)):
            answer = await browser.http.post("/api/missions/asks/approval", json=wanted)
            assert answer.status_code == status, answer.text
        assert (await anna.http.post("/api/runs", json=start)).status_code == 201
        await here.control.stop_all()
        # A change needs an approval anew, and not that of what was shown before.
        again = {"xml": f"{xml}<!-- -->", "base": saved.json()["version"]}
        await anna.http.put("/api/missions/asks", json=again)
        assert (await anna.http.post("/api/runs", json=start)).status_code == 409
        late = await bob.http.post("/api/missions/asks/approval", json=wanted)
        assert (late.status_code, "changed since bob" in late.text) == (409, True)
        shown = (await bob.http.get("/api/missions/asks/approval")).json()
        assert [each["changed"] for each in shown["earlier"]] == [["the mission file"]]
        wanted = {"digest": shown["digest"]}
        answer = await bob.http.post("/api/missions/asks/approval", json=wanted)
        assert answer.json()["missing"] == 0
        answer = await bob.http.post("/api/missions/asks/approval/withdraw")
        assert answer.json()["missing"] == 1


async def test_one_person_with_the_token_cannot_approve_their_own(tmp_path: Path) -> None:
    async with asking(tmp_path) as here:
        owner = await here.browser()
        xml = scenarios.question().decode()
        await owner.http.put("/api/missions/asks", json={"xml": xml, "base": None})
        shown = (await owner.http.get("/api/missions/asks/approval")).json()
        wanted = {"digest": shown["digest"]}
        answer = await owner.http.post("/api/missions/asks/approval", json=wanted)
        assert (answer.status_code, "edited it" in answer.text) == (409, True)
        # Nor what they put into the folder without saving it on the page.
        (here.missions / "copied.bpmn").write_bytes(scenarios.question() + b"\n")
        shown = (await owner.http.get("/api/missions/copied/approval")).json()
        wanted = {"digest": shown["digest"]}
        answer = await owner.http.post("/api/missions/copied/approval", json=wanted)
        assert answer.json()["missing"] == 1
        assert (await owner.http.post("/api/runs", json={"mission": "copied"})).status_code == 409
