"""The way of docs/tutorials/first-mission.md: two fields, two copters, a detection, a question.

Its author knows no BPMN, and uses only what the page itself says.
"""

import re
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest
from m2pem_plugin_web.access.roles import Role
from m2pem_plugin_web.access.users import User, write_users
from playwright.async_api import Browser, Locator, Page, expect
from web_desk import IN_ONE_LOOP, Desk, signed_in
from web_pictures import picture
from web_served import REPOSITORY, Served, served
from web_world import HASHED

pytestmark = IN_ONE_LOOP

TUTORIAL = REPOSITORY / "docs" / "tutorials" / "survey"
MOST_CLICKS = 59
PEOPLE = {"anna": Role.COMMANDER, "otto": Role.OPERATOR}
WORDS = ("--simulate", "--speed", "3", "--journal", "memory:")
"""Slow enough for the other copter to be handed over while the survey in the west goes on."""

FLIGHT_MS = 120_000
"""For what takes a minute where nothing else is done."""

COUNT_PRESSES = """addEventListener("pointerdown", (event) => {
  if (event.isTrusted) sessionStorage.presses = 1 + Number(sessionStorage.presses ?? 0);
}, { capture: true })"""

WEST = ((-125, 85), (-125, -85), (-12, -85), (-12, 85))
EAST = ((12, 85), (12, -85), (125, -85), (125, 85))
"""Corners of the fields: metres to the east and to the north of the middle of the farm."""


@dataclass(slots=True)
class Author:
    """Who draws. `lists`: how often something was chosen from one, for which a person clicks twice
    and the test not at all."""

    page: Page
    lists: int = 0

    async def clicks(self) -> int:
        """How often the page was clicked."""
        counted = await self.page.evaluate("Number(sessionStorage.presses ?? 0)")
        return int(counted) + 2 * self.lists

    async def click(self, what: Locator) -> None:
        await what.click()

    async def element(self, name: str) -> None:
        """Click what is called so on the diagram."""
        words = re.sub(r"\s", "", name)
        for each in await self.page.locator(".djs-shape[data-element-id]").all():
            if words in re.sub(r"\s", "", await each.text_content() or ""):
                return await self.click(each.locator(".djs-hit").first)
        raise AssertionError(f"nothing is called {name}")

    async def block(self, title: str) -> None:
        blocks = self.page.get_by_role("region", name="Blocks")
        await self.click(blocks.get_by_role("button", name=title, exact=True).first)

    async def write(self, label: str, text: str) -> None:
        field = self.page.get_by_label(re.compile(rf"^{re.escape(label)}\b")).first
        await self.click(field)
        await field.fill(text)
        await field.press("Tab")

    async def who(self, vehicle: str) -> None:
        await self.page.get_by_label(re.compile(r"^Who\b")).first.select_option(vehicle)
        self.lists += 1

    async def survey(self, corners: tuple[tuple[int, int], ...], vehicle: str) -> None:
        """Survey what is drawn on the map, on the farm that is seen there."""
        await self.block("Area survey")
        await self.who(vehicle)
        await self.click(self.page.get_by_role("button", name="Pick on the map").first)
        plan = self.page.get_by_role("region", name="Map", exact=True)
        await self.click(plan.get_by_role("button", name="Area", exact=True))
        scale = plan.locator(".leaflet-control-scale-line").first
        metres = int((await scale.inner_text()).removesuffix(" m"))
        bar = await scale.bounding_box()
        farm = await plan.locator(".map-name", has_text=re.compile("^farm$")).bounding_box()
        assert bar
        assert farm
        pixels = bar["width"] / metres
        x, y = farm["x"] + farm["width"] / 2, farm["y"] + farm["height"] / 2
        for east_m, north_m in (*corners, corners[0]):
            await self.page.mouse.click(x + east_m * pixels, y - north_m * pixels)

    async def picture(self, name: str) -> None:
        await picture(self.page, f"first_{name}")


@asynccontextmanager
async def author(chromium: Browser, executive: Served) -> AsyncIterator[Author]:
    """Anna, at the first page."""
    async with signed_in(chromium, executive, "anna", width=1440, height=900) as anna:
        await anna.page.goto(executive.origin)
        await expect(anna.page.locator(".link-open")).to_have_count(1)
        await anna.page.evaluate(COUNT_PRESSES)
        yield Author(anna.page)
        anna.assert_well()


@asynccontextmanager
async def tutorial(folder: Path) -> AsyncIterator[Served]:
    """The executive of the tutorial, with two operators."""
    users = folder / "users.json"
    write_users(users, {name: User(role, HASHED()) for name, role in PEOPLE.items()})
    environment = {"M2PEM_WEB_USERS": str(users)}
    fleet = TUTORIAL / "fleet.yaml"
    with served(folder, fleet=fleet, words=WORDS, environment=environment) as executive:
        yield executive


