"""A survey is drawn by touch alone; it is drawn, verified, run and replayed by keys alone."""

import math
import re

from playwright.async_api import Browser, CDPSession, Locator, Page, expect
from test_web_editor_map import plan, spot
from web_desk import IN_ONE_LOOP, OPERATOR, Desk, signed_in
from web_running import press_twice, wait_for_status
from web_served import Served

from m2pem import load_mission
from m2pem.mission.geometry import Area

pytestmark = IN_ONE_LOOP

CORNERS = ((0.3, 0.3), (0.25, 0.5), (0.45, 0.8), (0.8, 0.6), (0.8, 0.3))
NEAR_PX = 13
"""A vertex goes onto one of the fleet's that is nearer than 12 pixels."""
STILL_PX = 1
STEPS = 6
NOTE_LONG_PRESS = """addEventListener("contextmenu", () => (window.pressed = true))"""
COUNT_PRESSES = """addEventListener("pointerdown", () => (window.presses = 1), { capture: true })"""


async def middle(what: Locator) -> tuple[float, float]:
    """Of it, on the screen."""
    box = await what.bounding_box()
    assert box
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


class Finger:
    """A finger on a touch screen."""

    def __init__(self, session: CDPSession) -> None:
        self.session = session

    async def _touch(self, kind: str, *at: tuple[float, float]) -> None:
        points = [{"x": x, "y": y} for x, y in at]
        await self.session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    async def drag(self, what: Locator, east_px: float, south_px: float) -> None:
        x, y = await middle(what)
        await self._touch("touchStart", (x, y))
        for step in range(1, STEPS + 1):
            part = step / STEPS
            await self._touch("touchMove", (x + part * east_px, y + part * south_px))
        await self._touch("touchEnd")

    async def hold(self, what: Locator) -> None:
        """Until `lift`."""
        await self._touch("touchStart", await middle(what))

    async def lift(self) -> None:
        await self._touch("touchEnd")


async def test_an_area_is_drawn_and_changed_by_touch(chromium: Browser, executive: Served) -> None:
    async with signed_in(chromium, executive, OPERATOR, width=1180, height=820, touch=True) as it:
        page = it.page
        await page.goto(executive.origin)
        await page.get_by_role("button", name="New mission").tap()
        await page.get_by_label("Name").fill("touched")
        await page.get_by_role("button", name="Make it").tap()
        await page.wait_for_selector(".djs-shape")
        await page.get_by_role("button", name="Map", exact=True).tap()
        await plan(page).get_by_role("button", name="Area", exact=True).tap()
        await expect(plan(page).get_by_role("form", name="Drawing: Area")).to_be_visible()
        places = [await spot(page, *corner) for corner in CORNERS]
        vertices = plan(page).locator(".map-vertex")
        seen = []
        for count, place in enumerate(places, 1):
            await page.touchscreen.tap(*place)
            await expect(vertices).to_have_count(count)
            seen.append(await middle(vertices.last))
            assert math.dist(seen[-1], place) <= NEAR_PX
        # The form below has grown and shrunk meanwhile.
        for index, place in enumerate(seen):
            assert math.dist(await middle(vertices.nth(index)), place) <= STILL_PX
        await vertices.first.tap()
        form = plan(page).get_by_role("form", name="Area area1")
        await expect(form).to_be_visible()

        finger = Finger(await page.context.new_cdp_session(page))
        sizes = await form.locator(".plan-sizes").inner_text()
        await finger.drag(vertices.nth(3), 60, 20)
        await expect(form.locator(".plan-sizes")).not_to_have_text(sizes)
        await page.evaluate(NOTE_LONG_PRESS)
        await finger.hold(vertices.nth(2))
        await page.wait_for_function("() => window.pressed")
        await finger.lift()
        await expect(vertices).to_have_count(4)
        await page.get_by_role("button", name="Save", exact=True).tap()
        await expect(page.locator(".m2-saved-state")).to_have_text("Saved")
        area = load_mission(executive.missions / "touched.bpmn").geometries["area1"]
        assert isinstance(area, Area)
        it.assert_well()


