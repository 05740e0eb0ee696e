"""Every page in every theme has no violation that axe-core knows; a run needs no mouse."""

import re
import shutil
from pathlib import Path

import pytest
from playwright.async_api import Page, expect
from web_axe import Accessibility
from web_browsing import browser, page_at
from web_drawing import Drawing
from web_running import answer, press_twice, wait_for_status
from web_served import REPOSITORY, Served, served

NAME = "vignette1"
# One of each kind that has a form of its own.
KINDS = ["StartVignette1", "UserSendRoute", "CallDetection", "EscalationDetected", "Reverse"]
KINDS += ["GatewayDecision", "Detector", "ThrowStop", "RoutePromptReference", "PoolVignette1"]


def put(executive: Served) -> None:
    shutil.copy(REPOSITORY / "missions" / f"{NAME}.bpmn", executive.missions)


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
async def test_first_page_and_editor_have_no_violation(tmp_path: Path, dark: bool) -> None:
    with served(tmp_path) as executive:
        put(executive)
        async with browser() as chromium, page_at(chromium, executive.url, dark=dark) as it:
            eyes = Accessibility(it.page)
            await look_at_home(eyes)
            await look_at_editor(eyes, executive)
            await look_at_panels(eyes)
            await look_at_dialogs(eyes)
            await look_at_sign_in(eyes, executive)
            eyes.assert_well()


async def look_at_home(eyes: Accessibility) -> None:
    page = eyes.page
    await expect(page.get_by_role("link", name=NAME)).to_be_visible()
    await eyes.look("home")
    await page.get_by_role("button", name="New mission").click()
    await expect(page.get_by_role("radio")).to_have_count(6)
    await eyes.look("new mission")
    await page.keyboard.press("Escape")
    await page.get_by_role("button", name=f"Remove {NAME}").click()
    await eyes.look("remove mission")
    await page.keyboard.press("Escape")


async def look_at_editor(eyes: Accessibility, executive: Served) -> None:
    page = eyes.page
    await page.goto(f"{executive.origin}/missions/{NAME}")
    drawing = Drawing(page)
    await expect(drawing.element("Reverse")).to_be_attached()
    await eyes.look("editor")
    for kind in KINDS:
        await drawing.select(kind)
        await eyes.look(f"form of {kind}")
    await drawing.select_flow("GatewayDecision", "CallDetection")
    await eyes.look("form of a flow")
    await drawing.select("Reverse")
    await drawing.fill("Distance", "10 s")
    await expect(page.locator(".m2-has-error").first).to_be_attached()
    await eyes.look("form with an error")
    for action in ("append", "replace"):
        await page.click(f".djs-context-pad [data-action={action}]")
        await expect(page.locator(".djs-popup .entry").first).to_be_visible()
        await eyes.look(f"{action} menu")
        await page.keyboard.press("Escape")


async def look_at_panels(eyes: Accessibility) -> None:
    page = eyes.page
    await page.get_by_role("tab", name="Problems").click()
    await expect(page.locator(".m2-problem").first).to_be_visible()
    await eyes.look("problems")
    await page.get_by_role("button", name="Undo").click()
    await page.get_by_role("tab", name="Verify").click()
    await page.get_by_text("Options", exact=True).click()
    parts = page.get_by_role("region", name="Requirements of this mission")
    await parts.get_by_label("Pattern").select_option("operator_in_the_loop")
    await parts.get_by_role("button", name="Add", exact=True).click()
    await eyes.look("requirements")
    await page.get_by_role("button", name="Undo").click()
    await page.get_by_role("button", name="Verify", exact=True).click()
    report = page.get_by_role("region", name="Report")
    await expect(report.get_by_role("heading", name="Everything holds")).to_be_visible()
    await eyes.look("report")
    await report.get_by_role("button", name=re.compile("Show the run")).first.click()
    await eyes.look("run step by step")
    await page.get_by_role("tab", name="Run", exact=True).click()
    await page.get_by_text("What happens in the rehearsal").click()
    await eyes.look("run")
    await page.get_by_role("button", name="Rehearse").click()
    outcome = page.get_by_role("region", name="What came of it")
    await expect(outcome.get_by_role("heading").first).to_be_visible()
    await eyes.look("rehearsed")


async def look_at_dialogs(eyes: Accessibility) -> None:
    page = eyes.page
    for name in ("Versions", "Save under another name", "Keyboard shortcuts"):
        await page.get_by_role("button", name="More").click()
        await eyes.look("menu")
        await page.get_by_role("menuitem", name=name).click()
        await expect(page.get_by_role("dialog")).to_be_visible()
        await eyes.look(name)
        await page.keyboard.press("Escape")
        await expect(page.get_by_role("dialog")).to_have_count(0)
    for name in ("Lay the diagram out anew", "Add a process"):
        await page.get_by_role("button", name=name).click()
        await eyes.look(name)
        await page.keyboard.press("Escape")
    await page.get_by_role("button", name="Overview of the diagram").click()
    await eyes.look("minimap")


