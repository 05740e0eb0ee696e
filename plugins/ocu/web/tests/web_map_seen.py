"""What a map shows: its list of vehicles, which screen readers read, and its picture of them."""

from typing import cast

from playwright.async_api import Locator, Page

LOST = "179,38,30"
"""The colour of vehicles that are lost, in the light theme."""

COLOURS = """canvas => {
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  const found = new Set();
  for (let at = 0; at < data.length; at += 4) {
    if (data[at + 3] === 255) found.add(data.slice(at, at + 3).join());
  }
  return [...found];
}"""

MIDDLE = """canvas => {
  const { data, width, height } = canvas.getContext("2d").getImageData(
    0, 0, canvas.width, canvas.height);
  let [count, x, y] = [0, 0, 0];
  for (let at = 0; at < width * height; at += 1) {
    if (data[4 * at + 3] === 0) continue;
    count += 1;
    x += at % width;
    y += Math.floor(at / width);
  }
  const { left, top } = canvas.getBoundingClientRect();
  const ratio = window.devicePixelRatio;
  return [left + x / count / ratio, top + y / count / ratio];
}"""


def vehicles_on(there: Page | Locator) -> Locator:
    """The vehicles that a map lists, each with how it is and where."""
    listed = there.get_by_role("list", name="Vehicles on the map")
    return listed.get_by_role("listitem")


async def colours(page: Page) -> list[str]:
    """Of all that is drawn of vehicles: red, green and blue, from 0 to 255."""
    return cast(list[str], await page.locator(".vehicle-canvas").evaluate(COLOURS))


async def middle_drawn(page: Page) -> tuple[float, float]:
    """The middle of all that is drawn of vehicles, in pixels of the page."""
    x, y = await page.locator(".vehicle-canvas").evaluate(MIDDLE)
    return x, y