async def test_a_survey_is_drawn_run_and_replayed_by_keys_alone(desk: Desk) -> None:
    page = await desk.home()
    await page.evaluate(COUNT_PRESSES)
    await page.get_by_role("button", name="New mission").press("Enter")
    await page.keyboard.type("keys")
    await page.keyboard.press("Enter")
    await page.wait_for_selector(".djs-shape")
    await draw_by_keys(page)
    await page.get_by_role("tab", name=re.compile("Verify")).press("Enter")
    await page.get_by_role("button", name="Verify", exact=True).press("Enter")
    await expect(page.get_by_role("region", name="Report")).to_contain_text("Everything holds")
    await page.get_by_role("tab", name="Run", exact=True).press("Enter")
    await page.get_by_role("button", name="Rehearse", exact=True).press("Enter")
    outcome = page.get_by_role("region", name="What came of it")
    await expect(outcome.get_by_role("heading", level=2)).to_contain_text("ompleted")
    await page.get_by_role("button", name="Start", exact=True).press("Enter")
    await page.wait_for_url("**/runs/*")
    card = page.locator(".card", has_text="uav1")
    await expect(card).to_contain_text("Area survey area1 by uav1")
    await card.get_by_role("button", name="Take over", exact=True).press("Enter")
    dialog = page.get_by_role("dialog", name="Take over uav1")
    await expect(dialog).to_contain_text("the mission will fail")
    await page.keyboard.press("Escape")
    await expect(dialog).to_have_count(0)
    await press_twice(page, lambda: page.keyboard.press("Shift+Escape"))
    ended = page.get_by_role("dialog", name="The run has ended")
    await ended.get_by_role("button", name="Replay it").press("Enter")
    await wait_for_status(page, "Running")  # as it was at the beginning
    await page.get_by_role("button", name="Play", exact=True).press("Enter")
    position = page.get_by_label("Position")
    await expect(position).not_to_have_attribute("aria-valuetext", "0:00.0")
    assert await page.evaluate("window.presses") is None


async def draw_by_keys(page: Page) -> None:
    """A take-off and the survey of an area whose corners are entered, behind the start."""
    canvas = page.locator("svg[data-element-id]").first
    await canvas.focus()
    await page.keyboard.press("Tab")
    await expect(page.locator(".selected[data-element-id=Start]")).to_have_count(1)
    blocks = page.get_by_role("region", name="Blocks")
    who = page.get_by_label(re.compile(r"^Who\b")).first
    await blocks.get_by_role("button", name="Takeoff", exact=True).first.press("Enter")
    await expect(who).to_have_value("uav1")  # the only aircraft
    altitude = page.locator("#m2-parameter-altitude")
    await altitude.fill("5 m")
    await altitude.press("Tab")
    await blocks.get_by_role("button", name="Area survey", exact=True).first.press("Enter")
    await expect(who).to_have_value("")
    await who.press_sequentially("uav1")
    await expect(who).to_have_value("uav1")
    await page.get_by_role("button", name="Pick on the map").first.press("Enter")
    await plan(page).get_by_role("button", name="Area", exact=True).press("Enter")
    form = plan(page).get_by_role("form", name="Drawing: Area")
    for _ in range(3):
        await form.get_by_role("button", name="Add map centre").press("Enter")
    await form.locator("summary").press("Enter")
    for vertex, axis, value in (
        (2, "Latitude", "38.108"),
        (3, "Latitude", "38.109"),
        (3, "Longitude", "-77.317"),
    ):
        field = form.get_by_label(f"Vertex {vertex}: {axis} °")
        await field.fill(value)
        await field.press("Tab")
    await form.get_by_role("button", name="Done").press("Enter")
    await expect(page.locator("#m2-parameter-area")).to_have_value("area1")
    await canvas.focus()
    await page.keyboard.press("a")
    await page.keyboard.type("End event")
    await expect(page.locator(".djs-popup .entry", has_text="End event").first).to_be_visible()
    await page.keyboard.press("Enter")
    await expect(page.locator(".djs-popup")).to_have_count(0)
    await page.keyboard.press("Escape")  # no name
