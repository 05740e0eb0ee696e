"""The operator page in a real browser: STOP, colours, signals, drawing, vehicles, and breaks."""

import asyncio
import re

import pytest
from playwright.async_api import Page, WebSocketRoute, expect
from web_desk import IN_ONE_LOOP, Desk, element
from web_running import (
    AMBER,
    COLOUR,
    GRAY,
    GREEN,
    answer,
    is_near,
    press_twice,
    wait_for_colour,
    wait_for_status,
)

pytestmark = IN_ONE_LOOP

# Of Okabe and Ito, who chose them so that everybody tells them apart.
BLUE = (105, 190, 240)
YELLOW = (240, 228, 66)

# The colours in which an element is seen from now on.
KEEP_SHADES = f"""(name) => {{
  window.shades = [];
  const look = () => {{
    const found = ({COLOUR})([name]);
    if (found) window.shades.push(found);
    requestAnimationFrame(look);
  }};
  look();
}}"""


async def test_one_press_of_stop_stops_nothing_and_works_over_a_dialog(desk: Desk) -> None:
    page = await desk.start()
    await page.get_by_role("button", name="Signal…").click()
    await expect(page.get_by_role("dialog", name="Send a signal")).to_be_visible()
    stop = page.locator("header button.stop")
    await stop.click()
    await expect(stop).to_have_text("Again to STOP")
    await expect(stop).to_have_text("STOP")
    await wait_for_status(page, "Running")
    await press_twice(page, stop.click)
    await wait_for_status(page, "Stopped")


async def test_holding_stop_stops(desk: Desk) -> None:
    page = await desk.start()
    await page.locator("header button.stop").hover()
    await page.mouse.down()
    await wait_for_status(page, "Stopped")
    await page.mouse.up()


async def test_the_palette_is_what_elements_are_painted_with(desk: Desk) -> None:
    page = await desk.start()
    palette = page.get_by_label("Colours")
    await wait_for_colour(page, "USER SEND ROUTE", AMBER)
    await palette.select_option("Colour-blind")
    await wait_for_colour(page, "USER SEND ROUTE", YELLOW)
    await answer(page, "Continue").click()
    await wait_for_colour(page, "DRIVE ROUTE", BLUE)
    # It is remembered.
    await page.reload()
    await wait_for_colour(page, "DRIVE ROUTE", BLUE)
    await palette.select_option("Green")
    await wait_for_colour(page, "DRIVE ROUTE", GREEN)


@pytest.mark.parametrize(
    ("fade", "fades"), [("2 s", True), pytest.param("no fade", False, marks=pytest.mark.long)]
)
async def test_what_is_over_fades_or_is_gray_at_once(desk: Desk, fade: str, fades: bool) -> None:
    await desk.page.emulate_media(reduced_motion="no-preference")
    page = await desk.start()
    await page.get_by_label("Fade").select_option(fade)
    await wait_for_colour(page, "USER SEND ROUTE", AMBER)
    await page.evaluate(KEEP_SHADES, "USER SEND ROUTE")
    await answer(page, "Continue").click()
    await wait_for_colour(page, "USER SEND ROUTE", GRAY)
    shades = await page.evaluate("shades")
    between = [each for each in shades if not any(is_near(each, it) for it in (AMBER, GREEN, GRAY))]
    assert bool(between) == fades, shades


async def test_a_signal_moves_the_token_that_waits_for_it(desk: Desk) -> None:
    page = await desk.driving()
    await expect(element(page, "DriveStop")).not_to_have_class(re.compile("m2-(active|done)"))
    await page.get_by_role("button", name="Signal…").click()
    dialog = page.get_by_role("dialog", name="Send a signal")
    await dialog.get_by_label("Signal").select_option("Stop driving")
    await dialog.get_by_role("button", name="Send").click()
    await expect(dialog).to_have_count(0)
    await expect(element(page, "DriveRoute")).to_contain_class("m2-done")
    await expect(element(page, "DriveStop")).to_have_class(re.compile("m2-(active|done)"))
    log = page.get_by_role("region", name="Events")
    await expect(log).to_contain_text("anna: signal 'Stop driving'")


