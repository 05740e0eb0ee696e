"""Named users: their roles, their passwords, and what ends their sessions."""

import asyncio
import json
import time
from pathlib import Path

import pytest
from m2pem_plugin_web.access.passwords import hash_password
from m2pem_plugin_web.access.private_files import NotPrivateError
from m2pem_plugin_web.access.roles import Role
from m2pem_plugin_web.access.sessions import IDLE_S, LONGEST_S, Sessions, hash_of
from m2pem_plugin_web.access.sign_in import OF_A_NAME_HERE, WITHIN_S, Throttle
from m2pem_plugin_web.access.users import User, Users, write_users
from m2pem_plugin_web.live.socket import SIGNED_OUT
from web_world import PASSWORD, VEHICLE, MakeWorld

from m2pem.api import RunStatus
from m2pem.api import records as r
from m2pem.errors import PluginError
from m2pem.testing import scenarios

EVERYBODY = {"vera": Role.VIEWER, "otto": Role.OPERATOR, "carla": Role.COMMANDER}


def test_a_role_covers_those_before_it() -> None:
    assert [a.covers(b) for a in Role for b in Role] == [
        *(True, False, False),
        *(True, True, False),
        *(True, True, True),
    ]


# --- what roles may do --------------------------------------------------------------------------


async def test_a_viewer_sees_all_and_stops_nothing(world: MakeWorld) -> None:
    async with world(users=EVERYBODY) as here:
        prompt = await here.asked()
        vera = await here.browser("vera")
        assert (await vera.http.get("/api/session")).json()["role"] == "viewer"
        for path in ("runs", f"runs/{prompt.run}", "prompts", "resources"):
            assert (await vera.http.get(f"/api/{path}")).status_code == 200
        assert (await (await vera.live()).watch(prompt.run))["run"] == prompt.run
        run = f"/api/runs/{prompt.run}"
        for path, body in {
            "/api/stop": {},
            f"{run}/stop": {},
            f"{run}/pause": None,
            f"{run}/resume": None,
            f"{run}/signals": {"signal": "x"},
            f"{run}/messages": {"message": "x"},
            f"{run}/prompts/{prompt.prompt}": {"decision": "continue"},
            "/api/signals": {"signal": "x"},
            f"/api/resources/{VEHICLE}/take": None,
            f"/api/resources/{VEHICLE}/give-back": None,
            "/api/runs": {"mission": "x"},
        }.items():
            answer = await vera.http.post(path, json=body)
            assert answer.status_code == 403, path
            assert "viewer" in answer.json()["detail"]
        (summary,) = await here.control.runs()
        assert summary.status is RunStatus.RUNNING


async def test_an_operator_answers_and_stops_but_starts_nothing(world: MakeWorld) -> None:
    async with world(users=EVERYBODY) as here:
        prompt = await here.asked()
        otto = await here.browser("otto")
        assert (await otto.http.post("/api/runs", json={"mission": "x"})).status_code == 403
        answer = await otto.http.post(
            f"/api/runs/{prompt.run}/prompts/{prompt.prompt}", json={"decision": "abort"}
        )
        assert answer.status_code == 204
        again = await here.asked()
        body = {"reason": "enough"}
        assert (await otto.http.post("/api/stop", json=body)).json() == {"runs": [again.run]}
        assert (await here.control.wait(again.run)).status is RunStatus.STOPPED


async def test_the_journal_says_who_did_it(world: MakeWorld) -> None:
    async with world(users=EVERYBODY) as here:
        (here.missions / "asks.bpmn").write_bytes(scenarios.question())
        carla = await here.browser("carla")
        run = (await carla.http.post("/api/runs", json={"mission": "asks"})).json()["run"]
        otto = await here.browser("otto")
        assert (await otto.http.post(f"/api/runs/{run}/pause")).status_code == 204
        assert (await carla.http.post(f"/api/runs/{run}/resume")).status_code == 204
        path = f"/api/runs/{run}/prompts/{here.control.prompts()[0].prompt}"
        assert (await otto.http.post(path, json={"decision": "abort"})).status_code == 204
        await here.control.wait(run)
        by = {
            type(each.record): each.record.by
            for each in await here.control.records(run)
            if isinstance(each.record, r.RunStarted | r.RunPaused | r.RunResumed | r.PromptAnswered)
        }
        assert by == {
            r.RunStarted: "carla",
            r.RunPaused: "otto",
            r.RunResumed: "carla",
            r.PromptAnswered: "otto",
        }


