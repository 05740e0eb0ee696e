"""The editor's blocks for the course of a mission: each puts in a piece of BPMN that is correct."""

import re
from typing import Any

from playwright.async_api import Page, expect
from web_desk import IN_ONE_LOOP, Desk
from web_drawing import Drawing, new_mission

pytestmark = IN_ONE_LOOP

# What an author has still to choose: what is done, which process is called, what data decides.
OPEN = {"empty-script", "no-called-element", "unwritten-name"}
BLOCKS = {
    "At the same time": 4,
    "Wait": 1,
    "Wait until a time": 1,
    "Wait until something is true": 1,
    "If": 3,
    "Repeat": 4,
    "Every so often": 5,
    "When something is detected, stop": 10,
    "Ask and decide": 4,
    "If it fails": 4,
    "Try again": 6,
    "Within a time": 4,
    "When a signal comes, go on": 1,
    "When an operator says so, stop": 4,
    "Call another mission": 1,
}


async def test_each_block_is_one_step_that_the_check_finds_nothing_wrong_with(desk: Desk) -> None:
    page = await desk.home()
    drawing = await new_mission(page, "course")
    await drawing.append("Start", "Terminate end event", "Over")
    shapes = page.locator(".djs-shape[data-element-id]:not([data-element-id$=_label])")
    before = await shapes.count()
    wrong = []
    for title, count in BLOCKS.items():
        await page.locator("[title^='Fit to the window']").click()
        await put(drawing, "Start", title)
        await drawing.save()
        found = await findings(desk, "course")
        rules = {(each["rule"], each["message"]) for each in found if each["rule"] not in OPEN}
        made = await shapes.count() - before
        await page.locator("#m2-canvas svg").first.focus()
        await page.keyboard.press("Control+z")
        await expect(shapes).to_have_count(before)
        if rules or made != count:
            wrong.append(f"{title}: {made} elements, {rules}")
    assert not wrong, "\n".join(wrong)


async def put(drawing: Drawing, source: str, title: str) -> None:
    """Put a block behind an element by the menu at it."""
    await drawing.select(source)
    await drawing.page.click(".djs-context-pad [data-action=append]")
    await drawing.page.locator(".djs-popup-search input").press_sequentially(title)
    entry = drawing.page.locator(".djs-popup .entry").first
    await expect(entry).to_have_text(title)
    await entry.click()
    await expect(drawing.page.locator(".djs-popup")).to_have_count(0)


async def findings(desk: Desk, mission: str) -> list[dict[str, Any]]:
    """What the check finds in a saved mission."""
    said = await desk.ask("POST", "/api/checks", {"mission": mission})
    return list(said["findings"])


async def test_one_vehicle_in_two_branches_is_found_while_drawing_and_explained(desk: Desk) -> None:
    page = await desk.home()
    drawing = await new_mission(page, "twice")
    await drawing.append("Start", "Terminate end event", "Over")
    await put(drawing, "Start", "At the same time")
    # The blocks take the places that are open, and call themselves by what they do.
    blocks = page.get_by_role("region", name="Blocks")
    for part in ("first", "at the same time"):
        await drawing.select(await task(page, f"Choose what is done {part}"))
        await blocks.get_by_role("button", name="Reverse", exact=True).click()
        await drawing.fill("Distance", "20 m")
        await drawing.who("evsg1")
    assert await task(page, "Reverse by evsg1")

    await page.get_by_role("tab", name=re.compile("Problems")).click()
    problems = page.get_by_role("tabpanel", name=re.compile("Problems"))
    await expect(problems).to_contain_text("evsg1 may still do Reverse by evsg1 at that time")

    await page.get_by_role("tab", name="Run", exact=True).click()
    await page.get_by_role("button", name="Rehearse", exact=True).click()
    outcome = page.get_by_role("region", name="What came of it")
    await expect(outcome).to_contain_text("Its vehicle was still busy with another task")
    await expect(outcome).to_contain_text("Behaviors without a script end as the simulated")
    await outcome.get_by_role("button", name="one-behavior").click()
    pointed = page.locator(".m2v-pointed")
    await expect(pointed).to_contain_text("one-behavior violated")
    await expect(pointed).to_be_in_viewport()
    await page.get_by_text("What this assumes").click()
    await expect(page.get_by_text("Timers come in any order")).to_be_visible()


TASK = ".djs-shape"


async def task(page: Page, name: str) -> str:
    """The element that is called so."""
    # A name is drawn in lines, which have no space between them.
    words = re.sub(r"\s", "", name)
    for each in await page.locator(f"{TASK}[data-element-id^=Activity]").all():
        if words in re.sub(r"\s", "", await each.text_content() or ""):
            return await each.get_attribute("data-element-id") or ""
    raise AssertionError(f"nothing is called {name}")
