"""Operators look through cameras: streams of real servers in a real browser."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest
from playwright.async_api import Locator, Page, async_playwright, expect
from test_web_alerts import look
from web_axe import Accessibility
from web_browsing import ARGUMENTS, chromium, page_at
from web_cameras import cameras
from web_desk import IN_ONE_LOOP
from web_pictures import picture
from web_world import PLUGINS, WITHIN_S, World, serving

from m2pem.api.clock import SystemClock
from m2pem.executive.executive import Executive
from m2pem.fleet.fleet import Fleet
from m2pem.fleet.fleet_file import load_fleet
from m2pem.journal import MemoryJournal

pytestmark = IN_ONE_LOOP

# Chromium connects no WebRTC over 127.0.0.1 otherwise, and hides addresses by multicast names.
WEBRTC = ["--allow-loopback-in-peer-connection", "--disable-features=WebRtcHideLocalIpsWithMdns"]

FLEET = """
version: 1
name: cameras
origin: {{lat: 38.1075, lon: -77.3192}}
vehicles:
  ugv1:
    domain: ground
    arbiter: sim
    payloads:
      mast: {{connection: {{kind: ptz}}, video: {{url: "{base}/hls/index.m3u8", kind: hls}}}}
      front: {{connection: {{kind: ptz}}, video: {{url: "{base}/whep", kind: webrtc}}}}
  uav1:
    domain: air
    arbiter: sim
    payloads:
      belly: {{connection: {{kind: ptz}}, video: {{url: "{base}/mjpeg", kind: mjpeg}}}}
      old: {{connection: {{kind: ptz}}, video: {{url: "{base}/closed", kind: mjpeg}}}}
      still:
        connection: {{kind: ptz}}
        video: {{url: "{base}/image", kind: image, every: 0.5 s}}
