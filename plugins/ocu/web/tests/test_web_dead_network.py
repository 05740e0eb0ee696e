"""A network that stops passing bytes without closing: what operators see, and what happens."""

import asyncio
import re
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass
from itertools import cycle

import pytest
from playwright.async_api import Locator, Page, expect
from playwright.async_api import TimeoutError as PlaywrightTimeoutError
from test_web_alerts import look
from web_browsing import TIMEOUT_MS
from web_desk import IN_ONE_LOOP, Desk, element, forget
from web_proxy import Proxy, proxy_to
from web_running import answer, press_twice, wait_for_status

pytestmark = IN_ONE_LOOP

MISSION = "vignette1"
LATE = re.compile(r"was delivered \d+ s after it was given")


@dataclass
class Field:
    """An operator in the field: their page reaches the executive through `proxy` alone."""

    proxy: Proxy
    page: Page
    origin: str

    @property
    def stop(self) -> Locator:
        return self.page.locator("header button.stop")

    @property
    def undelivered(self) -> Locator:
        return self.page.locator(".undelivered")

    async def start(self) -> None:
        """The page of a run that asks its first question, started in the page."""
        await self.page.goto(f"{self.origin}/missions/{MISSION}")
        await self.page.get_by_role("tab", name="Run", exact=True).click()
        await expect(self.page.locator(".link-open")).to_have_count(1)  # else nothing is sent
        await self.page.get_by_role("button", name="Start", exact=True).click()
        await expect(answer(self.page, "Continue")).to_be_enabled()
        await expect(self.page.locator(".link-open")).to_have_count(1)

    async def is_dead(self) -> None:
        """The page says that it is not connected."""
        await expect(self.page.get_by_text("Not connected to the executive")).to_be_visible()
        await expect(self.page.locator(".operate.stale")).to_have_count(1)

    async def given_s(self, least: int) -> None:
        """Wait until a STOP is so old."""
        await self.page.wait_for_function(
            "least => parseInt(document.querySelector('.undelivered > span')?.innerText) >= least",
            arg=least,
        )


@asynccontextmanager
async def field(desk: Desk) -> AsyncIterator[Field]:
    async with proxy_to(desk.executive.origin) as proxy:
        origin = f"http://127.0.0.1:{proxy.port}"
        # The cookie of the session is valid at all ports of a host; its key is kept by each page.
        page = await desk.watched.context.new_page()
        await page.goto(f"{origin}/healthz")
        await forget(page, origin, desk.key)
        yield Field(proxy, page, origin)
        await page.close()


@pytest.mark.parametrize(
    "directions",
    [
        "both",
        pytest.param("up", marks=pytest.mark.long),
        pytest.param("down", marks=pytest.mark.long),
    ],
)
async def test_a_stop_that_is_not_delivered_is_said_and_carried_out_when_the_network_heals(
    desk: Desk, directions: str
) -> None:
    async with field(desk) as here:
        await here.start()
        here.proxy.stall(directions)
        await here.is_dead()
        await expect(here.undelivered).to_have_count(0)
        await press_twice(here.page, here.stop.click)
        await expect(here.undelivered).to_contain_text("STOP was NOT delivered.")
        await expect(here.undelivered).to_contain_text("m2pem stop")
        clock = here.page.locator(".clock")
        await here.given_s(3)
        stood = await clock.text_content()
        await here.given_s(6)
        assert await clock.text_content() == stood
        here.proxy.heal()
        await expect(here.undelivered).to_have_count(0)
        await expect(here.page.get_by_text(LATE)).to_be_visible()
        await expect(here.page.locator(".link-open")).to_have_count(1)
        await wait_for_status(here.page, "Stopped")


async def test_a_stop_of_a_moment_ago_is_said_before_the_stream_is_known_to_be_dead(
    desk: Desk,
) -> None:
    async with field(desk) as here:
        await here.start()
        await here.stop.click()
        await expect(here.stop).to_have_text("Again to STOP")
        here.proxy.stall()
        # Two presses within BETWEEN_MS are one; pressed until the second one counts.
        while await here.stop.text_content() != "STOP":
            await here.stop.click()
        await expect(here.undelivered).to_be_visible()
        await here.page.get_by_role("button", name="Give up this STOP").click()
        await expect(here.undelivered).to_have_count(0)