# --- signing in ---------------------------------------------------------------------------------


async def test_where_users_are_named_no_token_is_printed(world: MakeWorld) -> None:
    async with world(users=EVERYBODY) as here:
        assert "token" not in here.ocu.url
        answer = await here.stranger().http.post("/api/session", json={"token": ""})
        assert answer.status_code == 401
        assert "name and its password" in answer.json()["detail"]


async def test_where_nobody_is_named_nobody_signs_in_by_name(world: MakeWorld) -> None:
    async with world() as here:
        body = {"name": "anna", "password": PASSWORD}
        answer = await here.stranger().http.post("/api/session", json=body)
        assert answer.status_code == 401
        assert "m2pem web url" in answer.json()["detail"]


async def test_a_wrong_name_or_password_is_told_alike(world: MakeWorld) -> None:
    async with world(users=EVERYBODY) as here:
        stranger = here.stranger()
        told = set()
        for name, password in (("vera", "wrong"), ("nobody", PASSWORD), ("vera", "")):
            body = {"name": name, "password": password}
            answer = await stranger.http.post("/api/session", json=body)
            assert answer.status_code == 401
            assert "set-cookie" not in answer.headers
            told.add(answer.text)
        assert len(told) == 1


async def test_who_guesses_has_to_wait_and_others_do_not(world: MakeWorld) -> None:
    async with world(users=EVERYBODY) as here:
        stranger = here.stranger()
        body = {"name": "vera", "password": "guess"}
        answers = await asyncio.gather(
            *(stranger.http.post("/api/session", json=body) for _ in range(OF_A_NAME_HERE + 3))
        )
        assert {each.status_code for each in answers} == {401, 429}
        assert [each.status_code for each in answers].count(401) <= OF_A_NAME_HERE
        right = {"name": "vera", "password": PASSWORD}
        late = await stranger.http.post("/api/session", json=right)
        assert late.status_code == 429
        assert 0 < int(late.headers["retry-after"]) <= WITHIN_S
        assert (await here.browser("otto")).cookie


async def test_who_signs_out_is_out_and_so_is_the_page(world: MakeWorld) -> None:
    async with world(users=EVERYBODY) as here:
        browser = await here.browser("otto")
        live = await browser.live()
        secrets = browser.secrets
        assert (await browser.http.delete("/api/session")).status_code == 204
        assert await live.until_closed() == SIGNED_OUT
        answer = await here.stranger().http.get("/api/session", headers=secrets)
        assert answer.status_code == 401


async def test_who_is_removed_is_out_at_once(world: MakeWorld) -> None:
    async with world(users=EVERYBODY) as here:
        path = world.folder / "users.json"
        otto, vera = await here.browser("otto"), await here.browser("vera")
        users = dict(Users(path).all())
        del users["otto"]
        users["vera"] = User(Role.OPERATOR, users["vera"].password)
        write_users(path, users)
        assert (await otto.http.get("/api/session")).status_code == 401
        assert (await vera.http.get("/api/session")).json()["role"] == "operator"


async def test_a_new_password_ends_sessions(world: MakeWorld) -> None:
    async with world(users={"otto": Role.OPERATOR}) as here:
        otto = await here.browser("otto")
        user = User(Role.OPERATOR, hash_password("another one"))
        write_users(world.folder / "users.json", {"otto": user})
        assert (await otto.http.get("/api/session")).status_code == 401
        assert (await here.stranger().sign_in("otto", "another one")).cookie


# --- files --------------------------------------------------------------------------------------