"""


def fleet_of(folder: Path, base: str) -> Fleet:
    path = folder / "cameras.yaml"
    path.write_text(FLEET.format(base=base), "utf-8")
    return load_fleet(path)


@asynccontextmanager
async def serving_fleet(fleet: Fleet, folder: Path) -> AsyncIterator[World]:
    running = Executive(fleet, MemoryJournal(), PLUGINS, SystemClock(1.0))
    async with running, serving(running.control, folder, {}) as world:
        yield world


def camera(page: Page, name: str) -> Locator:
    return page.locator(".camera").filter(has=page.get_by_text(name, exact=True))


async def assert_picture(tile: Locator) -> None:
    """Something other than one colour is seen."""
    drawn = await tile.locator(".camera-host > *").evaluate(
        "it => [it.videoWidth ?? it.naturalWidth, it.videoHeight ?? it.naturalHeight]"
    )
    assert drawn == [320, 180]


@pytest.mark.tried_with(
    "aiortc", "serves WebRTC (WHEP) to the page", kind="Cameras", result="a picture is seen"
)
@pytest.mark.tried_with(
    "hls.js", "plays HLS on the page", kind="Cameras", result="a picture is seen"
)
async def test_operators_look_through_cameras_of_every_kind(tmp_path: Path) -> None:
    hls = tmp_path / "hls"
    hls.mkdir()
    async with cameras(hls) as there, async_playwright() as playwright:
        started = await playwright.chromium.launch(
            executable_path=chromium(), args=[*ARGUMENTS, *WEBRTC]
        )
        async with (
            serving_fleet(fleet_of(tmp_path, there.base), tmp_path) as world,
            page_at(started, world.ocu.url, width=1440, height=960) as watched,
        ):
            page = watched.page
            run = (await world.asked()).run
            await page.goto(f"{world.base}/runs/{run}")
            await page.get_by_role("tab", name="Cameras").click()
            for name in ("ugv1/mast", "ugv1/front", "uav1/belly", "uav1/still"):
                await expect(camera(page, name).locator(".camera-state")).to_have_text("live")
                await assert_picture(camera(page, name))
            old = camera(page, "uav1/old").locator(".camera-state")
            await expect(old).to_have_text("shown; age not known")
            eyes = Accessibility(page)
            await eyes.look("cameras", ".cameras-pane")
            eyes.assert_well()
            await picture(page, "cameras")
            # What a camera no longer sees is not taken for what it sees.
            there.deaf = there.broken = True
            still = camera(page, "uav1/still")
            await expect(still).to_contain_text("address gives no picture")
            there.broken = False
            await expect(still.locator(".camera-state")).to_have_text("live")
            frozen = camera(page, "uav1/belly")
            await expect(frozen).to_contain_class("camera-old")
            await expect(frozen.locator(".camera-state")).to_contain_text("no picture for")
            there.deaf = False
            await expect(frozen.locator(".camera-state")).to_have_text("live")
            # Who looks elsewhere lets go of the camera.
            assert not there.left.is_set()
            await page.get_by_role("button", name="Large uav1/belly").click()
            await expect(page.locator(".camera")).to_have_count(1)
            async with asyncio.timeout(WITHIN_S):
                await there.left.wait()
            refused = ("404 (Not Found)", f"{there.base}/closed", "ERR_FAILED")
            said = [each for each in watched.complaints if not any(map(each.__contains__, refused))]
            assert said == []
        await started.close()


async def test_the_page_of_the_fleet_shows_the_cameras_of_a_vehicle_on_request(
    tmp_path: Path,
) -> None:
    hls = tmp_path / "hls"
    hls.mkdir()
    async with (
        cameras(hls) as there,
        serving_fleet(fleet_of(tmp_path, there.base), tmp_path) as world,
        async_playwright() as playwright,
    ):
        started = await playwright.chromium.launch(
            executable_path=chromium(), args=[*ARGUMENTS, *WEBRTC]
        )
        async with page_at(started, world.ocu.url, width=1440, height=960) as watched:
            page = watched.page
            await page.goto(f"{world.base}/fleet")
            await page.get_by_role("row", name="ugv1").first.click()
            show = page.get_by_role("button", name="Show what its cameras see")
            await expect(show).to_be_visible()
            assert not await page.evaluate(
                "performance.getEntriesByType('resource').some(({name}) => /CameraList/.test(name))"
            )
            await show.click()
            await expect(page.locator(".camera")).to_have_count(2)
            await expect(camera(page, "ugv1/front").locator(".camera-state")).to_have_text("live")
            # Who chooses another vehicle lets go of the cameras.
            assert not there.left.is_set()
            await page.get_by_role("row", name="uav1").first.click()
            await expect(page.locator(".camera")).to_have_count(3)
            async with asyncio.timeout(WITHIN_S):
                await there.left.wait()
            for name in ("uav1/belly", "uav1/still"):
                await expect(camera(page, name).locator(".camera-state")).to_have_text("live")
                await assert_picture(camera(page, name))
            await look(page, "fleet_cameras")
            eyes = Accessibility(page)
            await eyes.look("cameras of the fleet", ".fleet-panel")
            eyes.assert_well()
            await page.get_by_role("button", name="Settings").click()
            await page.get_by_role("radio", name="Dark").check()
            await page.get_by_role("button", name="Done").click()
            await expect(page.locator("html")).to_have_attribute("data-theme", "dark")
            await look(page, "fleet_cameras_dark")
            await page.get_by_role("button", name="Hide what its cameras see").click()
            await expect(page.locator(".camera")).to_have_count(0)
        await started.close()


async def test_the_page_loads_from_the_cameras_of_the_fleet_and_from_nowhere_else(
    tmp_path: Path,
) -> None:
    async with serving_fleet(fleet_of(tmp_path, "http://10.0.0.5:8080"), tmp_path) as world:
        browser = await world.browser()
        answer = await browser.http.get("/")
        policy = dict(
            each.strip().partition(" ")[::2]
            for each in answer.headers["content-security-policy"].split(";")
        )
        for directive in ("img-src", "media-src", "connect-src"):
            assert "http://10.0.0.5:8080" in policy[directive].split()
        assert "10.0.0.5" not in policy["script-src"] + policy["default-src"]
        payloads = (await browser.http.get("/api/fleet")).json()["payloads"]
        videos = {each["id"]: each["video"] for each in payloads}
        assert videos["uav1/still"] == {
            "url": "http://10.0.0.5:8080/image",
            "kind": "image",
            "every_s": 0.5,
        }
