"""A mission's whole life on the page: drawn, checked, verified, rehearsed, run, stopped, replayed.

By mouse and keyboard alone, in a real browser, with simulated vehicles.
"""

import re
from collections import Counter
from pathlib import Path
from xml.etree import ElementTree

import pytest
from playwright.async_api import Browser, Page, ViewportSize, expect
from web_browsing import page_at
from web_desk import IN_ONE_LOOP, Desk
from web_drawing import Drawing, new_mission
from web_pictures import picture
from web_running import (
    AMBER,
    GRAY,
    GREEN,
    answer,
    fleet_with_mine,
    press_twice,
    wait_for_colour,
    wait_for_status,
)
from web_served import REPOSITORY, served
from web_vignette import Mission, draw_detection, draw_main

from m2pem import load_mission

pytestmark = IN_ONE_LOOP

NAME = "vignette1"
PROCESS = "{http://www.omg.org/spec/BPMN/20100524/MODEL}process"
FASTER = ("--simulate", "--speed", "5", "--journal", "memory:")
PROBLEMS = ".m2-problems-head p"
ROOM: ViewportSize = {"width": 1440, "height": 900}
"""For a whole diagram beside the form, as wide as it is drawn here."""


async def test_a_process_is_drawn_with_the_mouse(desk: Desk) -> None:
    await desk.page.set_viewport_size(ROOM)
    drawing = await new_mission(await desk.home(), "drawn")
    await draw_main(drawing)
    await drawing.save()
    drawn = kinds_of_first_process(desk.executive.missions / "drawn.bpmn")
    assert drawn == kinds_of_first_process(REPOSITORY / "missions" / f"{NAME}.bpmn")


def kinds_of_first_process(path: Path) -> Counter[str]:
    """How many of each kind of elements it has, but for data objects."""
    process = next(ElementTree.parse(path).iter(PROCESS))
    return Counter(each.tag for each in process if "dataObject" not in each.tag)


@pytest.mark.long
@pytest.mark.tried_with(
    "bpmn-js",
    "a mission is drawn with the mouse, checked, verified, run and replayed",
    kind="BPMN editors",
    result="completed",
    package="bpmn-js",
)
@pytest.mark.tried_with(
    "Chromium",
    "the life of a mission on the page",
    kind="Browsers and the web",
    result="completed",
    package="playwright",
)
async def test_vignette1_is_drawn_from_an_empty_page_and_lives_its_whole_life(
    chromium: Browser, tmp_path: Path
) -> None:
    fleet = fleet_with_mine(tmp_path)
    with served(tmp_path, fleet=fleet, words=FASTER) as executive:
        async with page_at(chromium, executive.url, **ROOM) as it:
            page = it.page
            drawing = await begin(page)
            mission = await draw(drawing)
            await mend_what_is_wrong(drawing, mission)
            await drawing.save()
            assert_same_elements(executive.missions / f"{NAME}.bpmn")
            await verify(page)
            await rehearse(page)
            await start_and_answer(page)
            await watch_detection(page)
            await pause_and_resume(page)
            await stop(page)
            await replay(page)
            it.assert_well()


async def begin(page: Page) -> Drawing:
    await page.get_by_role("button", name="New mission").click()
    await expect(page.get_by_role("radio")).to_have_count(6)
    await picture(page, "new_mission")
    await page.get_by_role("button", name="Cancel").click()
    return await new_mission(page, NAME)


async def draw(drawing: Drawing) -> Mission:
    page = drawing.page
    mission = await draw_main(drawing)
    await draw_detection(drawing)
    await page.get_by_role("button", name="Fit to the window").click()
    await picture(page, "drawn_detection")
    await page.get_by_role("tab", name=NAME).click()
    await page.get_by_role("button", name="Fit to the window").click()
    await drawing.select(mission.ask)
    await picture(page, "drawn")
    return mission


async def mend_what_is_wrong(drawing: Drawing, mission: Mission) -> None:
    """A name that was misspelled is told of, leads to where it is, and is gone when mended."""
    page = drawing.page
    await drawing.select(mission.call)
    await drawing.fill("Process", "DETECTOIN")
    await drawing.select(mission.reverse)
    await page.get_by_role("tab", name="Problems").click()
    problem = page.get_by_role("button", name=re.compile("DETECTOIN"))
    await expect(problem).to_contain_text("did you mean 'DETECTION'?")
    await expect(page.locator(PROBLEMS)).to_have_text("1 error, 0 warnings")
    await problem.click()
    assert await drawing.selected() == mission.call
    await picture(page, "problem")
    await page.get_by_role("tab", name="Properties").click()
    called = page.get_by_label(re.compile(r"^Process\b")).first
    await called.fill("")
    await page.get_by_role("option", name="DETECTION").click()
    await expect(called).to_have_value("DETECTION")
    await page.get_by_role("tab", name="Problems").click()
    await expect(page.locator(PROBLEMS)).to_have_text("No problems found.")


def assert_same_elements(path: Path) -> None:
    """What was drawn has the elements of the mission in the repository, but for the data object."""

    def kinds(file: Path) -> Counter[str]:
        mission = load_mission(file)
        return Counter(type(each).__name__ for each in (*mission.nodes, *mission.flows))

    assert kinds(path) == kinds(REPOSITORY / "missions" / f"{NAME}.bpmn")


