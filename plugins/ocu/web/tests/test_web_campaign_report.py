"""The HTML report of a campaign in a real browser: alone, accessible, and with the numbers of the
Markdown report."""

import re
from pathlib import Path

import pytest
from playwright.async_api import Page, Request, expect
from web_axe import Accessibility
from web_browsing import browser

from m2pem.campaign.campaign import CampaignResult, run_campaign
from m2pem.campaign.report_files import write_report
from m2pem.campaign.runs import order_of
from m2pem.executive.loading import load_source
from m2pem.fleet.default_fleet import fleet_for
from tests.campaign.conftest import sequence

MARKUP = "<img src=https://m2pem.invalid/a.png>|&amp;"
VARIATIONS = f"""
behaviors:
  A: {{fails: {{probability: 0.2, after: 1..5 s, error: '{MARKUP}'}}}}
  B: {{fails: {{probability: 0.1}}, duration: 5..15 s}}
vehicles: {{uav1: {{battery: 50 %..100 %}}}}
wind: {{speed: 0..8 m/s}}
"""
QUICK = '<m2pem:requirement id="quick" ltl="&lt;&gt;[0 s, 22 s] ended(completed)"/>'
TABLES = """() => [...document.querySelectorAll("table")].map((table) =>
  [...table.rows].map((row) => [...row.cells].map((cell) => cell.textContent)))"""
BACKGROUND = "() => getComputedStyle(document.body).backgroundColor"
CHART_BACKGROUND = "() => getComputedStyle(document.querySelector('.chart > rect')).fill"
PAPER = 718
"""Pixels across A4, without its margins."""

WHITE = "rgb(255, 255, 255)"


def campaign(mission: bytes, variations: str, runs: int) -> CampaignResult:
    loaded = load_source(mission)
    order = order_of(loaded, fleet_for(loaded), variations.encode(), 7)
    return run_campaign(order, runs)


def markdown_tables(text: str) -> list[list[list[str]]]:
    """The cells of the tables of a Markdown file, by their rows."""
    tables: list[list[list[str]]] = []
    above = ""
    for line in text.splitlines():
        if line.startswith("|"):
            if not above.startswith("|"):
                tables.append([])
            if not line.startswith("|---"):
                cells = re.split(r" (?<!\\)\| ", line.removeprefix("| ").removesuffix(" |"))
                tables[-1].append([each.replace("\\|", "|").strip("` ") for each in cells])
        above = line
    return tables


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    inside = f"<extensionElements>{QUICK}</extensionElements><startEvent"
    mission = sequence("A", "B").replace(b"<startEvent", inside.encode(), 1)
    folder = tmp_path_factory.mktemp("campaign") / ("with_a_long_name_" * 8)  # so are commands
    folder.mkdir()
    other = campaign(sequence("B", "A"), VARIATIONS, 60)
    write_report(folder, campaign(mission, VARIATIONS, 60), other)
    return folder


async def opened(page: Page, folder: Path) -> list[str]:
    """Open the report; the list has the addresses that the page asks for, and its errors."""
    noted: list[str] = []

    def note(request: Request) -> None:
        noted.append(request.url)

    page.on("request", note)
    page.on("console", lambda message: noted.append(message.text))
    page.on("pageerror", lambda error: noted.append(str(error)))
    await page.goto((folder / "report.html").as_uri(), wait_until="networkidle")
    return noted


async def test_it_loads_nothing_else_and_has_the_numbers_of_the_markdown(folder: Path) -> None:
    async with browser() as started:
        page = await started.new_page()
        noted = await opened(page, folder)
        assert noted == [(folder / "report.html").as_uri()]
        tables = await page.evaluate(TABLES)
    written = markdown_tables((folder / "report.md").read_text(encoding="utf-8"))
    assert tables == written
    assert len(tables) == 6
    assert any(MARKUP in row for row in tables[0])


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1200, 360])
async def test_it_is_accessible_in_light_and_dark_and_on_a_phone(
    folder: Path, scheme: str, width: int
) -> None:
    async with browser() as started:
        page = await started.new_page(
            color_scheme="dark" if scheme == "dark" else "light",
            viewport={"width": width, "height": 800},
            bypass_csp=True,  # axe is a script, which the page does not allow
        )
        await opened(page, folder)
        accessibility = Accessibility(page)
        await accessibility.look(f"the report, {scheme}, {width} px wide")
        accessibility.assert_well()
        wide = await page.evaluate("() => document.documentElement.scrollWidth")
        assert wide == width
        for element in (BACKGROUND, CHART_BACKGROUND):
            assert (await page.evaluate(element) == WHITE) is (scheme == "light")
        await page.emulate_media(media="print")
        await page.set_viewport_size({"width": PAPER, "height": 1000})
        assert await page.evaluate("() => document.documentElement.scrollWidth") == PAPER
        for element in (BACKGROUND, CHART_BACKGROUND):
            assert await page.evaluate(element) == WHITE


async def test_screen_readers_get_what_the_charts_show(folder: Path) -> None:
    async with browser() as started:
        page = await started.new_page()
        await opened(page, folder)
        times = page.get_by_role("img", name="Times")
        await expect(times).to_have_accessible_description(
            re.compile(r"Runs by time until the end, s: \d+ good runs between [\d.]+ and")
        )
        effects = page.get_by_role("img", name="What failures depend on")
        await expect(effects).to_have_accessible_description(
            re.compile(r"behaviors\.A\.fails: with it \+0\.\d+ \(")
        )
        # Each row of the table is in the chart, too.
        [table] = [each for each in await page.evaluate(TABLES) if each[0][0] == "what was drawn"]
        shown = await effects.locator("text").all_text_contents()
        assert {f"{row[0]}: {row[1]}" for row in table[1:]} <= set(shown)
