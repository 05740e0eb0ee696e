"""`/healthz` and `/readyz`: answered without a session, and say nothing secret."""

import asyncio
from pathlib import Path
from unittest.mock import AsyncMock, Mock

import httpx
import pytest
from fastapi import FastAPI
from m2pem_plugin_web import probes, server
from m2pem_plugin_web.access.roles import Role
from web_world import MakeWorld, executive, serving

from m2pem.api import HealthCheck, HealthStatus, MissionControl
from m2pem.errors import OperatorError
from m2pem.journal import open_journal
from m2pem.journal.storage_checks import MIN_FREE_VARIABLE

READY = {"journal": "ok", "arbiters": "ok", "event loop": "ok"}


async def test_a_stranger_reads_that_it_is_live_and_ready(world: MakeWorld) -> None:
    async with world() as here:
        http = here.stranger().http
        live, ready = await http.get("/healthz"), await http.get("/readyz")
        assert (live.status_code, live.json()) == (200, {"status": "live"})
        assert (ready.status_code, ready.json()) == (200, {"status": "ready", "checks": READY})
        assert ready.headers["cache-control"] == live.headers["cache-control"] == "no-store"
        head = await http.head("/readyz")
        assert (head.status_code, head.content) == (200, b"")
        assert (await http.post("/readyz", json={})).status_code == 405


async def test_a_name_that_is_not_of_this_server_is_refused(world: MakeWorld) -> None:
    async with world() as here:
        answer = await here.stranger().http.get("/healthz", headers={"Host": "evil.example"})
        assert answer.status_code == 400


async def test_a_journal_that_does_not_write_is_not_ready_and_no_path_is_shown(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    journal = open_journal(str(tmp_path / "journal.db"))
    try:
        monkeypatch.setenv(MIN_FREE_VARIABLE, "1e15")
        running = executive(journal)
        async with running, serving(running.control, tmp_path, {}) as here:
            http = here.stranger().http
            answer = await http.get("/readyz")
            assert answer.status_code == 503
            checks = {**READY, "journal": "error"}
            assert answer.json() == {"status": "not ready", "checks": checks}
            assert (await http.get("/healthz")).status_code == 200
    finally:
        await journal.close()


async def test_probes_are_answered_while_too_many_pages_are_open(
    world: MakeWorld, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(server, "MOST_KNOWN", 2)
    async with world(users={"anna": Role.VIEWER}) as here:
        browser = await here.browser("anna")
        held = [
            await asyncio.open_connection("127.0.0.1", int(here.base.rpartition(":")[2]))
            for _ in range(3)
        ]
        try:
            for reader, writer in held:
                head = f"GET /api/session HTTP/1.1\r\nHost: {here.base.partition('//')[2]}\r\n"
                secrets = "".join(f"{name}: {text}\r\n" for name, text in browser.secrets.items())
                writer.write(f"{head}{secrets}\r\n".encode())
                await reader.readuntil(b"\r\n\r\n")
            http = here.stranger().http
            assert (await http.get("/")).status_code == 503
            assert (await http.get("/healthz")).status_code == 200
            assert (await http.get("/readyz")).status_code == 200
        finally:
            for _, writer in held:
                writer.close()


def app_of(control: MissionControl) -> httpx.AsyncClient:
    app = FastAPI()
    app.include_router(probes.router(control))
    return httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://127.0.0.1")


async def test_a_warning_is_ready() -> None:
    control = Mock(spec=MissionControl)
    check = HealthCheck("journal", HealthStatus.WARNING, "/secret/journal.db", "look")
    control.health = AsyncMock(return_value=[check])
    async with app_of(control) as http:
        answer = await http.get("/readyz")
    assert (answer.status_code, answer.json()["checks"]) == (200, {"journal": "warning"})


async def test_an_executive_in_another_process_that_is_gone_is_not_ready(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    control = Mock(spec=MissionControl)
    control.health = AsyncMock(side_effect=OperatorError("it is gone from /secret"))
    async with app_of(control) as http:
        gone = await http.get("/readyz")
        control.health = AsyncMock(side_effect=asyncio.Event().wait)
        monkeypatch.setattr(probes, "ANSWERED_WITHIN_S", 0.05)
        hangs = await http.get("/readyz")
    assert gone.status_code == hangs.status_code == 503
    assert gone.json() == hangs.json() == {"status": "not ready", "checks": {"executive": "error"}}
