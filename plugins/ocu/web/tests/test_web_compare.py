"""Two versions of a mission side by side: on the diagrams, on the map, and in words."""

import json

import pytest
from playwright.async_api import Page, expect
from web_axe import Accessibility
from web_desk import IN_ONE_LOOP, MISSION, Desk
from web_drawing import SAVED, Drawing
from web_pictures import picture

pytestmark = IN_ONE_LOOP

PROCESS = '<bpmn:process id="VIGNETTE1" name="VIGNETTE1" isExecutable="true">'
NORTH = [[-77.37, 38.10], [-77.368, 38.10], [-77.366, 38.10]]
MOVED = [[-77.37, 38.10], [-77.368, 38.101], [-77.366, 38.10]]


def with_route(xml: str, coordinates: list[list[float]]) -> str:
    """The mission with a route of its own."""
    shape = json.dumps({"type": "LineString", "coordinates": coordinates})
    assert PROCESS in xml
    held = f'<m2pem:geometry name="loop">{shape}</m2pem:geometry>'
    return xml.replace(PROCESS, f"{PROCESS}<bpmn:extensionElements>{held}</bpmn:extensionElements>")


async def saved(desk: Desk, xml: str) -> None:
    base = (await desk.ask("GET", f"/api/missions/{MISSION}"))["version"]
    await desk.ask("PUT", f"/api/missions/{MISSION}", {"xml": xml, "base": base})


async def compared(page: Page) -> None:
    await page.get_by_role("button", name="More").click()
    await page.get_by_role("menuitem", name="Compare versions").click()
    await expect(page.get_by_role("dialog")).to_contain_text("added")


@pytest.mark.tried_with(
    "bpmn-js-differ",
    "compares versions of a mission on the page",
    kind="BPMN editors",
    result="what differs is marked",
)
async def test_versions_are_compared_on_diagrams_on_the_map_and_in_words(desk: Desk) -> None:
    xml = (await desk.ask("GET", f"/api/missions/{MISSION}"))["xml"]
    assert xml.count("10 m") == 1 and xml.count('name="REVERSE"') == 1
    await saved(desk, with_route(xml, NORTH))
    changed = xml.replace("10 m", "25 m").replace('name="REVERSE"', 'name="BACK OFF"')
    await saved(desk, with_route(changed, MOVED))
    page = await desk.edit()
    await compared(page)
    dialog = page.get_by_role("dialog")
    changes = dialog.get_by_role("region", name="Changes")
    await expect(changes.get_by_role("status")).to_have_text(
        "0 added, 0 removed, 2 changed, 0 moved"
    )
    await expect(changes).to_contain_text("name: REVERSE → BACK OFF")
    await expect(changes).to_contain_text("distance: 10 m → 25 m")
    await expect(changes).to_contain_text("1 vertex is in another place")
    for side in ("Before", "After"):
        half = dialog.get_by_role("region", name=side)
        await expect(half.locator("[data-element-id=Reverse].cmp-changed")).to_have_count(1)
    await changes.get_by_role("button", name="BACK OFF").press("Enter")
    await expect(dialog.locator(".cmp-selected[data-element-id=Reverse]")).to_have_count(2)
    await moved_together(page)
    await expect(dialog.locator(".leaflet-container")).to_be_visible()
    found = Accessibility(page)
    await found.look("two versions", ".dialog")
    await picture(page, "compared")
    await page.set_viewport_size({"width": 390, "height": 844})
    await found.look("two versions on a phone", ".dialog")
    found.assert_well()
    await page.keyboard.press("Escape")
    await expect(dialog).to_have_count(0)


async def moved_together(page: Page) -> None:
    """What is dragged in one diagram is dragged in the other."""
    read = """() => [...document.querySelectorAll('.cmp-sheet .viewport')].map((each) => {
      const { a, e, f } = each.getCTM();
      return [a, e, f].map((number) => Math.round(number * 100));
    })"""
    before = await page.evaluate(read)
    box = await page.get_by_role("region", name="Before").bounding_box()
    assert box is not None
    await page.mouse.move(box["x"] + 20, box["y"] + box["height"] - 20)
    await page.mouse.down()
    await page.mouse.move(box["x"] + 80, box["y"] + box["height"] - 50, steps=4)
    await page.mouse.up()
    after = await page.evaluate(read)
    assert after[0] != before[0]
    assert after[0] == after[1]


async def renamed(page: Page, name: str) -> None:
    await page.click("[data-element-id=Reverse]")
    await page.get_by_label("Name", exact=True).fill(name)
    await expect(page.locator(SAVED)).to_have_text("Not saved yet")


async def test_of_two_who_edit_each_sees_what_the_other_changed_and_loses_nothing(
    desk: Desk,
) -> None:
    page = await desk.edit()
    other = await desk.edit(page=await desk.another())
    await renamed(other, "THEIRS")
    await Drawing(other).save()
    await other.close()
    await renamed(page, "MINE")
    await page.get_by_role("button", name="Save", exact=True).click()
    desk.refusals.append(409)
    question = page.get_by_role("dialog", name="Another user changed this mission")
    await question.get_by_role("button", name="Compare mine with theirs").click()
    dialog = page.get_by_role("dialog", name="Compare versions")
    await expect(dialog).to_contain_text("name: THEIRS → MINE")
    await dialog.get_by_role("button", name="Close").click()
    await question.get_by_role("button", name="Take theirs").click()
    shown = page.locator("[data-element-id=Reverse]").first
    await expect(shown).to_contain_text("THEIRS")
    await page.get_by_role("note").get_by_role("button", name="Undo").click()
    await expect(shown).to_contain_text("MINE")
    await expect(page.locator(SAVED)).to_have_text("Not saved yet")
    await page.get_by_role("button", name="Save", exact=True).click()
    await expect(question).to_be_visible()  # it is still not theirs
