"""A desk for each test: one server and one browser serve all of them, for both take long to start.

The desks of one operator also share a browser profile. It has loaded the page before, which takes a
browser longer than most tests; what a test leaves in it is removed.

Tests that use these fixtures run in the browser's event loop: `pytestmark = IN_ONE_LOOP`.
"""

import asyncio
import json
import shutil
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
import pytest_asyncio
from m2pem_plugin_web.access.roles import Role
from m2pem_plugin_web.access.users import User, write_users
from playwright.async_api import Browser, Locator, Page, expect
from web_browsing import SIGN_IN, TIMEOUT_MS, Watched, browser, page_at
from web_running import answer
from web_served import REPOSITORY, Served, served
from web_world import HASHED, PASSWORD

IN_ONE_LOOP = pytest.mark.asyncio(loop_scope="session")
FLEET = REPOSITORY / "fleet_configs" / "mehds.yaml"
MISSION = "vignette1"
OPERATOR = "anna"
PEOPLE = {OPERATOR: Role.COMMANDER, "otto": Role.OPERATOR, "vera": Role.VIEWER}
POLL_S = 0.05
CONDITIONS = {"QUESTION", "INCIDENT", "LINK_LOST", "BATTERY_LOW", "NOT_READY", "SPACE_VIOLATED"}
"""Alerts that end by themselves."""
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
        await expect(page.locator(".link-open")).to_have_count(1)  # else nothing is sent
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
        await self.until("/api/resources", lambda said: not any(said["holders"].values()))
        for alert in await self.ask("GET", "/api/alerts"):
            if alert["calls"] and alert["code"] not in CONDITIONS:
                await self.ask("POST", f"/api/alerts/{alert['alert']}/acknowledge")

    async def until(self, path: str, wanted: Callable[[Any], bool]) -> None:
        """Ask the server again and again, until its answer is what is wanted."""
        async with asyncio.timeout(TIMEOUT_MS / 1000):
            while True:
                if wanted(await self.ask("GET", path)):
                    return
                await asyncio.sleep(POLL_S)

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


def named_users(folder: Path) -> dict[str, str]:
    """Settings of an executive for `PEOPLE`, who have the same password."""
    path = folder / "users.json"
    write_users(path, {name: User(role, HASHED()) for name, role in PEOPLE.items()})
    return {"M2PEM_WEB_USERS": str(path)}


@pytest.fixture(scope="session")
def executive(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    """An executive with the fleet of the field tests, all simulated, and with named users."""
    folder = tmp_path_factory.mktemp("executive")
    with served(folder, fleet=FLEET, environment=named_users(folder)) as running:
        yield running


@asynccontextmanager
async def signed_in(
    chromium: Browser, executive: Served, name: str, **screen: Any
) -> AsyncIterator[Desk]:
    """The desk of a person who has a browser profile of their own and has just signed in.

    `screen`: as for `page_at`.
    """
    async with page_at(chromium, f"{executive.origin}/healthz", **screen) as it:
        key = await it.page.evaluate(SIGN_IN, [name, PASSWORD])
        yield Desk(executive, it, key)


@pytest_asyncio.fixture(scope="session", loop_scope="session")
async def profile(chromium: Browser, executive: Served) -> AsyncIterator[Desk]:
    """What all desks of the operator have in common."""
    async with signed_in(chromium, executive, OPERATOR) as first:
        yield first


async def forget(page: Page, origin: str, key: str) -> None:
    """Remove what pages of an origin, as `page` is, have stored, but for the key of the session."""
    session = await page.context.new_cdp_session(page)
    stored = {"origin": origin, "storageTypes": "indexeddb,local_storage"}
    await session.send("Storage.clearDataForOrigin", stored)
    await session.detach()
    await page.evaluate("key => localStorage.setItem('m2pem.key', JSON.stringify(key))", key)


@pytest_asyncio.fixture(loop_scope="session")
async def desk(request: pytest.FixtureRequest, profile: Desk) -> AsyncIterator[Desk]:
    """A desk; dark if the test has a parameter `dark` that says so."""
    executive, context = profile.executive, profile.watched.context
    shutil.rmtree(executive.missions)
    shutil.copytree(REPOSITORY / "missions", executive.missions)
    dark = "callspec" in dir(request.node) and request.node.callspec.params.get("dark", False)
    await forget(profile.page, executive.origin, profile.key)
    page = await context.new_page()
    await page.emulate_media(color_scheme="dark" if dark else "light")
    watched = Watched(page, context)
    watched.listen(page)
    here = Desk(executive, watched, profile.key)
    async with AsyncExitStack() as stack:
        stack.push_async_callback(close_pages, profile)
        stack.push_async_callback(here.release)
        yield here
    here.assert_well()


async def close_pages(profile: Desk) -> None:
    """Close all that tests have opened; a profile without a page takes longer to open the next."""
    for page in profile.watched.context.pages:
        if page is not profile.page:
            await page.close()
