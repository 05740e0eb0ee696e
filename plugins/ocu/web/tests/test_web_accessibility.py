"""Every page in every theme has no violation that axe-core knows; a run needs no mouse."""

import re
import shutil
from collections.abc import Awaitable, Callable, Sequence

import pytest
from playwright.async_api import Browser, Page, expect
from web_axe import Accessibility
from web_browsing import page_at
from web_desk import IN_ONE_LOOP, MISSION, Desk, signed_in
from web_drawing import Drawing
from web_map_seen import vehicles_on
from web_running import answer, press_twice, wait_for_status
from web_served import REPOSITORY, Served

pytestmark = IN_ONE_LOOP

FORM, DIALOG, MENU, MAP = "aside", "[role=dialog]", "[role=menu]", ".map-pane"
DARK = pytest.param(True, marks=pytest.mark.long)
LIGHT_AND_DARK = pytest.mark.parametrize("dark", [False, DARK], ids=["light", "dark"])

STUCK = REPOSITORY / "docs" / "broken" / "join_fed_by_one_branch.bpmn"
# One of each kind that has a form of its own.
KINDS = ["StartVignette1", "UserSendRoute", "CallDetection", "EscalationDetected", "Reverse"]
KINDS += ["GatewayDecision", "Detector", "ThrowStop", "RoutePromptReference", "PoolVignette1"]
SOME_KINDS = ["UserSendRoute"]


@pytest.mark.parametrize(
    ("dark", "whole"),
    [
        (False, False),
        pytest.param(False, True, marks=pytest.mark.long),
        pytest.param(True, True, marks=pytest.mark.long),
    ],
    ids=["light", "light, all", "dark, all"],
)
@pytest.mark.tried_with(
    "axe-core",
    "pages and panels, light and dark",
    kind="Browsers and the web",
    result="no violation",
    package="axe-playwright-python",
)
async def test_first_page_and_editor_have_no_violation(desk: Desk, dark: bool, whole: bool) -> None:
    """`whole`: not only one of each kind of part."""
    eyes = await opened(desk, dark)
    await look_at_home(eyes)
    await look_at_editor(eyes, desk, KINDS if whole else SOME_KINDS)
    await look_at_dialogs(eyes, whole)
    eyes.assert_well()


async def opened(desk: Desk, dark: bool) -> Accessibility:
    """The first page, in one of the themes."""
    page = await desk.home()
    await expect(page.locator("html")).to_have_attribute("data-theme", "dark" if dark else "light")
    return Accessibility(page)


async def look_at_home(eyes: Accessibility) -> None:
    page = eyes.page
    await expect(page.get_by_role("link", name=MISSION)).to_be_visible()
    await eyes.look("home")
    await page.get_by_role("button", name="New mission").click()
    await expect(page.get_by_role("radio")).to_have_count(6)
    await eyes.look("new mission", DIALOG)
    await page.keyboard.press("Escape")
    await page.get_by_role("button", name=f"Remove {MISSION}").click()
    await eyes.look("remove mission", DIALOG)
    await page.keyboard.press("Escape")


async def look_at_editor(eyes: Accessibility, desk: Desk, kinds: Sequence[str]) -> None:
    page = await desk.edit()
    drawing = Drawing(page)
    await eyes.look("editor")
    for kind in kinds:
        await drawing.select(kind)
        await eyes.look(f"form of {kind}", FORM)
    await drawing.select_flow("GatewayDecision", "CallDetection")
    await eyes.look("form of a flow", FORM)
    await drawing.select("Reverse")
    await drawing.fill("Distance", "10 s")
    await expect(page.locator(".m2-has-error").first).to_be_attached()
    await eyes.look("form with an error", FORM)
    await page.get_by_role("tab", name="Problems").click()
    await expect(page.locator(".m2-problem").first).to_be_visible()
    await eyes.look("problems", FORM)
    await page.get_by_role("tab", name="Properties").click()
    for action in ("append", "replace"):
        await page.click(f".djs-context-pad [data-action={action}]")
        await expect(page.locator(".djs-popup .entry").first).to_be_visible()
        await eyes.look(f"{action} menu", ".djs-popup")
        await drawing.close_menu()
    await page.get_by_role("combobox").first.click()
    await eyes.look("list of a field", FORM)


@pytest.mark.long
@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
async def test_panels_of_the_editor_have_no_violation(desk: Desk, dark: bool) -> None:
    shutil.copy(STUCK, desk.executive.missions)
    eyes = await opened(desk, dark)
    await desk.edit(STUCK.stem)
    await look_at_verification(eyes)
    await look_at_rehearsal(eyes)
    eyes.assert_well()


