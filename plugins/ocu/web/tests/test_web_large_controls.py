"""With large controls, what is used with a finger is at least 48 px wide and high."""

import pytest
from playwright.async_api import Page, expect
from test_web_devices import BELL, DEVICES, SET
from test_web_phone import assert_stop_is_whole
from web_desk import IN_ONE_LOOP, MISSION, Desk
from web_running import answer

pytestmark = IN_ONE_LOOP

VEHICLE = "evsg2"


async def show_run(desk: Desk, run: str) -> None:
    await desk.page.goto(run)
    await expect(answer(desk.page, "Continue")).to_be_enabled()


async def show_home(desk: Desk, _: str) -> None:
    await desk.home()
    await expect(desk.page.get_by_role("row").filter(has_text=MISSION).first).to_be_visible()
    await expect(desk.page.get_by_role("checkbox", name="Select all on this page")).to_be_visible()


async def show_fleet(desk: Desk, _: str) -> None:
    await desk.page.goto(f"{desk.executive.origin}/fleet")
    await desk.page.get_by_role("row").filter(has_text=VEHICLE).click()
    tab = desk.page.get_by_role("tab", name="Commands (1)")  # where there is room for one pane
    if await tab.count():
        await tab.click()
    await expect(desk.page.get_by_role("region", name="Details and commands")).to_be_attached()


async def show_alerts(desk: Desk, _: str) -> None:
    await desk.page.goto(f"{desk.executive.origin}/alerts")
    await expect(desk.page.get_by_role("row").filter(has_text="asks").first).to_be_visible()


PAGES = {"run": show_run, "home": show_home, "fleet": show_fleet, "alerts": show_alerts}


@pytest.mark.parametrize("device", ["tablet", pytest.param("tall phone", marks=pytest.mark.long)])
async def test_large_controls_are_hit_with_gloves(desk: Desk, device: str) -> None:
    page = await desk.start()
    run = page.url
    await page.evaluate(SET, {"text-size": 100, "controls": "large"})
    width, height = DEVICES[device]
    await page.set_viewport_size({"width": width, "height": height})
    small = []
    for name, show in PAGES.items():
        await show(desk, run)
        small += [f"{name}: {each}" for each in await small_on(page)]
        await assert_stop_is_whole(page, name)
    assert small == [], "\n".join(small)


async def small_on(page: Page) -> list[str]:
    """What is too small of what can be seen or scrolled to."""
    await expect(page.get_by_role("button", name=BELL)).to_be_visible()
    await expect(page.locator("html")).to_have_attribute("data-controls", "large")
    found: list[str] = await page.evaluate(SMALL)
    return found


# What is used with a finger, and is smaller than one in a glove. Boxes count with their labels;
# links within texts may be as small as these. What skips the header is for keyboards.
SMALL = """() => [...document.querySelectorAll(
    "button, select, input, summary, a[href], [role=tab], [role=menuitem], [role=slider]")]
  .filter((each) => each.checkVisibility({ visibilityProperty: true }))
  .filter((each) => !each.closest("svg, p, .skip"))
  .map((each) => [each, (each.matches("input") && each.closest("label")) || each])
  .map(([each, hit]) => [each, hit.getBoundingClientRect()])
  .filter(([each, { width, height }]) => width > 1 && (width < 47.5 || height < 47.5))
  .map(([each, { width, height }]) =>
    `${Math.round(width)} x ${Math.round(height)}: ${each.outerHTML.slice(0, 120)}`)"""
