"""The contract of operator control units, with an operator at a browser's connection."""

import asyncio
import json
from pathlib import Path
from typing import Any

import pytest
from m2pem_plugin_web.ocu import WebOcu
from web_world import Browser, Live

from m2pem.api import MissionControl, OpenPrompt, RunId
from m2pem.testing import OcuContract
from m2pem.testing.contracts.ocu import MakeOcu, Operate


class Seat:
    """Who sits at the page: what it was told, and what its requests were answered with."""

    def __init__(self, ocu: WebOcu) -> None:
        self._ocu = ocu
        self._live: Live | None = None
        self._answers: list[str] = []
        self._browser = Browser(ocu.url.partition("?")[0].rstrip("/"))
        self._ready = asyncio.create_task(self._sit_down())
        self._asking: list[asyncio.Task[None]] = []

    async def _sit_down(self) -> None:
        await self._browser.open(self._ocu.url)
        self._live = await self._browser.live()
        await self._live.watch(None)

    def screen(self) -> str:
        told = self._live.said if self._live is not None else []
        lines = [json.dumps(each, ensure_ascii=False) for each in told]
        return "\n".join([*lines, *self._answers])

    async def answer(self, prompt: OpenPrompt, decision: str) -> None:
        self._post(f"/api/runs/{prompt.run}/prompts/{prompt.prompt}", {"decision": decision})

    async def stop(self, run: RunId) -> None:
        self._post(f"/api/runs/{run}/stop", {})

    def _post(self, path: str, body: dict[str, Any]) -> None:
        async def post() -> None:
            await self._ready
            self._answers.append((await self._browser.http.post(path, json=body)).text)

        self._asking.append(asyncio.create_task(post()))


class TestWeb(OcuContract):
    @pytest.fixture
    def make_ocu(self, tmp_path: Path) -> MakeOcu:
        environment = {"M2PEM_WEB_PORT": "0", "XDG_STATE_HOME": str(tmp_path)}

        def make(control: MissionControl) -> WebOcu:
            return WebOcu(control, environment=environment)

        return make

    @pytest.fixture
    def operate(self) -> Operate:
        return Seat
