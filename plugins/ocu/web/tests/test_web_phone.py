"""STOP on a phone: whole, and covered by nothing, on every page."""

import pytest
from playwright.async_api import Page, expect
from web_desk import IN_ONE_LOOP, Desk
from web_running import answer

pytestmark = IN_ONE_LOOP

HEIGHT = 780

# What is hit at the corners and in the middle of STOP, a little inside its edges.
HITS = """(stop) => {
  const { left, top, right, bottom } = stop.getBoundingClientRect();
  const points = [
    [left + 2, top + 2], [right - 2, top + 2], [left + 2, bottom - 2], [right - 2, bottom - 2],
    [(left + right) / 2, (top + bottom) / 2],
  ];
  return {
    inside: left >= 0 && top >= 0 && right <= innerWidth && bottom <= innerHeight,
    wide: right - left, high: bottom - top,
    hit: points.every(([x, y]) => stop.contains(document.elementFromPoint(x, y))),
  };
}"""


async def assert_stop_is_whole(page: Page, where: str) -> None:
    found = await page.locator("header button.stop").evaluate(HITS)
    assert found["inside"], (where, found)
    assert found["hit"], (where, found)
    assert min(found["wide"], found["high"]) >= 44, (where, found)


@pytest.mark.parametrize(
    "width", [320, *(pytest.param(width, marks=pytest.mark.long) for width in (390, 430))]
)
async def test_stop_is_whole_on_every_page_of_a_phone(desk: Desk, width: int) -> None:
    page = desk.page
    await page.set_viewport_size({"width": width, "height": HEIGHT})
    await desk.home()
    await assert_stop_is_whole(page, "home")
    await page.get_by_role("button", name="New mission").click()
    await expect(page.get_by_role("dialog")).to_be_visible()
    await assert_stop_is_whole(page, "a dialog")

    await desk.start()
    await assert_stop_is_whole(page, "run, asked")
    run = page.url.rpartition("/")[2]
    for others, at in (("home", desk.home), ("editor", desk.edit)):
        await at()
        await expect(page.get_by_role("link", name="question open")).to_be_visible()
        await assert_stop_is_whole(page, f"{others}, asked")
        await page.locator("header button.stop").click()
        await expect(page.locator("header button.stop-armed")).to_be_visible()
        await assert_stop_is_whole(page, f"{others}, armed")
    await desk.page.goto(f"{desk.executive.origin}/runs/{run}")
    await answer(page, "Continue").click()
    await expect(answer(page, "Continue")).to_have_count(0)
    await assert_stop_is_whole(page, "run, driving")

    await desk.ask("POST", "/api/stop-all", {})
    await expect(page.get_by_role("dialog")).to_be_visible()
    await assert_stop_is_whole(page, "run, ended")
    await page.get_by_role("button", name="Replay it").click()
    await expect(page.locator(".player")).to_be_visible()
    await assert_stop_is_whole(page, "replay")
