"""On a phone STOP and what calls are seen, whole and covered by nothing, on every page."""

import re

import pytest
from playwright.async_api import Page, expect
from web_desk import IN_ONE_LOOP, Desk, element
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


BELL = re.compile("alerts? needs? you$")


@pytest.mark.parametrize("size", [(320, 640), (640, 320)], ids=["upright", "on its side"])
async def test_what_calls_is_seen_on_every_page_of_a_phone(
    desk: Desk, size: tuple[int, int]
) -> None:
    page = desk.page
    await page.set_viewport_size({"width": size[0], "height": size[1]})
    await desk.start()
    await assert_calls_are_seen(page, "run")
    run = page.url
    await page.get_by_role("button", name="Message…").scroll_into_view_if_needed()
    await assert_stop_is_whole(page, "run, scrolled")
    await expect(answer(page, "Continue")).to_be_in_viewport(ratio=1)
    for where in ("", "fleet", "alerts", "missions/vignette1"):
        await page.goto(f"{desk.executive.origin}/{where}")
        await expect(page.get_by_role("link", name="question open")).to_be_in_viewport(ratio=1)
        await assert_calls_are_seen(page, where)
    await page.goto(run)
    await expect(answer(page, "Continue")).to_be_enabled()  # it takes the focus when it appears
    await page.get_by_role("button", name=BELL).click()
    await expect(page.get_by_role("dialog", name="Alerts")).to_be_in_viewport(ratio=1)
    await assert_calls_are_seen(page, "panel of alerts")
    await page.keyboard.press("Escape")
    await answer(page, "Continue").click()
    await expect(element(page, "DriveRoute")).to_contain_class("m2-active")
    await desk.edit(tab="Run")
    desk.refusals.append(409)  # another run has the vehicle
    await page.get_by_role("button", name="Start", exact=True).click()
    await expect(page.get_by_role("dialog", name="Vehicles are busy")).to_be_visible()
    await assert_stop_is_whole(page, "vehicles are busy")


async def assert_calls_are_seen(page: Page, where: str) -> None:
    """STOP, the bell and whether vehicles are real; and nothing needs to be scrolled sideways."""
    await assert_stop_is_whole(page, where)
    await expect(page.get_by_role("button", name=BELL)).to_be_in_viewport(ratio=1)
    await expect(page.locator(".reality")).to_be_in_viewport(ratio=1)
    assert await page.evaluate("document.documentElement.scrollWidth <= innerWidth"), where
