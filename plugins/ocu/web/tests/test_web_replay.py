"""Runs that are over, on the page that also shows those that go on."""

import re

from playwright.async_api import expect
from web_desk import IN_ONE_LOOP, Desk, element
from web_running import answer, wait_for_status

pytestmark = IN_ONE_LOOP


async def test_a_run_of_the_past_is_replayed(desk: Desk) -> None:
    page = await desk.start()
    await answer(page, "Abort").click()
    ended = page.get_by_role("dialog", name="The run has ended")
    await expect(ended).to_contain_text("abort")
    await ended.get_by_role("button", name="Replay it").click()
    await page.get_by_role("button", name="To the start").click()
    asked = element(page, "UserSendRoute")
    await expect(asked).to_contain_class("m2-asking")
    await page.get_by_role("button", name="To the end").click()
    await wait_for_status(page, "Terminated")
    await expect(asked).to_contain_class("m2-done")
    back = page.get_by_role("button", name="Previous event")
    for _ in range(3):
        await back.click()
    await wait_for_status(page, "Running")
    # The address leads to the same moment.
    await expect(page).to_have_url(re.compile(r"\?t="))
    at = float(page.url.partition("?t=")[2])
    await page.reload()
    await page.get_by_role("slider", name="Position").wait_for()
    await page.wait_for_function(SHOWS, arg=at)


SHOWS = """(t) => Math.abs(document.querySelector(".player-position").value - t) < 0.06"""
