"""Heights above the ground and estimates on the editor's map, with a tile that the test writes."""

import math
import re
import struct
from pathlib import Path

from playwright.async_api import Browser, Page, expect
from test_web_editor_map import plan
from web_axe import Accessibility
from web_desk import IN_ONE_LOOP, OPERATOR, named_users, signed_in
from web_pictures import picture
from web_served import served

from m2pem import load_mission
from m2pem.mission.geometry import Route

pytestmark = IN_ONE_LOOP

SIDE = 1201
FLEET = """version: 1
name: hills
origin: {lat: 38.10, lon: -77.30, alt: 60}
terrain: {folder: elevation, clearance: 20 m}
vehicles:
  uav:
    domain: air
    arbiter: sim
    connection: {altitude: 30 m}
    cruise_speed: 8 m/s
    endurance: 4 min
"""
MISSION = """<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"
 xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="t"><process id="p" isExecutable="true">
 <extensionElements><m2pem:geometry name="lane">{"type": "LineString", "coordinates":
 [[-77.30, 38.10, 30], [-77.30, 38.115, 30]]}</m2pem:geometry></extensionElements>
 <startEvent id="s"/><sequenceFlow id="f1" sourceRef="s" targetRef="Fly"/>
 <scriptTask id="Fly" name="Fly"><extensionElements>
  <m2pem:behavior type="vehicle" name="single_vehicle_routing">
   <m2pem:properties><m2pem:property name="route" value="lane"/></m2pem:properties>
   <m2pem:resources><m2pem:role name="pilot" vehicle="uav"/></m2pem:resources>
  </m2pem:behavior></extensionElements></scriptTask>
 <sequenceFlow id="f2" sourceRef="Fly" targetRef="e"/><endEvent id="e"/></process></definitions>"""


def write_hill(folder: Path) -> Path:
    """A fleet whose elevation files have a hill on the lane, 60 m high."""
    elevation = folder / "elevation"
    elevation.mkdir()
    rows = []
    for row in range(SIDE):
        latitude = 39 - row / (SIDE - 1)
        height = 60 + 60 * math.exp(-(((latitude - 38.108) / 0.003) ** 2))
        rows.append(struct.pack(">h", round(height)) * SIDE)
    (elevation / "N38W078.hgt").write_bytes(b"".join(rows))
    fleet = folder / "fleet.yaml"
    fleet.write_text(FLEET)
    return fleet


async def saved(page: Page) -> None:
    """Save, and wait until it is."""
    await page.get_by_role("button", name="Save", exact=True).click()
    await expect(page.locator(".m2-saved-state")).to_have_text("Saved")


async def test_a_low_route_and_a_short_battery_are_seen_and_the_route_follows_the_ground(
    tmp_path: Path, chromium: Browser
) -> None:
    fleet = write_hill(tmp_path)
    with served(tmp_path, fleet=fleet, environment=named_users(tmp_path)) as executive:
        path = executive.missions / "hill.bpmn"
        path.write_text(MISSION)
        async with signed_in(chromium, executive, OPERATOR) as desk:
            page = await desk.edit("hill")
            eyes = Accessibility(page)
            await page.get_by_role("button", name="Map", exact=True).click()
            await plan(page).get_by_text("Estimates", exact=True).press("Enter")
            table = plan(page).get_by_role("table", name="Estimates for each vehicle")
            await expect(table.get_by_role("row", name="uav")).to_contain_text("below the reserve")
            await plan(page).get_by_label("Routes, areas and points").select_option("lane")
            form = plan(page).get_by_role("form", name="Route lane")
            await form.get_by_text("Height above the ground").press("Enter")
            alert = form.get_by_role("alert")
            await expect(alert).to_contain_text("below the ground")
            await expect(form.locator(".terrain-low")).not_to_have_count(0)
            await expect(page.get_by_role("tab", name="Problems")).to_contain_text("2")
            await page.get_by_role("tab", name="Problems").click()
            await expect(page.get_by_text("let the route follow the terrain")).to_be_visible()
            problem = page.get_by_text("'route': uav would be")
            found = re.search(r"would be ([\d.]+ m below the ground)", await problem.inner_text())
            assert found
            await expect(alert).to_contain_text(f"The route goes {found[1]}")
            await expect(page.get_by_text("the battery of uav")).to_be_visible()
            await eyes.look("terrain and estimates")
            await picture(page, "terrain_low")

            await form.get_by_label("Above the ground, m").fill("40")
            await form.get_by_role("button", name="Follow the ground").press("Enter")
            least = form.get_by_text(re.compile(r"Nearest to the ground: (3[89]|40)(\.\d)? m"))
            await expect(least).to_be_visible()
            await expect(alert).to_have_count(0)
            await expect(page.get_by_text("let the route follow the terrain")).to_have_count(0)
            await saved(page)
            lane = load_mission(path).geometries["lane"]
            assert isinstance(lane, Route)
            assert lane.altitude_frame == "amsl"
            assert len(lane.waypoints) > 4
            await page.get_by_role("button", name="Undo", exact=False).first.click()
            await expect(alert).to_contain_text("below the ground")
            eyes.assert_well()