@pytest.mark.long
async def test_a_survey_of_drawn_fields_lives_its_whole_life_with_few_clicks(
    chromium: Browser, tmp_path: Path
) -> None:
    async with (
        tutorial(tmp_path) as executive,
        author(chromium, executive) as anna,
        signed_in(chromium, executive, "otto") as otto,
    ):
        await draw(anna)
        await verify_and_rehearse(anna)
        await run(anna, otto)
        await replay(anna)
        clicks = await anna.clicks()
    assert clicks <= MOST_CLICKS
    assert f"{clicks} clicks" in (TUTORIAL.parent / "first-mission.md").read_text(encoding="utf-8")


async def draw(author: Author) -> None:
    page = author.page
    await author.click(page.get_by_role("button", name="New mission"))
    await page.get_by_label("Name").fill("fields")
    await author.click(page.get_by_role("button", name="Make it"))
    await page.wait_for_selector(".djs-shape")
    await author.click(page.locator("[data-element-id=Start] .djs-hit").first)
    await author.click(page.locator(".djs-context-pad [title='Append end event']"))
    await page.keyboard.press("Escape")
    await author.click(page.locator("[data-element-id=Start] .djs-hit").first)
    await author.block("At the same time")
    await author.survey(WEST, "uav1")
    await author.picture("branches")
    await author.element("Choose what is done at the same time")
    await author.block("When something is detected, stop")
    await author.survey(EAST, "uav2")
    await author.picture("map")
    await author.element("Choose what is done then")
    await author.block("Hold")
    await author.who("uav2")
    await author.block("Ask and decide")
    await author.element("Ask the operator")
    await author.write("Question", "A person is there. Go home?")
    await author.element("Choose what is done then")
    await author.block("Return to launch")
    await author.who("uav2")
    await author.click(page.get_by_role("button", name="Map", exact=True))
    await expect(page.get_by_role("region", name="Map", exact=True)).to_have_count(0)
    await author.picture("drawn")


async def verify_and_rehearse(author: Author) -> None:
    page = author.page
    await author.click(page.get_by_role("tab", name=re.compile("Problems")))
    await expect(page.get_by_text("No problems found.")).to_be_visible()
    await author.click(page.get_by_role("tab", name=re.compile("Verify")))
    await author.click(page.get_by_role("button", name="Verify", exact=True))
    await expect(page.get_by_role("region", name="Report")).to_contain_text("Everything holds")
    await author.picture("verified")
    await author.click(page.get_by_role("tab", name="Run", exact=True))
    await author.click(page.get_by_role("button", name="Rehearse", exact=True))
    outcome = page.get_by_role("region", name="What came of it")
    await expect(outcome.get_by_role("heading", level=2)).to_contain_text("ompleted")
    await expect(outcome).to_contain_text("the first answer was taken")
    await author.picture("rehearsed")


async def run(author: Author, otto: Desk) -> None:
    """The question is answered, and the copter that is home is handed over to Otto, who asks."""
    page = author.page
    await author.click(page.get_by_role("button", name="Start", exact=True))
    await page.wait_for_url("**/runs/*")
    await otto.page.goto(page.url)
    go_on = page.get_by_role("button", name=re.compile("Continue")).first
    await expect(go_on).to_be_enabled(timeout=FLIGHT_MS)
    await author.picture("question")
    await author.click(go_on)
    log = page.get_by_role("region", name="Events")
    await expect(log).to_contain_text("uav2 ends return_to_launch: succeeded", timeout=FLIGHT_MS)
    card = page.locator(".card", has_text="uav2")
    await author.click(card.get_by_role("button", name="Take over", exact=True))
    await expect(card.get_by_role("button", name="Give back", exact=True)).to_be_visible()
    theirs = otto.page.locator(".card", has_text="uav2")
    await theirs.get_by_role("button", name="Ask for it", exact=True).click()
    await expect(page.get_by_text("otto asks you for uav2.")).to_be_visible()
    await author.picture("asked")
    await author.click(page.get_by_role("button", name="Give it", exact=True))
    await expect(card).to_contain_text("with otto")


async def replay(author: Author) -> None:
    page = author.page
    ended = page.get_by_role("dialog", name="The run has ended")
    await expect(ended).to_contain_text("Completed", timeout=FLIGHT_MS)
    await author.picture("ended")
    await author.click(ended.get_by_role("button", name="Replay it"))
    position = page.get_by_label("Position")
    await expect(position).to_have_attribute("aria-valuetext", "0:00.0")
    await author.click(page.get_by_role("button", name="Play", exact=True))
    await expect(position).not_to_have_attribute("aria-valuetext", "0:00.0")
    await position.fill("60")
    await expect(position).to_have_attribute("aria-valuetext", re.compile(r"^1:"))
    log = page.get_by_role("region", name="Events")
    await expect(log).to_contain_text("uav2 begins return_to_launch")
    await author.picture("replayed")
