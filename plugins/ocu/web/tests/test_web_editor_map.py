"""The editor's map: drawing, picking and changing routes, areas and points of the mission's own."""

import json
import re
from pathlib import Path
from typing import Any

import pytest
from playwright.async_api import Locator, Page, expect
from web_axe import Accessibility
from web_desk import IN_ONE_LOOP, Desk
from web_drawing import Drawing, new_mission
from web_map_seen import vehicles_on
from web_pictures import picture

from m2pem import load_mission
from m2pem.mission.geometry import Route

pytestmark = IN_ONE_LOOP


def plan(page: Page) -> Locator:
    """The map beside the diagram."""
    return page.get_by_role("region", name="Map", exact=True)


async def spot(page: Page, x: float, y: float) -> tuple[float, float]:
    """A place of the map on the screen, as parts of its width and height."""
    box = await plan(page).get_by_role("application").bounding_box()
    assert box
    return box["x"] + x * box["width"], box["y"] + y * box["height"]


async def draw(page: Page, *places: tuple[float, float]) -> None:
    """Click the map at some places, and at the last one twice."""
    for place in places:
        await page.mouse.click(*await spot(page, *place))
    await page.mouse.click(*await spot(page, *places[-1]))


async def drag_vertex(page: Page, index: int, east_px: float) -> None:
    """Move a vertex of what is selected to the east."""
    box = await plan(page).locator(".map-vertex").nth(index).bounding_box()
    assert box
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    await page.mouse.move(x, y)
    await page.mouse.down()
    await page.mouse.move(x + east_px, y, steps=5)
    await page.mouse.up()


async def test_a_target_is_drawn_on_the_map_changed_saved_and_undone(desk: Desk) -> None:
    page = await desk.home()
    drawing = await new_mission(page, "lane")
    drive = await drawing.append("Start", "Single vehicle routing", "Drive the lane")
    await drawing.append(drive, "End event")
    await drawing.select(drive)
    await page.get_by_label("Who", exact=False).first.select_option("evsg1")
    await page.get_by_role("button", name="Pick on the map").first.click()
    await plan(page).get_by_role("button", name="Route", exact=True).click()
    await draw(page, (0.3, 0.3), (0.5, 0.4), (0.4, 0.6))
    await expect(page.locator("#m2-parameter-route")).to_have_value("route1")
    await expect(plan(page).locator(".plan-badge")).to_contain_text("Drive the lane")

    name = plan(page).get_by_label("Name", exact=True)
    await name.fill("lane")
    await name.press("Enter")
    await expect(page.locator("#m2-parameter-route")).to_have_value("lane")
    await drag_vertex(page, 1, east_px=50)
    await plan(page).get_by_label("Altitude for all, m").fill("25")
    await plan(page).get_by_role("button", name="Set", exact=True).click()
    await page.get_by_role("button", name="Blocks", exact=True).click()
    await plan(page).get_by_role("button", name="Show all").click()
    await picture(page, "planned")
    await drawing.save()
    path = desk.executive.missions / "lane.bpmn"
    lane = load_mission(path).geometries["lane"]
    assert isinstance(lane, Route)
    assert [altitude for *_, altitude in lane.waypoints] == [25.0, 25.0, 25.0]
    east = [longitude for _, longitude, _ in lane.waypoints]
    assert east[1] - east[0] > east[1] - east[2] > 0  # as it was moved
    found = await desk.ask("POST", "/api/checks", {"xml": path.read_text()})
    assert found["findings"] == []
    page = await desk.edit("lane")
    await expect(plan(page).locator(".plan-badge")).to_contain_text("Drive the lane")
    await plan(page).locator(".plan-badge").click()
    assert await Drawing(page).selected() == drive
    await plan(page).get_by_label("Routes, areas and points").select_option("lane")
    await plan(page).get_by_role("button", name="Delete", exact=True).click()
    dialog = page.get_by_role("dialog", name="Delete lane?")
    await expect(dialog).to_contain_text("Drive the lane")
    await dialog.get_by_role("button", name="Delete", exact=True).click()
    await expect(plan(page).locator(".plan-badge")).to_have_count(0)
    await page.get_by_role("button", name="Undo", exact=False).first.click()
    await expect(plan(page).locator(".plan-badge")).to_have_count(1)

    run = (await desk.ask("POST", "/api/runs", {"mission": "lane"}))["run"]
    other = await desk.another()
    await other.goto(f"{desk.executive.origin}/runs/{run}")
    await expect(other.locator(".map-name", has_text=re.compile("^lane$"))).to_be_attached()
    await desk.until(f"/api/runs/{run}", lambda said: said["status"] == "running")


