"""A run is replayed after a restart: vehicles are where they were, in a real browser."""

import math
import re
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager
from pathlib import Path

from playwright.async_api import Browser, Page, expect
from test_web_telemetry import begun
from web_browsing import page_at
from web_desk import IN_ONE_LOOP
from web_map_seen import vehicles_on
from web_world import VEHICLE, World

from m2pem.api import RunStatus
from m2pem.testing import scenarios

pytestmark = IN_ONE_LOOP

FAR_M = 40
METRES_PER_DEGREE = 111_195
FAR = scenarios.one_behavior("reverse", VEHICLE, distance="60 m")
NEAR = scenarios.one_behavior("reverse", VEHICLE, distance="1 m")

PLACE = re.compile(r"at (-?[\d.]+)°, (-?[\d.]+)°")


def place(said: str) -> tuple[float, float]:
    """Where a vehicle is drawn, in degrees, by what the map lists of it."""
    found = PLACE.search(said)
    assert found
    return float(found[1]), float(found[2])


def apart_m(said: str, then: str) -> float:
    """Between two places, over a short distance."""
    one, other = place(said), place(then)
    north, east = one[0] - other[0], (one[1] - other[1]) * math.cos(math.radians(one[0]))
    return math.hypot(north, east) * METRES_PER_DEGREE


async def scrub(page: Page, t_s: float) -> None:
    """Take the scrubber to a time."""
    slider = page.get_by_role("slider", name="Position")
    await slider.evaluate(
        """(slider, t) => {
          slider.value = t;
          slider.dispatchEvent(new Event("input", {bubbles: true}));
        }""",
        t_s,
    )


@asynccontextmanager
async def opened(chromium: Browser, here: World) -> AsyncIterator[Page]:
    """The page, signed in; nothing in it complains."""
    async with page_at(chromium, here.ocu.url) as it:
        yield it.page
        it.assert_well()


async def have_run(folder: Path) -> list[str]:
    """Two runs, to their ends, by an executive that has ended."""
    async with AsyncExitStack() as stack:
        first = await begun(stack, folder)
        live = await (await first.browser()).live()
        await live.watch(None)
        await live.until(lambda message: VEHICLE in message.get("vehicles", {}))
        runs = []
        for mission in (FAR, NEAR):
            runs.append(await first.control.start(mission))
            assert (await first.control.wait(runs[-1])).status is RunStatus.COMPLETED
        return runs


async def test_a_replay_after_a_restart_shows_where_vehicles_were_or_why_not(
    chromium: Browser, tmp_path: Path
) -> None:
    run, other = await have_run(tmp_path)
    (tmp_path / "journal.db-tracks" / f"{other}.jsonl").unlink(missing_ok=True)
    async with AsyncExitStack() as stack:
        second = await begun(stack, tmp_path)
        page = await stack.enter_async_context(opened(chromium, second))
        await page.goto(f"{second.base}/runs/{run}?t=0")
        await expect(page.locator(".run-bar .mode")).to_contain_text("Replay")
        listed = vehicles_on(page).filter(has_text=f"{VEHICLE}:")
        begin = await listed.inner_text()
        await expect(page.locator(".map-nobody")).to_have_count(0)
        await scrub(page, await page.locator(".player-position").evaluate("e => +e.max"))
        await expect(page.locator(".run-bar .status")).to_have_text("Completed")
        await expect(listed).not_to_have_text(begin)
        there = await listed.inner_text()
        assert apart_m(there, begin) > FAR_M
        await scrub(page, 0)
        await expect(page.locator(".run-bar .status")).to_have_text("Running")
        await expect(listed).to_have_text(begin)

        await page.goto(f"{second.base}/runs/{other}")
        nobody = page.locator(".map-nobody")
        await expect(nobody).to_contain_text("No positions of vehicles were recorded")
        await expect(vehicles_on(page)).to_have_count(0)
