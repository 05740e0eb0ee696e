"""Several processes in one file: each on a diagram of its own, and all undone in one row."""

import re
import shutil
from collections.abc import Sequence
from pathlib import Path

import pytest
from playwright.async_api import Page, expect
from web_desk import IN_ONE_LOOP, Desk
from web_drawing import Drawing
from web_served import REPOSITORY

from m2pem.bpmn import parse_mission
from m2pem.bpmn.search_path import SearchPath
from tests.editing.same_model import model_of

pytestmark = IN_ONE_LOOP

NAME = "survey_pair"
NESTED = Path(__file__).parent / "nested.bpmn"
SHOWN = ".djs-shape:visible:not([data-element-id$=_label])"


def model(xml: str) -> object:
    """What m2pem makes of a file."""
    return model_of(parse_mission(xml.encode(), NAME, SearchPath(Path(NAME))))


async def tabs(page: Page, names: Sequence[str], shown: str) -> None:
    """The diagrams there are, and which is shown."""
    row = page.get_by_role("tablist", name="Diagrams of this file").get_by_role("tab")
    await expect(row).to_have_text(list(names))
    await expect(page.get_by_role("tab", name=shown, exact=True)).to_have_attribute(
        "aria-selected", "true"
    )


async def add_process(page: Page, name: str) -> None:
    await page.get_by_role("button", name="Add a process").click()
    await page.get_by_label("Name of the process").fill(name)
    await page.keyboard.press("Enter")
    await expect(page.get_by_role("tab", name=name, exact=True)).to_be_visible()


async def save_renamed(drawing: Drawing, element: str, name: str) -> None:
    page = drawing.page
    await drawing.select(element)
    await page.get_by_label("Name", exact=True).fill(name)
    await page.get_by_role("button", name="Save", exact=True).click()
    await expect(page.locator(".m2-saved-state")).to_have_text("Saved")


async def undo(page: Page, times: int = 1) -> None:
    for _ in range(times):
        await page.get_by_role("button", name="Undo").click()


async def redo(page: Page) -> None:
    await page.get_by_role("button", name="Redo").click()


async def test_what_was_done_on_several_diagrams_is_undone_and_redone_in_one_row(
    desk: Desk,
) -> None:
    page = await desk.edit(NAME)
    drawing = Drawing(page)
    await expect(drawing.element("WestSurveyed")).to_be_visible()
    before = await page.locator(SHOWN).count()
    await drawing.select("WestSurveyed")
    await page.get_by_label("Name", exact=True).fill("Done?")
    await expect(page.get_by_role("button", name="Undo")).to_be_enabled()

    await add_process(page, "HELP")
    await tabs(page, ["SURVEY BY TWO COPTERS", "HELP"], "HELP")
    await page.locator(".m2-block", has_text="Ask the operator").focus()
    await page.keyboard.press("Enter")
    await expect(page.locator(SHOWN)).to_have_count(1)
    await page.get_by_role("tab", name="SURVEY BY TWO COPTERS").click()
    await expect(page.locator(SHOWN)).to_have_count(before)

    await undo(page)  # what it takes back is shown
    await tabs(page, ["SURVEY BY TWO COPTERS", "HELP"], "HELP")
    await expect(page.locator(SHOWN)).to_have_count(0)
    await undo(page)
    await tabs(page, ["SURVEY BY TWO COPTERS"], "SURVEY BY TWO COPTERS")
    await undo(page)
    await expect(drawing.element("WestSurveyed")).not_to_contain_text("Done?")
    await expect(page.locator(".m2-saved-state")).to_have_text("Saved")
    for _ in range(3):
        await redo(page)
    await expect(page.locator(SHOWN)).to_have_count(1)

    await page.get_by_role("tab", name="SURVEY BY TWO COPTERS").click()
    await page.get_by_role("button", name="Remove SURVEY BY TWO COPTERS").click()
    await page.get_by_role("dialog").get_by_role("button", name="Remove").click()
    await tabs(page, ["HELP"], "HELP")
    await expect(page.get_by_role("button", name="Remove HELP")).to_have_count(0)
    await undo(page)
    await tabs(page, ["SURVEY BY TWO COPTERS", "HELP"], "SURVEY BY TWO COPTERS")
    await expect(page.locator(SHOWN)).to_have_count(before)
    await redo(page)
    await tabs(page, ["HELP"], "HELP")
    await undo(page, 2)
    await tabs(page, ["SURVEY BY TWO COPTERS", "HELP"], "HELP")
    await undo(page)
    await tabs(page, ["SURVEY BY TWO COPTERS"], "SURVEY BY TWO COPTERS")
    await undo(page)

    await add_process(page, "LATER")
    await undo(page)
    await save_renamed(drawing, "WestSurveyed", "Done?")
    source = (REPOSITORY / "missions" / f"{NAME}.bpmn").read_text()
    again = (
        (desk.executive.missions / f"{NAME}.bpmn")
        .read_text()
        .replace('"Done?"', '"West half surveyed?"')
    )
    assert model(again) == model(source)


