"""Rehearsals and starts from the editor, in a real browser."""

import asyncio
from pathlib import Path

import pytest
from playwright.async_api import Browser, Page, Route, expect
from web_browsing import KEY, page_at
from web_desk import IN_ONE_LOOP, Desk
from web_served import served

pytestmark = IN_ONE_LOOP

REAL = """\
version: 1
name: field
origin: {lat: 38.1075, lon: -77.3192, alt: 60.0}
vehicles:
  uav1:
    domain: air
    arbiter: mavlink
    connection: {url: "udpin://127.0.0.1:0", system_id: 1}
"""
TAKEOFF = """\
<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"
  xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="urn:field">
  <process id="UP" isExecutable="true">
    <startEvent id="Start"/>
    <sequenceFlow id="A" sourceRef="Start" targetRef="Up"/>
    <scriptTask id="Up"><extensionElements>
      <m2pem:behavior type="vehicle" name="takeoff">
        <m2pem:properties><m2pem:property name="altitude" value="20 m"/></m2pem:properties>
        <m2pem:resources><m2pem:role name="uav" vehicle="uav1"/></m2pem:resources>
      </m2pem:behavior></extensionElements></scriptTask>
    <sequenceFlow id="B" sourceRef="Up" targetRef="End"/>
    <endEvent id="End"/>
  </process>
</definitions>
"""


async def runs_of(page: Page) -> list[str]:
    """The missions of all runs."""
    found: list[str] = await page.evaluate(
        f"fetch('/api/runs', {{ headers: {{ {KEY} }} }}).then((answer) => answer.json())"
        ".then((runs) => runs.map(({mission}) => mission))"
    )
    return [Path(each).stem for each in found]


async def test_what_is_drawn_is_rehearsed_with_what_the_form_scripts(desk: Desk) -> None:
    page = await desk.edit(tab="Run")
    part = page.get_by_role("region", name="Rehearse")
    await part.get_by_text("What happens in the rehearsal").click()
    visits = part.get_by_role("group", name="USER SEND ROUTE")
    await visits.get_by_role("button", name="+ visit").click()
    await visits.get_by_role("button", name="+ visit").click()
    await visits.get_by_label("visit 2").select_option("abort")
    await part.get_by_role("button", name="Script a service").click()
    await expect(part.get_by_role("button", name="Rehearse")).to_be_disabled()
    await part.get_by_label("Value").fill("gpr")
    await part.get_by_label("Value").blur()
    await part.get_by_role("button", name="Write it as YAML").click()
    await expect(part.get_by_label("Answers file (YAML)")).to_have_value(
        "answers:\n  UserSendRoute: [continue, abort]\n"
        "services:\n  Detector:\n    - {after: 5 s, write: {detection.type: gpr}}\n"
    )
    # Twice in a row is once.
    posts: list[str] = []
    page.on("request", lambda sent: posts.append(sent.url) if sent.method == "POST" else None)
    await part.get_by_role("button", name="Rehearse").dblclick()
    outcome = part.get_by_role("region", name="What came of it")
    await expect(outcome.get_by_role("heading", name="Terminated")).to_be_visible()
    await expect(outcome.get_by_role("button", name="reverse", exact=False)).to_be_visible()
    assert len([url for url in posts if url.endswith("/api/rehearsals")]) == 1
    async with page.expect_popup() as opened:
        await outcome.get_by_role("link", name="Watch the rehearsal").click()
    watched = await opened.value
    assert "/rehearsals/" in watched.url


