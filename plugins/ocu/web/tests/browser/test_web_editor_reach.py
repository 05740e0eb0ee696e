"""The editor and the first page for everybody: axe finds nothing, and they load soon."""

import pytest
from axe_playwright_python.async_playwright import Axe
from browser_world import Browsing
from playwright.async_api import Page, expect

THEMES = ["light", "dark"]


async def violations(page: Page) -> list[str]:
    """What axe has against a page; the canvas is bpmn-js's own drawing."""
    found = await Axe().run(page)
    return [
        f"{each['id']}: {[node['html'][:200] for node in each['nodes']]}"
        for each in found.response["violations"]
    ]


@pytest.mark.parametrize("theme", THEMES)
async def test_axe_has_nothing_against_the_first_page(browsing: Browsing, theme: str) -> None:
    page = await browsing.begin()
    await page.emulate_media(color_scheme=theme)  # type: ignore[arg-type]
    await page.reload()
    await expect(page.get_by_role("link", name="vignette1", exact=True)).to_be_visible()
    assert await violations(page) == []
    await page.get_by_role("button", name="New mission").click()
    await expect(page.get_by_role("dialog")).to_be_visible()
    assert await violations(page) == []


@pytest.mark.parametrize("theme", THEMES)
async def test_axe_has_nothing_against_the_editor(browsing: Browsing, theme: str) -> None:
    page = await browsing.begin()
    await page.emulate_media(color_scheme=theme)  # type: ignore[arg-type]
    await browsing.edit("vignette1", page)
    assert await violations(page) == []
    for element in ("DriveRoute", "UserSendRoute", "SignalStop", "CallDetection", "Detector"):
        await page.click(f"[data-element-id={element}]")
        await expect(page.get_by_label("Name", exact=True).first).to_be_visible()
        assert await violations(page) == []
    await page.get_by_role("combobox").first.click()
    assert await violations(page) == []
    await page.click("[data-element-id=Reverse]")
    await page.get_by_label("Distance").fill("10 s")
    await page.get_by_role("tab", name="Problems").click()
    await expect(page.locator(".m2-problem").first).to_be_visible()
    assert await violations(page) == []
    await page.get_by_role("button", name="More").click()
    assert await violations(page) == []
    await page.keyboard.press("Escape")
    await page.keyboard.press("?")
    await expect(page.get_by_role("dialog")).to_be_visible()
    assert await violations(page) == []


async def test_the_mark_of_bpmn_io_is_seen_whole(browsing: Browsing) -> None:
    page = await browsing.edit("mehds_vignette_4")
    await page.get_by_role("button", name="Overview").click()
    covered = await page.evaluate(
        """() => {
          const mark = document.querySelector(".bjs-powered-by");
          const { left, right, top, bottom } = mark.getBoundingClientRect();
          const points = [[left + 3, top + 3], [right - 3, top + 3], [left + 3, bottom - 3],
                          [right - 3, bottom - 3], [(left + right) / 2, (top + bottom) / 2]];
          return points.filter(([x, y]) => !mark.contains(document.elementFromPoint(x, y)));
        }"""
    )
    assert covered == []


async def test_the_first_load_of_the_editor_is_small(browsing: Browsing) -> None:
    page = await browsing.begin()
    session = await page.context.new_cdp_session(page)
    await session.send("Network.enable")
    await session.send("Network.setCacheDisabled", {"cacheDisabled": True})
    received: list[float] = []
    session.on("Network.loadingFinished", lambda event: received.append(event["encodedDataLength"]))
    await browsing.edit("vignette1", page)
    await page.wait_for_load_state("networkidle")
    assert sum(received) < 450_000
