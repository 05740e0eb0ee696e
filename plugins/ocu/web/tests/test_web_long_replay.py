"""A long run on its page: read by pages, and shown as far as its index is."""

import json
from contextlib import AsyncExitStack
from pathlib import Path

from playwright.async_api import Browser, Route, expect
from test_web_replay_map import opened
from test_web_telemetry import begun
from web_desk import IN_ONE_LOOP
from web_replayed import looping, run_of
from web_running import wait_for_status

pytestmark = IN_ONE_LOOP

MAKING = {"state": "making", "records": 1_500_000, "done": 400_000}


async def test_a_long_run_opens_at_its_end_and_says_what_its_log_has(
    chromium: Browser, tmp_path: Path
) -> None:
    async with AsyncExitStack() as stack:
        here = await begun(stack, tmp_path)
        run = await run_of(here.control, looping(2000))
        (summary,) = [each for each in await here.control.runs() if each.run == run]
        page = await stack.enter_async_context(opened(chromium, here))
        asked: list[str] = []
        page.on("request", lambda request: asked.append(request.url.rpartition("/replay")[2]))
        await page.goto(f"{here.base}/runs/{run}?t=1e9")
        await wait_for_status(page, "Completed")
        events = page.locator(".run-bar .events")
        await expect(events).to_contain_text(f"{summary.records:,}")
        last = (summary.records - 1) // 1000
        assert f"/pages/{last}" in asked
        older = page.get_by_role("button", name="Older…")
        await expect(older).to_be_visible()
        await page.get_by_role("button", name="Tokens").click()
        lines = page.locator(".log-line")
        await expect(lines.last).to_contain_text("completed")
        await page.get_by_role("searchbox", name="Filter").fill("Work")
        await expect(page.locator(".log-kinds")).to_contain_text("Filtered: the last")


async def test_how_a_run_ended_is_said_while_its_index_is_made(
    chromium: Browser, tmp_path: Path
) -> None:
    async with AsyncExitStack() as stack:
        here = await begun(stack, tmp_path)
        run = await run_of(here.control, looping(3))
        page = await stack.enter_async_context(opened(chromium, here))
        is_made = False

        async def answer(route: Route) -> None:
            if is_made:
                await route.continue_()
            else:
                await route.fulfill(content_type="application/json", body=json.dumps(MAKING))

        await page.route(f"**/api/runs/{run}/replay", answer)
        await page.goto(f"{here.base}/runs/{run}")
        opening = page.get_by_role("region", name="Replay")
        await expect(opening).to_contain_text("Completed")
        await expect(opening).to_contain_text("400,000 of 1,500,000 events")
        bar = opening.get_by_role("progressbar", name="Preparing the replay")
        await expect(bar).to_have_attribute("value", "400000")
        is_made = True
        await expect(page.get_by_role("dialog", name="The run has ended")).to_be_visible()