@pytest.mark.long
async def test_what_is_typed_as_yaml_is_refused_with_the_reason_or_read_back_into_the_form(
    desk: Desk,
) -> None:
    page = await desk.edit(tab="Run")
    part = page.get_by_role("region", name="Rehearse")
    await part.get_by_text("What happens in the rehearsal").click()
    await part.get_by_role("button", name="Write it as YAML").click()
    yaml = part.get_by_label("Answers file (YAML)")
    back = part.get_by_role("button", name="Back to the form")
    typed = "answers: {UserSendRout: [continue, abort]}\nservices: {Detector: [{after: 2 min}]}\n"
    await yaml.fill(typed)
    await back.click()
    told = part.get_by_text("answers.UserSendRout: the form has no such task")
    await expect(told).to_be_visible()
    await expect(yaml).to_have_value(typed)
    await part.get_by_role("button", name="Rehearse").click()
    refused = page.get_by_role("alert").filter(has_text="could not be rehearsed")
    await expect(refused).to_contain_text("UserSendRoute")
    await yaml.fill(typed.replace("Rout:", "Route:"))
    await back.click()
    visits = part.get_by_role("group", name="USER SEND ROUTE")
    await expect(visits.get_by_label("visit 2")).to_have_value("abort")
    await expect(part.get_by_label("After, in seconds")).to_have_value("120")
    # A row as it is added can be rehearsed.
    await part.get_by_role("button", name="Script a behavior").click()
    await part.get_by_role("button", name="Rehearse").click()
    outcome = part.get_by_role("region", name="What came of it")
    await expect(outcome.get_by_role("heading", name="Terminated")).to_be_visible()


async def test_a_simulated_run_starts_once_and_is_shown(desk: Desk) -> None:
    page = await desk.edit(tab="Run")
    panel = page.get_by_role("tabpanel", name="Run")
    await panel.get_by_role("button", name="Add data").click()
    await panel.get_by_label("name", exact=True).fill("mission.speed")
    await panel.get_by_label("Value of mission.speed").fill("1.5")
    await expect(panel.get_by_text("number", exact=True)).to_be_visible()
    before = await runs_of(page)
    await page.get_by_role("button", name="Start", exact=True).dblclick()
    await page.wait_for_url("**/runs/*")
    assert await runs_of(page) == [*before, "vignette1"]
    reality = page.locator("header .reality")
    await expect(reality).to_have_text("Simulated")


async def test_a_mission_can_be_started_as_soon_as_it_is_drawn(desk: Desk) -> None:
    page, comes = desk.page, asyncio.Event()

    async def late(route: Route) -> None:
        await comes.wait()
        await route.continue_()

    await page.route("**/api/missions/vignette1", late)
    await page.goto(f"{desk.executive.origin}/missions/vignette1")
    await page.get_by_role("tab", name="Run", exact=True).click()
    start = page.get_by_role("button", name="Start", exact=True)
    rehearse = page.get_by_role("button", name="Rehearse", exact=True)
    await expect(start).to_be_disabled()
    await expect(rehearse).to_be_disabled()
    await page.get_by_role("tab", name="Verify", exact=True).click()
    verify = page.get_by_role("button", name="Verify", exact=True)
    await expect(verify).to_be_disabled()
    comes.set()
    await expect(verify).to_be_enabled()
    await page.get_by_role("tab", name="Run", exact=True).click()
    await expect(rehearse).to_be_enabled()
    await start.click()
    await page.wait_for_url("**/runs/*")


async def test_real_vehicles_start_only_when_that_was_confirmed(
    chromium: Browser, tmp_path: Path
) -> None:
    fleet = tmp_path / "field.yaml"
    fleet.write_text(REAL)
    with served(tmp_path, fleet=fleet, words=("--journal", "memory:")) as executive:
        (executive.missions / "up.bpmn").write_text(TAKEOFF)
        async with page_at(chromium, executive.url) as it:
            page = it.page
            await expect(page.locator("header strong.reality")).to_have_text("REAL VEHICLES")
            await page.get_by_role("link", name="up", exact=True).click()
            await page.get_by_role("tab", name="Run", exact=True).click()
            start = page.get_by_role("button", name="Start with real vehicles")
            await start.click()
            dialog = page.get_by_role("dialog", name="Start with real vehicles?")
            await expect(dialog).to_contain_text("REAL VEHICLES will move.")
            await page.keyboard.press("Enter")  # the focus is not on what starts them
            await dialog.get_by_role("button", name="Do not start").click()
            await expect(dialog).to_have_count(0)
            assert await runs_of(page) == []
            await start.click()
            await dialog.get_by_role("button", name="Start: real vehicles move").click()
            await page.wait_for_url("**/runs/*")
            assert await runs_of(page) == ["up"]
            it.assert_well()
