"""The schedule on the first page, and over REST."""

import asyncio
from collections.abc import AsyncIterator

import pytest_asyncio
from playwright.async_api import expect
from web_desk import IN_ONE_LOOP, MISSION, Desk

pytestmark = IN_ONE_LOOP


@pytest_asyncio.fixture(loop_scope="session")
async def page_desk(desk: Desk) -> AsyncIterator[Desk]:
    """A desk that leaves nothing scheduled."""
    yield desk
    schedule = await desk.ask("GET", "/api/schedule")
    for each in schedule["entries"]:
        if each["status"] not in ("ended", "cancelled", "failed"):
            await desk.ask("POST", f"/api/schedule/{each['entry']}/cancel")
    if schedule["hold"]:
        await desk.ask("POST", "/api/schedule/release")


async def test_a_mission_is_scheduled_held_released_and_cancelled(page_desk: Desk) -> None:
    page = await page_desk.home()
    section = page.get_by_role("region", name="Scheduled")
    await section.get_by_role("button", name="Schedule a mission").click()
    dialog = page.get_by_role("dialog", name="Schedule a mission")
    await dialog.get_by_label("Mission").select_option(MISSION)
    await dialog.get_by_label("again and again").check()
    await dialog.get_by_label("Minute, hour").fill("0 8 * * *")
    await dialog.get_by_role("button", name="Schedule", exact=True).click()
    await expect(dialog).to_have_count(0)
    (entry,) = [
        each["entry"]
        for each in (await page_desk.ask("GET", "/api/schedule"))["entries"]
        if each["status"] == "scheduled"
    ]
    row = section.get_by_role("row").filter(has_text="by cron 0 8 * * *").filter(has_text=entry)
    await expect(row).to_contain_text("scheduled")
    await row.get_by_role("button", name=f"Hold {entry}").click()
    await expect(row).to_contain_text("held by anna")
    await row.get_by_role("button", name=f"Release {entry}").click()
    await expect(row).to_contain_text("scheduled")
    await section.get_by_role("button", name="Hold all").click()
    await expect(section.get_by_role("status")).to_contain_text("Nothing starts")
    await section.get_by_role("button", name="Release all").click()
    await expect(section.get_by_role("status")).to_have_count(0)
    await row.get_by_role("button", name=f"Cancel {entry}").click()
    asked = page.get_by_role("dialog", name=f"Cancel {entry}?")
    await asked.get_by_role("button", name="Cancel", exact=True).click()
    await expect(row).to_contain_text("cancelled by anna")


async def test_stop_of_all_holds_the_schedule_on_every_page(page_desk: Desk) -> None:
    page = await page_desk.home()
    wanted = {"mission": MISSION, "when": {"cron": "0 8 * * *", "time_zone": "UTC"}, "priority": 3}
    entry = (await page_desk.ask("POST", "/api/schedule", wanted))["entry"]
    row = page.get_by_role("row").filter(has_text=entry)
    await expect(row).to_contain_text("scheduled")
    await page_desk.ask("POST", "/api/stop-all", {"reason": "smoke"})
    await expect(row).to_contain_text("STOP of all: smoke")
    await expect(page.get_by_role("alert").filter(has_text="the schedule is held")).to_have_count(1)


async def test_what_cannot_be_scheduled_is_refused_with_the_reason(page_desk: Desk) -> None:
    async def refused(when: dict[str, object]) -> str:
        response = await page_desk.watched.context.request.post(
            f"{page_desk.executive.origin}/api/schedule",
            headers={"Origin": page_desk.executive.origin, "M2pem-Key": page_desk.key},
            data={"mission": MISSION, "when": when},
        )
        assert 400 <= response.status < 500
        return await response.text()

    past, unknown, condition = await asyncio.gather(
        refused({"at": "2020-01-01T08:00Z"}),
        refused({"att": "08:00"}),
        refused({"condition": "vehicle.batery > 0.9"}),
    )
    assert "has passed" in past
    assert "att" in unknown
    assert "vehicle.battery" in condition
