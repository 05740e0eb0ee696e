"""What is seen of a run on the page of operators."""

import shutil
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import TypeAlias

from playwright.async_api import Locator, Page, expect
from playwright.async_api import TimeoutError as PlaywrightTimeoutError
from web_served import FLEET

GREEN = (61, 224, 88)
GRAY = (218, 222, 225)
AMBER = (255, 184, 46)
NEAR = 24
WITHIN_S = 30.0
# A place on route_alpha where a mine lies.
MINE = [38.10804, -77.317714]

# The diagram is coloured on a canvas that lies over it.
COLOUR = """([name]) => {
  for (const drawing of document.querySelectorAll(".drawing:not([hidden])")) {
    const canvas = drawing.querySelector("canvas.glow");
    for (const element of drawing.querySelectorAll(".djs-shape")) {
      const text = [...element.querySelectorAll("tspan")].map((part) => part.textContent);
      const said = text.join(" ").replace(/\\s+/g, " ").trim();
      if (said !== name && element.dataset.elementId !== name) continue;
      const shape = element.querySelector(".djs-visual > *").getBoundingClientRect();
      const { left, top } = canvas.getBoundingClientRect();
      const x = (shape.left + shape.width / 2 - left) * devicePixelRatio;
      const y = (shape.top + shape.height * 0.75 - top) * devicePixelRatio;
      return [...canvas.getContext("2d").getImageData(x, y, 1, 1).data].slice(0, 3);
    }
  }
  return null;
}"""

IS_NEAR = f"""([name, wanted, near]) => {{
  const found = ({COLOUR})([name]);
  return found !== null && found.every((each, index) => Math.abs(each - wanted[index]) <= near);
}}"""


def fleet_with_mine(folder: Path) -> Path:
    """The fleet of VIGNETTE1; evsg1's radar finds something when it drives along route_alpha."""
    made = folder / "fleet"
    shutil.copytree(FLEET.parent, made)
    path = made / FLEET.name
    plain = "gpr: {connection: {kind: gpr}, detector: true}"
    planted = f"targets: [{{type: gpr, position: {MINE}}}]"
    text = path.read_text(encoding="utf-8")
    assert plain in text
    path.write_text(text.replace("{kind: gpr}", f"{{kind: gpr, {planted}}}"), encoding="utf-8")
    return path


Colour: TypeAlias = tuple[int, int, int]


async def wait_for_colour(page: Page, element: str, wanted: Colour) -> None:
    """Until an element, known by its name or id, is drawn in a colour."""
    try:
        await page.wait_for_function(
            IS_NEAR, arg=[element, wanted, NEAR], polling=50, timeout=WITHIN_S * 1000
        )
    except PlaywrightTimeoutError:
        found = await page.evaluate(COLOUR, [element])
        raise AssertionError(f"{element} is {found}, not {wanted}") from None


def is_near(found: list[int] | None, wanted: Colour) -> bool:
    return found is not None and all(abs(a - b) <= NEAR for a, b in zip(found, wanted, strict=True))


def answer(page: Page, label: str) -> Locator:
    """The button of the question that stands, with one of its answers."""
    return page.get_by_role("alertdialog").locator("button[aria-keyshortcuts]", has_text=label)


async def wait_for_status(page: Page, wanted: str) -> None:
    """Until the run is in a status."""
    await expect(page.locator(".run-bar .status")).to_have_text(wanted, timeout=WITHIN_S * 1000)


async def press_twice(page: Page, press: Callable[[], Awaitable[None]]) -> None:
    """Press STOP as people do: a double click is not two decisions, so not too fast."""
    await press()
    await expect(page.locator("header button.stop")).to_have_text("Again to STOP")
    await page.wait_for_function(
        "begun => performance.now() - begun > 300", arg=await page.evaluate("performance.now()")
    )
    await press()
