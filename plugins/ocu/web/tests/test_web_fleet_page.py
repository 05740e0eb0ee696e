"""The page of the fleet, in a real browser: found, taken, commanded, held, given back."""

import re

import pytest
from playwright.async_api import Browser, Locator, Page, expect
from web_axe import Accessibility
from web_desk import IN_ONE_LOOP, Desk, forget, signed_in
from web_pictures import picture
from web_proxy import proxy_to

pytestmark = IN_ONE_LOOP


async def fleet(desk: Desk, page: Page | None = None) -> Page:
    """The page of the fleet, connected, with a state of each vehicle."""
    page = page or desk.page
    await page.goto(f"{desk.executive.origin}/fleet")
    await expect(page.locator(".link-open")).to_have_count(1)  # else nothing is sent
    await expect(row(page, "uav1")).to_contain_text("connected")
    return page


def row(page: Page, name: str) -> Locator:
    return page.get_by_role("row").filter(has=page.get_by_role("rowheader", name=name, exact=True))


def commands(page: Page) -> Locator:
    return page.get_by_role("region", name="Details and commands")


async def press(page: Page, name: str) -> None:
    await commands(page).get_by_role("button", name=name, exact=True).click()


async def click_map(page: Page) -> None:
    box = await page.get_by_role("application", name="Map of the fleet").bounding_box()
    assert box is not None
    await page.mouse.click(box["x"] + box["width"] * 0.7, box["y"] + box["height"] * 0.25)


async def test_an_operator_commands_a_vehicle_by_a_click_on_the_map(desk: Desk) -> None:
    page = await fleet(desk)
    await row(page, "uav1").click()
    await expect(commands(page)).to_contain_text("return_to_launch")  # its failsafe
    give = commands(page).get_by_role("button", name="Give the command")
    run = row(page, "uav1").get_by_role("link", name=re.compile("^run r"))
    await press(page, "Takeoff…")
    await page.locator("#m2-parameter-altitude").fill("5 m")
    await give.click()
    await expect(row(page, "uav1")).to_contain_text(" 5.0 m")
    await expect(run).to_have_count(0)
    await press(page, "Goto…")
    await expect(page.get_by_text("Click the map: Target of Goto")).to_be_visible()
    await expect(give).to_be_disabled()
    await click_map(page)
    await expect(give).to_be_enabled()
    await picture(page, "fleet_goto")
    await give.click()
    await expect(run).to_be_visible()
    await expect(row(page, "uav1")).to_contain_text("goto")
    await expect(commands(page).get_by_role("form")).to_have_count(0)
    first = await run.inner_text()
    await press(page, "Hold")
    await expect(row(page, "uav1")).to_contain_text("goto (held)")
    await press(page, "Resume")
    await expect(row(page, "uav1")).not_to_contain_text("(held)")
    # What another command ends is said before.
    await press(page, "Return to launch")
    dialog = page.get_by_role("dialog", name="Return to launch: uav1")
    await expect(dialog).to_contain_text("which you commanded, ends")
    await dialog.get_by_role("button", name="Give the command").click()
    await expect(run).not_to_have_text(first)
    await expect(run).to_be_visible()
    runs = (await desk.ask("GET", "/api/runs?limit=1000"))[-2:]
    assert [each["mission"] for each in runs] == ["goto of uav1", "return_to_launch of uav1"]
    assert runs[0]["status"] == "stopped"
    records = (await desk.ask("GET", f"/api/runs/{runs[1]['run']}/records"))["records"]
    assert next(each for each in records if each["record"] == "RunStarted")["by"] == "anna"


async def test_many_are_taken_and_held_after_what_that_ends_was_confirmed(desk: Desk) -> None:
    await desk.driving()
    page = await fleet(desk)
    await expect(row(page, "evsg1")).to_contain_text("DRIVE ROUTE")
    await page.get_by_role("button", name=re.compile("^In runs")).click()
    await expect(row(page, "evsg1")).to_be_visible()
    await expect(row(page, "uav1")).to_have_count(0)
    await page.get_by_role("button", name=re.compile("^In runs")).click()
    for name in ("evsg1", "uav1"):
        await row(page, name).get_by_role("checkbox").check()
    await press(page, "Hold")
    dialog = page.get_by_role("dialog", name="Hold 2 vehicles")
    await expect(dialog).to_contain_text("uav1")
    await expect(dialog).to_contain_text("It is taken over first")
    await expect(dialog).to_contain_text("ends with error TAKEN_OVER")
    await picture(page, "fleet_confirm")
    await dialog.get_by_role("button", name="Take over, and hold").click()
    await expect(row(page, "evsg1")).to_contain_text("with you")
    await expect(commands(page)).to_contain_text("2 vehicles")
    await page.get_by_label("Group by").select_option("holder")
    await expect(page.get_by_role("row", name=re.compile(r"^anna \d"))).to_be_visible()
    await press(page, "Give back")
    dialog = page.get_by_role("dialog", name="Give back 2 vehicles")
    await dialog.get_by_role("button", name="Give back").click()
    # One of them was never taken: that is said for it alone.
    await expect(commands(page).get_by_role("alert")).to_contain_text(
        "uav1: uav1 is not with an operator"
    )
    await expect(row(page, "evsg1")).not_to_contain_text("with you")