async def test_a_file_of_users_that_others_can_read_is_refused(
    world: MakeWorld, tmp_path: Path
) -> None:
    path = tmp_path / "open.json"
    write_users(path, {"vera": User(Role.VIEWER, "x")})
    assert path.stat().st_mode & 0o777 == 0o600
    path.chmod(0o640)
    with pytest.raises(PluginError, match="chmod 600"):
        async with world(M2PEM_WEB_USERS=str(path)):
            pass


@pytest.mark.parametrize(
    "text", ["", "[]", '{"a":{"role":"king","password":""}}', '{"../a":{"role":"viewer"}}']
)
def test_a_damaged_file_of_users_is_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "users.json"
    path.touch(mode=0o600)
    path.write_text(text)
    with pytest.raises(NotPrivateError, match=r"users\.json"):
        Users(path).all()


async def test_when_the_file_of_users_is_gone_nobody_is_let_in(world: MakeWorld) -> None:
    async with world(users=EVERYBODY) as here:
        browser = await here.browser("carla")
        (world.folder / "users.json").unlink()
        assert (await browser.http.get("/api/session")).status_code == 401


# --- sessions and attempts, over time -----------------------------------------------------------


class Clock:
    now = 1_000_000.0

    def __call__(self) -> float:
        return self.now


def test_a_session_ends_when_it_is_not_used_and_after_a_week_anyway() -> None:
    clock = Clock()
    sessions = Sessions(clock=clock)
    idle, used = sessions.begin("anna"), sessions.begin("ben")
    clock.now += IDLE_S / 2
    assert sessions.find(*used)
    clock.now += IDLE_S / 2 + 1
    assert sessions.find(*idle) is None
    began = clock.now
    while clock.now - began < LONGEST_S:
        sessions.find(*used)
        clock.now += IDLE_S / 2
    assert sessions.find(*used) is None


def test_sessions_are_kept_as_hashes(tmp_path: Path) -> None:
    kept = tmp_path / "sessions.json"
    made = Sessions(kept).begin("anna")
    assert not [each for each in made if each in kept.read_text()]
    assert kept.stat().st_mode & 0o777 == 0o600
    again = Sessions(kept)
    found = again.find(*made)
    assert found is not None
    assert found.name == "anna"
    again.end(made.cookie)
    assert Sessions(kept).find(*made) is None


def test_only_the_right_key_makes_a_session_last_longer() -> None:
    clock = Clock()
    sessions = Sessions(clock=clock)
    cookie, key = sessions.begin("anna")
    other = sessions.begin("ben")
    for wrong in ("", "x" * 43, cookie, other.key):
        assert sessions.find(cookie, wrong) is None
    clock.now += IDLE_S / 2
    assert sessions.of_cookie(cookie) is not None
    assert sessions.find(cookie, "wrong") is None
    clock.now += IDLE_S / 2 + 1
    assert sessions.find(cookie, key) is None


def test_a_session_without_a_key_of_an_older_release_lets_nobody_in(tmp_path: Path) -> None:
    kept = tmp_path / "sessions.json"
    kept.touch(mode=0o600)
    old = {"name": "anna", "proof": "", "began": time.time(), "used": time.time()}
    kept.write_text(json.dumps({hash_of("its cookie"): old}))
    sessions = Sessions(kept)
    assert sessions.of_cookie("its cookie") is not None
    assert [sessions.find("its cookie", key) for key in ("", "its cookie")] == [None, None]


def test_a_damaged_file_of_sessions_is_forgotten(tmp_path: Path) -> None:
    kept = tmp_path / "sessions.json"
    kept.touch(mode=0o600)
    kept.write_text("{")
    assert Sessions(kept).begin("anna")


def test_attempts_are_looked_at_again_after_a_while() -> None:
    clock = Clock()
    throttle = Throttle(clock)
    bounds = {"anna": 2}
    for _ in range(2):
        assert throttle.wait_s(bounds) == 0
        throttle.failed(bounds)
        clock.now += 10
    assert throttle.wait_s(bounds) == WITHIN_S - 20
    clock.now += WITHIN_S - 20
    assert throttle.wait_s(bounds) == 0
    throttle.failed(bounds)
    throttle.succeeded(bounds)
    throttle.failed(bounds)
    throttle.forget("anna")
    assert throttle.wait_s(bounds) == 0
