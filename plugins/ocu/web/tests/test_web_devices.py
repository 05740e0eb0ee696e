"""On every device: STOP in view, texts as large as chosen; the page as an app, and in German."""

import re

import pytest
from playwright.async_api import Browser, Page, expect
from test_web_phone import assert_stop_is_whole
from web_axe import Accessibility
from web_browsing import SIGN_IN, page_at
from web_desk import IN_ONE_LOOP, Desk
from web_proxy import proxy_to
from web_running import press_twice
from web_served import Served
from web_world import PASSWORD

pytestmark = IN_ONE_LOOP

DEVICES = {
    "small phone": (320, 568),
    "phone": (360, 640),
    "tall phone": (390, 844),
    "phone on its side": (844, 390),
    "small phone on its side": (640, 320),
    "phone with its keyboard up": (390, 400),
    "tablet": (1024, 768),
    "desk": (1280, 720),
    "4K": (3840, 2160),
}
USUAL = {"text-size": 100, "controls": "usual"}
LARGE = {"text-size": 200, "controls": "large"}
SET = """settings => Object.entries(settings).forEach(
  ([name, value]) => localStorage.setItem(`m2pem.${name}`, JSON.stringify(value)))"""
TEXT_PX = "parseFloat(getComputedStyle(document.body).fontSize)"
BELL = re.compile("alerts? needs? you$")


@pytest.mark.parametrize(
    "settings", [LARGE, pytest.param(USUAL, marks=pytest.mark.long)], ids=["large", "usual"]
)
async def test_stop_is_in_view_on_every_device(desk: Desk, settings: dict[str, object]) -> None:
    page = await desk.start()
    await page.evaluate(SET, settings)
    run = page.url
    for where in (run, f"{desk.executive.origin}/fleet", desk.executive.origin):
        await page.goto(where)
        await expect(page.get_by_role("button", name=BELL)).to_be_visible()
        for device, (width, height) in DEVICES.items():
            await page.set_viewport_size({"width": width, "height": height})
            await assert_seen(page, f"{where}, {device}")
    await page.get_by_role("button", name="New mission").click()
    await expect(page.get_by_role("dialog")).to_be_visible()
    for device, (width, height) in DEVICES.items():
        await page.set_viewport_size({"width": width, "height": height})
        await assert_seen(page, f"dialog, {device}")
        await expect(page.get_by_role("dialog")).to_be_in_viewport(ratio=0.99)


async def assert_seen(page: Page, where: str) -> None:
    await assert_stop_is_whole(page, where)
    await expect(page.get_by_role("button", name=BELL)).to_be_in_viewport(ratio=0.99)
    assert await page.evaluate("document.documentElement.scrollWidth <= innerWidth"), where
    assert await page.evaluate(TEXT_PX) >= 13.9, where


async def test_texts_are_as_large_as_was_chosen(desk: Desk) -> None:
    page = await desk.home()
    for width, height, chosen, least in (
        (1280, 720, 100, 14),
        (1280, 720, 200, 28),
        (390, 844, 125, 17),
        (3840, 2160, 100, 24),
    ):
        await page.set_viewport_size({"width": width, "height": height})
        await page.get_by_role("button", name="Settings").click()
        await page.get_by_role("radio", name=f"{chosen} %").check()
        await page.get_by_role("button", name="Done").click()
        assert await page.evaluate(TEXT_PX) >= least, (width, chosen)


async def test_settings_have_no_violation_and_are_remembered(desk: Desk) -> None:
    page = await desk.home()
    await page.get_by_role("button", name="Settings").click()
    eyes = Accessibility(page)
    for theme in ("Light", "Dark", "High contrast"):
        await page.get_by_role("radio", name=theme).check()
        await eyes.look(theme)
    await page.get_by_role("radio", name="Large").check()
    await eyes.look("large controls")
    await page.reload()
    await expect(page.locator("html")).to_have_attribute("data-contrast", "more")
    await expect(page.locator("html")).to_have_attribute("data-controls", "large")
    eyes.assert_well()


