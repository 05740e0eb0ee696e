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


async def test_the_dialog_takes_all_that_a_start_may_wait_for(page_desk: Desk) -> None:
    page = await page_desk.home()
    section = page.get_by_role("region", name="Scheduled")
    before = {"mission": MISSION, "when": {"cron": "0 8 * * *", "time_zone": "UTC"}}
    first = (await page_desk.ask("POST", "/api/schedule", before))["entry"]
    await section.get_by_role("button", name="Schedule a mission").click()
    dialog = page.get_by_role("dialog", name="Schedule a mission")
    await dialog.get_by_label("Mission").select_option(MISSION)
    await dialog.get_by_label("as soon as its vehicles are free").check()
    await dialog.get_by_text("What it waits for").click()
    await dialog.get_by_label("After", exact=True).select_option(first)
    await dialog.get_by_label("failed", exact=True).check()
    await dialog.get_by_label("Condition of its vehicles").fill("vehicle.batery > 0.9")
    await dialog.get_by_label("For so many seconds").fill("30")
    await dialog.get_by_text("Deadlines, and times that are missed").click()
    await dialog.get_by_label("Starting deadline").fill("90")
    await dialog.get_by_label("A time that was missed").select_option("run-once")
    await dialog.get_by_text("Priority, process and data").click()
    await dialog.get_by_label("Priority").fill("5")
    submit = dialog.get_by_role("button", name="Schedule", exact=True)
    page_desk.refusals.append(409)
    await submit.click()
    condition = dialog.get_by_label("Condition of its vehicles")
    await expect(condition).to_have_attribute("aria-invalid", "true")
    await expect(dialog.get_by_role("alert")).to_contain_text("did you mean 'vehicle.battery'")
    await condition.fill("vehicle.battery > 0.9")
    await expect(dialog.get_by_role("alert")).to_have_count(0)
    await submit.click()
    await expect(dialog).to_have_count(0)
    row = section.get_by_role("row").filter(has_text=f"after {first} has completed or failed")
    await expect(row).to_contain_text("when vehicle.battery > 0.9 for 30 s")
    await expect(row).to_contain_text("waiting")


async def test_an_entry_is_started_now(page_desk: Desk) -> None:
    page = await page_desk.home()
    wanted = {"mission": MISSION, "when": {"cron": "0 8 * * *", "time_zone": "UTC"}}
    entry = (await page_desk.ask("POST", "/api/schedule", wanted))["entry"]
    section = page.get_by_role("region", name="Scheduled")
    row = section.get_by_role("row").filter(has_text=entry).first
    await row.get_by_role("button", name=f"Start {entry} now").click()
    asked = page.get_by_role("dialog", name=f"Start {entry} now?")
    await asked.get_by_role("button", name="Start now", exact=True).click()
    run = row.get_by_role("link")
    await expect(run).to_have_count(1)
    started = await run.inner_text()
    runs = {each["run"]: each for each in await page_desk.ask("GET", "/api/runs")}
    assert runs[started]["status"] == "running"
    await page_desk.ask("POST", f"/api/runs/{started}/stop", {"reason": "seen"})


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
    async def refused(when: dict[str, object]) -> dict[str, str]:
        response = await page_desk.watched.context.request.post(
            f"{page_desk.executive.origin}/api/schedule",
            headers={"Origin": page_desk.executive.origin, "M2pem-Key": page_desk.key},
            data={"mission": MISSION, "when": when},
        )
        assert 400 <= response.status < 500
        found: dict[str, str] = await response.json()
        return found

    past, unknown, condition = await asyncio.gather(
        refused({"at": "2020-01-01T08:00Z"}),
        refused({"att": "08:00"}),
        refused({"condition": "vehicle.batery > 0.9"}),
    )
    assert "has passed" in past["detail"]
    assert past["field"] == "at"
    assert "att" in unknown["detail"]
    assert "vehicle.battery" in condition["detail"]
    assert condition["field"] == "condition"
