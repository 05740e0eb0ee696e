"""The versions of its mission that a run has had: listed, compared, and gone back to."""

from playwright.async_api import FilePayload, Page, expect
from web_axe import Accessibility
from web_desk import IN_ONE_LOOP, Desk, signed_in

from m2pem.testing import scenarios

pytestmark = IN_ONE_LOOP

FIRST = scenarios.question()
LATER = scenarios.question("Really go on?").replace(b'id="End"', b'id="End" name="done"')


async def revised(desk: Desk) -> tuple[Page, str]:
    """The page of a run that another operator has revised."""
    (desk.executive.missions / "first.bpmn").write_bytes(FIRST)
    (desk.executive.missions / "later.bpmn").write_bytes(LATER)
    run = str((await desk.ask("POST", "/api/runs", {"mission": "first"}))["run"])
    path = f"/api/runs/{run}/revision"
    plan = await desk.ask("POST", f"{path}/plan", {"mission": "later"})
    await desk.ask("POST", path, {"mission": "later", "plan": plan["plan"]})
    await desk.page.goto(f"{desk.executive.origin}/runs/{run}")
    await expect(desk.page.get_by_text("Really go on?").first).to_be_visible()
    return desk.page, run


async def test_versions_are_listed_and_the_run_is_revised_back(desk: Desk) -> None:
    page, run = await revised(desk)
    other = (await desk.ask("POST", "/api/runs", {"mission": "later"}))["run"]
    await page.get_by_role("button", name="Versions", exact=True).press("Enter")
    listed = page.get_by_role("dialog", name=f"Versions of the mission of {run}")
    lines = listed.get_by_role("listitem")
    await expect(lines).to_have_count(2)
    first, last = lines.nth(0), lines.nth(1)
    await expect(first).to_contain_text("Version 1")
    await expect(first).to_contain_text("by anna, from record 1 on")
    await expect(first).to_contain_text("first.bpmn")
    await expect(last).to_contain_text("Version 2")
    await expect(last).to_contain_text("now")
    await expect(last).to_contain_text(f"Also of {other}, now")
    found = Accessibility(page)
    await found.look("versions of a run", ".dialog")
    found.assert_well()
    await expect(listed.get_by_role("button", name="Revise back")).to_have_count(1)
    await first.get_by_role("button", name="Revise back to this version…").press("Enter")
    dialog = page.get_by_role("dialog", name=f"Revise {run}")
    chosen = dialog.get_by_label("Or a version that the run has had")
    await expect(chosen).to_have_value("1")
    becomes = dialog.get_by_role("region", name="What becomes of the run")
    await expect(becomes).to_contain_text("begins again")
    await dialog.get_by_role("button", name=f"Revise {run}").click()
    await expect(dialog).to_have_count(0)
    await expect(page.get_by_text("Go on?", exact=True).first).to_be_visible()
    versions = await desk.ask("GET", f"/api/runs/{run}/versions")
    assert [each["version"] for each in versions][::2] == [versions[0]["version"]] * 2


async def test_both_diagrams_are_shown_with_what_differs(desk: Desk) -> None:
    page, run = await revised(desk)
    await page.get_by_role("button", name="Revise…").click()
    dialog = page.get_by_role("dialog", name=f"Revise {run}")
    await dialog.get_by_label("Or a version that the run has had").select_option(index=1)
    await dialog.get_by_role("button", name="Show both diagrams…").click()
    diagrams = page.get_by_role("dialog", name=f"{run}: now, and after the revision")
    changes = diagrams.get_by_role("region", name="Changes")
    await expect(changes.get_by_role("status")).to_have_text(
        "0 added, 0 removed, 2 changed, 0 moved"
    )
    await expect(changes).to_contain_text("Really go on? → Go on?")
    for side in ("Before", "After"):
        half = diagrams.get_by_role("region", name=side)
        await expect(half.locator("[data-element-id=Question].cmp-changed")).to_have_count(1)
        await expect(half.locator("[data-element-id=Start].cmp-changed")).to_have_count(0)
    found = Accessibility(page)
    await found.look("both diagrams", ".dialog-full")
    found.assert_well()
    await page.keyboard.press("Escape")
    await expect(diagrams).to_have_count(0)
    await expect(dialog.get_by_role("button", name=f"Revise {run}")).to_be_enabled()


