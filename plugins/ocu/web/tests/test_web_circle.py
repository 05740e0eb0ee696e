"""Two runs wait for each other: the page says so, and the other completes when one is stopped."""

from playwright.async_api import expect
from web_desk import IN_ONE_LOOP, Desk
from web_running import wait_for_status

from tests.waiting_circle import GO, NONE_GOES_ON, holding_and_waiting

pytestmark = IN_ONE_LOOP


async def test_an_operator_stops_one_of_two_runs_that_wait_for_each_other(desk: Desk) -> None:
    runs = []
    for holds, needs in (("evsg1", "evsg2"), ("evsg2", "evsg1")):
        mission = holding_and_waiting(holds, needs)
        (desk.executive.missions / f"{holds}.bpmn").write_bytes(mission)
        runs.append((await desk.ask("POST", "/api/runs", {"mission": holds}))["run"])
    first, second = runs
    page = desk.page
    await page.goto(f"{desk.executive.origin}/runs/{second}")
    await wait_for_status(page, "Running")
    await desk.until("/api/resources", lambda said: said["holders"]["evsg2"] == f"{second}.b1")
    await desk.ask("POST", "/api/signals", {"signal": GO})
    alert = page.get_by_role("alert").filter(has_text=NONE_GOES_ON).first
    held = f"held by Hold of {second} (evsg2)"
    await expect(alert).to_contain_text(f"Need of {first} (evsg1) waits for evsg2 ({held})")
    await expect(alert).to_contain_text(f"m2pem stop {second}")
    await page.get_by_role("button", name="Stop this run").hover()
    await page.mouse.down()
    await wait_for_status(page, "Stopped")
    await page.mouse.up()
    await desk.until(f"/api/runs/{first}", lambda said: said["status"] == "terminated")
