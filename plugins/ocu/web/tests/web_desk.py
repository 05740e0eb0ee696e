"""A desk for each test: one server and one browser serve all of them, for both take long to start.

Tests that use these fixtures run in the browser's event loop: `pytestmark = IN_ONE_LOOP`.
"""

import asyncio
import json
import shutil
from collections.abc import AsyncIterator, Iterator
from contextlib import AsyncExitStack
from dataclasses import dataclass, field
from typing import Any

import pytest
import pytest_asyncio
from playwright.async_api import Browser, Locator, Page, StorageState, expect
from web_browsing import TIMEOUT_MS, Watched, browser, key_of, page_at
from web_running import answer
from web_served import REPOSITORY, Served, served

IN_ONE_LOOP = pytest.mark.asyncio(loop_scope="session")
FLEET = REPOSITORY / "fleet_configs" / "mehds.yaml"
MISSION = "vignette1"
OPERATOR = "anna"
OVER = {"completed", "terminated", "failed", "stopped"}


@dataclass(slots=True)
class Desk:
    """Somebody who has signed in, with a profile of their own and the repository's missions."""

    executive: Served
    watched: Watched
    key: str
    refusals: list[int] = field(default_factory=list)
    """Answers that the test asks for, which Chromium logs as errors."""

    @property
    def page(self) -> Page:
        """Shows the list of missions, until the test goes elsewhere."""
        return self.watched.page

    async def another(self) -> Page:
        """A second tab; what it complains about counts as well."""
        page = await self.watched.context.new_page()
        self.watched.listen(page)
        return page

    async def home(self) -> Page:
        """The first page."""
        await self.page.goto(self.executive.origin)
        await expect(self.page.get_by_role("link", name=MISSION, exact=True)).to_be_visible()
        return self.page

    async def edit(self, mission: str = MISSION, page: Page | None = None, tab: str = "") -> Page:
        """The editor, with a mission drawn and a tab of its panel open."""
        page = page or self.page
        await page.goto(f"{self.executive.origin}/missions/{mission}")
        await page.wait_for_selector(".djs-shape")
        if tab:
            await page.get_by_role("tab", name=tab, exact=True).click()
        return page

    async def start(self) -> Page:
        """A new run of vignette 1, which asks its first question; its page."""
        run = (await self.ask("POST", "/api/runs", {"mission": MISSION}))["run"]
        await self.page.goto(f"{self.executive.origin}/runs/{run}")
        await expect(answer(self.page, "Continue")).to_be_enabled()
        await self.page.wait_for_selector(".glow")
        return self.page

    async def driving(self) -> Page:
        """The page of a run whose question was answered: vehicle evsg1 drives."""
        page = await self.start()
        await answer(page, "Continue").click()
        await expect(element(page, "DriveRoute")).to_contain_class("m2-active")
        return page

    async def ask(self, method: str, path: str, body: object = None) -> Any:
        """What the server answers a request of this person."""
        response = await self.watched.context.request.fetch(
            f"{self.executive.origin}{path}",
            method=method,
            headers={
                "Origin": self.executive.origin,
                "Content-Type": "application/json",
                "M2pem-Key": self.key,
            },
            data=None if body is None else json.dumps(body),
        )
        assert response.ok, await response.text()
        return json.loads(await response.text() or "null")

    async def release(self) -> None:
        """End what the test has started: others shall find all vehicles free."""
        for vehicle, holder in (await self.ask("GET", "/api/resources"))["holders"].items():
            if holder == OPERATOR:
                await self.ask("POST", f"/api/resources/{vehicle}/give-back")
        runs = await self.ask("GET", "/api/runs?limit=1000")
        if any(each["status"] not in OVER for each in runs):
            await self.ask("POST", "/api/stop", {"reason": "the test is over"})
        # A run that has ended still has its vehicles until they have stopped.
        async with asyncio.timeout(TIMEOUT_MS / 1000):
            while any((await self.ask("GET", "/api/resources"))["holders"].values()):
                await self.page.evaluate("new Promise(requestAnimationFrame)")

    def assert_well(self) -> None:
        """No page complained, but for refusals that the test has asked for."""
        said = [f"status of {status}" for status in self.refusals]
        assert [
            each for each in self.watched.complaints if not any(part in each for part in said)
        ] == []


def element(page: Page, name: str) -> Locator:
    """What is drawn of an element on the page of a run; its classes say its state."""
    return page.locator(f".drawing:not([hidden]) [data-element-id='{name}']").first


@pytest_asyncio.fixture(scope="session", loop_scope="session")
async def chromium() -> AsyncIterator[Browser]:
    """The browser."""
    async with browser() as started:
        yield started


@pytest.fixture(scope="session")
def executive(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    """An executive with the fleet of the field tests, all simulated."""
    with served(tmp_path_factory.mktemp("executive"), fleet=FLEET) as running:
        yield running


@pytest_asyncio.fixture(scope="session", loop_scope="session")
async def signed_in(chromium: Browser, executive: Served) -> StorageState:
    """Cookie and key of somebody who has signed in: the printed address does so once."""
    async with page_at(chromium, executive.url) as it:
        await it.page.get_by_role("heading", name="Missions").wait_for()
        return await it.context.storage_state()


@pytest_asyncio.fixture(loop_scope="session")
async def desk(
    request: pytest.FixtureRequest,
    chromium: Browser,
    executive: Served,
    signed_in: StorageState,
) -> AsyncIterator[Desk]:
    """A desk; dark if the test has a parameter `dark` that says so."""
    shutil.rmtree(executive.missions)
    shutil.copytree(REPOSITORY / "missions", executive.missions)
    dark = "callspec" in dir(request.node) and request.node.callspec.params.get("dark", False)
    async with AsyncExitStack() as stack:
        opening = page_at(chromium, "about:blank", dark=dark, state=signed_in)
        here = Desk(executive, await stack.enter_async_context(opening), key_of(signed_in))
        stack.push_async_callback(here.release)
        yield here
    here.assert_well()