async def test_a_dialog_does_not_cover_that_a_stop_was_not_delivered(desk: Desk) -> None:
    page = await desk.home()
    await page.get_by_role("button", name="New mission").click()
    dialog = page.get_by_role("dialog")
    await expect(dialog).to_be_visible()
    for width, height in ((1280, 720), (390, 844), (640, 320)):
        await page.set_viewport_size({"width": width, "height": height})
        await page.route("**/api/stop-all", lambda route: route.abort())
        desk.refusals.append(0)
        await press_twice(page, lambda: page.keyboard.press("Shift+Escape"))
        said = page.locator(".undelivered")
        await expect(said).to_contain_text("STOP was NOT delivered.")
        hit = await said.evaluate(COVERED)
        assert hit == [], (width, hit)
        top = await dialog.evaluate("it => it.getBoundingClientRect().top")
        assert top >= await said.evaluate("it => it.getBoundingClientRect().bottom"), width
        await said.get_by_role("button", name="Give up this STOP").click()
        await expect(said).to_have_count(0)
        await page.unroute("**/api/stop-all")
    desk.watched.complaints.clear()  # requests that this test has aborted


# What lies above the message at its corners and in its middle.
COVERED = """(said) => {
  const { left, top, right, bottom } = said.getBoundingClientRect();
  const points = [[left + 2, top + 2], [right - 2, bottom - 2],
    [(left + right) / 2, (top + bottom) / 2]];
  return points.map(([x, y]) => document.elementFromPoint(x, y))
    .filter((found) => !said.contains(found)).map((found) => found?.outerHTML.slice(0, 100));
}"""


async def test_the_page_can_be_installed(chromium: Browser, executive: Served) -> None:
    async with page_at(chromium, f"{executive.origin}/sign-in", offline=True) as it:
        await it.page.evaluate("navigator.serviceWorker.ready.then(() => true)")
        session = await it.context.new_cdp_session(it.page)
        manifest = await session.send("Page.getAppManifest")
        assert manifest["errors"] == []
        assert manifest["url"] == f"{executive.origin}/manifest.webmanifest"
        found = await session.send("Page.getInstallabilityErrors")
        # Profiles of tests are private ones, in which nothing is ever installed.
        errors = {each["errorId"] for each in found["installabilityErrors"]}
        assert errors <= {"in-incognito"}


async def test_without_the_executive_the_page_says_what_it_saw_last(
    chromium: Browser, desk: Desk
) -> None:
    await desk.driving()
    async with (
        proxy_to(desk.executive.origin) as proxy,
        page_at(chromium, f"http://127.0.0.1:{proxy.port}/healthz", offline=True) as it,
    ):
        page = it.page
        await page.evaluate(SIGN_IN, ["otto", PASSWORD])
        await page.goto(f"http://127.0.0.1:{proxy.port}/")
        await expect(page.locator(".link-open")).to_have_count(1)
        await page.evaluate("navigator.serviceWorker.ready.then(() => true)")
        await page.wait_for_function(
            "() => JSON.parse(localStorage.getItem('m2pem.last-known'))?.runs.length > 0"
        )
        kept = await page.evaluate(KEPT)
        assert kept
        assert [each for each in kept if not re.match(r"^/(assets/.*|favicon.svg)?$", each)] == []
        await it.context.set_offline(True)
        await page.goto(f"http://127.0.0.1:{proxy.port}/fleet")
        await expect(
            page.get_by_role("heading", name="No connection to the executive")
        ).to_be_visible()
        await expect(page.get_by_text("STOP cannot be sent from here.")).to_be_visible()
        await expect(page.locator(".no-connection li")).to_contain_text("vignette1: Running")
        await expect(page.locator(".no-connection")).to_contain_text("ago")
        await it.context.set_offline(False)
        await expect(page.locator(".fleet-table tbody tr").first).to_be_visible()


KEPT = """async () => {
  const found = [];
  for (const name of await caches.keys()) {
    const cache = await caches.open(name);
    for (const request of await cache.keys()) found.push(new URL(request.url).pathname);
  }
  return found;
}"""


async def test_the_page_is_german_for_a_browser_that_is(
    chromium: Browser, executive: Served
) -> None:
    url = f"{executive.origin}/healthz"
    async with page_at(chromium, url, width=390, height=844, language="de-DE") as it:
        await it.page.evaluate(SIGN_IN, ["anna", PASSWORD])
        await it.page.goto(executive.origin)
        await expect(it.page.get_by_role("heading", name="Missionen")).to_be_visible()
        await expect(it.page.locator("html")).to_have_attribute("lang", "de")
        await it.page.get_by_role("button", name="Einstellungen").click()
        await it.page.get_by_role("radio", name="English").check()
        await it.page.get_by_role("button", name="Seite neu laden").click()
        await expect(it.page.get_by_role("heading", name="Missions")).to_be_visible()
        await expect(it.page.locator("html")).to_have_attribute("lang", "en")
        it.assert_well()
