"""The versions of a drawing on the page of a run: looked at on the map, restored, deleted."""

import re

from playwright.async_api import Page, expect
from web_axe import Accessibility
from web_desk import IN_ONE_LOOP, Desk

pytestmark = IN_ONE_LOOP

NAME = "route_alpha"
"""A route that the mission names."""
EAST = {"type": "LineString", "coordinates": [[-77.3192, 38.1075], [-77.3172, 38.1075]]}
NORTH = {"type": "LineString", "coordinates": [[-77.3192, 38.1075], [-77.3192, 38.1095]]}


async def open_versions(page: Page) -> None:
    await page.get_by_role("button", name=re.compile("^Draw")).press("Enter")
    await page.get_by_role("menuitem", name=f"Versions of {NAME}", exact=True).press("Enter")


async def test_a_version_is_looked_at_restored_for_runs_that_use_it_and_deleted(desk: Desk) -> None:
    page = await desk.driving()
    desk.refusals.append(409)
    for geometry in (EAST, NORTH):
        body = {"geometry": geometry, "force": True}
        await desk.ask("PUT", f"/api/geometries/{NAME}", body)
    await page.reload()
    await open_versions(page)
    panel = page.get_by_role("region", name=f"Versions of {NAME}")
    rows = panel.get_by_role("listitem")
    await expect(rows).to_have_count(2)
    await expect(rows.first).to_contain_text("Route, vertices: 2 · the latest")
    eyes = Accessibility(page)
    look = panel.get_by_role("button", name=re.compile("Show version 1 on the map"))
    await look.press("Enter")
    await expect(look).to_have_attribute("aria-pressed", "true")
    await eyes.look("versions of a drawing")
    await panel.get_by_role("button", name="Restore version 1", exact=True).press("Enter")
    asked = panel.get_by_role("alert")
    await expect(asked).to_contain_text("Tasks that have not begun get this version.")
    await asked.get_by_role("button", name="Replace it").press("Enter")
    await expect(rows).to_have_count(3)
    versions = await desk.ask("GET", f"/api/geometries/{NAME}/versions")
    assert [each["geometry"]["coordinates"][1] for each in versions] == [
        EAST["coordinates"][1],
        NORTH["coordinates"][1],
        EAST["coordinates"][1],
    ]
    await panel.get_by_role("button", name="Delete it", exact=True).click()
    await expect(asked).to_contain_text("Runs under way keep it.")
    await asked.get_by_role("button", name="Delete it").click()
    await expect(rows.first).to_contain_text("4: deleted")
    known = {each["name"]: each for each in await desk.ask("GET", "/api/geometries")}
    assert known[NAME]["from"] == "fleet"
    await panel.get_by_role("button", name="Restore version 2", exact=True).press("Enter")
    await asked.get_by_role("button", name="Replace it").press("Enter")
    await expect(rows).to_have_count(5)
    await page.set_viewport_size({"width": 390, "height": 844})
    await page.get_by_role("tab", name="Map").click()
    await open_versions(page)
    await eyes.look("versions of a drawing, phone")
    await panel.get_by_role("button", name="Close the versions").click()
    await expect(panel).to_have_count(0)
    eyes.assert_well()
    await desk.ask("DELETE", f"/api/geometries/{NAME}")
