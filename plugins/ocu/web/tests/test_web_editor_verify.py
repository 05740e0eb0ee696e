"""Verification from the editor, in a real browser: the report, a run step by step, requirements."""

import re
import shutil
from xml.etree import ElementTree

import pytest
from playwright.async_api import Locator, Page, expect
from web_desk import IN_ONE_LOOP, MISSION, Desk
from web_served import REPOSITORY

from tests.cli.test_verify_terminal import tangled

pytestmark = IN_ONE_LOOP

STUCK = REPOSITORY / "docs" / "broken" / "join_fed_by_one_branch.bpmn"
REQUIREMENT = "{https://m2pem.org/schema/1}requirement"


async def verify(page: Page) -> None:
    await page.get_by_role("button", name="Verify", exact=True).click()


def drawn(page: Page, element: str) -> Locator:
    return page.locator(f'.m2-canvas g.djs-element[data-element-id="{element}"]').first


def offered(page: Page) -> Locator:
    """What may come next in a field, or be chosen for it."""
    return page.get_by_role("listbox")


async def test_a_run_into_a_deadlock_is_stepped_through_on_the_diagram(desk: Desk) -> None:
    shutil.copy(STUCK, desk.executive.missions)
    page = await desk.edit(STUCK.stem, tab="Verify")
    await verify(page)
    report = page.get_by_role("region", name="Report")
    await expect(report.get_by_role("heading", name="Violated")).to_be_visible()
    await expect(drawn(page, "Reverse")).to_contain_class("m2v-unreached")
    await expect(report.get_by_role("button", name="REVERSE", exact=True)).to_be_visible()

    await report.get_by_role("button", name="Show the run: 12 steps").first.click()
    walk = page.get_by_role("region", name="A run that breaks it")
    await expect(walk.get_by_text("12 of 12")).to_be_visible()
    await expect(drawn(page, "JoinDetection")).to_contain_class("m2v-stuck")
    await expect(drawn(page, "FlowStopped")).to_contain_class("m2v-missing")
    await expect(page.locator(".m2v-reason")).to_contain_text(
        "wait at parallel gateway JoinDetection"
    )

    # By keyboard alone, from where the focus is.
    await expect(walk.get_by_role("button", name="All answers")).to_be_focused()
    await page.keyboard.press("Home")
    await expect(walk.get_by_text("1 of 12")).to_be_visible()
    await expect(drawn(page, "StartVignette1")).to_contain_class("m2v-now")
    await expect(drawn(page, "JoinDetection")).not_to_contain_class("m2v-stuck")
    await page.keyboard.press("ArrowRight")
    await expect(drawn(page, "UserSendRoute")).to_contain_class("m2v-now")
    await expect(drawn(page, "StartVignette1")).to_contain_class("m2v-passed")
    await expect(page.locator(".m2v-number")).to_have_text(["1", "2"])
    await walk.get_by_role("slider", name="Step").focus()
    await page.keyboard.press("End")
    await expect(walk.get_by_text("12 of 12")).to_be_visible()
    await walk.get_by_role("button", name="Previous step").click()
    await expect(walk.locator('[aria-current="step"]')).to_contain_text("gpr")

    await walk.get_by_role("button", name="All answers").click()
    await expect(page.locator(".m2v-number")).to_have_count(0)
    await report.get_by_role("button", name="Clear the report").click()
    await expect(drawn(page, "Reverse")).not_to_contain_class("m2v-unreached")


