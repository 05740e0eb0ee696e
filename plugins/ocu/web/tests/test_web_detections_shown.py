"""Operators see what payloads detect: on the map and in a list, as it comes and in a replay."""

import os
from contextlib import AsyncExitStack
from pathlib import Path

from playwright.async_api import Browser, Locator, Page, expect
from test_web_detections import BEHIND, detecting
from test_web_snapshots import eye
from web_axe import Accessibility
from web_browsing import page_at
from web_cameras import SIZE
from web_desk import IN_ONE_LOOP
from web_pictures import picture
from web_snapshots import picture_server

from m2pem.testing import scenarios

pytestmark = IN_ONE_LOOP

PAST = {"distance": "80 m"}, {"distance": "200 m", "speed": "0.01 m/s"}
NEAR = scenarios.in_sequence("reverse", "ugv1", *PAST)
"""It finds both, and stays near them for longer than any test takes."""
BUTTON = "Detections (2)"
UNCOVERED = """() => {
  const [mark, card] = [".map-detection-chosen > i", ".detection-card"].map((each) =>
    document.querySelector(each)?.getBoundingClientRect());
  return mark && card && (mark.left > card.right || mark.right < card.left
    || mark.top > card.bottom || mark.bottom < card.top);
}"""


def card(page: Page) -> Locator:
    return page.locator(".detection-card")


def seen(page: Page) -> Locator:
    """What the camera saw."""
    return page.locator(".detection-picture img")


async def assert_seen(page: Page) -> None:
    """The picture of the camera is in the card."""
    await expect(seen(page)).to_have_js_property("naturalWidth", SIZE[0])
    await expect(card(page)).to_contain_text("Picture of ugv1/mast")


async def assert_uncovered(page: Page) -> None:
    """The mark of the chosen detection is beside or above its card."""
    await page.wait_for_function(UNCOVERED)


async def look_at(page: Page, name: str) -> None:
    """A picture for those who change the page."""
    if folder := os.environ.get("M2PEM_LOOK"):
        await page.screenshot(path=Path(folder) / f"{name}.png", animations="disabled")


async def test_detections_are_on_the_map_and_in_a_list(chromium: Browser, tmp_path: Path) -> None:
    async with AsyncExitStack() as stack:
        server = await stack.enter_async_context(picture_server())
        world = await detecting(stack, tmp_path, BEHIND, eye(server, "/good"))
        watched = await stack.enter_async_context(
            page_at(chromium, world.ocu.url, width=1440, height=960)
        )
        page = watched.page
        run = await world.control.start(NEAR)
        await page.goto(f"{world.base}/runs/{run}")
        marks = page.locator(".map-detection")
        await expect(marks).to_have_count(2)
        await page.get_by_role("button", name=BUTTON, exact=True).click()
        entries = page.locator(".detections li")
        await expect(entries).to_have_count(2)
        await expect(entries.first).to_contain_text("man")
        # By keyboard: the card opens, and closing it leads back to the list.
        mine = entries.last.get_by_role("button")
        await mine.focus()
        await page.keyboard.press("Enter")
        await expect(card(page)).to_contain_text("ugv1/radar")
        await expect(card(page)).to_contain_text("38.107300°, -77.319200°")
        await expect(page.locator(".map-detection-chosen")).to_have_text("mine")
        await assert_seen(page)
        await assert_uncovered(page)
        eyes = Accessibility(page)
        await eyes.look("a detection", ".map-pane")
        await eyes.look("the list of detections", ".detections-pane")
        eyes.assert_well()
        await look_at(page, "live")
        await picture(page, "detections")
        small = await seen(page).bounding_box()
        await page.get_by_role("button", name="What ugv1/mast saw").click()
        await expect(page.locator(".detection-card-large")).to_be_visible()
        large = await seen(page).bounding_box()
        assert small is not None
        assert large is not None
        assert large["width"] > small["width"]
        await look_at(page, "large")
        await page.keyboard.press("Escape")
        await expect(card(page)).to_have_count(0)
        await expect(mine).to_be_focused()
        await page.get_by_role("button", name="Show all", exact=True).click()
        await marks.filter(has_text="mine").click()
        await expect(card(page).locator("strong")).to_have_text("mine")
        await hidden(page)
        await world.control.stop(run)
        await world.control.wait(run)
        await replay(page, f"{world.base}/runs/{run}?t=0")
        await narrow(page)
        assert watched.complaints == []


async def hidden(page: Page) -> None:
    """Operators who do not want marks hide them."""
    marks, switch = page.locator(".map-detection"), page.get_by_label("Detections", exact=True)
    await page.get_by_text("Show", exact=True).click()
    await switch.uncheck()
    await expect(marks).to_have_count(0)
    await switch.check()
    await expect(marks).to_have_count(2)


async def replay(page: Page, address: str) -> None:
    """The map has what was detected up to the time that is shown; the list leads there."""
    await page.goto(address)
    await expect(page.get_by_role("button", name=BUTTON, exact=True)).to_be_visible()
    entries, marks = page.locator(".detections li"), page.locator(".map-detection")
    await expect(entries).to_have_count(2)
    time = page.locator(".detection-time")
    latest = await time.first.text_content()
    await expect(marks).to_have_count(0)
    await entries.last.get_by_role("button").click()
    await expect(marks).to_have_text(["mine"])
    await expect(card(page)).to_contain_text("Go to its time")
    await entries.first.get_by_role("button").click()
    await expect(marks).to_have_count(2)
    await expect(card(page).locator("dd").nth(1)).to_have_text(latest or "")
    await assert_uncovered(page)
    await assert_seen(page)
    await look_at(page, "replay")


async def narrow(page: Page) -> None:
    """The list is a tab, the card is on the map."""
    await page.emulate_media(forced_colors="active")
    await look_at(page, "forced")
    await page.emulate_media(forced_colors="none", color_scheme="dark")
    await page.set_viewport_size({"width": 390, "height": 844})
    await page.get_by_role("tab", name=BUTTON, exact=True).click()
    await expect(page.locator(".detections li")).to_have_count(2)
    await look_at(page, "phone")
    await page.get_by_role("tab", name="Map", exact=True).click()
    await expect(card(page)).to_be_visible()
    await assert_uncovered(page)
    await look_at(page, "phone_map")


async def test_the_card_says_why_there_is_no_picture(chromium: Browser, tmp_path: Path) -> None:
    async with AsyncExitStack() as stack:
        server = await stack.enter_async_context(picture_server())
        world = await detecting(stack, tmp_path, BEHIND, eye(server, "/missing"))
        watched = await stack.enter_async_context(page_at(chromium, world.ocu.url))
        page = watched.page
        run = await world.control.start(NEAR)
        await page.goto(f"{world.base}/runs/{run}")
        mine = page.locator(".map-detection").filter(has_text="mine")
        await expect(mine).to_be_attached()
        await page.get_by_role("button", name="Show all", exact=True).click()
        await mine.click()
        await expect(card(page)).to_contain_text("No picture: the camera's server answers 404")
        await expect(seen(page)).to_have_count(0)
        await world.control.stop(run)
        assert watched.complaints == []
