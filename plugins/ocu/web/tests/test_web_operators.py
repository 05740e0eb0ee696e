"""Several operators at real pages: who is first, who may, and what happens when something ends."""

import asyncio
import shutil
import socket
from pathlib import Path

from playwright.async_api import Browser, Page, expect
from web_axe import Accessibility
from web_browsing import KEY, page_at
from web_desk import IN_ONE_LOOP, Desk, element, named_users, signed_in
from web_running import answer, wait_for_status
from web_served import REPOSITORY, Served, served
from web_world import PASSWORD

pytestmark = IN_ONE_LOOP

NAME = "vignette1"
# Steering that the page has for those who may, and that the server refuses to those who may not.
STEERING = ["STOP", "Pause", "Stop this run", "Signal…", "Message…", "Take over", "Continue"]
STEERED = ["pause", "resume", "stop"]
REFUSED = """async ([run, what]) => {
  const path = what === "STOP" ? "/api/stop" : `/api/runs/${run}/${what}`;
  const said = { method: "POST", headers: HEADERS, body: "{}" };
  return (await fetch(path, said)).status;
}""".replace("HEADERS", f'{{ {KEY}, "Content-Type": "application/json" }}')


async def see(it: Desk, run: str) -> Page:
    """The page of somebody who looks at a run."""
    it.watched.listen(it.page)
    await it.page.goto(run)
    return it.page


async def test_operators_see_the_same_and_the_first_answer_counts(
    chromium: Browser, desk: Desk
) -> None:
    async with signed_in(chromium, desk.executive, "otto") as otto:
        await desk.start()
        page = await see(otto, desk.page.url)
        await expect(answer(page, "Abort")).to_be_enabled()
        await see_who_has_taken_a_vehicle(desk.page, page)
        await answer(desk.page, "Continue").click()
        await expect(page.locator(".toasts")).to_contain_text("anna was first: “Continue”")
        await expect(page.get_by_role("alertdialog")).to_have_count(0)
        await expect(desk.page.get_by_text("was first")).to_have_count(0)
        # An operator, who cannot start runs, steers them.
        await page.get_by_role("button", name="Pause", exact=True).click()
        for each in (desk, otto):
            log = each.page.get_by_role("region", name="Events")
            await expect(log).to_contain_text("USER SEND ROUTE: continue, answered by anna")
            await expect(element(each.page, "DriveRoute")).to_contain_class("m2-active")
            await wait_for_status(each.page, "Paused")
            each.assert_well()


async def see_who_has_taken_a_vehicle(page: Page, takes: Page) -> None:
    taken = takes.locator(".card", has_text="evsg2")
    await taken.get_by_role("button", name="Take over", exact=True).click()
    seen = page.locator(".card", has_text="evsg2")
    await expect(seen).to_contain_text("with otto")
    await hand_over(page, takes, "evsg2")
    await seen.get_by_role("button", name="Give back", exact=True).click()
    await expect(taken.get_by_role("button", name="Take over", exact=True)).to_be_enabled()


async def hand_over(asks: Page, has: Page, vehicle: str) -> None:
    """Anna sees that Otto is there, asks him for a vehicle, and he gives it; both read a note."""
    await asks.get_by_role("button", name="2 persons are present").click()
    present = asks.get_by_role("region", name="Who is present")
    await expect(present.get_by_text("otto")).to_be_visible()
    await asks.keyboard.press("Escape")
    await expect(present).to_have_count(0)
    card = asks.locator(".card", has_text=vehicle)
    await card.get_by_role("button", name="Ask for it", exact=True).click()
    await expect(asks.get_by_text(f"You ask otto for {vehicle}.")).to_be_visible()
    await expect(has.get_by_text(f"anna asks you for {vehicle}.")).to_be_visible()
    found = Accessibility(has)
    await found.look("a request for control", ".control-request")
    found.assert_well()
    await has.get_by_role("button", name="Give it", exact=True).click()
    await expect(has.locator(".control-request")).to_have_count(0)
    await expect(has.locator(".card", has_text=vehicle)).to_contain_text("with anna")
    await has.get_by_label("Note for the log").fill("wind picks up")
    await has.keyboard.press("Enter")
    log = asks.get_by_role("region", name="Events")
    await expect(log).to_contain_text("otto: wind picks up")