async def test_a_route_is_drawn_with_the_keyboard(desk: Desk) -> None:
    page = await desk.start()
    await page.get_by_role("button", name="Draw").press("Enter")
    await page.get_by_role("menuitem", name="New route").press("Enter")
    await page.get_by_role("textbox", name="Name").fill("detour")
    save = page.get_by_role("button", name="Save", exact=True)
    add = page.get_by_role("button", name="Add map centre")
    await add.press("Enter")
    await expect(save).to_be_disabled()
    await add.press("Enter")
    latitude = page.get_by_label("Vertex 2: Latitude °")
    await latitude.fill("38.1085")
    await latitude.press("Tab")
    await page.get_by_label("Vertex 2: Altitude m").fill("70")
    await save.press("Enter")
    await expect(page.get_by_text("detour can be used in the mission now.")).to_be_visible()
    geometries = await desk.ask("GET", "/api/geometries")
    drawn = next(each for each in geometries if each["name"] == "detour")
    assert drawn["geometry"]["type"] == "LineString"
    assert drawn["geometry"]["coordinates"][1][1:] == [38.1085, 70]


async def test_a_vehicle_and_its_payload_are_taken_and_given_back(desk: Desk) -> None:
    page = await desk.start()
    card = page.locator(".card", has_text="evsg2")
    log = page.get_by_role("region", name="Events")
    await card.get_by_role("button", name="Take over", exact=True).click()
    await expect(card).to_contain_text("with anna")
    assert await holder(desk, "evsg2") == "anna"
    await expect(log.get_by_text("evsg2 taken by anna")).to_be_visible()
    await card.get_by_role("button", name="Give back", exact=True).click()
    await expect(card.get_by_role("button", name="Take over", exact=True)).to_be_visible()
    assert await holder(desk, "evsg2") == ""
    await expect(log.get_by_text("evsg2 given back by anna")).to_be_visible()

    await card.get_by_role("button", name="Take over ptz").click()  # without its vehicle
    await expect(card).to_contain_text("with anna")
    assert await holder(desk, "evsg2/ptz") == "anna"
    assert await holder(desk, "evsg2") == ""
    await card.get_by_role("button", name="Give back ptz").click()
    await expect(card.get_by_role("button", name="Take over ptz")).to_be_visible()
    assert await holder(desk, "evsg2/ptz") == ""


async def test_taking_a_vehicle_from_a_task_says_before_what_that_ends(desk: Desk) -> None:
    page = await desk.driving()
    take = page.locator(".card", has_text="evsg1").get_by_role(
        "button", name="Take over", exact=True
    )
    dialog = page.get_by_role("dialog", name="Take over evsg1")
    await take.click()
    await expect(dialog).to_contain_text("DRIVE ROUTE ends with error TAKEN_OVER")
    await page.keyboard.press("Escape")
    await expect(dialog).to_have_count(0)
    await expect(element(page, "DriveRoute")).to_contain_class("m2-active")
    assert await holder(desk, "evsg1") not in ("", "anna")
    await take.click()
    await dialog.get_by_role("button", name="Take over").click()
    await desk.until("/api/resources", lambda said: said["holders"]["evsg1"] == "anna")
    await expect(element(page, "DriveRoute")).not_to_contain_class("m2-active")


async def holder(desk: Desk, vehicle: str) -> str:
    """Who has it, as the server says."""
    return str((await desk.ask("GET", "/api/resources"))["holders"][vehicle])


async def test_the_page_finds_back_after_the_connection_broke(desk: Desk) -> None:
    page = desk.page
    lines: list[WebSocketRoute] = []
    may_come_back = asyncio.Event()

    async def pass_on(line: WebSocketRoute) -> None:
        lines.append(line)
        if len(lines) > 1:
            await may_come_back.wait()
        line.connect_to_server()

    await page.route_web_socket(re.compile("/api/live"), pass_on)
    await desk.start()
    assert len(lines) == 1
    await lines[0].close(code=1011)
    lost = page.get_by_role("alert").filter(has_text="Not connected")
    await until_tried_again(page, lines)
    # It is still not connected: trying is not having.
    await expect(lost).to_be_visible()
    may_come_back.set()
    await expect(lost).to_have_count(0)
    assert len(lines) == 2
    await answer(page, "Continue").click()
    await expect(element(page, "DriveRoute")).to_contain_class("m2-active")


async def until_tried_again(page: Page, lines: list[WebSocketRoute]) -> None:
    async with asyncio.timeout(30):
        while len(lines) < 2:
            await page.evaluate("new Promise(requestAnimationFrame)")
