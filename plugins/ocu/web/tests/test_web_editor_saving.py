"""What is drawn in the editor is not lost: others who save the same, crashes, and leaving."""

import asyncio
from pathlib import Path

import pytest
from playwright.async_api import Dialog, Page, expect
from web_desk import IN_ONE_LOOP, MISSION, Desk
from web_drawing import SAVED, Drawing

pytestmark = IN_ONE_LOOP


async def renamed(page: Page, name: str) -> None:
    await page.click("[data-element-id=Reverse]")
    await page.get_by_label("Name", exact=True).fill(name)
    await expect(page.locator(SAVED)).to_have_text("Not saved yet")


async def saved_beside(desk: Desk) -> tuple[Page, Path]:
    """A page with changes of its own, after somebody else saved the same mission."""
    page = await desk.edit()
    other = await desk.edit(page=await desk.another())
    await renamed(other, "THEIRS")
    await Drawing(other).save()
    # The browser takes its time with tabs that lie behind others.
    await other.close()
    await renamed(page, "MINE")
    await page.get_by_role("button", name="Save", exact=True).click()
    await expect(page.get_by_role("dialog")).to_contain_text("Another user changed")
    desk.refusals.append(409)
    return page, desk.executive.missions


async def test_a_mission_that_somebody_else_saved_is_not_overwritten_unasked(
    desk: Desk,
) -> None:
    page, missions = await saved_beside(desk)
    await page.get_by_role("button", name="under another name").click()
    await page.get_by_role("dialog").get_by_role("button", name="Save").click()
    await page.wait_for_url("**/missions/vignette1%202")
    assert "THEIRS" in (missions / "vignette1.bpmn").read_text()
    assert "MINE" in (missions / "vignette1 2.bpmn").read_text()


async def test_a_mission_is_overwritten_deliberately_and_theirs_is_kept(desk: Desk) -> None:
    page, missions = await saved_beside(desk)
    await page.get_by_role("button", name="as the newest version").click()
    await expect(page.locator(SAVED)).to_have_text("Saved")
    assert "MINE" in (missions / "vignette1.bpmn").read_text()
    await page.get_by_role("button", name="More").click()
    await page.get_by_role("menuitem", name="Versions…", exact=True).click()
    await page.locator("tbody tr").nth(1).get_by_role("button").click()
    await expect(page.locator("[data-element-id=Reverse]").first).to_contain_text("THEIRS")


@pytest.mark.long
async def test_taking_theirs_draws_theirs(desk: Desk) -> None:
    page, _ = await saved_beside(desk)
    await page.get_by_role("button", name="Take theirs").click()
    await expect(page.locator("[data-element-id=Reverse]").first).to_contain_text("THEIRS")
    await expect(page.locator(SAVED)).to_have_text("Saved")


async def test_a_mission_that_somebody_removed_is_saved_again_only_when_asked(
    desk: Desk,
) -> None:
    page = await desk.edit()
    await renamed(page, "MINE")
    (desk.executive.missions / "vignette1.bpmn").unlink()
    await page.get_by_role("button", name="Save", exact=True).click()
    await page.get_by_role("button", name="Save it again").click()
    await expect(page.locator(SAVED)).to_have_text("Saved")
    assert "MINE" in (desk.executive.missions / "vignette1.bpmn").read_text()
    desk.refusals.append(409)


async def test_a_draft_outlives_its_tab(desk: Desk) -> None:
    page = await desk.edit()
    await renamed(page, "BACK OFF")
    async with asyncio.timeout(30):
        while not await page.evaluate(HAS_DRAFT, "BACK OFF"):
            await page.evaluate("new Promise(requestAnimationFrame)")
    again = await desk.another()
    # Nothing of the page has a say.
    await crash(page)
    await desk.edit(page=again)
    await again.get_by_role("button", name="Go on with the draft").click()
    await expect(again.locator("[data-element-id=Reverse]").first).to_contain_text("BACK OFF")
    await expect(again.locator(SAVED)).to_have_text("Not saved yet")
    await Drawing(again).save()
    assert "BACK OFF" in (desk.executive.missions / f"{MISSION}.bpmn").read_text()


async def test_changes_are_not_left_unasked(desk: Desk) -> None:
    page = await desk.home()
    asked: list[str] = []

    async def stay(dialog: Dialog) -> None:
        asked.append(dialog.message)
        await dialog.dismiss()

    await page.get_by_role("link", name="vignette1", exact=True).click()
    await page.click("[data-element-id=Reverse]")
    await page.get_by_label("Name", exact=True).fill("BACK OFF")
    await expect(page.locator(".m2-saved-state")).to_have_text("Not saved yet")
    page.on("dialog", stay)
    await page.get_by_role("button", name="All missions").click()
    await page.evaluate("history.back()")
    await page.wait_for_url("**/missions/vignette1")
    await expect(page.locator("[data-element-id=Reverse]").first).to_contain_text("BACK OFF")
    assert len(asked) == 2


async def crash(page: Page) -> None:
    gone = asyncio.Event()
    page.on("crash", lambda _: gone.set())
    session = await page.context.new_cdp_session(page)
    ended = asyncio.create_task(session.send("Page.crash"))
    await asyncio.wait_for(gone.wait(), 20)
    ended.cancel()


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
