"""The editor in a real browser: menus, forms, checks, saving, and what happens when two save."""

import re
from pathlib import Path

import pytest
from browser_world import Browsing
from playwright.async_api import Page, expect

from m2pem import load_mission
from m2pem.model.elements import ScriptTask, SequenceFlow, UserTask

SAVED = ".m2-saved-state"
HAS_DRAFT = """(text) => new Promise((resolve) => {
  const request = indexedDB.open("m2pem-editor");
  request.onsuccess = () => {
    const { result } = request;
    if (!result.objectStoreNames.contains("drafts")) return resolve(false);
    const drafts = result.transaction("drafts").objectStore("drafts").getAll();
    drafts.onsuccess = () => {
      result.close();
      resolve(drafts.result.some(({ xml }) => xml.includes(text)));
    };
  };
})"""


async def appended(page: Page, word: str) -> None:
    """Append by keyboard what a word finds, to what is selected."""
    await page.locator("svg[data-element-id]").first.focus()
    await page.keyboard.press("a")
    search = page.locator(".djs-popup-search input")
    await search.press_sequentially(word)
    await expect(page.locator(".djs-popup .entry").first).to_contain_text(re.compile(word, re.I))
    await page.keyboard.press("Enter")
    await expect(page.locator(".djs-popup")).to_have_count(0)
    await page.keyboard.press("Escape")


async def new_mission(page: Page, base: str, name: str) -> None:
    """Begin with an empty page."""
    await page.goto(base)
    await page.get_by_role("button", name="New mission").click()
    await page.get_by_label("Name").fill(name)
    await page.get_by_role("button", name="Make it").click()
    await page.wait_for_selector(".djs-shape")


async def save(page: Page) -> None:
    await page.get_by_role("button", name="Save", exact=True).click()
    await expect(page.locator(SAVED)).to_have_text("Saved")


async def test_every_menu_opens_with_its_entries(browsing: Browsing) -> None:
    page = await browsing.edit("vignette1")
    entries = page.locator(".djs-popup .entry")
    await page.click(".djs-palette [data-action=create]")
    await expect(entries.filter(has_text="Takeoff")).to_have_count(1)
    assert await entries.count() > 90
    await page.keyboard.press("Escape")
    await page.click("[data-element-id=DriveRoute]")
    for action in ("append", "replace"):
        await page.click(f".djs-context-pad [data-action={action}]")
        await expect(entries.filter(has_text="Orbit")).not_to_have_count(0)
        assert await entries.count() > 50
        await page.keyboard.press("Escape")
    await page.click("[data-element-id=StartVignette1]")
    await page.click(".djs-context-pad [data-action=replace]")
    await expect(entries.filter(has_text="Message start event")).to_have_count(1)


async def test_a_mission_is_drawn_by_keyboard_and_saved(browsing: Browsing) -> None:
    page = await browsing.begin()
    await new_mission(page, browsing.served.base, "patrol")
    await page.click("[data-element-id=Start]")
    await appended(page, "Ask the operator")
    await page.get_by_label("Question", exact=True).fill("Drive on?")
    await appended(page, "Exclusive gateway")
    await appended(page, "Single vehicle routing")
    await page.get_by_label("Route").fill("route_alpha")
    await page.get_by_label("Who", exact=False).first.select_option("evsg1")
    await appended(page, "Terminate end event")
    await save(page)
    mission = load_mission(browsing.served.missions / "patrol.bpmn")
    drive = next(each for each in mission.nodes if isinstance(each, ScriptTask))
    assert drive.behavior is not None
    assert [(role.name, role.resource) for role in drive.behavior.roles] == [("driver", "evsg1")]
    assert [each.name for each in drive.behavior.parameters] == ["route"]
    ask = next(each for each in mission.nodes if isinstance(each, UserTask))
    assert ask.prompt is not None
    assert ask.prompt.text == "Drive on?"
    assert [each.value for each in ask.prompt.decisions] == ["continue", "abort"]


async def test_a_condition_is_completed_and_checked_while_it_is_typed(browsing: Browsing) -> None:
    page = await browsing.edit("vignette1")
    await page.locator("[data-element-id=FlowContinue] .djs-hit").first.click(force=True)
    condition = page.get_by_label("Taken when")
    await condition.fill("")
    await condition.press_sequentially("user.dec")
    await page.get_by_role("option", name="user.decision").click()
    await condition.press_sequentially(" == ")
    await page.keyboard.press("ArrowDown")
    await expect(page.get_by_role("option").first).to_contain_text("'continue'")
    await page.keyboard.press("Enter")
    await expect(condition).to_have_value("user.decision == 'continue'")
    await condition.press_sequentially(" and")
    await expect(page.locator("#m2-condition-error")).to_be_visible()
    await condition.fill("user.decision == 'continue'")
    await expect(page.locator("#m2-condition-error")).to_have_count(0)
    await save(page)
    mission = load_mission(browsing.served.missions / "vignette1.bpmn")
    flow = next(each for each in mission.flows if each.id == "FlowContinue")
    assert isinstance(flow, SequenceFlow)
    assert str(flow.condition) == "user.decision == 'continue'"


async def test_a_problem_is_marked_and_leads_to_its_element(browsing: Browsing) -> None:
    page = await browsing.edit("vignette1")
    await page.click("[data-element-id=Reverse]")
    await page.get_by_label("Distance").fill("10 s")
    await expect(page.locator("#m2-parameter-distance-error")).to_contain_text("does not fit")
    await expect(page.locator("[data-element-id=Reverse]")).to_have_class(
        re.compile("m2-has-error")
    )
    await page.click("[data-element-id=StartVignette1]")
    await page.get_by_role("tab", name="Problems").click()
    await page.get_by_role("button", name=re.compile("REVERSE")).click()
    await expect(page.locator("[data-element-id=Reverse]")).to_have_class(re.compile("selected"))
    await page.keyboard.press("Control+z")
    await expect(page.locator(".m2-problems-head p")).to_have_text("No problems found.")
    await expect(page.locator(SAVED)).to_have_text("Saved")


