"""A server of its own process with the missions of this repository, and Chromium to look at it."""

import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import AsyncIterator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest
from m2pem_plugin_web import __file__ as plugin_file
from playwright.async_api import (
    Browser,
    BrowserContext,
    Page,
    StorageState,
    async_playwright,
)

WITHIN_S = 60.0
WITHIN_MS = 15_000
ROOT = Path(__file__).parents[5]
BUILT = Path(plugin_file).parent / "static" / "index.html"
_ADDRESS = re.compile(r"http://\S+/(?:\?token=\S+)?")


@dataclass
class Served:
    """An executive that serves the page. `missions`: its folder of missions."""

    address: str
    missions: Path
    state: StorageState | None = None
    """Of a browser that has signed in: the address does so once."""

    @property
    def base(self) -> str:
        return self.address.partition("/?")[0].rstrip("/")

    def tidy(self) -> None:
        """The missions of this repository, and nothing of the test before."""
        shutil.rmtree(self.missions, ignore_errors=True)
        shutil.copytree(ROOT / "missions", self.missions)


@contextmanager
def serving(folder: Path, fleet: str = "mehds.yaml") -> Iterator[Served]:
    """Serve a folder of missions on a free port, from a process of its own."""
    assert BUILT.is_file(), "the page is not built: npm run build in plugins/ocu/web/ui"
    missions = folder / "missions"
    missions.mkdir()
    environment = os.environ | {
        "M2PEM_WEB_PORT": "0",
        "M2PEM_WEB_MISSIONS": str(missions),
        "XDG_RUNTIME_DIR": str(folder),
    }
    arguments = ["serve", "--fleet", str(ROOT / "fleet_configs" / fleet), "--simulate"]
    with (folder / "said").open("w+") as said:
        process = subprocess.Popen(
            [sys.executable, "-m", "m2pem", *arguments, "--ocu", "web", "--journal", "memory:"],
            env=environment,
            cwd=folder,
            stdout=said,
            stderr=subprocess.STDOUT,
        )
        try:
            yield Served(_address(process, folder / "said"), missions)
        finally:
            process.terminate()
            process.wait(WITHIN_S)


def _address(process: "subprocess.Popen[bytes]", said: Path) -> str:
    until = time.monotonic() + WITHIN_S
    while not (found := _ADDRESS.search(said.read_text())):
        assert process.poll() is None, f"it ended: {said.read_text()}"
        assert time.monotonic() < until, f"it says no address: {said.read_text()}"
        time.sleep(0.05)
    return found.group(0)


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    """One server for all tests of this process: it takes seconds to start."""
    with serving(tmp_path_factory.mktemp("served")) as running:
        yield running


@pytest.fixture
def served(server: Served) -> Served:
    """A server with the missions of this repository."""
    server.tidy()
    return server


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
            storage_state=self.served.state,
        )
        self.context.set_default_timeout(WITHIN_MS)
        page = await self.context.new_page()
        page.on("pageerror", lambda error: self.faults.append(str(error)))
        page.on(
            "console",
            lambda message: self.faults.append(message.text) if message.type == "error" else None,
        )
        await page.goto(self.served.base if self.served.state else self.served.address)
        await page.wait_for_selector("h1")
        self.served.state = self.served.state or await self.context.storage_state()
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
