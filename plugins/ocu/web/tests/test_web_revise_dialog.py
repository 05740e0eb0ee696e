"""A run is revised on its page: the plan is shown, tokens are moved, and what was shown is done."""

import pytest
from playwright.async_api import FilePayload, Page, expect
from web_axe import Accessibility
from web_desk import IN_ONE_LOOP, Desk, signed_in

from m2pem.testing import scenarios

pytestmark = IN_ONE_LOOP

FIRST = scenarios.question()
NAMED = FIRST.replace(b'id="Question"', b'id="Question" name="Shall it go on?"')
ASKED_AGAIN = scenarios.question("Really go on?", ("continue", "abort", "later"))
GONE = FIRST.replace(b'"Question"', b'"Another"')
TWO = scenarios.two_questions()
ONE = TWO.replace(b'"Question2"', b'"Another"').replace(
    b"<startEvent ",
    b"""<extensionElements><m2pem:requirement id="asked" ltl="&lt;&gt; completed(Another)"/>
    </extensionElements><startEvent """,
    1,
)

HANDLER = FIRST.partition(b"<userTask")[2].partition(b"</userTask>")[0]
"""What is in the question of the mission."""

HANDLED = FIRST.replace(
    b'<endEvent id="End"/>',
    b"""<endEvent id="End"/><subProcess id="Handler" triggeredByEvent="true">
    <startEvent id="Soon" isInterrupting="false"><timerEventDefinition id="After">
    <timeDuration>PT0.1S</timeDuration></timerEventDefinition></startEvent>
    <userTask"""
    + HANDLER.replace(b"Question", b"Handle").replace(b"Go on?", b"What now?")
    + b"""</userTask><endEvent id="Handled"/>
    <sequenceFlow id="h1" sourceRef="Soon" targetRef="Handle"/>
    <sequenceFlow id="h2" sourceRef="Handle" targetRef="Handled"/></subProcess>""",
)
"""An event subprocess asks, too: a token in it has no place without it."""


async def asked(desk: Desk, page: Page | None = None) -> tuple[Page, str]:
    """The page of a run that asks a question."""
    page = page or desk.page
    for name, source in (
        ("first", FIRST),
        ("named", NAMED),
        ("again", ASKED_AGAIN),
        ("gone", GONE),
    ):
        (desk.executive.missions / f"{name}.bpmn").write_bytes(source)
    run = str((await desk.ask("POST", "/api/runs", {"mission": "first"}))["run"])
    await page.goto(f"{desk.executive.origin}/runs/{run}")
    await expect(page.locator('[data-element-id="Question"]').first).to_be_visible()
    return page, run


def file_of(name: str, content: bytes) -> FilePayload:
    """A file on the disk of the person."""
    return FilePayload(name=name, mimeType="text/xml", buffer=content)


async def version_of(desk: Desk, run: str) -> str:
    """The file that a run has now."""
    return str((await desk.ask("GET", f"/api/runs/{run}/mission"))["files"][0]["xml"])


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
async def test_a_plan_is_looked_at_and_carried_out_by_keyboard(desk: Desk, dark: bool) -> None:
    page, run = await asked(desk)
    await page.get_by_role("button", name="Revise…").press("Enter")
    dialog = page.get_by_role("dialog", name=f"Revise {run}")
    act = dialog.get_by_role("button", name=f"Revise {run}")
    await expect(act).to_be_disabled()
    await expect(dialog.get_by_label("Mission")).to_be_focused()
    await dialog.get_by_label("Mission").select_option("again")
    becomes = dialog.get_by_role("region", name="What becomes of the run")
    await expect(becomes).to_contain_text("begins again")
    differs = dialog.get_by_role("region", name="What differs")
    await expect(differs).to_contain_text("changed: user task Question (prompt)")
    await expect(dialog.get_by_role("region", name="What follows")).to_contain_text("complete")
    await expect(page.get_by_role("button", name="STOP", exact=True).first).to_be_enabled()
    found = Accessibility(page)
    await found.look("a plan", ".dialog")
    found.assert_well()
    await act.press("Enter")
    await expect(dialog).to_have_count(0)
    await expect(page.get_by_text("Really go on?").first).to_be_visible()
    assert "Really go on?" in await version_of(desk, run)


