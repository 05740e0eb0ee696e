"""Expressions in the editor, in a browser: completed, explained, marked, and saved as typed."""

import re

import pytest
from playwright.async_api import Locator, Page, expect
from web_desk import IN_ONE_LOOP, Desk
from web_drawing import Drawing

from m2pem import load_mission
from m2pem.mission.elements import SequenceFlow

pytestmark = IN_ONE_LOOP
OPTION = ".cm-tooltip-autocomplete:not(.cm-tooltip-autocomplete-disabled) [role=option]"
"""Of a list that belongs to what has been typed last."""


async def condition_of(page: Page) -> Locator:
    """The empty field of a flow's condition, with the focus in it."""
    await page.locator("[data-element-id=FlowContinue] .djs-hit").first.click(force=True)
    condition = page.get_by_label("Taken when")
    await condition.fill("")
    await expect(condition).to_be_focused()
    return condition


async def choose(page: Page, shown: str) -> None:
    """Choose the first of what is offered, by keyboard."""
    await expect(page.locator(OPTION).first).to_contain_text(shown)
    await page.keyboard.press("ArrowDown")
    await expect(page.locator(f"{OPTION}[aria-selected=true]")).to_contain_text(shown)
    await page.keyboard.press("Enter")


async def test_an_expression_is_completed_by_keyboard_alone_and_saved(desk: Desk) -> None:
    page = await desk.edit()
    condition = await condition_of(page)
    await page.keyboard.type("= user.")
    await choose(page, "user.decision")
    await expect(condition).to_have_text("= user.decision")
    await page.keyboard.type(" = ")
    await choose(page, '"continue"')
    await page.keyboard.type(" and string le")
    await expect(page.locator(OPTION)).to_have_text("string length((string)")
    await page.keyboard.press("ArrowDown")
    await expect(page.locator(".cm-completionInfo")).to_have_text(
        "how many characters the text has"
    )
    await page.keyboard.press("Enter")
    await page.keyboard.type("user.decision) > 2")
    written = '= user.decision = "continue" and string length(user.decision) > 2'
    await expect(condition).to_have_text(written)
    await page.keyboard.press("Escape")
    await page.keyboard.press("Tab")
    await expect(condition).not_to_be_focused()
    await Drawing(page).save()
    mission = load_mission(desk.executive.missions / "vignette1.bpmn")
    flow = next(each for each in mission.flows if each.id == "FlowContinue")
    assert isinstance(flow, SequenceFlow)
    assert flow.condition is not None
    assert flow.condition.text == written


async def test_escape_closes_the_list_and_undoing_is_that_of_the_field(desk: Desk) -> None:
    page = await desk.edit()
    condition = await condition_of(page)
    await page.keyboard.type("us")
    await expect(page.locator(OPTION).first).to_be_visible()
    await page.keyboard.press("Escape")
    await expect(page.locator(OPTION)).to_have_count(0)
    await expect(condition).to_be_focused()
    await page.keyboard.press("Control+z")
    await expect(condition).not_to_have_text("us")
    await expect(page.locator("[data-element-id=FlowContinue]").first).to_be_attached()
    await page.keyboard.press("Control+y")
    await expect(condition).to_have_text("us")


async def test_what_is_below_the_pointer_is_explained(desk: Desk) -> None:
    page = await desk.edit()
    condition = await condition_of(page)
    await condition.fill('= substring(user.decision, 1) = "c"')
    said = page.get_by_role("tooltip")
    await page.locator(".m2-code-function").hover()
    await expect(said).to_contain_text("substring(string, start position, length?)")
    await expect(said).to_contain_text("the first is 1")
    await page.locator(".m2-code-name").hover()
    await expect(said).to_have_text("user.decision: data, written by UserSendRoute")


@pytest.mark.parametrize(
    ("typed", "wrong"), [("= user.decision = > 2", ">"), ("1 == * 'a b'", "*")]
)
async def test_what_is_wrong_is_marked_at_its_place(desk: Desk, typed: str, wrong: str) -> None:
    page = await desk.edit()
    condition = await condition_of(page)
    await condition.fill(typed)
    mark = page.locator(".m2-code-wrong")
    await expect(mark).to_have_text(wrong)
    await expect(condition).to_have_attribute("aria-invalid", "true")
    await condition.fill("user.decision == 'continue'")
    await expect(mark).to_have_count(0)
    await expect(page.locator(".m2-code-text")).to_have_text("'continue'")


async def test_a_parameter_that_is_an_expression_is_written_with_completion(desk: Desk) -> None:
    page = await desk.edit()
    drawing = Drawing(page)
    await drawing.select("Reverse")
    await drawing.fill("Distance", "= 1")
    distance = page.get_by_label(re.compile("^Distance")).first
    await expect(distance).to_have_class(re.compile("cm-content"))
    await distance.fill("")
    await page.keyboard.type("= user.")
    await choose(page, "user.decision")
    await page.keyboard.press("Escape")
    await page.keyboard.press("Tab")
    await drawing.save()
    mission = load_mission(desk.executive.missions / "vignette1.bpmn")
    (behavior,) = (each for task, each in mission.commands() if task.id == "Reverse")
    (value,) = (each.value for each in behavior.parameters if each.name == "distance")
    assert str(value) == "= user.decision"
    # The field stays the same one while it has the focus.
    await distance.fill("5 m")
    await expect(distance).to_be_focused()
    await expect(distance).to_have_class(re.compile("cm-content"))
    await page.keyboard.press("Tab")
    await expect(distance).to_have_value("5 m")
