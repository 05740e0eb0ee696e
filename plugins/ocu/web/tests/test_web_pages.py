"""The page of an executive of this process, in a real browser: how people come in, and what they
are told of vehicles that are not heard."""

import asyncio
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from playwright.async_api import Browser, Route, expect
from web_browsing import page_at
from web_desk import IN_ONE_LOOP
from web_map_seen import LOST, colours, middle_drawn, vehicles_on
from web_world import VEHICLE, MakeWorld, executive, serving

from m2pem.api.arbiter import Arbiter
from m2pem.journal import MemoryJournal
from m2pem.mission.catalogue import ResourceId
from m2pem.plugins import PluginManager
from m2pem.simulation.arbiters import SimArbiter

pytestmark = IN_ONE_LOOP


async def test_the_printed_address_signs_in(chromium: Browser, world: MakeWorld) -> None:
    async with world() as here, page_at(chromium, here.ocu.url) as it:
        await it.page.get_by_role("heading", name="Missions").wait_for()
        assert "token" not in it.page.url
        it.assert_well()


class Kept(PluginManager):
    """Keeps the simulated arbiter that an executive makes: its links can be cut."""

    made: SimArbiter

    def arbiter(self, name: str) -> Callable[..., Arbiter]:
        make = super().arbiter(name)

        def keep(*given: Any) -> Arbiter:
            arbiter = make(*given)
            assert isinstance(arbiter, SimArbiter)
            self.made = arbiter
            return arbiter

        return keep


async def test_a_vehicle_whose_link_is_lost_is_gray_and_comes_back(
    chromium: Browser, tmp_path: Path
) -> None:
    plugins = Kept()
    async with (
        executive(MemoryJournal(), plugins) as running,
        serving(running.control, tmp_path, {}) as here,
        page_at(chromium, here.ocu.url) as it,
    ):
        page = it.page
        prompt = await here.asked()
        await page.goto(f"{here.base}/runs/{prompt.run}")
        card = page.locator(".card", has_text=VEHICLE)
        listed = vehicles_on(page)
        await expect(card).not_to_contain_class("card-stale")
        await expect(listed).to_contain_text(f"{VEHICLE}: OK")
        assert LOST not in await colours(page)
        await page.mouse.move(*await middle_drawn(page))
        await expect(page.locator(".map-over-vehicle")).to_be_attached()
        plugins.made.lose_link(ResourceId(VEHICLE))
        await expect(card).to_contain_class("card-stale")
        await expect(card).to_contain_text("silent for")
        await expect(listed).to_contain_text(f"{VEHICLE}: Lost")
        assert LOST in await colours(page)
        plugins.made.restore_link(ResourceId(VEHICLE))
        await expect(card).not_to_contain_class("card-stale")
        await expect(card).not_to_contain_text("silent for")
        await expect(listed).to_contain_text(f"{VEHICLE}: OK")
        assert LOST not in await colours(page)
        it.assert_well()


FLEET_PAGE = re.compile(r"/assets/Fleet-[\w-]+\.js$")


async def test_who_leaves_a_page_before_it_is_loaded_sees_the_next_one(
    chromium: Browser, world: MakeWorld
) -> None:
    async with world() as here, page_at(chromium, here.ocu.url) as it:
        comes = asyncio.Event()

        async def late(route: Route) -> None:
            await comes.wait()
            await route.continue_()

        await it.page.route(FLEET_PAGE, late)
        pages = it.page.get_by_role("navigation", name="Pages")
        missions = it.page.get_by_role("heading", name="Missions")
        await expect(missions).to_be_visible()
        await pages.get_by_role("link", name="Fleet").click()
        await expect(it.page.get_by_text("Loading…")).to_be_visible()
        await pages.get_by_role("link", name="Missions").click()
        await expect(missions).to_be_visible()
        async with it.page.expect_event(
            "requestfinished", lambda request: FLEET_PAGE.search(request.url) is not None
        ):
            comes.set()
        await expect(missions).to_be_visible()
        await pages.get_by_role("link", name="Fleet").click()
        await expect(it.page.get_by_role("grid", name="Vehicles")).to_be_visible()
        await pages.get_by_role("link", name="Missions").click()
        await expect(missions).to_be_visible()
        it.assert_well()


async def test_a_page_that_cannot_be_loaded_is_loaded_later(
    chromium: Browser, world: MakeWorld
) -> None:
    async with world() as here, page_at(chromium, here.ocu.url) as it:
        await it.page.route(FLEET_PAGE, lambda route: route.abort())
        pages = it.page.get_by_role("navigation", name="Pages")
        await pages.get_by_role("link", name="Fleet").click()
        await expect(
            it.page.get_by_role("alert").filter(has_text="could not be loaded")
        ).to_have_count(1)
        await it.page.unroute(FLEET_PAGE)
        await pages.get_by_role("link", name="Missions").click()
        await expect(it.page.get_by_role("heading", name="Missions")).to_be_visible()
        await pages.get_by_role("link", name="Fleet").click()
        await expect(it.page.get_by_role("grid", name="Vehicles")).to_be_visible()
