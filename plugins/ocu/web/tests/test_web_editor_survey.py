"""Surveys on the editor's map: drawn while the form changes, made, undone, and made again."""

import pytest
from playwright.async_api import Page, expect
from test_web_editor_map import drag_vertex, draw, plan, spot
from web_axe import Accessibility
from web_desk import IN_ONE_LOOP, Desk
from web_drawing import new_mission
from web_pictures import picture

from m2pem import load_mission
from m2pem.mission.elements import ScriptTask
from m2pem.mission.geometry import Route

pytestmark = IN_ONE_LOOP

LINES = ".survey-line"
ROUTES = ("area1-survey1-evsg1", "area1-survey1-evsg2")
CORNERS = ((0.3, 0.25), (0.7, 0.3), (0.65, 0.7), (0.32, 0.65))


async def drawn_area(page: Page) -> None:
    """An area in the middle of the map, by the mouse."""
    await page.get_by_role("button", name="Map", exact=True).click()
    await plan(page).get_by_role("button", name="Area", exact=True).click()
    await draw(page, *CORNERS)
    await expect(plan(page).get_by_role("form", name="Area area1")).to_be_visible()


async def test_a_survey_of_two_vehicles_is_drawn_made_undone_and_follows_its_area(
    desk: Desk,
) -> None:
    page = await desk.home()
    drawing = await new_mission(page, "survey")
    await drawn_area(page)
    await plan(page).get_by_role("button", name="Survey…").click()
    form = plan(page).get_by_role("form", name="Survey of area1")
    await expect(plan(page).locator(LINES)).not_to_have_count(0)
    await form.get_by_label("evsg1", exact=True).check()
    await form.get_by_label("evsg2", exact=True).check()
    await expect(form.get_by_role("row").filter(has_text="evsg2")).to_be_visible()

    slider = form.get_by_role("slider", name="Between passes, m")
    await slider.fill("10")
    await expect(form).to_contain_text("10.0 m apart")
    handle = plan(page).locator(".survey-turn")
    box = await handle.bounding_box()
    assert box
    await page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    await page.mouse.down()
    middle = await spot(page, 0.5, 0.48)
    await page.mouse.move(middle[0] + 90, middle[1], steps=6)
    await page.mouse.up()
    await expect(form.get_by_label("Fewest turns", exact=False)).not_to_be_checked()
    await form.get_by_label("Fewest turns", exact=False).check()
    await expect(form.get_by_text("Calculating")).to_have_count(0)
    await picture(page, "survey")

    await form.get_by_role("button", name="Make routes and tasks").click()
    await expect(form).to_have_count(0)
    await expect(plan(page).locator(".plan-badge")).to_have_count(2)
    undo = page.get_by_role("button", name="Undo", exact=False).first
    await undo.click()
    await expect(plan(page).locator(".plan-badge")).to_have_count(0)
    assert await plan(page).get_by_label("Routes, areas and points").locator(
        "optgroup[label='Of this mission'] option"
    ).all_inner_texts() == ["area1"]
    await page.get_by_role("button", name="Redo", exact=False).first.click()
    await expect(plan(page).locator(".plan-badge")).to_have_count(2)
    await drawing.save()
    path = desk.executive.missions / "survey.bpmn"
    mission = load_mission(path)
    tasks = [each for each in mission.activities() if isinstance(each, ScriptTask)]
    named = sorted(task.behavior.parameters[0].value for task in tasks if task.behavior)
    assert named == list(ROUTES)
    assert 'surveyor="evsg2"' in path.read_text()
    found = await desk.ask("POST", "/api/checks", {"xml": path.read_text()})
    assert [each for each in found["findings"] if each["severity"] == "error"] == []