async def look_at_verification(eyes: Accessibility) -> None:
    page = eyes.page
    await page.get_by_role("tab", name="Verify").click()
    await page.get_by_text("Options", exact=True).click()
    parts = page.get_by_role("region", name="Requirements of this mission")
    for pattern in ("", "operator_in_the_loop"):
        await parts.get_by_label("Pattern").last.select_option(pattern)
        await parts.get_by_role("button", name="Add", exact=True).click()
    await eyes.look("requirements", FORM)
    verify = page.get_by_role("button", name="Verify", exact=True)
    await verify.click()
    await expect(page.get_by_role("alert").filter(has_text="not be verified")).to_be_visible()
    await eyes.look("requirements that are wrong", FORM)
    for _ in range(2):
        await page.get_by_role("button", name="Undo (Ctrl+Z)").click()
    await verify.click()
    report = page.get_by_role("region", name="Report")
    await expect(report.get_by_role("heading", name="Violated")).to_be_visible()
    await eyes.look("report", FORM)
    await report.get_by_role("button", name=re.compile("Show the run")).first.click()
    await expect(page.get_by_role("region", name="A run that breaks it")).to_be_visible()
    await eyes.look("run step by step")


async def look_at_rehearsal(eyes: Accessibility) -> None:
    """What the editor tells of it, and its page."""
    page = eyes.page
    await page.get_by_role("tab", name="Run", exact=True).click()
    await page.get_by_text("What happens in the rehearsal").click()
    await eyes.look("run", FORM)
    await page.get_by_role("button", name="Rehearse").click()
    outcome = page.get_by_role("region", name="What came of it")
    await expect(outcome.get_by_role("heading").first).to_be_visible()
    await eyes.look("rehearsed", FORM)
    async with page.expect_popup() as opening:
        await outcome.get_by_role("link", name="Watch the rehearsal").click()
    watched = Accessibility(await opening.value, eyes.wrong, eyes.looked)
    await expect(watched.page.get_by_label("Position")).to_be_visible()
    await expect(vehicles_on(watched.page)).not_to_have_count(0)
    await watched.look("rehearsal, from the start")
    await watched.page.get_by_role("button", name="To the end").click()
    await wait_for_status(watched.page, "Failed")
    await watched.look("rehearsal, at its end")
    await watched.page.close()


async def look_at_dialogs(eyes: Accessibility, whole: bool) -> None:
    """The menu and its dialogs, or the first of them."""
    page = eyes.page
    names = ("Versions…", "Save under another name", "Keyboard shortcuts")
    for name in names if whole else names[:1]:
        await page.get_by_role("button", name="More").click()
        if name == "Versions…":  # the menu is the same for each
            await eyes.look("menu", MENU)
        # "Compare versions…" is another item of the menu.
        await page.get_by_role("menuitem", name=re.compile(f"^{name}")).click()
        await expect(page.get_by_role("dialog")).to_be_visible()
        await eyes.look(name, DIALOG)
        await page.keyboard.press("Escape")
        await expect(page.get_by_role("dialog")).to_have_count(0)
    if not whole:
        return
    for name in ("Lay the diagram out anew", "Add a process"):
        await page.get_by_role("button", name=name).click()
        await eyes.look(name, DIALOG)
        await page.keyboard.press("Escape")
    await page.get_by_role("button", name="Overview of the diagram").click()
    await eyes.look("minimap")


@LIGHT_AND_DARK
async def test_signing_in_has_no_violation(
    chromium: Browser, executive: Served, dark: bool
) -> None:
    async with page_at(chromium, f"{executive.origin}/sign-in", dark=dark) as it:
        await expect(it.page.get_by_label("Password")).to_be_visible()
        eyes = Accessibility(it.page)
        await eyes.look("sign-in")
        await it.page.goto(f"{executive.origin}/?token=wrong")
        await expect(it.page.get_by_text("That address was used already")).to_be_visible()
        await eyes.look("refused")
        eyes.assert_well()


@pytest.mark.long
@LIGHT_AND_DARK
async def test_runs_and_replays_have_no_violation(desk: Desk, dark: bool) -> None:
    eyes = await opened(desk, dark)
    await desk.start()
    await look_at_run(eyes)
    await look_at_map(eyes)
    await look_at_end(eyes)
    eyes.assert_well()


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
    await eyes.look("signal", DIALOG)
    await page.keyboard.press("Escape")
    await page.get_by_role("button", name="Pause", exact=True).click()
    await wait_for_status(page, "Paused")
    await eyes.look("paused", ".run-bar")


async def look_at_map(eyes: Accessibility) -> None:
    page = eyes.page
    await page.get_by_role("button", name=re.compile("^Show")).first.click()
    await eyes.look("what the map shows", MAP)
    await page.keyboard.press("Escape")
    await page.get_by_role("button", name=re.compile("^Draw")).click()
    await page.get_by_role("menuitem", name="New route").click()
    await eyes.look("route drawn", MAP)
    await page.keyboard.press("Escape")