async def test_a_token_without_a_place_is_moved_by_a_choice(desk: Desk) -> None:
    page, run = await asked(desk)
    await page.get_by_role("button", name="Revise…").click()
    dialog = page.get_by_role("dialog", name=f"Revise {run}")
    await dialog.get_by_label("Mission").select_option("gone")
    refused = dialog.get_by_role("region", name="Refused")
    await expect(refused).to_contain_text("a token is on user task Question")
    act = dialog.get_by_role("button", name=f"Revise {run}")
    await expect(act).to_be_disabled()
    await dialog.get_by_label("Token on Question").select_option("Another")
    await expect(refused).to_have_count(0)
    becomes = dialog.get_by_role("region", name="What becomes of the run")
    await expect(becomes).to_contain_text("goes to user task Another")
    await act.click()
    await expect(dialog).to_have_count(0)
    await expect(page.locator('[data-element-id="Another"]').first).to_be_visible()
    assert '"Another"' in await version_of(desk, run)


async def test_a_token_without_a_place_ends_by_a_choice(desk: Desk) -> None:
    page, run = await asked(desk)
    await page.get_by_role("button", name="Revise…").click()
    dialog = page.get_by_role("dialog", name=f"Revise {run}")
    await dialog.get_by_label("Mission").select_option("gone")
    await dialog.get_by_label("Token on Question").select_option("ends")
    becomes = dialog.get_by_role("region", name="What becomes of the run")
    await expect(becomes).to_contain_text("the token on user task Question ends")
    await expect(becomes).to_contain_text("cancelled: prompt")
    await dialog.get_by_role("button", name=f"Revise {run}").click()
    await expect(dialog).to_have_count(0)
    await desk.until(f"/api/runs/{run}", lambda said: said["status"] == "completed")


async def test_a_token_that_can_only_end_is_offered_that_alone(desk: Desk) -> None:
    (desk.executive.missions / "handled.bpmn").write_bytes(HANDLED)
    (desk.executive.missions / "unhandled.bpmn").write_bytes(FIRST)
    page = desk.page
    run = str((await desk.ask("POST", "/api/runs", {"mission": "handled"}))["run"])
    await page.goto(f"{desk.executive.origin}/runs/{run}")
    await expect(page.get_by_role("log")).to_contain_text("Handle asks: What now?")
    await page.get_by_role("button", name="Revise…").click()
    dialog = page.get_by_role("dialog", name=f"Revise {run}")
    await dialog.get_by_label("Mission").select_option("unhandled")
    await expect(dialog.get_by_role("region", name="Refused")).to_contain_text("it can end")
    choice = dialog.get_by_label("Token on Handler")
    await expect(choice.locator("option")).to_have_text(["stays: no choice yet", "ends"])
    await choice.select_option("ends")
    await dialog.get_by_role("button", name=f"Revise {run}").click()
    await expect(dialog).to_have_count(0)
    prompts = [each for each in await desk.ask("GET", "/api/prompts") if each["run"] == run]
    assert [each["element"] for each in prompts] == ["Question"]
    assert '"Handler"' not in await version_of(desk, run)


async def test_a_version_with_which_the_mission_cannot_complete_is_confirmed(desk: Desk) -> None:
    for name, source in (("two", TWO), ("one", ONE)):
        (desk.executive.missions / f"{name}.bpmn").write_bytes(source)
    page = desk.page
    run = str((await desk.ask("POST", "/api/runs", {"mission": "two"}))["run"])
    await page.goto(f"{desk.executive.origin}/runs/{run}")
    await page.get_by_role("button", name="Revise…").click()
    dialog = page.get_by_role("dialog", name=f"Revise {run}")
    await dialog.get_by_label("Mission").select_option("one")
    await dialog.get_by_label("Token on Question2").select_option("ends")
    follows = dialog.get_by_role("region", name="What follows")
    await expect(follows).to_contain_text("cannot complete")
    await expect(follows).to_contain_text("Join")
    asked_again = follows.get_by_role("listitem")
    await expect(asked_again).to_contain_text("requirement asked is violated on all paths")
    act = dialog.get_by_role("button", name=f"Revise {run}")
    await expect(act).to_be_disabled()
    confirmed = dialog.get_by_label("After it the mission cannot complete.")
    await confirmed.check()
    # Another plan is confirmed for itself.
    await dialog.get_by_label("Token on Question2").select_option("Another")
    await expect(follows).to_contain_text("completes")
    await expect(asked_again).to_contain_text("requirement asked holds on all paths")
    await dialog.get_by_label("Token on Question2").select_option("ends")
    await expect(confirmed).not_to_be_checked()
    await expect(act).to_be_disabled()
    await confirmed.check()
    await act.click()
    await expect(dialog).to_have_count(0)
    assert '"Another"' in await version_of(desk, run)