@pytest.mark.parametrize("dark", [False, True])
async def test_the_map_needs_no_mouse_has_no_violation_and_fits_a_phone(
    desk: Desk, dark: bool
) -> None:
    page = await desk.edit()
    eyes = Accessibility(page)
    toggle = page.get_by_role("button", name="Map", exact=True)
    await toggle.press("Enter")
    await plan(page).get_by_role("button", name="Area", exact=True).press("Enter")
    form = plan(page).get_by_role("form", name="Drawing: Area")
    add = form.get_by_role("button", name="Add map centre")
    for _ in range(3):
        await add.press("Enter")
    await form.locator("summary").press("Enter")
    for vertex, latitude in ((2, "38.108"), (3, "38.109")):
        field = form.get_by_label(f"Vertex {vertex}: Latitude °")
        await field.fill(latitude)
        await field.press("Tab")
    await form.get_by_label("Vertex 3: Longitude °").fill("-77.317")
    await eyes.look("map, drawing")
    await form.get_by_role("button", name="Done").press("Enter")
    own = plan(page).get_by_role("form", name="Area area1")
    await expect(own).to_contain_text("No task uses it yet.")
    await eyes.look("map, own")
    await plan(page).get_by_label("Routes, areas and points").select_option("route_alpha")
    await expect(plan(page).get_by_role("form", name="Route route_alpha")).to_be_visible()
    await eyes.look("map, of the fleet")
    if not dark:  # forced colours know no theme
        await page.emulate_media(forced_colors="active")
        await eyes.look("map, forced colours")
        await page.emulate_media(forced_colors="none")
    await page.set_viewport_size({"width": 390, "height": 780})
    await expect(page.locator("#m2-canvas")).to_be_hidden()
    await eyes.look("map, phone")
    assert await plan(page).evaluate("map => map.getBoundingClientRect().width") == 390
    await toggle.click()
    await expect(page.locator("#m2-canvas")).to_be_visible()
    eyes.assert_well()


def read(path: Path) -> Any:
    """A file that the page gave."""
    return json.loads(path.read_text())


FILE = {
    "type": "FeatureCollection",
    "features": [
        {
            "type": "Feature",
            "properties": {"name": "west gate"},
            "geometry": {"type": "Point", "coordinates": [-77.3192, 38.1075]},
        },
        {
            "type": "Feature",
            "properties": {"name": "route_alpha"},
            "geometry": {
                "type": "LineString",
                "coordinates": [[-77.3192, 38.1075], [-77.3182, 38.1085, 12]],
            },
        },
        {"type": "Feature", "properties": {}, "geometry": {"type": "Sphere"}},
    ],
}


async def test_a_file_is_looked_at_taken_and_exported(desk: Desk) -> None:
    page = await desk.home()
    drawing = await new_mission(page, "taken")
    await page.get_by_role("button", name="Map", exact=True).click()
    content = json.dumps(FILE).encode()
    await (
        plan(page)
        .locator("input[type=file]")
        .set_input_files(
            {"name": "site.geojson", "mimeType": "application/geo+json", "buffer": content}
        )
    )
    form = plan(page).get_by_role("form", name="From site.geojson")
    await expect(form.get_by_label("Name: Point 1")).to_have_value("west_gate")
    await expect(form).to_contain_text("Sphere")
    await form.get_by_label("Name: Point 1").fill("gate")
    await form.get_by_role("button", name="Add to the mission").click()
    await expect(plan(page).get_by_role("form", name="Point gate")).to_be_visible()
    await drawing.save()
    own = load_mission(desk.executive.missions / "taken.bpmn").geometries
    assert sorted(own) == ["gate", "route_alpha"]

    await plan(page).get_by_role("button", name="Files").click()
    async with page.expect_download() as given:
        await page.get_by_role("menuitem", name="Export: GeoJSON").click()
    written = read(await (await given.value).path())
    routes = {each["properties"]["name"]: each for each in written["features"]}
    assert routes["route_alpha"]["geometry"]["coordinates"][1] == [-77.3182, 38.1085, 12]
    assert "route_bravo" in routes  # the fleet's
    assert (await given.value).suggested_filename == "taken.geojson"


async def test_a_rehearsal_of_the_draft_is_played_on_the_map(desk: Desk) -> None:
    page = await desk.edit(tab="Run")
    await page.get_by_role("button", name="Rehearse").click()
    outcome = page.get_by_role("region", name="What came of it")
    await outcome.get_by_role("button", name="Play on the map").click()
    await expect(vehicles_on(plan(page))).not_to_have_count(0)
    await expect(page.locator(".m2-rehearsed").first).to_be_attached()
    await plan(page).get_by_role("button", name="Pause").click()
    await plan(page).get_by_label("Position", exact=True).fill("40")
    eyes = Accessibility(page)
    await eyes.look("rehearsal on the map")
    eyes.assert_well()
    await picture(page, "rehearsed_on_map")
    assert page.url.endswith("/missions/vignette1")
    await plan(page).get_by_role("button", name="End of the rehearsal on the map").click()
    await expect(vehicles_on(plan(page))).to_have_count(0)
    await expect(page.locator(".m2-rehearsed")).to_have_count(0)
