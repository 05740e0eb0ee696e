"""Files through the editor: nothing is lost, every element has its form, pictures and copies."""

import os
import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import pytest
from playwright.async_api import FilePayload, Page, expect
from web_desk import IN_ONE_LOOP, Desk
from web_served import REPOSITORY

from m2pem.bpmn import parse_mission
from m2pem.bpmn.search_path import SearchPath
from m2pem.editing.editable import editable
from m2pem.errors import MissionError
from tests.editing.same_model import model_of, new_names

pytestmark = IN_ONE_LOOP

CORPORA = os.environ.get("M2PEM_CORPORA", "")
MISSIONS = sorted((REPOSITORY / "missions").glob("*.bpmn"))
OTHERS = sorted(
    [
        *(REPOSITORY / "examples").glob("*/*.bpmn"),
        *(REPOSITORY / "docs" / "broken").glob("*.bpmn"),
        *(Path(CORPORA).rglob("*.bpmn") if CORPORA else ()),
    ]
)


async def from_menu(page: Page, item: str) -> None:
    await page.get_by_role("button", name="More").click()
    await page.get_by_role("menuitem", name=item).click()


async def upload(page: Page, name: str, content: bytes) -> None:
    async with page.expect_file_chooser() as chooser:
        await from_menu(page, "Replace by a file")
    file = FilePayload(name=name, mimeType="application/xml", buffer=content)
    async with page.expect_response("**/api/editable") as answered:
        await (await chooser.value).set_files([file])
    assert (await answered.value).ok
    await expect(page.locator(".toasts")).to_contain_text(f"{name} was put in place")


async def downloaded(page: Page, item: str) -> bytes:
    async with page.expect_download() as download:
        await from_menu(page, item)
    return Path(await (await download.value).path()).read_bytes()  # noqa: ASYNC240  # small


def renamed(notes: Iterable[str]) -> Iterator[tuple[str, str]]:
    """Old and new ids, as people are told of them."""
    for note in notes:
        if told := re.fullmatch(r"(.+) is (.+) now: editors refuse such an id\.", note):
            yield told[1], told[2]


@pytest.mark.parametrize(
    "files", [MISSIONS, pytest.param(OTHERS, marks=pytest.mark.long)], ids=["missions", "others"]
)
async def test_every_mission_goes_through_the_editor_without_loss(
    desk: Desk, files: Sequence[Path]
) -> None:
    page = await desk.edit()
    for number, file in enumerate(files):
        source = file.read_bytes()
        try:
            before = parse_mission(source, str(file), SearchPath(file))
        except MissionError:
            continue
        await upload(page, f"file-{number}.bpmn", source)
        saved = await downloaded(page, "Download .bpmn")
        after = parse_mission(saved, str(file), SearchPath(file))
        names = {**new_names(before, after), **dict(renamed(editable(source).notes))}
        assert model_of(after) == model_of(before, names), file


@pytest.mark.long
@pytest.mark.parametrize("mission", ["mehds_vignette_1", "team_column"])
async def test_every_element_has_its_form(desk: Desk, mission: str) -> None:
    page = await desk.edit(mission)
    shapes = await page.locator("#m2-canvas .djs-container > svg .djs-shape").count()
    await page.locator("svg[data-element-id]").first.focus()
    seen = set()
    for _ in range(shapes):
        await page.keyboard.press("Tab")
        chosen = page.locator(".djs-element.selected").first
        seen.add(await chosen.get_attribute("data-element-id"))
        await expect(page.get_by_label("Id", exact=False).first).to_be_visible()
    assert len(seen) > 20