async def test_the_dialog_is_german_for_a_browser_that_is(desk: Desk) -> None:
    _, run = await asked(desk)
    browser = desk.page.context.browser
    assert browser is not None
    async with signed_in(browser, desk.executive, "anna", language="de-DE") as there:
        page = there.page
        await page.goto(f"{desk.executive.origin}/runs/{run}")
        await page.get_by_role("button", name="Ändern…").click()
        dialog = page.get_by_role("dialog", name=f"{run} ändern")
        await dialog.get_by_label("Mission").select_option("gone")
        await expect(dialog.get_by_role("region", name="Abgelehnt")).to_be_visible()
        await dialog.get_by_label("Token auf Question").select_option("endet")
        await expect(dialog.get_by_role("region", name="Was folgt")).to_be_visible()
        becomes = dialog.get_by_role("region", name="Was aus dem Lauf wird")
        await expect(becomes.locator(".rev-kind")).to_have_text(["endet"])
        await dialog.get_by_role("button", name="Beide Diagramme zeigen…").click()
        diagrams = page.get_by_role("dialog", name=f"{run}: jetzt, und nach der Änderung")
        await expect(diagrams.get_by_role("status")).to_contain_text("entfernt")
        await page.keyboard.press("Escape")
        found = Accessibility(page)
        await found.look("a plan in German", ".dialog")
        found.assert_well()
        await dialog.get_by_role("button", name=f"{run} ändern").click()
        await expect(dialog).to_have_count(0)
        await desk.until(f"/api/runs/{run}", lambda said: said["status"] == "completed")


async def test_a_plan_fits_on_a_phone(desk: Desk) -> None:
    await desk.page.set_viewport_size({"width": 390, "height": 844})
    page, run = await asked(desk)
    await page.get_by_role("button", name="Revise…").click()
    dialog = page.get_by_role("dialog", name=f"Revise {run}")
    await dialog.get_by_label("Mission").select_option("gone")
    await expect(dialog.get_by_role("region", name="Refused")).to_be_visible()
    assert await page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    await expect(page.get_by_role("button", name="STOP", exact=True).first).to_be_enabled()
    found = Accessibility(page)
    await found.look("a plan on a phone", ".dialog")
    found.assert_well()


async def test_a_plan_that_holds_no_more_is_shown_again_and_not_carried_out(desk: Desk) -> None:
    page, run = await asked(desk)
    await page.get_by_role("button", name="Revise…").click()
    dialog = page.get_by_role("dialog", name=f"Revise {run}")
    await dialog.get_by_label("Mission").select_option("again")
    act = dialog.get_by_role("button", name=f"Revise {run}")
    await expect(act).to_be_enabled()
    path = f"/api/runs/{run}/revision"
    plan = await desk.ask("POST", f"{path}/plan", {"mission": "named"})
    await desk.ask("POST", path, {"mission": "named", "plan": plan["plan"]})
    desk.refusals.append(409)
    await act.click()
    await expect(dialog.get_by_role("status")).to_contain_text("The run went on meanwhile")
    assert "Shall it go on?" in await version_of(desk, run)
    await act.click()
    await expect(dialog).to_have_count(0)
    assert "Really go on?" in await version_of(desk, run)


async def test_a_file_of_this_computer_is_a_new_version_and_a_wrong_one_is_explained(
    desk: Desk,
) -> None:
    page, run = await asked(desk)
    await page.get_by_role("button", name="Revise…").click()
    dialog = page.get_by_role("dialog", name=f"Revise {run}")
    chosen = dialog.locator("input[type=file]")
    desk.refusals.append(422)
    await chosen.set_input_files(file_of("wrong.bpmn", b"<no>\n<bpmn>"))
    await expect(dialog.get_by_role("alert")).to_contain_text("line 2")
    await chosen.set_input_files(file_of("my file.bpmn", NAMED))
    await expect(dialog).to_contain_text("All that is active stays.")
    await dialog.get_by_role("button", name=f"Revise {run}").click()
    await expect(dialog).to_have_count(0)
    assert "Shall it go on?" in await version_of(desk, run)
    assert not (desk.executive.missions / "my file.bpmn").exists()


async def test_who_does_not_start_missions_sees_the_plan_and_why_there_is_no_button(
    desk: Desk,
) -> None:
    _, run = await asked(desk)
    browser = desk.page.context.browser
    assert browser is not None
    async with signed_in(browser, desk.executive, "otto") as otto:
        page = otto.page
        await page.goto(f"{desk.executive.origin}/runs/{run}")
        await page.get_by_role("button", name="Revise…").click()
        dialog = page.get_by_role("dialog", name=f"Revise {run}")
        await dialog.get_by_label("Mission").select_option("again")
        await expect(dialog).to_contain_text("begins again")
        await expect(dialog).to_contain_text("Only commanders revise a run.")
        await expect(dialog.get_by_role("button", name=f"Revise {run}")).to_have_count(0)
