"""Drawing in the editor as people do: with the mouse and the keyboard alone."""

import asyncio
import re
from collections.abc import Awaitable, Callable
from contextlib import suppress
from dataclasses import dataclass

from playwright.async_api import Locator, Page, expect
from playwright.async_api import TimeoutError as PlaywrightTimeoutError

SAVED = ".m2-saved-state"
SELECTED = ".djs-element.selected[data-element-id]"
MENU = ".djs-popup"
WITHIN_S = 40.0
TRAP_MS = 500


async def new_mission(page: Page, name: str, template: str = "") -> "Drawing":
    """Begin a mission on the first page, with an empty page or a template."""
    await page.get_by_role("button", name="New mission").click()
    await page.get_by_label("Name").fill(name)
    if template:
        await page.get_by_role("radio", name=template).check()
    await page.get_by_role("button", name="Make it").click()
    await page.wait_for_selector(".djs-shape")
    return Drawing(page)


@dataclass(frozen=True, slots=True)
class Drawing:
    """The canvas of the editor and the form beside it. Elements are known by their ids."""

    page: Page

    def element(self, element: str) -> Locator:
        """What is drawn of an element, without its label."""
        return self.page.locator(f".djs-element[data-element-id='{element}']")

    async def centre(self, element: str) -> tuple[float, float]:
        """Of the element, on the screen."""
        box = await self.element(element).locator(".djs-hit").first.bounding_box()
        assert box
        return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    async def selected(self) -> str:
        """The one element that is selected."""
        await expect(self.page.locator(SELECTED)).to_have_count(1)
        found = await self.page.locator(SELECTED).get_attribute("data-element-id")
        assert found
        return found

    async def select(self, element: str) -> None:
        """Click an element, unless it is selected already: a second click would let go of it."""
        await self.click_until_selected(element, lambda: self.centre(element))

    async def select_flow(self, source: str, target: str) -> str:
        """Click the sequence flow between two elements, somewhere on its way."""
        flow = await self.flow(source, target)
        hit = self.element(flow).locator(".djs-hit").first
        await self.click_until_selected(flow, lambda: hit.evaluate(ON_LINE))
        return flow

    async def click_until_selected(
        self, element: str, place: Callable[[], Awaitable[tuple[float, float]]]
    ) -> None:
        """For a moment after something was dragged, diagram-js takes no click."""
        wanted = self.page.locator(f"{SELECTED}[data-element-id='{element}']")
        async with asyncio.timeout(WITHIN_S):
            while not await wanted.count():
                await self.page.mouse.click(*await place())
                with suppress(AssertionError):
                    await expect(wanted).to_have_count(1, timeout=TRAP_MS)
        await expect(self.page.locator(SELECTED)).to_have_count(1)

    async def flow(self, source: str, target: str) -> str:
        """The flow that begins at one element's symbol and ends at the other's."""
        ends = [await self.centre(source), await self.centre(target)]
        try:  # what was drawn just now may not be seen yet
            found = await self.page.wait_for_function(
                FLOW_BETWEEN, arg=ends, timeout=WITHIN_S * 1000
            )
        except PlaywrightTimeoutError:
            raise AssertionError(f"no flow leads from {source} to {target}") from None
        return str(await found.json_value())

    async def drag(self, element: str, x: float, y: float) -> None:
        """Move an element to a place on the screen, by the mouse."""
        await self.page.mouse.move(*await self.centre(element))
        await self.page.mouse.down()
        await self.page.mouse.move(x - 8, y - 8, steps=4)
        await self.page.mouse.move(x, y, steps=4)
        await self.page.mouse.up()

    async def append(self, source: str, word: str, name: str = "") -> str:
        """Append, by the menu at the element, what is called `word`; what was made."""
        await self.select(source)
        await self.page.click(".djs-context-pad [data-action=append]")
        await self.choose(word)
        return await self.named(name)

    async def append_by_key(self, source: str, word: str, name: str = "") -> str:
        """The same without the mouse: A, the word, Enter."""
        await self.select(source)
        await self.page.locator("svg[data-element-id]").first.focus()
        await self.page.keyboard.press("a")
        await self.choose(word)
        return await self.named(name)

    async def create(self, word: str, x: float, y: float, name: str = "") -> str:
        """Take something out of the create menu, and put it down somewhere."""
        await self.page.click(".djs-palette [data-action=create]")
        await self.choose(word)
        await self.put_down(x, y)
        return await self.named(name)

    async def palette(self, title: str, x: float, y: float, name: str = "") -> str:
        """Take one of the palette's symbols, and put it down somewhere."""
        await self.page.locator(".djs-palette").get_by_role("button", name=title).click()
        await self.put_down(x, y)
        return await self.named(name)

    async def block(self, title: str, x: float, y: float, name: str = "") -> str:
        """Drag a block of the library to a place."""
        block = self.page.get_by_role("button", name=title, exact=True).first
        await block.hover()
        await self.page.mouse.down()
        await self.page.mouse.move(x - 40, y - 40, steps=12)
        await expect(self.page.locator(".djs-drag-group .djs-dragger").first).to_be_attached()
        await self.page.mouse.move(x, y, steps=4)
        await self.page.mouse.up()
        return await self.named(name)

    async def choose(self, word: str) -> None:
        """Type a word into the open menu, and take what is called so."""
        await self.page.locator(f"{MENU}-search input").press_sequentially(word)
        entry = self.page.locator(f"{MENU} .entry", has_text=word).first
        await expect(entry).to_be_visible()
        await entry.click()
        await expect(self.page.locator(MENU)).to_have_count(0)

    async def close_menu(self) -> None:
        """Press Escape; a menu that has just been drawn does not listen yet."""
        menu = self.page.locator(MENU)
        async with asyncio.timeout(WITHIN_S):
            while await menu.count():
                await self.page.keyboard.press("Escape")
                with suppress(AssertionError):
                    await expect(menu).to_have_count(0, timeout=TRAP_MS)

    async def put_down(self, x: float, y: float) -> None:
        """Put down what hangs at the mouse."""
        await self.page.mouse.move(x - 8, y - 8, steps=3)
        await self.page.mouse.move(x, y, steps=3)
        await self.page.mouse.click(x, y)

    async def named(self, name: str) -> str:
        """Write a name over what was just made, where it stands; what that is."""
        made = await self.selected()
        await self.leave_label()
        if name:
            await self.fill("Name", name)
        return made

    async def fill(self, label: str, text: str) -> None:
        """Write into a field of the form, and leave it. The label may go on, with a unit say."""
        field = self.page.get_by_label(re.compile(rf"^{re.escape(label)}\b")).first
        await field.fill(text)
        await field.press("Tab")

    async def leave_label(self) -> None:
        """End the writing of a name on the canvas, if it has begun."""
        if await self.page.locator(".djs-direct-editing-content").count():
            await self.page.keyboard.press("Escape")

    async def who(self, resource: str) -> None:
        """Choose who does the behavior."""
        await self.page.get_by_label(re.compile(r"^Who\b")).first.select_option(resource)

    async def connect(self, source: str, target: str) -> str:
        """Draw a sequence flow from one element to another; the flow."""
        await self.select(source)
        await self.page.click(".djs-context-pad [data-action=connect]")
        x, y = await self.centre(target)
        await self.page.mouse.move(x - 8, y - 8, steps=3)
        await self.page.mouse.move(x, y, steps=3)
        # A click that comes before the editor knows where it is ends in nothing.
        await expect(self.element(target)).to_contain_class("connect-ok")
        await self.page.mouse.click(x, y)
        return await self.flow(source, target)

    async def bend(self, source: str, target: str, x: float, y: float, to_y: float) -> None:
        """Drag a piece of a flow, at a place, up or down."""
        await self.select_flow(source, target)
        await self.page.mouse.move(x, y)
        await self.page.mouse.down()
        await self.page.mouse.move(x, (y + to_y) / 2, steps=4)
        await self.page.mouse.move(x, to_y, steps=4)
        await self.page.mouse.up()

    async def condition(self, source: str, target: str, text: str, name: str = "") -> None:
        """Say when a flow is taken."""
        await self.select_flow(source, target)
        await self.fill("Taken when", text)
        if name:
            await self.fill("Name", name)

    async def save(self) -> None:
        """Save by the button, and see that it was."""
        await self.page.get_by_role("button", name="Save", exact=True).click()
        await expect(self.page.locator(SAVED)).to_have_text("Saved")


# A quarter of the way along a line: in the middle, a label may lie on it.
ON_LINE = """(line) => {
  const length = line.getTotalLength();
  const at = line.getPointAtLength(length / 4).matrixTransform(line.getScreenCTM());
  return [at.x, at.y];
}"""

FLOW_BETWEEN = """([source, target]) => {
  const near = (line, length, [x, y]) => {
    const at = line.getPointAtLength(length).matrixTransform(line.getScreenCTM());
    return Math.abs(at.x - x) <= 60 && Math.abs(at.y - y) <= 60;
  };
  for (const flow of document.querySelectorAll(".djs-connection[data-element-id]")) {
    const line = flow.querySelector(".djs-hit");
    if (near(line, 0, source) && near(line, line.getTotalLength(), target)) {
      return flow.dataset.elementId;
    }
  }
  return null;
}"""
