"""A form says whether runs are monitored for a requirement, and what a violation throws."""

from pathlib import Path
from xml.etree import ElementTree

from playwright.async_api import Locator, Page, expect
from web_axe import Accessibility
from web_desk import IN_ONE_LOOP, MISSION, Desk

pytestmark = IN_ONE_LOOP

REQUIREMENT = "{https://m2pem.org/schema/1}requirement"
SIGNAL = "dc45ff2b-ef6b-45bd-96e6-c7ac8ef055c2"


async def added(page: Page, pattern: str) -> Locator:
    """The form of a requirement of a pattern, "" for a formula, that is added to the mission."""
    parts = page.get_by_role("region", name="Requirements of this mission")
    await parts.get_by_label("Pattern").last.select_option(pattern)
    await parts.get_by_role("button", name="Add", exact=True).click()
    return parts


async def saved(page: Page, file: Path) -> list[dict[str, str]]:
    """The requirements of the file, after the editor has saved it."""
    await page.get_by_role("button", name="Save", exact=True).click()
    await expect(page.get_by_role("toolbar", name="Editor")).to_contain_text("Saved")
    return [dict(each.attrib) for each in ElementTree.parse(file).iter(REQUIREMENT)]


async def test_what_a_violation_throws_is_chosen_kept_and_thrown_in_a_rehearsal(
    desk: Desk,
) -> None:
    file = desk.executive.missions / f"{MISSION}.bpmn"
    page = await desk.edit(tab="Verify")
    form = await added(page, "")
    await form.get_by_role("textbox", name="Formula", exact=True).fill("[] !active(DriveRoute)")
    throws = form.get_by_label("A violation in a run")
    code = form.get_by_label("Error code")
    await expect(form.get_by_label("In runs and rehearsals")).to_have_value("")
    await expect(code).to_have_count(0)
    await throws.select_option("error")
    await expect(form).to_contain_text("Write the code of the error.")
    await code.fill("UNSAFE")
    await code.blur()
    await expect(form).not_to_contain_text("Write the code of the error.")
    whole = {"id": "formula", "ltl": "[] !active(DriveRoute)", "onViolation": "error:UNSAFE"}
    assert await saved(page, file) == [whole]

    # The rehearsal fails by it, where the mission does not catch it.
    await page.get_by_role("tab", name="Run", exact=True).click()
    await page.get_by_role("button", name="Rehearse", exact=True).click()
    outcome = page.get_by_role("region", name="What came of it")
    await expect(outcome.get_by_role("heading", name="Failed")).to_be_visible()
    await expect(outcome).to_contain_text("UNSAFE")
    await expect(outcome).to_contain_text("A violation throws error UNSAFE in the mission.")

    await page.get_by_role("tab", name="Verify", exact=True).click()
    await form.get_by_label("In runs and rehearsals").select_option("not monitored")
    await expect(form).to_contain_text("Runs are not monitored for it, so a violation throws")
    await expect(form.locator(".m2-field-error")).to_have_count(1)
    eyes = Accessibility(page)
    await eyes.look("a requirement in runs", ".m2v-requirement-form")
    eyes.assert_well()
    await throws.select_option("throws nothing")
    await expect(form.locator(".m2-field-error")).to_have_count(0)
    ltl = "[] !active(DriveRoute)"
    assert await saved(page, file) == [{"id": "formula", "ltl": ltl, "monitor": "false"}]

    await form.get_by_label("In runs and rehearsals").select_option("monitored")
    await throws.select_option("signal")
    await expect(form).to_contain_text("Choose a signal.")
    await form.get_by_role("combobox", name="Signal", exact=True).select_option(SIGNAL)
    await expect(form.locator(".m2-field-error")).to_have_count(0)
    whole["onViolation"] = f"signal:{SIGNAL}"
    assert await saved(page, file) == [whole]
    await page.get_by_role("button", name="Undo (Ctrl+Z)").click()
    await expect(form).to_contain_text("Choose a signal.")


async def test_what_cannot_be_thrown_is_said_where_it_is_chosen(desk: Desk) -> None:
    file = desk.executive.missions / f"{MISSION}.bpmn"
    begin = b'<bpmn:process id="VIGNETTE1" name="VIGNETTE1" isExecutable="true">'
    written = b"""<bpmn:extensionElements>
  <m2pem:requirement id="named" ltl="[] true" monitor="true" onViolation="signal:Stop driving"/>
  <m2pem:requirement id="gone" ltl="[] true" onViolation="signal:Stop flying"/>
  <m2pem:requirement id="odd" ltl="[] true" onViolation="stop"/>
</bpmn:extensionElements>"""
    file.write_bytes(file.read_bytes().replace(begin, begin + written))
    page = await desk.edit(tab="Verify")
    form = page.get_by_role("region", name="Requirements of this mission")
    error = form.locator(".m2-field-error")
    await form.get_by_role("button", name="named").first.click()
    await expect(form.get_by_role("combobox", name="Signal", exact=True)).to_have_value(SIGNAL)
    await expect(error).to_have_count(0)
    await form.get_by_role("button", name="gone").first.click()
    await expect(error).to_have_text("The mission has no signal “Stop flying”, or more than one.")
    await form.get_by_role("button", name="odd").first.click()
    await expect(error).to_have_text("“stop” is neither an error nor a signal.")
    await form.get_by_label("A violation in a run").select_option("throws nothing")
    await expect(error).to_have_count(0)
    await form.get_by_role("button", name="gone").first.click()
    await form.get_by_role("combobox", name="Signal", exact=True).select_option("Stop driving")

    form = await added(page, "prompt_reaction")
    await expect(form).to_contain_text(
        "Runs are not monitored for this pattern: it is about single"
    )
    await form.get_by_label("A violation in a run").select_option("error")
    await expect(form).to_contain_text("so a violation throws nothing")
    await form.get_by_label("A violation in a run").select_option("throws nothing")
    kept = await saved(page, file)
    assert [each.get("onViolation") for each in kept] == [
        "signal:Stop driving",
        f"signal:{SIGNAL}",
        None,
        None,
    ]
    assert kept[0]["monitor"] == "true"