async def test_signals_are_made_by_name_and_shared(browsing: Browsing) -> None:
    page = await browsing.edit("vignette1")
    await page.click("[data-element-id=SignalStop]")
    signal = page.get_by_role("combobox", name="Signal", exact=False)
    await expect(signal).to_have_value("Stop driving")
    await signal.fill("Halt")
    await page.get_by_label("Sent by operators").check()
    await page.click("[data-element-id=ThrowStop]")
    await signal.click()
    await page.get_by_role("option", name="Halt").click()
    await expect(page.get_by_text("Shared by 2 events")).to_be_visible()
    await save(page)
    text = (browsing.served.missions / "vignette1.bpmn").read_text()
    made = re.search(
        r'<bpmn:signal id="([a-f][0-9a-f-]{35})" name="Halt" m2pem:from="operator"', text
    )
    assert made
    assert text.count(f'signalRef="{made.group(1)}"') == 2


async def test_nothing_that_was_drawn_is_lost_when_the_browser_ends(browsing: Browsing) -> None:
    page = await browsing.edit("vignette1")
    await page.click("[data-element-id=Reverse]")
    await page.get_by_label("Name", exact=True).fill("BACK OFF")
    await expect(page.locator(SAVED)).to_have_text("Not saved yet")
    while not await page.evaluate(HAS_DRAFT, "BACK OFF"):
        await page.wait_for_timeout(50)
    assert browsing.context
    again = await browsing.context.new_page()
    await page.close(run_before_unload=False)
    await browsing.edit("vignette1", again)
    await again.get_by_role("button", name="Go on with the draft").click()
    await expect(again.locator("[data-element-id=Reverse]").first).to_contain_text("BACK OFF")
    await save(again)
    assert "BACK OFF" in (browsing.served.missions / "vignette1.bpmn").read_text()


async def renamed(page: Page, name: str) -> None:
    await page.click("[data-element-id=Reverse]")
    await page.get_by_label("Name", exact=True).fill(name)
    await expect(page.locator(SAVED)).to_have_text("Not saved yet")


async def saved_beside(browsing: Browsing) -> tuple[Page, Path]:
    """A page with changes of its own, after somebody else saved the same mission."""
    page = await browsing.edit("vignette1")
    assert browsing.context
    other = await browsing.edit("vignette1", await browsing.context.new_page())
    await renamed(other, "THEIRS")
    await save(other)
    await renamed(page, "MINE")
    browsing.faults.clear()
    await page.get_by_role("button", name="Save", exact=True).click()
    await expect(page.get_by_role("dialog")).to_contain_text("Somebody else changed")
    # Chromium logs the answer 409, which is what is asked for here.
    browsing.faults[:] = [fault for fault in browsing.faults if "409" not in fault]
    return page, browsing.served.missions


async def test_a_mission_that_somebody_else_saved_is_not_overwritten_unasked(
    browsing: Browsing,
) -> None:
    page, missions = await saved_beside(browsing)
    await page.get_by_role("button", name="under another name").click()
    await page.get_by_role("dialog").get_by_role("button", name="Save").click()
    await page.wait_for_url("**/missions/vignette1%202")
    assert "THEIRS" in (missions / "vignette1.bpmn").read_text()
    assert "MINE" in (missions / "vignette1 2.bpmn").read_text()


async def test_a_mission_is_overwritten_deliberately_and_theirs_is_kept(browsing: Browsing) -> None:
    page, missions = await saved_beside(browsing)
    await page.get_by_role("button", name="as the newest version").click()
    await expect(page.locator(SAVED)).to_have_text("Saved")
    assert "MINE" in (missions / "vignette1.bpmn").read_text()
    await page.get_by_role("button", name="More").click()
    await page.get_by_role("menuitem", name="Versions").click()
    await page.locator("tbody tr").nth(1).get_by_role("button").click()
    await expect(page.locator("[data-element-id=Reverse]").first).to_contain_text("THEIRS")


async def test_taking_theirs_draws_theirs(browsing: Browsing) -> None:
    page, _ = await saved_beside(browsing)
    await page.get_by_role("button", name="Take theirs").click()
    await expect(page.locator("[data-element-id=Reverse]").first).to_contain_text("THEIRS")
    await expect(page.locator(SAVED)).to_have_text("Saved")


@pytest.mark.parametrize("key", ["Control+z", "Control+y"])
async def test_keys_typed_into_a_field_are_for_the_field(browsing: Browsing, key: str) -> None:
    page = await browsing.edit("vignette1")
    await page.click("[data-element-id=Reverse]")
    await page.get_by_label("Documentation").fill("n a r")
    await page.get_by_label("Documentation").press(key)
    await expect(page.locator("[data-element-id=Reverse]")).to_have_count(1)
    await expect(page.locator(".djs-popup")).to_have_count(0)


async def test_a_mission_that_somebody_removed_is_saved_again_only_when_asked(
    browsing: Browsing,
) -> None:
    page = await browsing.edit("vignette1")
    await renamed(page, "MINE")
    (browsing.served.missions / "vignette1.bpmn").unlink()
    await page.get_by_role("button", name="Save", exact=True).click()
    await page.get_by_role("button", name="Save it again").click()
    await expect(page.locator(SAVED)).to_have_text("Saved")
    assert "MINE" in (browsing.served.missions / "vignette1.bpmn").read_text()
    browsing.faults[:] = [fault for fault in browsing.faults if "409" not in fault]
