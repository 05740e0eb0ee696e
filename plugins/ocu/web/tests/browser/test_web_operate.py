"""The operator page in a real browser: questions, STOP, colours, drawing, and runs of the past."""

import asyncio
import re
from collections.abc import AsyncIterator

import pytest
from browser_world import WITHIN_MS, WITHIN_S, Browsing
from playwright.async_api import Locator, Page, WebSocketRoute, expect

expect.set_options(timeout=WITHIN_MS)

RUN = "/api/runs"
COLOUR = """(id) => {
  const shape = `.drawing:not([hidden]) [data-element-id="${id}"] .djs-visual > :first-child`;
  const element = document.querySelector(shape);
  const canvas = document.querySelector(".drawing:not([hidden]) .glow");
  const box = element.getBoundingClientRect();
  const around = canvas.getBoundingClientRect();
  const ratio = canvas.width / around.width;
  const x = (box.x + box.width * 0.25 - around.x) * ratio;
  const y = (box.y + box.height * 0.75 - around.y) * ratio;
  return [...canvas.getContext("2d").getImageData(x, y, 1, 1).data];
}"""


async def ask(page: Page, method: str, path: str, body: object = None) -> object:
    """What the server answers a request of the page."""
    return await page.evaluate(
        """async ([method, path, body]) => {
          const headers = { "Content-Type": "application/json" };
          const init = body === null ? {} : { body: JSON.stringify(body) };
          const response = await fetch(path, { method, headers, ...init });
          if (!response.ok) throw new Error(await response.text());
          return response.status === 204 ? null : await response.json();
        }""",
        [method, path, body],
    )


async def start(browsing: Browsing, page: Page | None = None) -> Page:
    """A page that shows a new run of vignette 1, which asks its first question."""
    page = page or await browsing.begin()
    started = await ask(page, "POST", RUN, {"mission": "vignette1"})
    assert isinstance(started, dict)
    await page.goto(f"{browsing.served.base}/runs/{started['run']}")
    await expect(page.get_by_role("alertdialog")).to_be_focused()
    await page.wait_for_selector(".glow")
    return page


@pytest.fixture(autouse=True)
async def released(browsing: Browsing) -> AsyncIterator[None]:
    """Others shall find no run, and all vehicles free."""
    yield
    page = await browsing.begin()
    await ask(page, "POST", "/api/stop", {"reason": "the test is over"})
    async with asyncio.timeout(WITHIN_S):
        while True:
            answer = await ask(page, "GET", "/api/resources")
            assert isinstance(answer, dict)
            if not any(answer["holders"].values()):
                break
            await asyncio.sleep(0.1)


def active(page: Page, name: str) -> Locator:
    """An element of the tree that says it is active."""
    return page.get_by_role("treeitem", name=re.compile(f"^{name}, .*, active"))


async def test_a_run_is_steered_by_keyboard_alone(browsing: Browsing) -> None:
    page = await start(browsing)
    first = page.get_by_role("alertdialog").get_by_role("button", name="Continue")
    await expect(first).to_be_enabled()
    await page.keyboard.press("1")
    await expect(page.get_by_role("alertdialog")).to_have_count(0)
    await expect(active(page, "DRIVE ROUTE")).to_have_count(1)
    await page.get_by_role("button", name="Pause").press("Enter")
    await expect(page.locator(".run-bar .status")).to_have_text("Paused")
    await page.get_by_role("button", name="Resume").press("Enter")
    await expect(page.locator(".run-bar .status")).to_have_text("Running")
    await page.keyboard.press("Shift+Escape")
    stop = page.get_by_role("button", name="Again to STOP")
    await expect(stop).to_be_visible()
    await page.wait_for_timeout(300)
    await page.keyboard.press("Shift+Escape")
    await expect(page.get_by_role("dialog", name="The run has ended")).to_contain_text("Stopped")


async def test_one_press_of_stop_stops_nothing_and_works_over_a_dialog(browsing: Browsing) -> None:
    page = await start(browsing)
    await page.get_by_role("button", name="Signal…").click()
    await expect(page.get_by_role("dialog", name="Send a signal")).to_be_visible()
    stop = page.locator(".stop-all")
    await stop.click()
    await expect(stop).to_have_text("Again to STOP")
    await expect(stop).to_have_text("STOP", timeout=6000)
    await expect(page.locator(".run-bar .status")).to_have_text("Running")
    await stop.click()
    await page.wait_for_timeout(300)
    await stop.click()
    await expect(page.locator(".run-bar .status")).to_have_text("Stopped")


async def test_holding_stop_stops(browsing: Browsing) -> None:
    page = await start(browsing)
    await page.locator(".stop-all").click(delay=1300)
    await expect(page.locator(".run-bar .status")).to_have_text("Stopped")