async def test_what_is_certain_is_shown_while_the_search_goes_on(desk: Desk) -> None:
    mission = desk.executive.missions / "tangled.bpmn"
    mission.write_text(tangled(handled=False), encoding="utf-8")
    page = await desk.edit("tangled", tab="Verify")
    await page.get_by_text("Options", exact=True).click()
    await page.get_by_label("Search on after a violation").check()
    await verify(page)
    certain = page.get_by_role("list", name="Certain already")
    await expect(certain.get_by_text("violated: decisions-handled")).to_be_visible()
    await expect(certain.get_by_role("listitem").first).to_contain_text("violated")
    await expect(certain.get_by_text("holds: can-be-triggered")).to_be_visible()
    status = page.get_by_role("status").filter(has_text="states found")
    rate = re.compile(r"still to search, [1-9][\d,]* a second, [1-9]")
    await expect(status).to_contain_text(rate)
    await page.get_by_role("button", name="Cancel", exact=True).click()
    await expect(page.get_by_text("The verification was cancelled.")).to_be_visible()
    await expect(certain).to_have_count(0)

    await page.get_by_label("Search on after a violation").uncheck()
    await verify(page)
    report = page.get_by_role("region", name="Report")
    await expect(report.get_by_role("heading", name="Violated")).to_be_visible()
    await expect(report).to_contain_text("a violation that was found before")


async def test_requirements_are_written_verified_undone_and_kept(desk: Desk) -> None:
    page = await desk.edit(tab="Verify")
    parts = page.get_by_role("region", name="Requirements of this mission")
    await parts.get_by_label("Pattern").select_option("")
    await parts.get_by_role("button", name="Add", exact=True).click()
    formula = parts.get_by_role("textbox", name="Formula", exact=True)
    await formula.fill("[](activ(Reverse) -> <> ended)")
    caret = parts.locator(".m2v-caret")  # of the check, while it is being typed
    await expect(caret).to_have_text("[](activ(Reverse) -> <> ended)\n   ^")
    await verify(page)
    problem = page.get_by_role("alert").filter(has_text="could not be verified")
    await expect(problem).to_contain_text("there is no 'activ(...)'")
    await expect(caret).to_have_text("[](activ(Reverse) -> <> ended)\n   ^")

    # What may come next: an element.
    await formula.fill("[](completed(")
    await formula.press_sequentially("rev")
    await expect(offered(page).get_by_role("option").first).to_be_visible()
    await page.keyboard.press("ArrowDown")
    await page.keyboard.press("Enter")
    await expect(formula).to_have_text("[](completed(Reverse)")
    await page.keyboard.type(" -> once(user.decision == ")
    await offered(page).get_by_role("option", name="'continue'").click()
    await page.keyboard.type("))")
    await parts.get_by_label("What it is for").fill("nobody reverses unasked")
    await parts.get_by_label("What it is for").blur()
    await verify(page)
    report = page.get_by_role("region", name="Report")
    await expect(report.get_by_role("heading", name="Everything holds")).to_be_visible()
    await expect(report).to_contain_text("“nobody reverses unasked”")
    await expect(parts).to_contain_text("Whenever 'REVERSE' is completed")

    await parts.get_by_label("What it is for").fill("another reason")
    await parts.get_by_label("What it is for").blur()
    await expect(report).to_contain_text("The mission has changed since")
    await page.get_by_role("button", name="Undo (Ctrl+Z)").click()
    await expect(report).not_to_contain_text("The mission has changed since")
    await expect(parts.get_by_label("What it is for")).to_have_value("nobody reverses unasked")

    await page.get_by_role("button", name="Save").click()
    await expect(page.get_by_role("toolbar", name="Editor")).to_contain_text("Saved")
    kept = ElementTree.parse(desk.executive.missions / f"{MISSION}.bpmn")
    assert [each.attrib for each in kept.iter(REQUIREMENT)] == [
        {
            "id": "formula",
            "text": "nobody reverses unasked",
            "ltl": "[](completed(Reverse) -> once(user.decision == 'continue'))",
        }
    ]


