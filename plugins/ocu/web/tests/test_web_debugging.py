"""Operators debug a run on its page: breakpoints, stops, steps, data; and see it in the replay."""

import os
from pathlib import Path

from playwright.async_api import Browser, Locator, Page, Route, expect
from web_axe import Accessibility
from web_browsing import SIGN_IN, page_at
from web_desk import IN_ONE_LOOP, Desk, element, signed_in
from web_pictures import picture
from web_running import answer, wait_for_status
from web_world import PASSWORD

pytestmark = IN_ONE_LOOP

GATEWAY = "GatewayDecision"
STOP = "header button.stop"
NOT_JSON = "This is not JSON"


def banner(page: Page) -> Locator:
    """Where the run is stopped."""
    return page.locator(".stop-banner")


def badge(page: Page, name: str) -> Locator:
    """The mark of an element in the diagram."""
    return element(page, name).locator(".m2-badge-breakpoint")


def row(page: Page, name: str) -> Locator:
    """An element in the tree."""
    return page.get_by_role("treeitem", name=name).first


async def set_by_menu(page: Page, name: str) -> None:
    await element(page, name).locator(".djs-hit").first.click(button="right")
    await page.get_by_role("menuitem", name="Set a breakpoint").click()


async def look_at(page: Page, name: str) -> None:
    """A picture for those who change the page."""
    if folder := os.environ.get("M2PEM_LOOK"):
        await page.screenshot(path=Path(folder) / f"{name}.png", animations="disabled")


async def close_toasts(page: Page) -> None:
    """Close what a slow machine says."""
    faults = page.locator(".toast button")
    for left in range(await faults.count(), 0, -1):
        await faults.first.click()
        await expect(faults).to_have_count(left - 1)


async def watch(page: Page, desk: Desk) -> str:
    """Show the run of the desk on another page; its path."""
    await page.set_viewport_size({"width": 1440, "height": 960})
    await page.goto(desk.page.url)
    await expect(page.locator(".link-open")).to_have_count(1)
    return desk.page.url.rpartition("/")[2]


async def test_a_run_is_stopped_looked_at_changed_and_goes_on(desk: Desk) -> None:
    page = desk.page
    await page.set_viewport_size({"width": 1440, "height": 960})
    await desk.start()
    desk.refusals += [409, 409]  # of an expression that fails, and a condition that cannot be read
    other = await desk.another()
    run = await watch(other, desk)

    await set_by_menu(page, GATEWAY)
    for each in (page, other):
        await expect(badge(each, GATEWAY)).to_have_text("●")
        await expect(each.get_by_role("tab", name="Breakpoints (1)")).to_be_visible()
    drive = row(page, "DRIVE ROUTE")
    await drive.focus()
    await page.keyboard.press("b")
    await expect(row(other, "DRIVE ROUTE")).to_contain_text("●")
    await expect(row(other, "DRIVE ROUTE")).to_have_accessible_name(
        "DRIVE ROUTE, script task, not visited, breakpoint"
    )

    await answer(page, "Continue").click()
    for each in (page, other):
        await expect(banner(each)).to_contain_text("Stopped before Decision? breakpoint")
        await wait_for_status(each, "Paused")
        await expect(badge(each, GATEWAY)).to_have_text("▶")
        await expect(each.locator(STOP)).to_be_in_viewport()
    await banner(page).get_by_role("button", name="Data").click()
    pane = page.locator(".debug-pane")
    eyes = Accessibility(page)
    await eyes.look("stopped")
    await close_toasts(page)
    await look_at(page, "debugging")
    await picture(page, "debugging")
    await data_is_changed(pane, other)
    await expressions_are_evaluated(pane)
    await conditions_are_set(pane)

    await banner(page).get_by_role("button", name="Step").click()
    await expect(banner(other)).to_contain_text("Stopped before DETECTION one step was made")
    await banner(other).get_by_role("button", name="Continue").click()
    await expect(banner(page)).to_contain_text(
        "Stopped before DRIVE ROUTE in DETECTION, of evsg1 breakpoint"
    )
    await eyes.look("the banner", ".stop-banner")
    eyes.assert_well()
    await pane.get_by_role("button", name="Remove all").click()
    await expect(other.get_by_role("tab", name="Breakpoints", exact=True)).to_be_visible()
    await expect(badge(page, GATEWAY)).to_be_hidden()
    await banner(page).get_by_role("button", name="Continue").click()
    await expect(element(page, "DriveRoute")).to_contain_class("m2-active")
    await expect(banner(page)).to_have_count(0)
    await other.close()
    await page.goto(desk.executive.origin)  # else it reads the data of a run that is over
    await desk.ask("POST", f"/api/runs/{run}/stop", {"reason": "seen"})
    await page.goto(f"{desk.executive.origin}/runs/{run}?t=0")
    await the_replay_shows_the_stops(page)


