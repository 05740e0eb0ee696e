"""The way of docs/tutorials/first-mission.md: two fields, two copters, a detection, a question.

Its author knows no BPMN, and uses only what the page itself says.
"""

import os
import re
from dataclasses import dataclass
from pathlib import Path

import pytest
from playwright.async_api import Browser, Locator, Page, expect
from web_browsing import page_at
from web_desk import IN_ONE_LOOP
from web_served import REPOSITORY, served

pytestmark = IN_ONE_LOOP

TUTORIAL = REPOSITORY / "docs" / "tutorials" / "survey"
MOST_CLICKS = 40  # the page says 35


@dataclass(slots=True)
class Author:
    """Somebody with a mouse and a keyboard. `clicks`: what was clicked so far."""

    page: Page
    clicks: int = 0

    async def click(self, what: Locator) -> None:
        await what.click()
        self.clicks += 1

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
        field = self.page.get_by_label(re.compile(r"^Who\b")).first
        await field.select_option(vehicle)
        self.clicks += 2  # the list, and what is chosen from it

    async def survey(self, area: str, vehicle: str) -> None:
        await self.block("Area survey")
        await self.write("Area", area)
        await self.who(vehicle)

    async def picture(self, name: str) -> None:
        if os.environ.get("M2PEM_PICTURES"):
            images = REPOSITORY / "docs" / "images"
            await self.page.mouse.move(0, 0)
            await self.page.screenshot(path=images / f"web_first_{name}.png", animations="disabled")


@pytest.mark.long
async def test_a_survey_with_a_detection_and_a_question_is_drawn_with_few_clicks(
    chromium: Browser, tmp_path: Path
) -> None:
    words = ("--simulate", "--speed", "50", "--journal", "memory:")
    with served(tmp_path, fleet=TUTORIAL / "fleet.yaml", words=words) as executive:
        async with page_at(chromium, executive.url) as it:
            author = Author(it.page)
            await draw(author)
            await verify_and_rehearse(author)
            await run(author)
            assert author.clicks <= MOST_CLICKS
            it.assert_well()


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
    await author.survey("field_west", "uav1")
    await author.picture("branches")
    await author.element("Choose what is done at the same time")
    await author.block("When something is detected, stop")
    await author.survey("field_east", "uav2")
    await author.element("Choose what is done then")
    await author.block("Hold")
    await author.who("uav2")
    await author.block("Ask and decide")
    await author.element("Ask the operator")
    await author.write("Question", "A person is there. Go home?")
    await author.element("Choose what is done then")
    await author.block("Return to launch")
    await author.who("uav2")
    await author.click(page.get_by_role("button", name=re.compile("Fit to the window")))
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


async def run(author: Author) -> None:
    page = author.page
    await author.click(page.get_by_role("button", name="Start", exact=True))
    await page.wait_for_url("**/runs/*")
    go_on = page.get_by_role("button", name=re.compile("Continue")).first
    await expect(go_on).to_be_visible()
    await author.picture("question")
    await author.click(go_on)
    await expect(page.get_by_text(re.compile("Completed", re.I)).first).to_be_visible()
    await author.picture("ended")