async def look_at_sign_in(eyes: Accessibility, executive: Served) -> None:
    page = eyes.page
    page.on("dialog", lambda dialog: dialog.accept())
    await page.goto(f"{executive.origin}/sign-in")
    await expect(page.get_by_label("Password")).to_be_visible()
    await eyes.look("sign-in")


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
async def test_runs_and_replays_have_no_violation(tmp_path: Path, dark: bool) -> None:
    with served(tmp_path) as executive:
        put(executive)
        async with browser() as chromium, page_at(chromium, executive.url, dark=dark) as it:
            eyes = Accessibility(it.page)
            await start(it.page, executive)
            await look_at_run(eyes)
            await look_at_map(eyes)
            await look_at_end(eyes)
            eyes.assert_well()


async def start(page: Page, executive: Served) -> None:
    await expect(page.get_by_role("link", name=NAME)).to_be_visible()
    await page.goto(f"{executive.origin}/missions/{NAME}")
    await page.get_by_role("tab", name="Run", exact=True).click()
    await page.get_by_role("button", name="Start", exact=True).click()
    await page.wait_for_url("**/runs/*")
    await expect(answer(page, "Continue")).to_be_enabled()


async def look_at_run(eyes: Accessibility) -> None:
    page = eyes.page
    await eyes.look("question")
    await answer(page, "Continue").click()
    await expect(page.get_by_role("alertdialog")).to_have_count(0)
    await expect(page.locator(".vehicles-pane .card").first).to_contain_text("DRIVE ROUTE")
    await eyes.look("running")
    await page.get_by_role("treeitem", name=re.compile("DRIVE ROUTE")).first.click()
    await eyes.look("selected element")
    await page.get_by_role("button", name="Signal…").click()
    await expect(page.get_by_role("dialog")).to_be_visible()
    await eyes.look("signal")
    await page.keyboard.press("Escape")
    await page.get_by_role("button", name="Pause", exact=True).click()
    await wait_for_status(page, "Paused")
    await eyes.look("paused")


async def look_at_map(eyes: Accessibility) -> None:
    page = eyes.page
    await page.get_by_role("button", name=re.compile("^Show")).first.click()
    await eyes.look("what the map shows")
    await page.keyboard.press("Escape")
    await page.get_by_role("button", name=re.compile("^Draw")).click()
    await page.get_by_role("menuitem", name="New route").click()
    await eyes.look("route drawn")
    await page.keyboard.press("Escape")


async def look_at_end(eyes: Accessibility) -> None:
    page = eyes.page
    await page.keyboard.press("Shift+Escape")
    await eyes.look("STOP made ready")
    await expect(page.locator("header button.stop")).to_have_text("STOP")
    await press_twice(page, lambda: page.keyboard.press("Shift+Escape"))
    await expect(page.get_by_role("dialog", name="The run has ended")).to_be_visible()
    await eyes.look("run ended")
    await page.get_by_role("button", name="Replay it").click()
    await expect(page.get_by_label("Position")).to_be_visible()
    await eyes.look("replay")


async def test_a_run_needs_no_mouse(tmp_path: Path) -> None:
    with served(tmp_path) as executive:
        put(executive)
        async with browser() as chromium, page_at(chromium, executive.url) as it:
            page = it.page
            await expect(page.get_by_role("link", name=NAME)).to_be_visible()
            await tab_to(page, NAME)
            await page.keyboard.press("Enter")
            await page.wait_for_url("**/missions/*")
            await tab_to(page, "Properties")
            await page.keyboard.press("End")
            await tab_to(page, "Start")
            await page.keyboard.press("Enter")
            await page.wait_for_url("**/runs/*")
            await expect(answer(page, "Continue")).to_be_enabled()
            # The question has the focus: nobody needs to look for it.
            await expect(page.get_by_role("alertdialog")).to_be_focused()
            await page.keyboard.press("1")
            await expect(page.get_by_role("alertdialog")).to_have_count(0)
            await tab_to(page, "Pause")
            await page.keyboard.press("Enter")
            await wait_for_status(page, "Paused")
            await tab_to(page, "Resume")
            await page.keyboard.press("Space")
            await wait_for_status(page, "Running")
            await press_twice(page, lambda: page.keyboard.press("Shift+Escape"))
            await expect(page.get_by_role("dialog", name="The run has ended")).to_be_visible()
            await wait_for_status(page, "Stopped")
            it.assert_well()


async def tab_to(page: Page, name: str) -> None:
    """Press Tab until what is called so has the focus; the browser itself comes in between."""
    passed = []
    for _ in range(200):
        await page.keyboard.press("Tab")
        passed.append(await page.evaluate(FOCUSED))
        if passed[-1] == name:
            return
    raise AssertionError(f"Tab does not come to {name}, but to {passed}")


FOCUSED = """() => {
  const focused = document.activeElement;
  return (focused?.getAttribute("aria-label") ?? focused?.textContent ?? "").trim();
}"""
