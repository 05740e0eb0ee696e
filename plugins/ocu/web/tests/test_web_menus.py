"""Every menu of the editor opens with its entries, on every kind of element."""

import pytest
from playwright.async_api import Page, expect
from web_desk import IN_ONE_LOOP, Desk
from web_drawing import MENU, Drawing

pytestmark = IN_ONE_LOOP

# By element: how many entries the menus have at least, 0 where there is none; and the context pad.
APPEND = 70
REPLACE_TASK = 40
KINDS = {
    "StartVignette1": (APPEND, 4),
    "UserSendRoute": (APPEND, REPLACE_TASK),
    "Reverse": (APPEND, REPLACE_TASK),
    "Detector": (APPEND, REPLACE_TASK),
    "CallDetection": (APPEND, REPLACE_TASK),
    "GatewayDecision": (APPEND, 3),
    "ForkDetection": (APPEND, 3),
    "EscalationDetected": (APPEND, 8),
    "ThrowStop": (APPEND, 8),
    "EndMission": (0, 5),
    "RoutePromptReference": (0, 1),
    "PoolVignette1": (0, 1),
}
BLOCKS = {"Operator": 1, "Ground vehicles": 13, "Aircraft": 15}
BLOCKS |= {"Payloads": 7, "Teams": 7, "Services": 1}
PALETTE = 15
TWO_FRAMES = "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"


@pytest.mark.long
async def test_every_menu_has_its_entries_on_every_kind_of_element(desk: Desk) -> None:
    page = await desk.edit()
    drawing = Drawing(page)
    wrong = []
    for element, (append, replace) in KINDS.items():
        await drawing.select(element)
        found = (await entries(page, "append"), await entries(page, "replace"))
        if not (found[0] >= append and found[1] >= replace and bool(found[0]) == bool(append)):
            wrong.append(f"{element}: {found}, not {(append, replace)} or more")
    assert not wrong, "\n".join(wrong)
    await look_at_flow(drawing)
    await look_at_palette_and_blocks(page)


async def test_a_menu_opens_at_once_after_something_was_typed(desk: Desk) -> None:
    page = await desk.edit()
    drawing = Drawing(page)
    await drawing.select("Reverse")
    box = await page.locator(".djs-context-pad [data-action=append]").bounding_box()
    assert box
    for name in ("Back", "Back off"):
        await page.get_by_label("Name", exact=True).fill(name)
        await page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        await page.evaluate(TWO_FRAMES)  # nobody clicks sooner than the page is painted
        await page.mouse.down()
        await page.mouse.up()
        await expect(page.locator(MENU)).to_be_visible()
        await drawing.close_menu()
    await expect(drawing.element("Reverse")).to_contain_text("Back off")


async def entries(page: Page, menu: str) -> int:
    """How many a menu of the context pad has; 0: there is no such menu."""
    opener = page.locator(f".djs-context-pad [data-action={menu}]")
    await expect(page.locator(".djs-context-pad [data-action=delete]")).to_be_visible()
    if not await opener.count():
        return 0
    await opener.click()
    await expect(page.locator(f"{MENU} .entry").first).to_be_visible()
    found = await page.locator(f"{MENU} .entry").count()
    await Drawing(page).close_menu()
    return found


async def look_at_flow(drawing: Drawing) -> None:
    await drawing.select_flow("GatewayDecision", "CallDetection")
    assert await entries(drawing.page, "replace") >= 1


async def look_at_palette_and_blocks(page: Page) -> None:
    await expect(page.locator(".djs-palette .entry")).to_have_count(PALETTE)
    await page.click(".djs-palette [data-action=create]")
    await expect(page.locator(f"{MENU} .entry", has_text="Bridge crossing")).to_have_count(1)
    assert await page.locator(f"{MENU} .entry").count() > 80
    await page.locator(f"{MENU}-search input").press_sequentially("orbit")
    await expect(page.locator(f"{MENU} .entry").first).to_have_text("Orbit")
    await Drawing(page).close_menu()
    blocks = page.get_by_role("region", name="Blocks")
    for group, count in BLOCKS.items():
        part = blocks.locator("details", has=page.get_by_text(group, exact=True))
        await expect(part.get_by_role("button")).to_have_count(count)
    await blocks.get_by_role("searchbox").fill("route")
    found = blocks.get_by_role("button", name="Single vehicle routing")
    await expect(found).to_have_count(2)  # of ground vehicles, and of aircraft
    await expect(blocks.get_by_role("button", name="Zoom")).to_have_count(0)
