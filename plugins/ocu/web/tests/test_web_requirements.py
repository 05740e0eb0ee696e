"""Operators see which requirements a run has violated: as it goes on, and at each moment after."""

import os
from pathlib import Path

from playwright.async_api import Locator, Page, expect
from web_axe import Accessibility
from web_desk import IN_ONE_LOOP, Desk, element
from web_pictures import picture
from web_running import answer

from m2pem.testing import scenarios

pytestmark = IN_ONE_LOOP

REQUIREMENTS = """<extensionElements>
  <m2pem:requirement id="both-first" ltl="[] !(completed(Question1) &amp;&amp; active(Question2))"
                     onViolation="signal:Unheeded"/>
  <m2pem:requirement id="never"
                     ltl="[] !(once(completed(Question1)) &amp;&amp; active(Question2))"/>
  <m2pem:requirement id="asked" ltl="&lt;&gt; completed(Question1)"/>
  <m2pem:requirement id="ends" ltl="&lt;&gt; ended(completed)"/>
  <m2pem:requirement id="unmonitored" monitor="false" ltl="[] !completed(Question1)"/>
</extensionElements>"""
BEGIN = b'isExecutable="true">'
SIGNAL = b'<signal id="Unheeded" name="Unheeded"/><process id="SCENARIO"'
MISSION = (
    scenarios.two_questions()
    .replace(BEGIN, BEGIN + REQUIREMENTS.encode())
    .replace(b'<process id="SCENARIO"', SIGNAL)
)
VIOLATED = "2 requirements violated"


async def begin(desk: Desk) -> str:
    """A run that asks both questions; its page."""
    (desk.executive.missions / "required.bpmn").write_bytes(MISSION)
    run = str((await desk.ask("POST", "/api/runs", {"mission": "required"}))["run"])
    await desk.page.goto(f"{desk.executive.origin}/runs/{run}")
    await expect(element(desk.page, "Question1")).to_contain_class("m2-asking")
    return run


def verdict(page: Page, name: str) -> Locator:
    """What the panel says of a requirement."""
    return page.locator(".verdict").filter(has=page.get_by_text(name, exact=True))


async def look_at(page: Page, name: str) -> None:
    """A picture for those who change the page."""
    if folder := os.environ.get("M2PEM_LOOK"):
        await page.screenshot(path=Path(folder) / f"{name}.png", animations="disabled")


async def test_a_violation_is_seen_at_once_and_at_each_moment_of_the_replay(desk: Desk) -> None:
    page = desk.page
    await page.set_viewport_size({"width": 1440, "height": 960})
    run = await begin(desk)
    tab = page.get_by_role("tab", name="Requirements")
    await tab.click()
    entries = page.locator(".verdict")
    await expect(entries).to_have_count(4)
    for name in ("both-first", "never", "asked", "ends"):
        await expect(verdict(page, name)).to_contain_text("open")
    await page.get_by_role("tab", name="Events").click()
    badge = page.get_by_role("button", name=VIOLATED)
    await expect(badge).to_have_count(0)

    await answer(page, "yes").first.click()
    await expect(badge).to_be_visible()
    await expect(tab).to_contain_text("2 violated")
    question = element(page, "Question2")
    named = "violates requirement both-first, never"
    await expect(question.locator(".m2-badge-requirement")).to_have_text("!")
    await expect(page.get_by_role("treeitem", name=named).first).to_be_visible()
    await badge.click()
    await expect(verdict(page, "never")).to_contain_text("violated since")
    await expect(verdict(page, "never")).to_contain_text("What made it certain")
    await expect(verdict(page, "both-first")).to_contain_text("throws signal Unheeded")
    await expect(verdict(page, "asked")).to_contain_text("satisfied since")
    await expect(verdict(page, "ends")).to_contain_text("open")
    await expect(entries.first).to_contain_text("violated")
    # By keyboard: the requirement shows its first element.
    head = verdict(page, "never").locator("button.verdict-head")
    await head.focus()
    await page.keyboard.press("Enter")
    await expect(page.get_by_role("treeitem", selected=True)).to_contain_text("Question1")
    await verdict(page, "never").get_by_text("Formula").click()
    await expect(verdict(page, "never").locator("code")).to_contain_text("once")
    eyes = Accessibility(page)
    await eyes.look("requirements", ".requirements-pane")
    await eyes.look("the run bar", ".run-bar")
    eyes.assert_well()
    faults = page.locator(".toast button")
    for left in range(await faults.count(), 0, -1):
        await faults.first.click()
        await expect(faults).to_have_count(left - 1)
    await head.scroll_into_view_if_needed()
    await expect(tab).to_be_in_viewport()  # the list scrolls, and not what is around it
    await look_at(page, "requirements")
    await picture(page, "requirements")

    await answer(page, "yes").first.click()
    end = page.get_by_role("dialog")
    await expect(end).to_contain_text("never")
    await page.goto(f"{desk.executive.origin}/runs/{run}?t=0")
    await back(page)
    await narrow(page)


async def back(page: Page) -> None:
    """In the replay each moment has what was certain then."""
    badge = page.get_by_role("button", name=VIOLATED)
    await expect(page.get_by_role("tab", name="Requirements")).to_be_visible()
    await page.get_by_role("tab", name="Requirements").click()
    await expect(verdict(page, "never")).to_contain_text("open")
    await expect(badge).to_have_count(0)
    await page.get_by_role("button", name="To the end", exact=True).click()
    await expect(badge).to_be_visible()
    await expect(verdict(page, "ends")).to_contain_text("satisfied")
    await verdict(page, "never").locator("button.verdict-head").click()
    await expect(verdict(page, "ends")).to_contain_text("open")
    await expect(badge).to_be_visible()
    await page.get_by_role("button", name="To the start", exact=True).click()
    await expect(badge).to_have_count(0)
    await expect(verdict(page, "never")).to_contain_text("open")
    await page.get_by_role("button", name="To the end", exact=True).click()


async def narrow(page: Page) -> None:
    """On a phone the badge leads to the tab; it is also without colours that it is seen."""
    await page.emulate_media(color_scheme="dark")
    await page.set_viewport_size({"width": 390, "height": 844})
    await page.get_by_role("tab", name="Map").click()
    await expect(page.locator(".verdict")).to_have_count(0)
    await page.get_by_role("button", name=VIOLATED).click()
    await expect(verdict(page, "never")).to_contain_text("violated")
    await look_at(page, "requirements-phone")
    await page.emulate_media(forced_colors="active", color_scheme="light")
    await look_at(page, "requirements-forced")
