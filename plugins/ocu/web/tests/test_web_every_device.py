"""Every page, in every look, on every device has no violation that axe-core knows.

One operator's browser and one executive serve the whole table. What is usually run is one cell of
each page, so that each look and each device is there.
"""

import os
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Any

import pytest
from playwright.async_api import Browser, Page, Route, expect
from test_web_editor_survey import drawn_area
from test_web_plots import open_plots
from web_axe import Accessibility
from web_browsing import page_at
from web_desk import IN_ONE_LOOP, Desk
from web_drawing import new_mission

pytestmark = IN_ONE_LOOP

LOOKS: dict[str, dict[str, Any]] = {
    "light": {},
    "dark": {"color_scheme": "dark"},
    "high contrast": {"contrast": "more"},
    "forced colours": {"forced_colors": "active"},
}
NO_LOOK = {"color_scheme": "light", "contrast": "no-preference", "forced_colors": "none"}
DEVICES = {
    "desk": (1280, 720),
    "phone": (390, 844),
    "phone on its side": (844, 390),
    "tablet": (1024, 768),
    "4K": (3840, 2160),
}
PICTURES = os.environ.get("M2PEM_TABLE_PICTURES")
"""A folder for a picture of each cell, to be looked at."""


@dataclass(slots=True)
class Cell:
    """Of the table: how a page is looked at, and on what."""

    look: str
    device: str

    async def shown(self, page: Page) -> None:
        await page.emulate_media(**{**NO_LOOK, **LOOKS[self.look]})
        width, height = DEVICES[self.device]
        await page.set_viewport_size({"width": width, "height": height})
        theme = "light" if self.look in ("light", "forced colours") else "dark"
        await expect(page.locator("html")).to_have_attribute("data-theme", theme)
        await page.evaluate(DRAWN)


# What is laid out after a change of the window is there in the second frame.
DRAWN = """() => new Promise((done) =>
  requestAnimationFrame(() => requestAnimationFrame(() => done())))"""

CELLS = [Cell(look, device) for look in LOOKS for device in DEVICES]


async def show_home(desk: Desk) -> None:
    await desk.home()
    await expect(desk.page.get_by_role("checkbox", name="Select all on this page")).to_be_visible()


async def show_diagram(desk: Desk) -> None:
    await desk.edit()


async def show_survey(desk: Desk) -> None:
    page = await desk.home()
    await new_mission(page, "survey")
    await drawn_area(page)
    await page.get_by_role("button", name="Survey…").click()
    await expect(page.get_by_role("form", name="Survey of area1")).to_be_visible()
    await expect(page.locator(".survey-line")).not_to_have_count(0)


async def show_run(desk: Desk) -> None:
    run = await run_of(desk, lambda status: status == "running")
    await desk.page.goto(f"{desk.executive.origin}/runs/{run}")
    await expect(desk.page.locator(".m2-active").first).to_be_attached()


async def show_replay(desk: Desk) -> None:
    run = await run_of(desk, lambda status: status != "running")
    await desk.page.goto(f"{desk.executive.origin}/runs/{run}?t=0")
    await expect(desk.page.get_by_role("slider", name="Position")).to_be_visible()
    await open_plots(desk.page)


async def choose_plots(page: Page) -> None:
    """They are a tab where there is room for one pane."""
    tab = page.get_by_role("tab", name="Plots")
    if await tab.count():
        await tab.click()
    await expect(page.locator(".plots-pane canvas").first).to_be_visible()


async def run_of(desk: Desk, wanted: Callable[[str], bool]) -> str:
    """The newest run whose status is wanted."""
    runs = await desk.ask("GET", "/api/runs?limit=20")
    return next(each["run"] for each in runs if wanted(each["status"]))


async def show_fleet(desk: Desk) -> None:
    await desk.page.goto(f"{desk.executive.origin}/fleet")
    await desk.page.get_by_role("row").filter(has_text="evsg2").click()
    await expect(desk.page.get_by_role("region", name="Details and commands")).to_be_attached()