async def test_an_answer_that_the_network_held_back_is_not_given(
    desk: Desk,
) -> None:
    async with field(desk) as here:
        await here.start()
        here.proxy.stall("up")
        await answer(here.page, "Continue").click()
        await expect(here.page.get_by_text("No answer within the time limit")).to_be_visible()
        await here.is_dead()
        here.proxy.heal()
        await expect(here.page.locator(".link-open")).to_have_count(1)
        await expect(answer(here.page, "Continue")).to_be_enabled()
        await answer(here.page, "Continue").click()
        await expect(element(here.page, "DriveRoute")).to_contain_class("m2-active")


async def test_what_is_shown_of_the_fleet_and_the_alerts_is_said_to_be_old(desk: Desk) -> None:
    async with field(desk) as here:
        page = here.page
        await page.goto(f"{here.origin}/alerts")
        await expect(page.get_by_role("heading", name="Alerts", level=1)).to_be_visible()
        await page.get_by_role("link", name="Fleet").click()
        table = page.get_by_role("grid", name="Vehicles")
        vehicle = table.get_by_role("row", name="evsg1", exact=False).first
        await expect(vehicle).to_contain_text("connected")
        here.proxy.stall()
        await expect(vehicle).to_contain_text(re.compile(r"not known since \d+:\d\d:\d\d"))
        await expect(vehicle).to_contain_text("Not known")
        await expect(table.get_by_text("Lost", exact=True)).to_have_count(0)
        await look(page, "fleet_not_connected")
        await page.go_back()
        await expect(page.locator(".alert-page.stale")).to_have_count(1)
        here.proxy.heal()
        await expect(page.locator(".alert-page.stale")).to_have_count(0)
        await page.go_forward()
        await expect(vehicle).to_contain_text("connected")


# The map is a canvas: in how many pieces trails were drawn when all was drawn the last time.
PIECES = """
  const { beginPath, clearRect, moveTo, stroke } = CanvasRenderingContext2D.prototype;
  let moves = 0;
  const whole = new WeakSet();
  window.pieces = 0;
  Object.assign(CanvasRenderingContext2D.prototype, {
    clearRect(...at) { whole.add(this); clearRect.apply(this, at); },
    beginPath() { moves = 0; beginPath.call(this); },
    moveTo(...at) { moves += 1; moveTo.apply(this, at); },
    stroke() {
      if (this.strokeStyle === "#3a7bd0" && whole.has(this)) window.pieces = moves;
      whole.delete(this);
      stroke.call(this);
    },
  });
"""


async def drawn_whole(page: Page, pieces: int) -> None:
    """Zoom the map in or out, which draws all of it again, until trails have so many pieces."""
    async with asyncio.timeout(TIMEOUT_MS / 1000):
        for name in cycle(("Zoom in", "Zoom out")):
            await page.locator(".map-pane").get_by_role("button", name=name).click()
            with suppress(PlaywrightTimeoutError):
                await page.wait_for_function(f"() => window.pieces === {pieces}", timeout=2000)
                return


@pytest.mark.long
async def test_no_line_is_drawn_where_nothing_was_known_of_a_vehicle(
    desk: Desk,
) -> None:
    async with field(desk) as here:
        await here.page.add_init_script(PIECES)
        await here.start()
        await answer(here.page, "Continue").click()
        await expect(element(here.page, "DriveRoute")).to_contain_class("m2-active")
        vehicles = len((await desk.ask("GET", "/api/fleet"))["vehicles"])
        await drawn_whole(here.page, vehicles)
        here.proxy.stall()
        await here.is_dead()
        began_s = await took_s(desk)
        await desk.until("/api/runs", lambda runs: runs[-1]["took_s"] > began_s + 8)
        here.proxy.heal()
        await expect(here.page.locator(".link-open")).to_have_count(1)
        await drawn_whole(here.page, vehicles + 1)


async def took_s(desk: Desk) -> float:
    """The mission time of the newest run."""
    return float((await desk.ask("GET", "/api/runs"))[-1]["took_s"])