async def verify(page: Page) -> None:
    await page.get_by_role("tab", name="Verify").click()
    await page.get_by_role("button", name="Verify", exact=True).click()
    report = page.get_by_role("region", name="Report")
    await expect(report.get_by_role("heading", name="Everything holds")).to_be_visible()
    await expect(report).to_contain_text("14 hold")
    await expect(report).to_contain_text("Work that may fail has an error boundary event.")
    await picture(page, "verified")


async def rehearse(page: Page) -> None:
    await page.get_by_role("tab", name="Run", exact=True).click()
    part = page.get_by_role("region", name="Rehearse")
    await part.get_by_text("What happens in the rehearsal").click()
    visits = part.get_by_role("group", name="USER SEND ROUTE")
    await visits.get_by_role("button", name="+ visit").click()
    await visits.get_by_role("button", name="+ visit").click()
    await visits.get_by_label("visit 2").select_option("abort")
    await part.get_by_role("button", name="Rehearse").click()
    outcome = part.get_by_role("region", name="What came of it")
    await expect(outcome.get_by_role("heading", name="Terminated")).to_be_visible()
    await outcome.scroll_into_view_if_needed()
    await picture(page, "rehearsed")
    async with page.expect_popup() as opened:
        await outcome.get_by_role("link", name="Watch the rehearsal").click()
    await watch_rehearsal(await opened.value)


async def watch_rehearsal(page: Page) -> None:
    """It plays: the vehicle drives, and what it does is green."""
    await page.get_by_role("button", name="Play", exact=True).click()
    await wait_for_colour(page, "DRIVE ROUTE", GREEN)
    await expect(page.locator(".vehicles-pane .card", has_text="evsg1").first).to_contain_text(
        "5.0 m/s"
    )
    await picture(page, "rehearsal")
    await page.get_by_label("Position").focus()
    await page.keyboard.press("End")
    await wait_for_status(page, "Terminated")
    await page.close()


async def start_and_answer(page: Page) -> None:
    await page.get_by_role("button", name="Start", exact=True).click()
    await page.wait_for_url("**/runs/*")
    await expect(answer(page, "Continue")).to_be_enabled()
    await wait_for_colour(page, "USER SEND ROUTE", AMBER)
    await picture(page, "question")
    await answer(page, "Continue").click()
    await expect(page.get_by_role("alertdialog")).to_have_count(0)


async def watch_detection(page: Page) -> None:
    """The page follows into the called process, until the radar finds what lies on the route."""
    await expect(page.get_by_role("tab", name="DETECTION")).to_have_attribute(
        "aria-selected", "true"
    )
    await wait_for_colour(page, "DRIVE ROUTE", GREEN)
    await wait_for_colour(page, "DETECTOR", GREEN)
    await picture(page, "running")
    await expect(answer(page, "Continue")).to_be_enabled()
    events = page.get_by_role("region", name="Events")
    await expect(events).to_contain_text("signal 'Stop driving'")
    # Both have been left: they fade from green to gray.
    await page.get_by_role("tab", name="DETECTION").click()
    await wait_for_colour(page, "DRIVE ROUTE", GRAY)
    await wait_for_colour(page, "DETECTOR", GRAY)
    await picture(page, "detected")
    await answer(page, "Continue").click()
    await wait_for_colour(page, "DRIVE ROUTE", GREEN)


async def pause_and_resume(page: Page) -> None:
    await page.get_by_role("button", name="Pause", exact=True).click()
    await wait_for_status(page, "Paused")
    await expect(page.locator(".vehicles-pane .card", has_text="evsg1").first).to_contain_text(
        "0.0 m/s"
    )
    await picture(page, "paused")
    await page.get_by_role("button", name="Resume", exact=True).click()
    await wait_for_status(page, "Running")
    await expect(page.locator(".vehicles-pane .card", has_text="evsg1").first).to_contain_text(
        "5.0 m/s"
    )


async def stop(page: Page) -> None:
    """The STOP of every page, which stops all runs: a first click only makes it ready."""
    await press_twice(page, page.locator("header button.stop").click)
    ended = page.get_by_role("dialog", name="The run has ended")
    await expect(ended).to_contain_text("was stopped")
    await expect(ended).to_contain_text("continue, answered by anna")
    await picture(page, "stopped")


async def replay(page: Page) -> None:
    """The same page plays what happened, from the journal; the scrubber goes anywhere."""
    await page.get_by_role("button", name="Replay it").click()
    await expect(page.locator(".run-bar")).to_contain_text("Replay")
    position = page.get_by_label("Position")
    await position.focus()
    await page.keyboard.press("Home")
    await wait_for_colour(page, "USER SEND ROUTE", AMBER)
    await page.locator(".bar", has_text=re.compile("DETECTOR|DRIVE")).first.click()
    await wait_for_colour(page, "DRIVE ROUTE", GREEN)
    before = await position.input_value()
    await page.get_by_role("button", name="Play", exact=True).click()
    await expect(position).not_to_have_value(before)
    await picture(page, "replay")
    await position.focus()
    await page.keyboard.press("End")
    await wait_for_status(page, "Stopped")