async def test_a_vehicle_is_found_and_held_without_a_mouse_on_a_phone(desk: Desk) -> None:
    page = desk.page
    await page.set_viewport_size({"width": 390, "height": 780})
    await fleet(desk)
    await page.get_by_label("Find vehicles").fill("air")
    await expect(page.get_by_role("row")).to_have_count(2)
    await page.get_by_role("grid", name="Vehicles").focus()
    await page.keyboard.press("End")
    await page.keyboard.press("Space")
    await expect(row(page, "uav1")).to_have_attribute("aria-selected", "true")
    await page.keyboard.press("Enter")
    await expect(page.get_by_role("tab", name="Commands (1)")).to_have_attribute(
        "aria-selected", "true"
    )
    await press(page, "Goto…")
    # The map is shown for the position, and the commands again when it is known.
    await expect(page.get_by_text("Click the map: Target of Goto")).to_be_visible()
    await click_map(page)
    give = commands(page).get_by_role("button", name="Give the command")
    await expect(give).to_be_enabled()
    await give.press("Enter")
    await expect(page.locator(".toasts")).to_contain_text("uav1: Goto was commanded")


async def test_a_viewer_sees_the_fleet_and_commands_nothing(chromium: Browser, desk: Desk) -> None:
    async with signed_in(chromium, desk.executive, "vera") as vera:
        page = await fleet(vera)
        await row(page, "evsg1").click()
        await expect(commands(page)).to_contain_text("Operators and commanders give commands.")
        await expect(commands(page).get_by_role("button", name="Hold")).to_have_count(0)


async def test_a_dead_network_makes_it_gray_and_sends_nothing(desk: Desk) -> None:
    async with proxy_to(desk.executive.origin) as proxy:
        page = await desk.watched.context.new_page()
        origin = f"http://127.0.0.1:{proxy.port}"
        await page.goto(f"{origin}/healthz")
        await forget(page, origin, desk.key)
        await page.goto(f"{origin}/fleet")
        await expect(page.locator(".link-open")).to_have_count(1)
        await row(page, "uav1").click()
        proxy.stall()
        await expect(page.locator(".fleet-page.stale")).to_have_count(1)
        await expect(row(page, "uav1")).to_contain_text("Not known")
        await press(page, "Hold")
        await expect(page.locator(".toasts")).to_contain_text("Not connected: nothing was sent.")
        proxy.heal()
        await expect(page.locator(".fleet-page.stale")).to_have_count(0)
        await expect(row(page, "uav1")).to_contain_text("OK")
        assert not (await desk.ask("GET", "/api/resources"))["holders"]["uav1"]
        await page.close()


@pytest.mark.parametrize(
    "dark", [False, pytest.param(True, marks=pytest.mark.long)], ids=["light", "dark"]
)
async def test_the_fleet_has_no_violation(desk: Desk, dark: bool) -> None:
    page = await fleet(desk)
    eyes = Accessibility(page)
    await page.get_by_label("Payloads").check()
    await page.get_by_label("Group by").select_option("domain")
    await eyes.look("fleet")
    await row(page, "uav1").click()
    await press(page, "Goto…")
    await eyes.look("form", ".fleet-panel")
    await row(page, "evsg1").get_by_role("checkbox").check()
    await row(page, "evsg2").get_by_role("checkbox").check()
    await press(page, "Take over")
    await expect(page.get_by_role("dialog")).to_contain_text("evsg2")
    await eyes.look("confirmation", "[role=dialog]")
    await page.keyboard.press("Escape")
    await page.emulate_media(forced_colors="active")
    await eyes.look("forced colours")
    await page.set_viewport_size({"width": 390, "height": 780})
    await expect(page.get_by_role("tab", name="Map")).to_be_visible()
    await eyes.look("phone")
    eyes.assert_well()


async def test_to_take_over_what_one_has_commanded_oneself_is_no_fault(desk: Desk) -> None:
    far = {"resources": ["evsg3"], "behavior": "goto", "parameters": {"target": "[38.2, -77.3]"}}
    run = (await desk.ask("POST", "/api/fleet/execute", far))["results"][0]["run"]
    page = await fleet(desk)
    await row(page, "evsg3").click()
    await press(page, "Take over")
    dialog = page.get_by_role("dialog", name="Take over evsg3")
    await expect(dialog).to_contain_text("which you commanded, ends")
    await dialog.get_by_role("button", name="Take over").click()
    await expect(row(page, "evsg3")).to_contain_text("with you")
    await desk.until(f"/api/runs/{run}", lambda said: said["status"] == "stopped")
    await expect(page.locator(".toast-bad")).to_have_count(0)
    assert not [each for each in await desk.ask("GET", "/api/alerts") if each["run"] == run]