async def test_what_is_copied_keeps_its_behavior_in_another_mission(desk: Desk) -> None:
    page = await desk.edit()
    await page.click("[data-element-id=Reverse]")
    await page.keyboard.press("Control+c")
    await desk.edit("survey_pair", page)
    before = await page.locator(".djs-shape").count()
    await page.mouse.move(500, 700)
    await page.mouse.move(520, 700)
    await page.locator("svg[data-element-id]").first.focus()
    await page.keyboard.press("Control+v")
    await expect(page.locator(".djs-drag-group")).to_have_count(1)
    await page.mouse.move(600, 720)
    await page.mouse.click(600, 720)
    await expect(page.locator(".djs-shape")).to_have_count(before + 1)
    saved = (await downloaded(page, "Download .bpmn")).decode()
    assert '<m2pem:property name="distance" value="10 m"' in saved


@pytest.mark.long
async def test_pictures_are_drawn(desk: Desk) -> None:
    page = await desk.edit()
    svg = await downloaded(page, "picture (SVG)")
    assert b"DRIVE ROUTE" in svg
    assert b"evsg1" in svg
    png = await downloaded(page, "picture (PNG)")
    assert png.startswith(b"\x89PNG")


async def test_a_diagram_is_laid_out_and_put_back(desk: Desk) -> None:
    page = await desk.edit()
    before = await page.locator("[data-element-id=Reverse]").first.get_attribute("transform")
    await page.get_by_role("button", name="Lay the diagram out anew").click()
    await page.get_by_role("button", name="Lay out", exact=True).click()
    await expect(page.get_by_text("The diagram was laid out anew.")).to_be_visible()
    moved = page.locator("[data-element-id=Reverse]").first
    assert await moved.get_attribute("transform") != before
    await page.locator(".m2-notice").get_by_role("button", name="Undo").click()
    await expect(page.locator("[data-element-id=Reverse]")).to_have_count(1)
    assert (
        await page.locator("[data-element-id=Reverse]").first.get_attribute("transform") == before
    )


async def test_a_called_process_of_another_diagram_is_shown(desk: Desk) -> None:
    page = await desk.edit("survey_pair")
    await page.get_by_role("button", name="Add a process").click()
    await page.get_by_label("Name of the process").fill("HELP")
    await page.keyboard.press("Enter")
    await expect(page.get_by_role("tab", name="HELP")).to_have_attribute("aria-selected", "true")
    ask = page.locator(".m2-block", has_text="Ask the operator")
    await ask.focus()
    await page.keyboard.press("Enter")
    await expect(page.locator(".djs-shape:visible")).to_have_count(1)
    await page.get_by_role("tab", name="SURVEY").click()
    await expect(page.locator("[data-element-id=WestSurveyed]").first).to_be_visible()
    saved = (await downloaded(page, "Download .bpmn")).decode()
    assert saved.count("<bpmndi:BPMNDiagram ") == 2
    assert 'name="HELP"' in saved


async def test_what_cannot_be_drawn_is_refused_with_the_reason(desk: Desk) -> None:
    page = await desk.edit()
    async with page.expect_file_chooser() as chooser:
        await from_menu(page, "Replace by a file")
    file = FilePayload(name="x.bpmn", mimeType="application/xml", buffer=b"<!DOCTYPE x><x/>")
    await (await chooser.value).set_files([file])
    said = page.get_by_role("alert").filter(has_text="cannot be drawn")
    await expect(said).to_be_visible()
    await expect(page.locator("[data-element-id=Reverse]")).to_have_count(1)
    desk.refusals.append(422)


async def test_problems_lead_into_collapsed_subprocesses_and_other_diagrams(
    desk: Desk,
) -> None:
    page = desk.page
    source = (Path(__file__).parent / "nested.bpmn").read_bytes()
    (desk.executive.missions / "nested.bpmn").write_bytes(source)
    await desk.edit("nested", page)
    problems = page.get_by_role("tab", name="Problems")
    for element, diagram in (("Unreached", "OUTER"), ("Bad", "OTHER")):
        await problems.click()
        await page.locator(".m2-problem", has_text=element).first.click()
        selected = page.locator(".djs-element.selected")
        await expect(selected).to_be_visible()
        await expect(selected).to_have_attribute("data-element-id", element)
        tab = page.get_by_role("tab", name=diagram)
        await expect(tab).to_have_attribute("aria-selected", "true")