async def test_what_is_assumed_is_said_with_the_answers_and_kept(desk: Desk) -> None:
    page = await desk.edit(tab="Verify")
    await page.get_by_text("Options", exact=True).click()
    of_all = page.get_by_role("group").get_by_role("textbox", name="Assumed")
    await of_all.fill("no-failure")
    await of_all.blur()
    await verify(page)
    said = "'no-failure' is no assumption; did you mean 'no-failures'?"
    await expect(page.locator("#m2v-assume-error")).to_have_text(said)
    await of_all.fill("no-failures")
    await of_all.blur()
    await verify(page)
    report = page.get_by_role("region", name="Report")
    await report.get_by_text("What this assumes").click()
    await expect(report).to_contain_text("As you say: no-failures.")
    await report.locator("summary", has_text="hold").last.click()
    await expect(report).to_contain_text("if no behavior fails; without that: warning, by a run")
    await of_all.fill("")
    await of_all.blur()

    parts = page.get_by_role("region", name="Requirements of this mission")
    await parts.get_by_label("Pattern").select_option("")
    await parts.get_by_role("button", name="Add", exact=True).click()
    await parts.get_by_role("textbox", name="Formula", exact=True).fill("[] !ended(failed)")
    await parts.get_by_role("textbox", name="Assumed").fill("no-failures")
    await parts.get_by_role("textbox", name="Assumed").blur()
    await verify(page)
    condition = "if no behavior fails; without that: violated, by a run in which"
    await expect(parts.locator(".m2v-condition")).to_contain_text(condition)
    await report.get_by_role("button", name="Show the run without the assumption").first.click()
    walk = page.get_by_role("region", name="A run that breaks it")
    await expect(walk.locator('[aria-current="step"]')).to_contain_text("fails with FAILED")
    await expect(walk).to_contain_text("one of those without the assumption (no-failures)")

    await page.get_by_role("button", name="Save").click()
    await expect(page.get_by_role("toolbar", name="Editor")).to_contain_text("Saved")
    kept = ElementTree.parse(desk.executive.missions / f"{MISSION}.bpmn")
    assert [each.get("assume") for each in kept.iter(REQUIREMENT)] == ["no-failures"]


@pytest.mark.long
async def test_a_pattern_gets_its_arguments_from_pickers(desk: Desk) -> None:
    page = await desk.edit(tab="Verify")
    parts = page.get_by_role("region", name="Requirements of this mission")
    await parts.get_by_label("Pattern").select_option("operator_in_the_loop")
    await parts.get_by_role("button", name="Add", exact=True).click()
    ask = parts.get_by_role("combobox", name="ask", exact=True)
    await ask.click()
    await expect(offered(page).get_by_role("option")).to_have_text(["UserSendRouteUSER SEND ROUTE"])
    await offered(page).get_by_role("option").click()
    await parts.get_by_role("combobox", name="decision").click()
    await offered(page).get_by_role("option", name="continue").click()
    before = parts.get_by_role("textbox", name="before")
    await before.fill("active(DriveR")
    await offered(page).get_by_role("option", name="DriveRoute").click()
    await before.blur()
    await verify(page)
    report = page.get_by_role("region", name="Report")
    await expect(report.get_by_role("heading", name="Everything holds")).to_be_visible()
    await expect(parts).to_contain_text("an operator has answered 'USER SEND ROUTE'")


@pytest.mark.long
async def test_requirements_typed_as_yaml_are_pointed_at_where_they_are_wrong(desk: Desk) -> None:
    page = await desk.edit(tab="Verify")
    await page.get_by_text("Options", exact=True).click()
    spec = page.get_by_label("More requirements (YAML)")
    await spec.fill("requirements:\n  - id: ends\n    ltl: '<> endd'\n")
    await spec.blur()
    await verify(page)
    problem = page.get_by_role("alert").filter(has_text="could not be verified")
    await expect(problem).to_contain_text("Line 3")
    await expect(problem.locator(".m2v-caret")).to_have_text("<> endd\n   ^")
    await spec.fill("requirements:\n  - {id: ends, ltl: '<> ended', fair: true}\n")
    await spec.blur()
    await verify(page)
    report = page.get_by_role("region", name="Report")
    await expect(report).to_contain_text("Your requirements")
    await expect(report).to_contain_text("ends")