async def test_active_elements_are_green_and_those_that_ask_are_amber(browsing: Browsing) -> None:
    page = await start(browsing)
    asks = page.locator("[data-element-id=UserSendRoute]")
    await expect(asks).to_have_class(re.compile("m2-asking"))
    red, green, blue, _ = await page.evaluate(COLOUR, "UserSendRoute")
    assert red > 200 and 150 < green < 220 and blue < 100
    await page.get_by_role("alertdialog").get_by_role("button", name="Continue").click()
    await expect(page.locator("[data-element-id=DriveRoute]")).to_have_class(
        re.compile("m2-active")
    )
    await expect(asks).to_have_class(re.compile("m2-done"))
    red, green, blue, _ = await page.evaluate(COLOUR, "DriveRoute")
    assert green > 200 and red < 120 and blue < 120
    await page.get_by_label("Fade").select_option("0")
    await page.wait_for_function(
        f"() => {{ const [r, , b] = ({COLOUR})('UserSendRoute'); return r > 200 && b > 200; }}"
    )


async def test_a_route_is_drawn_with_the_keyboard(browsing: Browsing) -> None:
    page = await start(browsing)
    await page.get_by_role("button", name="Draw").press("Enter")
    await page.get_by_role("menuitem", name="New route").press("Enter")
    await page.get_by_role("textbox", name="Name").fill("detour")
    save = page.get_by_role("button", name="Save", exact=True)
    add = page.get_by_role("button", name="Add map centre")
    await add.press("Enter")
    await expect(save).to_be_disabled()
    await add.press("Enter")
    latitude = page.get_by_label("Vertex 2: Latitude °")
    await latitude.fill("38.1085")
    await latitude.press("Tab")
    await page.get_by_label("Vertex 2: Altitude m").fill("70")
    await save.press("Enter")
    await expect(page.get_by_text("detour can be used in the mission now.")).to_be_visible()
    geometries = await ask(page, "GET", "/api/geometries")
    assert isinstance(geometries, list)
    drawn = next(each for each in geometries if each["name"] == "detour")
    assert drawn["geometry"]["type"] == "LineString"
    assert drawn["geometry"]["coordinates"][1][1:] == [38.1085, 70]


async def test_a_vehicle_is_taken_and_given_back(browsing: Browsing) -> None:
    page = await start(browsing)
    card = page.locator(".card", has_text="evsg2")
    await card.get_by_role("button", name="Take over").click()
    await expect(card).to_contain_text("with ")
    await card.get_by_role("button", name="Give back").click()
    await expect(card.get_by_role("button", name="Take over")).to_be_visible()


async def test_a_run_of_the_past_is_replayed(browsing: Browsing) -> None:
    page = await start(browsing)
    await page.get_by_role("alertdialog").get_by_role("button", name="Abort").click()
    ended = page.get_by_role("dialog", name="The run has ended")
    await expect(ended).to_contain_text("abort")
    await ended.get_by_role("button", name="Replay it").click()
    await page.get_by_role("button", name="To the start").click()
    await expect(page.locator("[data-element-id=UserSendRoute]")).to_have_class(
        re.compile("m2-asking")
    )
    await page.get_by_role("button", name="To the end").click()
    await expect(page.locator(".run-bar .status")).to_have_text("Terminated")
    asked = page.locator("[data-element-id=UserSendRoute]")
    await expect(asked).to_have_class(re.compile("m2-done"))
    back = page.get_by_role("button", name="Previous event")
    for _ in range(3):
        await back.click()
    await expect(page.locator(".run-bar .status")).to_have_text("Running")
    # The address leads to the same moment.
    await page.reload()
    await expect(page.get_by_role("slider", name="Position")).to_be_visible()


async def test_a_rehearsal_shows_vehicles_on_the_way(browsing: Browsing) -> None:
    page = await browsing.begin()
    asked = await ask(page, "POST", "/api/rehearsals", {"mission": "vignette1"})
    assert isinstance(asked, dict)
    await page.goto(f"{browsing.served.base}/rehearsals/{asked['id']}")
    card = page.locator(".card", has_text="evsg1")
    await expect(card).to_contain_text("DRIVE ROUTE")
    await page.get_by_role("button", name="Play", exact=True).click()
    await expect(card).to_contain_text(re.compile(r"[1-9]\.\d m/s"))
    await page.get_by_role("button", name="Pause", exact=True).click()
    await expect(page.locator(".vehicle")).not_to_have_count(0)


async def test_the_page_finds_back_after_the_connection_broke(browsing: Browsing) -> None:
    page = await browsing.begin()
    lines: list[WebSocketRoute] = []

    def pass_on(line: WebSocketRoute) -> None:
        lines.append(line)
        line.connect_to_server()

    await page.route_web_socket(re.compile("/api/live"), pass_on)
    await start(browsing, page)
    before = len(lines)
    await lines[-1].close(code=1011)
    await expect(page.get_by_role("alert").filter(has_text="Not connected")).to_be_visible()
    await expect(page.get_by_role("alert").filter(has_text="Not connected")).to_have_count(0)
    assert len(lines) == before + 1
    await page.get_by_role("alertdialog").get_by_role("button", name="Continue").click()
    await expect(active(page, "DRIVE ROUTE")).to_have_count(1)