async def test_a_file_and_an_older_version_of_the_folder_are_drawn_beside_it(desk: Desk) -> None:
    page, run = await revised(desk)
    base = (await desk.ask("GET", "/api/missions/later"))["version"]
    body = {"xml": LATER.replace(b"done", b"over").decode(), "base": base}
    await desk.ask("PUT", "/api/missions/later", body)
    await page.get_by_role("button", name="Revise…").click()
    dialog = page.get_by_role("dialog", name=f"Revise {run}")
    await dialog.get_by_label("Mission").select_option("later")
    diagrams = page.get_by_role("dialog", name=f"{run}: now, and after the revision")
    changes = diagrams.get_by_role("region", name="Changes")
    await dialog.get_by_role("button", name="Show both diagrams…").click()
    await expect(changes).to_contain_text("name: done → over")
    await page.keyboard.press("Escape")
    await dialog.get_by_role("combobox", name="Version", exact=True).select_option(index=2)
    await dialog.get_by_role("button", name="Show both diagrams…").click()
    await expect(changes.get_by_role("status")).to_have_text("Nothing is different.")
    await page.keyboard.press("Escape")
    content = LATER.replace(b"done", b"by file")
    file = FilePayload(name="mine.bpmn", mimeType="text/xml", buffer=content)
    await dialog.locator("input[type=file]").set_input_files(file)
    await dialog.get_by_role("button", name="Show both diagrams…").click()
    await expect(changes).to_contain_text("name: done → by file")


async def test_a_run_that_is_over_lists_its_versions_and_is_not_revised_back(desk: Desk) -> None:
    page, run = await revised(desk)
    await desk.ask("POST", f"/api/runs/{run}/stop", {"reason": "enough"})
    await desk.until(f"/api/runs/{run}", lambda said: said["status"] == "stopped")
    await page.goto(f"{desk.executive.origin}/runs/{run}?t=0")
    await page.get_by_role("button", name="Versions", exact=True).click()
    listed = page.get_by_role("dialog", name=f"Versions of the mission of {run}")
    await expect(listed.get_by_role("listitem")).to_have_count(2)
    await expect(listed).to_contain_text("the last one")
    await expect(listed.get_by_role("button", name="Revise back")).to_have_count(0)


async def test_who_only_looks_sees_the_versions(desk: Desk) -> None:
    _, run = await revised(desk)
    browser = desk.page.context.browser
    assert browser is not None
    async with signed_in(browser, desk.executive, "vera") as vera:
        await vera.page.goto(f"{desk.executive.origin}/runs/{run}")
        await vera.page.get_by_role("button", name="Versions", exact=True).click()
        listed = vera.page.get_by_role("dialog", name=f"Versions of the mission of {run}")
        await expect(listed.get_by_role("listitem")).to_have_count(2)
        await expect(listed.get_by_role("button", name="Revise back")).to_have_count(0)


async def test_what_is_drawn_is_saved_and_given_to_a_run_of_the_mission(desk: Desk) -> None:
    (desk.executive.missions / "given.bpmn").write_bytes(FIRST)
    run = str((await desk.ask("POST", "/api/runs", {"mission": "given"}))["run"])
    page = await desk.edit("given")
    await page.locator("#m2-canvas [data-element-id=End]").first.click()
    name = page.get_by_role("textbox", name="Name", exact=True)
    await name.fill("all done")
    await expect(page.get_by_text("Not saved")).to_be_visible()
    await page.get_by_role("button", name="More").click()
    await page.get_by_role("menuitem", name=f"Save, and give to {run}…").click()
    dialog = page.get_by_role("dialog", name=f"Revise {run}")
    await expect(dialog.get_by_label("Mission")).to_have_value("given")
    await expect(dialog.get_by_role("region", name="What differs")).to_contain_text("all done")
    await dialog.get_by_role("button", name=f"Revise {run}").click()
    await expect(dialog).to_have_count(0)
    assert page.url == f"{desk.executive.origin}/runs/{run}"
    files = (await desk.ask("GET", f"/api/runs/{run}/mission"))["files"]
    assert "all done" in files[0]["xml"]
    page = await desk.edit("vignette1")
    await page.get_by_role("button", name="More").click()
    await expect(page.get_by_role("menuitem", name="Compare versions")).to_be_visible()
    await expect(page.get_by_role("menuitem", name="give to")).to_have_count(0)
