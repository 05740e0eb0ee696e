"""A server of its own process with the missions of this repository, and Chromium to look at it."""

import asyncio
import os
import re
import shutil
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from m2pem_plugin_web import __file__ as plugin_file
from playwright.async_api import Browser, BrowserContext, Page, async_playwright

WITHIN_S = 60.0
WITHIN_MS = 15_000
ROOT = Path(__file__).parents[5]
BUILT = Path(plugin_file).parent / "static" / "index.html"
_ADDRESS = re.compile(r"http://\S+/(?:\?token=\S+)?")


@dataclass
class Served:
    """An executive that serves the page. `missions`: its folder of missions."""

    process: asyncio.subprocess.Process
    address: str
    missions: Path
    cookies: list[dict[str, object]] = field(default_factory=list)

    @property
    def base(self) -> str:
        return self.address.partition("/?")[0].rstrip("/")


@asynccontextmanager
async def serving(folder: Path, fleet: str = "mehds.yaml") -> AsyncIterator[Served]:
    """Serve a copy of this repository's missions on a free port."""
    assert BUILT.is_file(), "the page is not built: npm run build in plugins/ocu/web/ui"
    missions = folder / "missions"
    shutil.copytree(ROOT / "missions", missions)
    environment = os.environ | {
        "M2PEM_WEB_PORT": "0",
        "M2PEM_WEB_MISSIONS": str(missions),
        "XDG_RUNTIME_DIR": str(folder),
    }
    arguments = ["serve", "--fleet", str(ROOT / "fleet_configs" / fleet), "--simulate"]
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "m2pem", *arguments, "--ocu", "web", "--journal", "memory:"),
        env=environment,
        cwd=folder,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.STDOUT,
    )
    assert process.stdout is not None
    said = ""
    try:
        async with asyncio.timeout(WITHIN_S):
            while not (found := _ADDRESS.search(said)):
                line = await process.stdout.readline()
                assert line, f"it ended: {said}"
                said += line.decode()
        draining = asyncio.create_task(process.stdout.read())
        yield Served(process, found.group(0), missions)
        draining.cancel()
    finally:
        if process.returncode is None:
            process.terminate()
        await process.wait()


@pytest.fixture
async def served(tmp_path: Path) -> AsyncIterator[Served]:
    """A server with the missions of this repository."""
    async with serving(tmp_path) as server:
        yield server


class Browsing:
    """One person at a browser: pages that fail the test when they fail themselves."""

    def __init__(self, served: Served, browser: Browser) -> None:
        self.served = served
        self._browser = browser
        self.context: BrowserContext | None = None
        self.faults: list[str] = []

    async def begin(self, width: int = 1440, height: int = 900) -> Page:
        """A window that has signed in."""
        self.context = await self._browser.new_context(
            viewport={"width": width, "height": height},
            permissions=["clipboard-read", "clipboard-write"],
        )
        self.context.set_default_timeout(WITHIN_MS)
        page = await self.context.new_page()
        page.on("pageerror", lambda error: self.faults.append(str(error)))
        page.on(
            "console",
            lambda message: self.faults.append(message.text) if message.type == "error" else None,
        )
        await page.goto(self.served.address)
        return page

    async def edit(self, mission: str, page: Page | None = None) -> Page:
        """The editor, with a mission drawn."""
        page = page or await self.begin()
        await page.goto(f"{self.served.base}/missions/{mission}")
        await page.wait_for_selector(".djs-shape")
        return page


@pytest.fixture
async def browsing(served: Served) -> AsyncIterator[Browsing]:
    """Chromium. What a page logs as an error fails the test."""
    async with async_playwright() as playwright:
        executable = shutil.which("chromium") or shutil.which("google-chrome")
        browser = await playwright.chromium.launch(
            executable_path=executable,
            args=["--no-sandbox"] if os.geteuid() == 0 else [],
        )
        here = Browsing(served, browser)
        yield here
        await browser.close()
        assert here.faults == []
