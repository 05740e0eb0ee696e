"""Plots of telemetry beside the time line, of a run that goes on and of one that is over."""

import re
from pathlib import Path

from playwright.async_api import Locator, Page, expect
from web_axe import Accessibility
from web_desk import IN_ONE_LOOP, Desk
from web_pictures import picture

pytestmark = IN_ONE_LOOP


async def open_plots(page: Page) -> Locator:
    await page.get_by_role("button", name="Plots", exact=True).click()
    pane = page.get_by_role("region", name="Plots")
    await expect(pane.locator("canvas").first).to_be_visible()
    return pane


async def only(pane: Locator, folder: str, *names: str) -> None:
    """Choose these things of a folder, and nothing else."""
    summary = pane.locator("summary", has_text=folder)
    await summary.click()
    await pane.get_by_role("button", name="None", exact=True).locator("visible=true").click()
    for name in names:
        await pane.get_by_role("checkbox", name=name, exact=True).check()
    await summary.press("Escape")


def value(pane: Locator, resource: str, column: int) -> Locator:
    """A cell of the table of values."""
    header = pane.page.get_by_role("rowheader", name=resource, exact=True)
    row = pane.get_by_role("row").filter(has=header)
    return row.get_by_role("cell").nth(column)


async def test_an_operator_plots_what_a_vehicle_does(desk: Desk, tmp_path: Path) -> None:
    page = await desk.driving()
    await page.set_viewport_size({"width": 1440, "height": 960})
    pane = await open_plots(page)
    await only(pane, "Vehicles", "evsg1", "evsg2")
    await only(pane, "Quantities", "Battery, %", "Speed, m/s", "Heading, °", "Link")
    # Live: the table says what is now.
    await expect(pane.locator("canvas")).to_have_count(4)
    await expect(value(pane, "evsg1", 0)).to_have_text(re.compile(r"\d+(\.\d)? %"))
    await expect(value(pane, "evsg1", 1)).to_have_text(re.compile(r"[1-9]\.\d m/s"))
    await expect(value(pane, "evsg1", 3)).to_have_text("connected")
    eyes = Accessibility(page)
    await eyes.look("plots", ".plots-pane")
    # One cursor: what is pointed at in the time line is read in the plots.
    times = pane.get_by_role("slider")
    await page.locator(".timeline-plot").hover(position={"x": 20, "y": 60})
    await expect(pane.locator("caption")).not_to_contain_text("present")
    await expect(pane.locator(".time-cursor")).to_have_count(1)
    await times.hover(position={"x": 30, "y": 60})
    await expect(page.locator(".timeline-plot .time-cursor")).to_have_count(1)
    await expect(pane.locator(".plot-tip")).to_contain_text("Battery")
    # One axis: who zooms the plots zooms the time line.
    await times.focus()
    await times.press("Home")
    await expect(pane.locator("caption")).to_have_text("Values at 0:00.0")
    await times.press("+")
    there, here = page.locator(".timeline-plot .mark text"), pane.locator(".plots-marks text")
    await expect(there.first).not_to_have_text("0:00")
    assert await there.all_text_contents() == await here.all_text_contents()
    await page.mouse.move(0, 0)
    await pane.get_by_role("button", name="All", exact=True).locator("visible=true").click()
    async with page.expect_download() as found:
        await pane.get_by_role("button", name="CSV").click()
    await (await found.value).save_as(tmp_path / "plotted.csv")
    lines = (tmp_path / "plotted.csv").read_text("utf-8").splitlines()
    assert lines[0] == "time_s,resource,battery_percent,speed_m_s,heading_deg,link"
    assert {line.split(",")[1] for line in lines[1:]} == {"evsg1", "evsg2"}
    await picture(page, "plots")
    eyes.assert_well()


async def test_a_click_into_the_plots_of_a_replay_goes_to_that_time(desk: Desk) -> None:
    page = await desk.driving()
    await expect(page.locator(".card-numbers").first).to_contain_text("m/s")
    run = page.url.rsplit("/", 1)[1]
    await desk.ask("POST", f"/api/runs/{run}/stop", {"reason": "seen enough"})
    await desk.until(f"/api/runs/{run}", lambda said: said["status"] == "stopped")
    await page.goto(f"{desk.executive.origin}/runs/{run}?t=0")
    position = page.get_by_role("slider", name="Position")
    await expect(position).to_be_visible()
    pane = await open_plots(page)
    await expect(value(pane, "evsg1", 0)).to_have_text(re.compile(r"\d+(\.\d)? %"))
    times = pane.get_by_role("slider")
    box = await times.bounding_box()
    assert box is not None
    await times.click(position={"x": box["width"] / 2, "y": 60})
    await expect(position).not_to_have_attribute("aria-valuetext", "0:00.0")
    await times.press("Home")
    await times.press("Enter")
    await expect(position).to_have_attribute("aria-valuetext", "0:00.0")
    # Without colours, too, each line differs from the others.
    assert len(await pane.evaluate(LINES)) == 1
    await page.emulate_media(contrast="more")
    await page.wait_for_function(f"() => ({LINES})(document).length === 2")
    await page.emulate_media(contrast="no-preference", forced_colors="active")
    await page.wait_for_function(f"() => ({LINES})(document).length === 2")


# Dashes and widths of the first lines of the legend: as many as differ.
LINES = """(there) => [...new Set([...there.querySelectorAll(".swatch line")].slice(0, 2)
  .map((line) => getComputedStyle(line))
  .map(({ strokeDasharray, strokeWidth }) => `${strokeDasharray} ${strokeWidth}`))]"""