async def test_a_viewer_sees_all_and_finds_nothing_to_steer_with(
    chromium: Browser, desk: Desk
) -> None:
    async with signed_in(chromium, desk.executive, "vera") as vera:
        page = await see(vera, desk.executive.origin)
        await desk.home()
        for name in ("New mission", "Upload", f"Remove {NAME}"):
            button = desk.page.get_by_role("button", name=name, exact=True)
            await expect(button).to_have_count(1)
            await expect(page.get_by_role("button", name=name, exact=True)).to_have_count(0)
        await desk.start()
        run = desk.page.url
        await see_how_a_viewer_looks_at_a_run(page, run)
        for name in STEERING:
            theirs = desk.page.get_by_role("button", name=name, exact=True)
            await expect(theirs).not_to_have_count(0)
            await expect(page.get_by_role("button", name=name, exact=True)).to_have_count(0)
        await page.keyboard.press("1")
        await page.keyboard.press("Shift+Escape")
        await page.keyboard.press("Shift+Escape")
        vera.assert_well()
        for what in (*STEERED, "STOP"):
            assert await page.evaluate(REFUSED, [run.rpartition("/")[2], what]) == 403
        await wait_for_status(page, "Running")
        await expect(answer(desk.page, "Continue")).to_be_visible()
        await see_how_a_viewer_looks_at_a_mission(page, desk.executive)


async def see_how_a_viewer_looks_at_a_run(page: Page, run: str) -> None:
    await page.goto(run)
    question = page.get_by_role("alertdialog")
    await expect(question).to_contain_text("Send the route, then continue")
    await expect(question).to_contain_text("Operators answer “Continue”, “Abort”.")
    await expect(element(page, "UserSendRoute")).to_contain_class("m2-asking")
    await expect(page.locator(".vehicles-pane .card", has_text="evsg1")).to_be_visible()


async def see_how_a_viewer_looks_at_a_mission(page: Page, executive: Served) -> None:
    await page.goto(f"{executive.origin}/missions/{NAME}")
    await expect(page.locator("[data-element-id=Reverse]").first).to_be_visible()
    for tab, names in {
        "Properties": ["Save"],
        "Verify": ["Verify"],
        "Run": ["Rehearse", "Start"],
    }.items():
        await page.get_by_role("tab", name=tab, exact=True).click()
        await expect(page.get_by_role("tabpanel", name=tab)).to_be_visible()
        for name in names:
            await expect(page.get_by_role("button", name=name, exact=True)).to_have_count(0)


async def test_who_signs_in_on_the_way_to_a_page_comes_there(
    chromium: Browser, executive: Served
) -> None:
    shutil.copy(REPOSITORY / "missions" / f"{NAME}.bpmn", executive.missions)
    async with page_at(chromium, f"{executive.origin}/missions/{NAME}") as it:
        page = it.page
        await page.get_by_label("Name").fill("anna")
        await page.get_by_label("Password").fill("wrong")
        await page.keyboard.press("Enter")
        await expect(page.get_by_text("Name or password is wrong.")).to_be_visible()
        await page.get_by_label("Password").fill(PASSWORD)
        await page.get_by_role("button", name="Sign in").click()
        await expect(page.locator(".who")).to_contain_text("anna")
        await expect(page).to_have_url(f"{executive.origin}/missions/{NAME}")


def free_port() -> int:
    """Of 127.0.0.1. The page's address must not change when its executive is started again."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


async def test_a_page_comes_back_when_the_executive_does(chromium: Browser, tmp_path: Path) -> None:
    port = {"M2PEM_WEB_PORT": str(free_port()), **named_users(tmp_path)}
    words = ("--simulate", "--journal", str(tmp_path / "journal.db"))
    with served(tmp_path, words=words, environment=port) as executive:
        shutil.copy(REPOSITORY / "missions" / f"{NAME}.bpmn", executive.missions)
        async with signed_in(chromium, executive, "anna") as anna:
            page = await anna.start()
            executive.process.kill()
            await asyncio.to_thread(executive.process.wait)
            gone = page.get_by_text("Not connected to the executive")
            await expect(gone.first).to_be_visible()
            with served(tmp_path, words=words, environment=port):
                # Nobody reloads, nobody signs in: it connects by itself, and the run goes on.
                await expect(answer(page, "Continue")).to_be_enabled()
                await wait_for_status(page, "Running")
                await expect(gone).to_have_count(0)
                await answer(page, "Continue").click()
                await expect(page.locator(".vehicles-pane .card").first).to_contain_text(
                    "DRIVE ROUTE"
                )
