"""The run of a vehicle that drives is revised on its page."""

from playwright.async_api import Locator, Page, expect
from web_desk import IN_ONE_LOOP, MISSION, Desk, element

pytestmark = IN_ONE_LOOP

ROUTE = "route_alpha"
SLOWER = '<property name="route" value="route_alpha"/><property name="speed" value="1 m/s"/>'


async def planned(desk: Desk, page: Page, xml: str) -> Locator:
    """The dialog with the plan for a new version of the folder."""
    (desk.executive.missions / "vignette1_new.bpmn").write_text(xml, encoding="utf-8")
    await page.get_by_role("button", name="Revise…").click()
    dialog = page.get_by_role("dialog", name="Revise r")
    await dialog.get_by_label("Mission").select_option("vignette1_new")
    return dialog


async def driver(desk: Desk) -> str:
    """The behavior that has the vehicle."""
    return str((await desk.ask("GET", "/api/resources"))["holders"]["evsg1"])


async def test_a_vehicle_drives_on_while_another_task_changes(desk: Desk) -> None:
    page = await desk.driving()
    before = await driver(desk)
    xml = (desk.executive.missions / f"{MISSION}.bpmn").read_text(encoding="utf-8")
    dialog = await planned(desk, page, xml.replace('name="REVERSE"', 'name="BACK OFF"'))
    await expect(dialog).to_contain_text("All that is active stays.")
    await dialog.get_by_role("button", name="Revise r").click()
    await expect(dialog).to_have_count(0)
    await expect(element(page, "Reverse")).to_contain_text("BACK OFF")
    await expect(element(page, "DriveRoute")).to_contain_class("m2-active")
    assert await driver(desk) == before


async def test_a_vehicle_whose_task_changes_is_named_and_begins_again(desk: Desk) -> None:
    page = await desk.driving()
    before = await driver(desk)
    xml = (desk.executive.missions / f"{MISSION}.bpmn").read_text(encoding="utf-8")
    route = f'<property name="route" value="{ROUTE}"/>'
    assert route in xml
    dialog = await planned(desk, page, xml.replace(route, SLOWER))
    becomes = dialog.get_by_role("region", name="What becomes of the run")
    await expect(becomes.locator(".rev-vehicle")).to_have_text(["evsg1"])
    await expect(becomes).to_contain_text("is cancelled and the task begins again")
    await dialog.get_by_role("button", name="Revise r").click()
    await expect(dialog).to_have_count(0)
    await desk.until("/api/resources", lambda said: said["holders"]["evsg1"] not in ("", before))
    await expect(element(page, "DriveRoute")).to_contain_class("m2-active")


async def test_a_vehicle_stops_when_its_token_is_moved(desk: Desk) -> None:
    page = await desk.driving()
    xml = (desk.executive.missions / f"{MISSION}.bpmn").read_text(encoding="utf-8")
    dialog = await planned(desk, page, xml.replace('"DriveRoute"', '"DriveAnother"'))
    refused = dialog.get_by_role("region", name="Refused")
    await expect(refused.locator(".rev-vehicle")).to_have_text(["evsg1"])
    await expect(refused).to_contain_text("behavior single_vehicle_routing of evsg1")
    await dialog.get_by_label("Token on DriveRoute").select_option("DriveStop")
    becomes = dialog.get_by_role("region", name="What becomes of the run")
    await expect(becomes).to_contain_text("cancelled: behavior single_vehicle_routing of evsg1")
    await dialog.get_by_role("button", name="Revise r").click()
    await expect(dialog).to_have_count(0)
    await expect(element(page, "DriveAnother")).to_be_visible()
    await expect(element(page, "DriveStop")).to_contain_class("m2-done")
    run = page.url.rpartition("/")[2]
    page_of = await desk.ask("GET", f"/api/runs/{run}/records?limit=5000")
    ended = [each for each in page_of["records"] if each["record"] == "BehaviorEnded"]
    assert any("DriveRoute" in str(each) for each in ended)


async def test_a_vehicle_that_an_operator_has_is_named(desk: Desk) -> None:
    page = await desk.driving()
    await desk.ask("POST", "/api/resources/evsg2/take")
    xml = (desk.executive.missions / f"{MISSION}.bpmn").read_text(encoding="utf-8")
    before, start, task = xml.partition('<bpmn:scriptTask id="DriveStop"')
    dialog = await planned(desk, page, before + start + task.replace("evsg1", "evsg2", 1))
    await expect(dialog.get_by_role("region", name="What others have now")).to_have_text(
        "What others have now"
        "script task 'DRIVE STOP' (DriveStop) needs evsg2, which operator anna has now: "
        "the task ends with error RESOURCE_UNAVAILABLE, unless that is free when it starts"
    )
