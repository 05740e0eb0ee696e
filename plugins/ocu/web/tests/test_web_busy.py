"""Vehicles that another run or an operator has, and runs that ended before they were looked at."""

from playwright.async_api import expect
from test_web_alerts import look
from web_desk import IN_ONE_LOOP, OVER, Desk
from web_running import wait_for_status

from m2pem.testing import scenarios

pytestmark = IN_ONE_LOOP

VEHICLE = "evsg1"
BUSY = "busy"
DRIVES_AT_ONCE = scenarios.in_sequence("reverse", VEHICLE, {"distance": "20 m"})


async def begun(desk: Desk) -> str:
    """Start a mission whose first task needs the vehicle, whoever has it; its run."""
    (desk.executive.missions / f"{BUSY}.bpmn").write_bytes(DRIVES_AT_ONCE)
    wanted = {"mission": BUSY, "even_if_busy": True}
    return str((await desk.ask("POST", "/api/runs", wanted))["run"])


def run_of(desk: Desk) -> str:
    """The run that the page shows."""
    return desk.page.url.rpartition("/")[2]


async def test_pages_of_other_runs_say_which_run_drives_a_vehicle(desk: Desk) -> None:
    page = await desk.driving()
    driver = run_of(desk)
    own = page.locator(".timeline .held")
    await expect(page.locator(".timeline .bar-behavior.bar-open")).not_to_have_count(0)
    await expect(own).to_have_count(0)
    other = (await desk.ask("POST", "/api/runs", {"mission": "vignette1", "even_if_busy": True}))[
        "run"
    ]
    await page.goto(f"{desk.executive.origin}/runs/{other}")
    held = f"vehicle of another run: {driver}, DRIVE ROUTE"
    line = page.get_by_role("img", name=f"{VEHICLE}: {held}", exact=True)
    await expect(line).to_be_visible()
    await expect(page.locator(".card", has_text=VEHICLE)).to_contain_text(held)
    await desk.ask("POST", "/api/resources/evsg2/take")
    await expect(page.get_by_role("img", name="evsg2: with anna", exact=True)).to_be_visible()
    await see_that_a_run_failed_before_its_page_loaded(desk)
    await page.goto(f"{desk.executive.origin}/runs/{other}")
    await expect(line).to_be_visible()
    await desk.ask("POST", f"/api/runs/{driver}/stop", {"reason": "the vehicle is needed"})
    await expect(line).to_have_count(0)


async def see_that_a_run_failed_before_its_page_loaded(desk: Desk) -> None:
    page = desk.page
    run = await begun(desk)
    await desk.until(f"/api/runs/{run}", lambda said: said["status"] in OVER)
    await page.goto(f"{desk.executive.origin}/runs/{run}")
    ended = page.get_by_role("dialog", name="The run has ended")
    await expect(ended).to_contain_text("Failed")
    await expect(ended).to_contain_text(f"{run} failed")
    await expect(ended).to_contain_text("RESOURCE_UNAVAILABLE")
    await ended.get_by_role("button", name="Stay on this page").click()
    await wait_for_status(page, "Failed")
    task = page.locator(".drawing:not([hidden]) [data-element-id='Task1']").first
    await expect(task).to_contain_class("m2-failed")
    # Whoever comes for a moment of it is not told of its end.
    await page.goto(f"{desk.executive.origin}/runs/{run}?t=0")
    await page.get_by_role("slider", name="Position").wait_for()
    await expect(ended).to_have_count(0)


async def test_a_start_with_a_busy_vehicle_is_refused_until_it_is_confirmed(desk: Desk) -> None:
    page = await desk.driving()
    driver = run_of(desk)
    desk.refusals.append(409)
    runs = len(await desk.ask("GET", "/api/runs"))
    await desk.edit(tab="Run")
    start = page.get_by_role("button", name="Start", exact=True)
    await start.click()
    dialog = page.get_by_role("dialog", name="Vehicles are busy")
    held = dialog.get_by_role("row", name=VEHICLE)
    await expect(held).to_contain_text(f"{driver}DRIVE ROUTE of {driver}")
    await look(page, "busy")
    await page.keyboard.press("Enter")  # the focus is not on what starts it
    await dialog.get_by_role("button", name="Do not start").click()
    await expect(dialog).to_have_count(0)
    assert len(await desk.ask("GET", "/api/runs")) == runs
    await start.click()
    await dialog.get_by_role("button", name="Start all the same").click()
    await page.wait_for_url("**/runs/*")
    assert run_of(desk) != driver
    assert len(await desk.ask("GET", "/api/runs")) == runs + 1
    await page.get_by_role("button", name="Stop this run").dblclick()
    await see_that_it_waits_or_that_the_other_run_is_stopped(desk, driver)


async def see_that_it_waits_or_that_the_other_run_is_stopped(desk: Desk, driver: str) -> None:
    page = desk.page
    await desk.edit(tab="Run")
    start = page.get_by_role("button", name="Start", exact=True)
    dialog = page.get_by_role("dialog", name="Vehicles are busy")
    await start.click()
    await dialog.get_by_role("button", name="Wait in the queue").click()
    queue = page.get_by_role("region", name="Scheduled")
    # Entries of the past may be listed, too.
    await expect(queue.get_by_role("row", name="vignette1 waiting")).to_have_count(1)
    entries = (await desk.ask("GET", "/api/schedule"))["entries"]
    (entry,) = (each for each in entries if each["status"] == "waiting")
    await desk.ask("POST", f"/api/schedule/{entry['entry']}/cancel")
    await desk.edit(tab="Run")
    await start.click()
    await dialog.get_by_role("button", name=f"Stop {driver}…").click()
    await dialog.get_by_role("button", name=f"Stop {driver}: its mission ends").click()
    await dialog.get_by_role("button", name="Start now").click()
    await page.wait_for_url("**/runs/*")
    assert run_of(desk) != driver
