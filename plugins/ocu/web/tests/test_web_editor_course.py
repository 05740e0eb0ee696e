"""The editor's blocks for the course of a mission: each puts in a piece of BPMN that is correct."""

from typing import Any

from playwright.async_api import expect
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