async def look_at_end(eyes: Accessibility) -> None:
    page = eyes.page
    await page.keyboard.press("Shift+Escape")
    await eyes.look("STOP made ready", "header")
    await expect(page.locator("header button.stop")).to_have_text("STOP")
    await press_twice(page, lambda: page.keyboard.press("Shift+Escape"))
    await expect(page.get_by_role("dialog", name="The run has ended")).to_be_visible()
    await eyes.look("run ended", DIALOG)
    await page.get_by_role("button", name="Replay it").click()
    await expect(page.get_by_label("Position")).to_be_visible()
    await eyes.look("replay")


async def test_a_run_needs_no_mouse(desk: Desk) -> None:
    page = await desk.home()
    await tab_to(page, MISSION)
    await page.keyboard.press("Enter")
    await page.wait_for_url("**/missions/*")
    await expect(page.locator(".link-open")).to_have_count(1)  # else nothing is sent
    await tab_to(page, "Properties")
    run = page.get_by_role("tab", name="Run", exact=True)
    while await run.get_attribute("aria-selected") != "true":
        await page.keyboard.press("ArrowRight")
    await tab_to(page, "Start")
    await page.keyboard.press("Enter")
    await page.wait_for_url("**/runs/*")
    await expect(answer(page, "Continue")).to_be_enabled()
    # The question has the focus: nobody needs to look for it.
    await expect(page.get_by_role("alertdialog")).to_be_focused()
    await page.keyboard.press("1")
    await expect(page.get_by_role("alertdialog")).to_have_count(0)
    active = page.get_by_role("treeitem", name=re.compile("^DRIVE ROUTE, .*, active"))
    await expect(active).to_have_count(1)
    await tab_to(page, "Pause")
    await page.keyboard.press("Enter")
    await wait_for_status(page, "Paused")
    await tab_to(page, "Resume")
    await page.keyboard.press("Space")
    await wait_for_status(page, "Running")
    await press_twice(page, lambda: page.keyboard.press("Shift+Escape"))
    await expect(page.get_by_role("dialog", name="The run has ended")).to_be_visible()
    await wait_for_status(page, "Stopped")


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


@pytest.mark.long
@LIGHT_AND_DARK
async def test_pages_of_the_fleet_and_of_alerts_have_no_violation(
    chromium: Browser, desk: Desk, dark: bool
) -> None:
    """Each as a whole, on a desk and on a phone, and with forced colours."""
    eyes = await opened(desk, dark)
    page = eyes.page
    async with signed_in(chromium, desk.executive, "otto"):
        await desk.ask("POST", "/api/resources/evsg2/take")
        await desk.driving()
        for name, show in SHOWN.items():
            await page.set_viewport_size({"width": 1280, "height": 720})
            await show(desk)
            await eyes.look(name)
            if not dark:  # forced colours know no theme
                await page.emulate_media(forced_colors="active")
                await eyes.look(f"{name}, forced colours")
                await page.emulate_media(forced_colors="none")
            await page.set_viewport_size({"width": 390, "height": 780})
            await eyes.look(f"{name}, phone")
            await page.keyboard.press("Escape")
    eyes.assert_well()


async def show_runs(desk: Desk) -> None:
    await desk.home()
    await desk.page.get_by_role("checkbox", name="Select all on this page").check()


async def show_stopping(desk: Desk) -> None:
    await show_runs(desk)
    runs = desk.page.get_by_role("region", name="Runs")
    await runs.get_by_role("button", name="Stop", exact=True).click()
    await expect(desk.page.get_by_role("dialog", name=re.compile("^Stop"))).to_be_visible()


async def show_panel_of_alerts(desk: Desk) -> None:
    await desk.home()
    await desk.page.get_by_role("button", name=re.compile("needs? you$")).click()
    await expect(desk.page.get_by_role("dialog", name="Alerts")).to_be_visible()


async def show_alerts(desk: Desk) -> None:
    await desk.page.goto(f"{desk.executive.origin}/alerts")
    await expect(desk.page.get_by_role("region", name="Ended")).to_be_visible()


async def show_present(desk: Desk) -> None:
    await desk.home()
    await desk.page.get_by_role("button", name=re.compile("present$")).click()
    await expect(desk.page.get_by_role("region", name="Who is present")).to_be_visible()


async def show_fleet(desk: Desk) -> None:
    await desk.page.goto(f"{desk.executive.origin}/fleet")
    await desk.page.get_by_role("row").filter(has_text="uav1").click()
    await expect(desk.page.get_by_role("region", name="Details and commands")).to_be_attached()


async def show_busy(desk: Desk) -> None:
    await desk.edit(tab="Run")
    desk.refusals.append(409)  # another run has the vehicle
    await desk.page.get_by_role("button", name="Start", exact=True).click()
    await expect(desk.page.get_by_role("dialog", name="Vehicles are busy")).to_be_visible()


SHOWN: dict[str, Callable[[Desk], Awaitable[None]]] = {
    "runs selected": show_runs,
    "runs to be stopped": show_stopping,
    "panel of alerts": show_panel_of_alerts,
    "alerts": show_alerts,
    "who is present": show_present,
    "fleet": show_fleet,
    "vehicles are busy": show_busy,
}