async def data_is_changed(pane: Locator, other: Page) -> None:
    """What no JSON is, is said; another page sees the change."""
    await expect(pane.get_by_role("region", name="VIGNETTE1")).to_contain_text("user.decision")
    await pane.get_by_role("button", name="Change user.decision").click()
    field = pane.get_by_role("textbox", name="Value of user.decision")
    await field.fill("abort")
    await pane.get_by_role("button", name="Save").click()
    await expect(pane.get_by_role("alert").filter(has_text=NOT_JSON)).to_be_visible()
    await field.fill('"abort"')
    await field.press("Enter")
    await other.get_by_role("tab", name="Breakpoints").click()
    seen = other.locator(".run-data")
    await expect(seen).to_contain_text('"abort"')
    await seen.get_by_role("button", name="Change user.decision").click()
    await seen.get_by_role("textbox", name="Value of user.decision").fill('"continue"')
    await seen.get_by_role("button", name="Save").click()
    await expect(pane.locator(".run-data")).to_contain_text('"continue"')
    await pane.get_by_role("button", name="Add a value").first.click()
    await pane.get_by_label("Name").fill("seen.count")
    await pane.get_by_role("textbox", name="Value (JSON)").fill("2")
    await pane.get_by_role("button", name="Save").click()
    await expect(pane.locator("dd", has_text="2")).to_be_visible()


async def expressions_are_evaluated(pane: Locator) -> None:
    """The value and its kind; a name that is not set; what fails, and where."""
    expression = pane.get_by_role("textbox", name="Expression, such as")
    for text, shown in (
        ("seen.count * 2", "4 number"),
        ("= user.decision", '"continue" text'),
        ("= armed and seen.count > 1", "null armed is not set"),
    ):
        await expression.fill(text)
        await expression.press("Enter")
        await expect(pane.get_by_role("status")).to_have_text(shown)
    await expression.fill("= user.decision + 1 > 3")
    await pane.get_by_role("button", name="Evaluate").click()
    await expect(pane.get_by_role("status")).to_contain_text(
        "in 'user.decision + 1' at column 3 of '= user.decision + 1 > 3', "
        "where user.decision is the text 'continue'"
    )


async def conditions_are_set(pane: Locator) -> None:
    """A condition that cannot be read is refused where it is typed."""
    condition = pane.get_by_label("Or when this has become true")
    await condition.fill("seen.count >")
    await condition.press("Enter")
    refused = pane.get_by_role("alert").filter(has_text="'seen.count >' is no condition")
    await expect(refused).to_be_visible()
    await condition.fill("seen.count > 5")
    await pane.get_by_role("button", name="Set", exact=True).click()
    await expect(pane.get_by_text("when seen.count > 5")).to_be_visible()
    await expect(condition).to_have_value("")


async def the_replay_shows_the_stops(page: Page) -> None:
    """Each is shown as it was; nothing is asked of a run that is over."""
    await page.get_by_role("tab", name="Stops (3)").click()
    await expect(banner(page)).to_have_count(0)
    await page.get_by_role("button", name="Stopped before DRIVE ROUTE").click()
    await expect(banner(page)).to_contain_text("Stopped before DRIVE ROUTE in DETECTION, of evsg1")
    await expect(banner(page).get_by_role("button", name="Step")).to_have_count(0)
    await expect(row(page, "DRIVE ROUTE")).to_contain_text("▶")
    await page.get_by_role("button", name="Stopped before DETECTION").click()
    await expect(banner(page)).to_contain_text("Stopped before DETECTION one step was made")
    await page.get_by_role("button", name="To the end", exact=True).click()
    await expect(banner(page)).to_have_count(0)