async def show_alerts(desk: Desk) -> None:
    await desk.page.goto(f"{desk.executive.origin}/alerts")
    await expect(desk.page.get_by_role("region", name="Ended")).to_be_visible()


async def show_no_connection(desk: Desk) -> None:
    """The session is asked for first, and not answered."""
    desk.refusals.append(0)
    await desk.home()
    await desk.page.wait_for_function(
        "() => JSON.parse(localStorage.getItem('m2pem.last-known'))?.runs.length > 0"
    )
    await desk.page.route("**/api/session", refuse)
    await desk.page.goto(desk.executive.origin)
    heading = desk.page.get_by_role("heading", name="No connection to the executive")
    await expect(heading).to_be_visible()


async def refuse(route: Route) -> None:
    await route.abort()


PAGES: dict[str, Callable[[Desk], Awaitable[None]]] = {
    "home": show_home,
    "editor": show_diagram,
    "survey": show_survey,
    "run": show_run,
    "replay": show_replay,
    "fleet": show_fleet,
    "alerts": show_alerts,
    "no connection": show_no_connection,
}


@asynccontextmanager
async def going_on(desk: Desk) -> AsyncIterator[None]:
    """A run that was stopped, one that drives, a vehicle that an operator has."""
    first = (await desk.driving()).url.rpartition("/")[2]
    await expect(desk.page.locator(".card-numbers").first).to_contain_text("m/s")
    await desk.ask("POST", f"/api/runs/{first}/stop", {"reason": "seen enough"})
    # A run that has ended still has its vehicles until they have stopped.
    await desk.until("/api/resources", lambda said: not any(said["holders"].values()))
    await desk.ask("POST", "/api/resources/evsg2/take")
    await desk.driving()
    try:
        yield
    finally:
        await desk.page.unroute_all()
        desk.watched.complaints[:] = [
            each for each in desk.watched.complaints if "ERR_FAILED" not in each
        ]


async def look_at(eyes: Accessibility, where: str, cells: list[Cell]) -> None:
    for cell in cells:
        await cell.shown(eyes.page)
        if where == "replay":
            await choose_plots(eyes.page)
        name = f"{where}, {cell.look}, {cell.device}"
        await eyes.look(name)
        if PICTURES:
            await eyes.page.screenshot(path=f"{PICTURES}/{name.replace(', ', '-')}.png")


async def made_ready(page: Page) -> None:
    """Pages are made ready as on a desk."""
    await page.emulate_media(**NO_LOOK)
    await page.set_viewport_size({"width": 1280, "height": 720})


async def test_each_page_on_one_device_has_no_violation(desk: Desk) -> None:
    eyes = Accessibility(desk.page)
    async with going_on(desk):
        for number, (where, show) in enumerate(PAGES.items()):
            await made_ready(desk.page)
            await show(desk)
            look = list(LOOKS)[-1 - number % len(LOOKS)]
            await look_at(eyes, where, [Cell(look, list(DEVICES)[number % len(DEVICES)])])
    eyes.assert_well()


@pytest.mark.long
@pytest.mark.parametrize("where", PAGES)
async def test_every_page_on_every_device_has_no_violation(desk: Desk, where: str) -> None:
    eyes = Accessibility(desk.page)
    async with going_on(desk):
        await made_ready(desk.page)
        await PAGES[where](desk)
        await look_at(eyes, where, CELLS)
    assert len(eyes.looked) == len(CELLS)
    eyes.assert_well()


@pytest.mark.long
async def test_signing_in_on_every_device_has_no_violation(chromium: Browser, desk: Desk) -> None:
    async with page_at(chromium, f"{desk.executive.origin}/sign-in") as it:
        await expect(it.page.get_by_label("Password")).to_be_visible()
        eyes = Accessibility(it.page)
        await look_at(eyes, "sign-in", CELLS)
        eyes.assert_well()
