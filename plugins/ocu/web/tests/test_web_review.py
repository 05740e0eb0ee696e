"""A mission is drawn by one person, approved by another, and started: two browsers."""

from pathlib import Path

from playwright.async_api import Browser, expect
from web_axe import Accessibility
from web_browsing import page_at
from web_desk import IN_ONE_LOOP, named_users
from web_served import served
from web_world import PASSWORD

from m2pem.testing import scenarios

pytestmark = IN_ONE_LOOP

FLEET = """version: 1
name: north
approval: {persons: 1}
vehicles:
  ugv1: {domain: ground, arbiter: sim}
"""


async def test_another_person_approves_before_it_starts(chromium: Browser, tmp_path: Path) -> None:
    fleet = tmp_path / "north.yaml"
    fleet.write_text(FLEET)
    words = ("--journal", "memory:")
    with served(tmp_path, fleet=fleet, words=words, environment=named_users(tmp_path)) as north:
        (north.missions / "asks.bpmn").write_bytes(scenarios.question())
        edit = f"{north.origin}/missions/asks"
        async with page_at(chromium, edit) as anna, page_at(chromium, edit) as otto:
            for each, name in ((anna, "anna"), (otto, "otto")):
                await each.page.get_by_label("Name").fill(name)
                await each.page.get_by_label("Password").fill(PASSWORD)
                await each.page.get_by_role("button", name="Sign in").click()
                await each.page.wait_for_selector(".djs-shape")
                await each.page.get_by_role("tab", name="Run", exact=True).click()
            theirs = anna.page.get_by_role("region", name="Approval")
            # It came as a file: nobody knows who drew it, so two persons must approve it.
            await expect(theirs).to_contain_text("2 persons (one more than the fleet says")
            await anna.page.get_by_role("button", name="Start", exact=True).click()
            await expect(anna.page.get_by_text("is not approved").first).to_be_visible()
            found = Accessibility(anna.page)
            await found.look("approvals", ".approval")
            found.assert_well()
            for each in (anna, otto):
                await each.page.get_by_role("button", name="Approve this content").click()
            await expect(theirs).to_contain_text("Approved: it may start.")
            await expect(theirs).to_contain_text("otto approved it on")
            await anna.page.get_by_role("button", name="Start", exact=True).click()
            await anna.page.wait_for_url("**/runs/r1")