@pytest.mark.long
async def test_pools_that_were_removed_come_back_as_they_were(desk: Desk) -> None:
    page = await desk.edit("vignette1")
    source = REPOSITORY / "missions" / "vignette1.bpmn"
    await expect(Drawing(page).element("PoolVignette1")).to_be_visible()
    before = await page.locator(SHOWN).count()
    pools = (await page.get_by_role("tab", selected=True).first.inner_text()).strip()
    await add_process(page, "HELP")
    await page.get_by_role("tab", name=pools).click()
    await page.get_by_role("button", name=f"Remove {pools}").click()
    await page.get_by_role("dialog").get_by_role("button", name="Remove").click()
    await tabs(page, ["HELP"], "HELP")
    await undo(page)
    await expect(page.locator(SHOWN)).to_have_count(before)
    await undo(page)
    await tabs(page, [pools], pools)
    await save_renamed(Drawing(page), "Reverse", "Turn back")
    drawn = (desk.executive.missions / "vignette1.bpmn").read_text()
    name = model(
        source.read_text().replace('id="Reverse" name="REVERSE"', 'id="Reverse" name="Turn back"')
    )
    assert model(drawn) == name


async def test_what_is_in_a_collapsed_subprocess_comes_back_with_its_process(desk: Desk) -> None:
    shutil.copy(NESTED, desk.executive.missions)
    page = await desk.edit(NESTED.stem)
    await page.get_by_role("tab", name="OUTER").click()
    before = await page.locator(SHOWN).count()
    await page.get_by_role("button", name="Remove OUTER").click()
    await page.get_by_role("dialog").get_by_role("button", name="Remove").click()
    await tabs(page, ["OTHER"], "OTHER")
    await undo(page)
    await expect(page.locator(SHOWN)).to_have_count(before)
    await page.locator(".bjs-drilldown:visible").click()
    await expect(page.locator("[data-element-id=Unreached]")).to_be_visible()


async def test_all_and_what_is_in_a_frame_are_of_the_diagram_that_is_shown(desk: Desk) -> None:
    page = await desk.edit(NAME)
    await expect(Drawing(page).element("WestSurveyed")).to_be_visible()
    await add_process(page, "HELP")
    await page.locator(".m2-block", has_text="Ask the operator").focus()
    await page.keyboard.press("Enter")
    await expect(page.locator(SHOWN)).to_have_count(1)
    await page.locator("svg[data-element-id]").first.focus()
    await page.keyboard.press("Control+a")
    await expect(page.locator(".djs-element.selected")).to_have_count(1)
    await page.keyboard.press("Delete")
    await expect(page.locator(SHOWN)).to_have_count(0)
    await page.get_by_role("tab", name="SURVEY BY TWO COPTERS").click()
    await expect(Drawing(page).element("WestSurveyed")).to_be_visible()


@pytest.mark.long
async def test_a_second_diagram_of_the_same_process_is_drawn_when_it_is_opened(desk: Desk) -> None:
    file = desk.executive.missions / f"{NAME}.bpmn"
    text = file.read_text()
    begin = text.index("<bpmndi:BPMNDiagram")
    end = text.index("</bpmndi:BPMNDiagram>") + len("</bpmndi:BPMNDiagram>")
    second = re.sub(r'(<bpmndi:\w+ id=")', r"\1Second_", text[begin:end])
    file.write_text(text[:end] + second + text[end:])
    page = await desk.edit(NAME)
    views = page.get_by_role("tab", name="SURVEY BY TWO COPTERS")
    await expect(views).to_have_count(2)
    before = await page.locator(SHOWN).count()
    await views.nth(1).click()
    await expect(views.nth(1)).to_have_attribute("aria-selected", "true")
    await expect(page.locator(SHOWN)).to_have_count(before)
    await views.nth(0).click()
    await expect(views.nth(0)).to_have_attribute("aria-selected", "true")
    await save_renamed(Drawing(page), "WestSurveyed", "Done?")
    assert file.read_text().count("<bpmndi:BPMNDiagram ") == 2
