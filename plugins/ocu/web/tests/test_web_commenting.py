"""Comments on a mission's elements in the editor, of two persons at once."""

from playwright.async_api import Browser, expect
from web_axe import Accessibility
from web_desk import IN_ONE_LOOP, MISSION, Desk, signed_in
from web_pictures import picture

pytestmark = IN_ONE_LOOP


async def test_a_comment_on_an_element_is_seen_answered_and_resolved(
    chromium: Browser, desk: Desk
) -> None:
    page = await desk.edit()
    async with signed_in(chromium, desk.executive, "otto") as otto:
        otto.watched.listen(otto.page)
        other = await otto.edit(tab="Comments")
        await page.get_by_role("tab", name="Comments").click()
        await page.click("[data-element-id=Reverse]")
        await page.get_by_label("Comment on REVERSE").fill("10 m is too far here")
        await page.get_by_role("button", name="Add comment").press("Enter")
        badge = other.get_by_role("button", name="1 open comment on REVERSE")
        await expect(badge).to_be_visible()
        await expect(other.locator(".comments")).to_contain_text("10 m is too far here")
        await badge.press("Enter")
        await expect(other.get_by_role("textbox", name="Comment on REVERSE")).to_be_visible()
        await expect(other.get_by_role("button", name="Delete: 10 m")).to_have_count(0)
        await other.get_by_role("button", name="Answer", exact=True).click()
        await other.get_by_label("Answer to anna").fill("5 m, then")
        await other.get_by_role("button", name="Send").click()
        await expect(page.locator(".comment-answer")).to_contain_text("5 m, then")
        found = Accessibility(page)
        await found.look("comments", ".m2-side")
        found.assert_well()
        await picture(page, "comments")
        await other.get_by_role("button", name="Resolve").click()
        await expect(page.get_by_text("resolved by otto")).to_be_visible()
        await expect(page.locator(".comment-badge")).to_have_count(0)
        await page.get_by_role("button", name="Delete: 10 m").click()
        await expect(other.get_by_text("No comments yet.")).to_be_visible()
        otto.assert_well()
    assert await desk.ask("GET", f"/api/missions/{MISSION}/comments") == []
    await expect(page.locator(".m2-saved-state")).to_have_text("Saved")
    desk.assert_well()