async def test_a_condition_stops_the_run_and_a_viewer_only_sees_it(
    chromium: Browser, desk: Desk
) -> None:
    await desk.page.set_viewport_size({"width": 1440, "height": 960})
    await desk.start()
    async with signed_in(chromium, desk.executive, "vera") as vera:
        run = await watch(vera.page, desk)
        condition = "user.decision == 'continue'"
        await desk.ask("PUT", f"/api/runs/{run}/breakpoints", {"conditions": [condition]})
        await answer(desk.page, "Continue").click()
        await expect(banner(vera.page)).to_contain_text(f"{condition} has become true")
        for name in ("Step", "Continue"):
            await expect(banner(vera.page).get_by_role("button", name=name)).to_have_count(0)
        await banner(vera.page).get_by_role("button", name="Data").click()
        pane = vera.page.locator(".debug-pane")
        await expect(pane).to_contain_text("Operators and commanders set breakpoints.")
        await expect(pane.locator(".run-data")).to_contain_text('"continue"')
        await expect(pane.get_by_role("button", name="Change user.decision")).to_have_count(0)
        await expect(pane.get_by_role("button", name="Remove all")).to_have_count(0)
        await element(vera.page, GATEWAY).locator(".djs-hit").first.click(button="right")
        item = vera.page.get_by_role("menuitem", name="Set a breakpoint")
        await expect(item).to_have_attribute("aria-disabled", "true")
        eyes = Accessibility(vera.page)
        await eyes.look("the menu of an element", ".element-menu")
        eyes.assert_well()
        await vera.page.keyboard.press("Escape")
        await expect(item).to_have_count(0)
        for method, path, body in (
            ("PUT", "breakpoints", {"elements": [GATEWAY]}),
            ("POST", "step", {}),
            ("POST", "data", {"data": {"a": 1}}),
        ):
            refused = await vera.watched.context.request.fetch(
                f"{desk.executive.origin}/api/runs/{run}/{path}",
                method=method,
                headers={"Origin": desk.executive.origin, "M2pem-Key": vera.key},
                data=body,
            )
            assert refused.status == 403
        await desk.ask("POST", f"/api/runs/{run}/step")


async def test_a_fleet_that_allows_no_breakpoints_says_why(desk: Desk) -> None:
    page = desk.page

    async def real(route: Route) -> None:
        answered = await route.fetch()
        fleet = {**await answered.json(), "may_be_debugged": False}
        await route.fulfill(response=answered, json=fleet)

    await page.route("**/api/fleet", real)
    await page.set_viewport_size({"width": 1440, "height": 960})
    await desk.start()
    await expect(page.get_by_role("tab", name="Breakpoints")).to_have_count(0)
    await row(page, "Decision?").click(button="right")
    menu = page.get_by_role("menu", name="Decision?: breakpoint")
    await expect(menu).to_contain_text("its file does not say “debugging: true”")
    item = menu.get_by_role("menuitem")
    await expect(item).to_have_attribute("aria-disabled", "true")
    await item.press("Enter")
    await expect(menu).to_be_visible()
    await page.keyboard.press("Escape")
    await expect(row(page, "Decision?")).to_be_focused()
    await page.keyboard.press("b")
    await expect(page.locator(".toast")).to_contain_text("debugging: true")
    await expect(badge(page, GATEWAY)).to_have_count(0)


async def test_a_run_is_debugged_on_a_phone_in_german(chromium: Browser, desk: Desk) -> None:
    await desk.start()
    url = f"{desk.executive.origin}/healthz"
    async with page_at(chromium, url, width=390, height=844, language="de-DE", touch=True) as it:
        page = it.page
        await page.evaluate(SIGN_IN, ["anna", PASSWORD])
        await page.goto(desk.page.url)
        await page.get_by_role("tab", name="Elemente", exact=True).click()
        await row(page, "DRIVE ROUTE").click()
        await page.get_by_role("tab", name="Haltepunkte").click()
        await page.get_by_role("button", name="Setzen bei DRIVE ROUTE").click()
        await expect(page.get_by_role("tab", name="Haltepunkte (1)")).to_be_visible()
        await answer(page, "Continue").click()
        await expect(banner(page)).to_contain_text("Angehalten vor DRIVE ROUTE")
        await expect(banner(page)).to_contain_text("in DETECTION, von evsg1")
        await expect(page.locator(STOP)).to_be_in_viewport()
        narrow = "() => document.documentElement.scrollWidth <= innerWidth"
        await page.wait_for_function(narrow)
        await look_at(page, "debugging-phone")
        eyes = Accessibility(page)
        await eyes.look("a stop on a phone")
        eyes.assert_well()
        await banner(page).get_by_role("button", name="Schritt").click()
        await expect(banner(page)).not_to_contain_text("Angehalten vor DRIVE ROUTE")
        await page.get_by_role("button", name="Alle entfernen").click()
        await banner(page).get_by_role("button", name="Fortsetzen").click()
        await wait_for_status(page, "Läuft")
        it.assert_well()
