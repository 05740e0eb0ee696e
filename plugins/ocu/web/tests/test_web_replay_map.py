"""A run is replayed after a restart: vehicles are where they were, in a real browser."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

from playwright.async_api import Browser, Page, expect
from web_browsing import KEY, browser, page_at
from web_served import Served, served

from m2pem.testing import scenarios

VEHICLE = "evsg1"
FAR_PX = 20
WORDS = ("--simulate", "--speed", "10", "--journal", "journal.db")
MISSION = scenarios.in_sequence("reverse", VEHICLE, *({"distance": "20 m"} for _ in range(6)))

RUN = """async (mission) => {
  const headers = {KEY, "Content-Type": "application/json"};
  const body = JSON.stringify({mission});
  const answer = await fetch("/api/runs", {method: "POST", headers, body});
  const {run} = await answer.json();
  for (;;) {
    const {status} = await (await fetch(`/api/runs/${run}`, {headers})).json();
    if (status === "completed") return run;
    await new Promise((resolve) => setTimeout(resolve, 100));
  }
}""".replace("KEY", KEY)

PLACE = """([vehicle]) => {
  for (const marker of document.querySelectorAll(".map .vehicle")) {
    if (!marker.textContent.includes(vehicle)) continue;
    const {left, top} = marker.getBoundingClientRect();
    return [Math.round(left), Math.round(top)];
  }
  return null;
}"""


async def place(page: Page) -> list[int]:
    """Where the vehicle is drawn."""
    await expect(page.locator(".map .vehicle", has_text=VEHICLE)).to_be_visible()
    found: list[int] = await page.evaluate(PLACE, [VEHICLE])
    return found


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
async def opened(chromium: Browser, executive: Served) -> AsyncIterator[Page]:
    """The page, signed in; nothing in it complains."""
    async with page_at(chromium, executive.url) as it:
        await it.page.get_by_role("heading", name="Missions").wait_for()
        yield it.page
        it.assert_well()


async def has_run(chromium: Browser, folder: Path) -> str:
    """A run, to its end, by an executive that has ended."""
    with served(folder, words=WORDS) as executive:
        (executive.missions / "back.bpmn").write_bytes(MISSION)
        async with opened(chromium, executive) as page:
            run: str = await page.evaluate(RUN, "back")
        executive.end()
    return run


async def test_a_replay_after_a_restart_shows_where_vehicles_were(tmp_path: Path) -> None:
    async with browser() as chromium:
        run = await has_run(chromium, tmp_path)
        with served(tmp_path, words=WORDS) as executive:
            async with opened(chromium, executive) as page:
                await page.goto(f"{executive.origin}/runs/{run}?t=0")
                await expect(page.locator(".run-bar .mode")).to_contain_text("Replay")
                begin = await place(page)
                await expect(page.locator(".map-nobody")).to_have_count(0)
                await scrub(page, await page.locator(".player-position").evaluate("e => +e.max"))
                await expect(page.locator(".run-bar .status")).to_have_text("Completed")
                there = await place(page)
                assert abs(there[0] - begin[0]) + abs(there[1] - begin[1]) > FAR_PX
                await scrub(page, 0)
                await expect(page.locator(".run-bar .status")).to_have_text("Running")
                assert await place(page) == begin


async def test_a_replay_says_why_it_shows_no_vehicles(tmp_path: Path) -> None:
    async with browser() as chromium:
        run = await has_run(chromium, tmp_path)
        (tmp_path / "journal.db-tracks" / f"{run}.jsonl").unlink()
        with served(tmp_path, words=WORDS) as executive:
            async with opened(chromium, executive) as page:
                await page.goto(f"{executive.origin}/runs/{run}")
                await expect(page.locator(".map-nobody")).to_contain_text(
                    "No positions of vehicles were recorded"
                )
                await expect(page.locator(".map .vehicle")).to_have_count(0)
