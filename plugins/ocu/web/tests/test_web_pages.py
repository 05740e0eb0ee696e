"""The page of an executive of this process, in a real browser: how people come in, and what they
are told of vehicles that are not heard."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from playwright.async_api import Browser, expect
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
        await expect(listed).to_contain_text(f"{VEHICLE}: Well")
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
        await expect(listed).to_contain_text(f"{VEHICLE}: Well")
        assert LOST not in await colours(page)
        it.assert_well()