async def test_routes_follow_their_area_and_their_pattern_is_changed(desk: Desk) -> None:
    page = await desk.home()
    drawing = await new_mission(page, "followed")
    await drawn_area(page)
    await plan(page).get_by_role("button", name="Survey…").click()
    form = plan(page).get_by_role("form", name="Survey of area1")
    await form.get_by_label("evsg1", exact=True).check()
    await form.get_by_label("evsg2", exact=True).check()
    await expect(form.get_by_role("row").filter(has_text="evsg2")).to_be_visible()
    await form.get_by_role("button", name="Make routes", exact=True).click()
    await drawing.save()
    path = desk.executive.missions / "followed.bpmn"
    before = load_mission(path).geometries
    await plan(page).get_by_label("Routes, areas and points").select_option("area1")
    await drag_vertex(page, 1, east_px=60)
    await expect(page.get_by_text("The survey of area1 was made again.")).to_be_visible()
    await drawing.save()
    after = load_mission(path).geometries
    for name in ROUTES:
        assert isinstance(after[name], Route)
        assert after[name] != before[name]

    await plan(page).get_by_label("Routes, areas and points").select_option(ROUTES[0])
    await plan(page).get_by_role("button", name="Change the pattern…").click()
    await form.get_by_label("evsg2", exact=True).uncheck()
    await form.get_by_role("button", name="Change the routes").click()
    await expect(form).to_have_count(0)
    await drawing.save()
    kept = load_mission(path).geometries
    assert ROUTES[0] in kept
    assert ROUTES[1] not in kept
    await drag_vertex(page, 1, east_px=20)  # changed by hand, it is no part of a survey any more
    await expect(plan(page).get_by_role("button", name="Change the pattern…")).to_have_count(0)


async def test_what_cannot_be_surveyed_is_said_and_nothing_is_made(desk: Desk) -> None:
    desk.refusals.append(422)
    page = await desk.home()
    await new_mission(page, "refused")
    await drawn_area(page)
    await plan(page).get_by_role("button", name="Survey…").click()
    form = plan(page).get_by_role("form", name="Survey of area1")
    await form.locator("summary", has_text="Edges").click()
    await form.get_by_label("Beyond the edge, m").fill("-9000")
    await expect(form.get_by_role("alert")).to_contain_text("nothing of the area is left")
    await expect(form.get_by_role("button", name="Make routes", exact=True)).to_be_disabled()
    await expect(plan(page).locator(LINES)).to_have_count(0)
    await form.get_by_label("Beyond the edge, m").fill("0")
    await expect(form.get_by_role("button", name="Make routes", exact=True)).to_be_enabled()
    await form.get_by_label("Name of the route").fill("evsg1")
    await expect(form.get_by_role("alert")).to_contain_text("no other route, area or vehicle")
    await page.keyboard.press("Escape")
    await expect(form).to_have_count(0)


@pytest.mark.parametrize("dark", [False, True])
async def test_the_form_needs_no_mouse_and_fits_a_phone(desk: Desk, dark: bool) -> None:
    page = await desk.edit()
    if dark:
        await page.emulate_media(color_scheme="dark")
    eyes = Accessibility(page)
    await page.get_by_role("button", name="Map", exact=True).press("Enter")
    await plan(page).get_by_label("Routes, areas and points").select_option("village")
    await plan(page).get_by_role("button", name="Survey…").press("Enter")
    form = plan(page).get_by_role("form", name="Survey of village")
    await form.get_by_label("camera", exact=True).press("Space")
    await form.get_by_role("combobox", name="Camera").select_option("Sony a6000, 16 mm")
    await form.get_by_role("slider", name="Side overlap, %").press("ArrowLeft")
    await expect(form).to_contain_text("cm a pixel")
    await form.get_by_label("evsg1", exact=True).press("Space")
    await expect(form.get_by_role("row").filter(has_text="evsg1")).to_be_visible()
    await eyes.look("survey, camera")
    await page.set_viewport_size({"width": 390, "height": 844})
    await eyes.look("survey, phone")
    await form.get_by_role("button", name="Make routes", exact=True).scroll_into_view_if_needed()
    if not dark:
        await picture(page, "survey_phone")
    await form.get_by_role("button", name="Make routes", exact=True).press("Enter")
    await expect(form).to_have_count(0)
    await expect(plan(page).get_by_role("form", name="Route village-survey1")).to_be_visible()
    eyes.assert_well()
