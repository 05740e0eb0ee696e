"""States can be distinguished where the system has its own colours, or a person sees none."""

import json
import re
from typing import Any

from playwright.async_api import Locator, Page, WebSocketRoute, expect
from web_desk import IN_ONE_LOOP, Desk

pytestmark = IN_ONE_LOOP

STATES: dict[str, dict[str, Any]] = {
    "evsg2": {"link": "lost"},
    "evsg3": {"ready": False, "not_ready": "GPS"},
    "uav1": {"link": "degraded"},
}
"""What vehicles are said to report; evsg1 is well."""


def changed(message: str) -> str:
    """A message of the server, with other states of vehicles."""
    view = json.loads(message)
    for name, state in (view.get("vehicles") or {}).items():
        if state:
            state.update(STATES.get(name, {}))
    return json.dumps(view)


async def force_colours(page: Page) -> None:
    await page.emulate_media(forced_colors="active")


def row(page: Page, said: str) -> Locator:
    """A row of the tree of elements."""
    return page.get_by_role("treeitem", name=re.compile(said))


async def ground(button: Locator) -> str:
    found = await button.evaluate("it => getComputedStyle(it).backgroundColor")
    return str(found)


async def test_signs_tell_states_of_a_run(desk: Desk) -> None:
    page = await desk.driving()
    await force_colours(page)
    for said, sign in (
        ("^DRIVE ROUTE, .*, active", "●"),
        ("^USER SEND ROUTE, .*, done", "✓"),
        ("^REVERSE, .*, not visited", ""),
    ):
        await expect(row(page, said).locator(".dot")).to_have_text(sign)
    chosen = page.get_by_role("button", name="Behaviors", pressed=True)
    other = page.get_by_role("button", name="Tokens", pressed=False)
    assert await ground(chosen) != await ground(other)
    await chosen.hover()
    assert await ground(chosen) != await ground(other)
    run = page.url.rpartition("/")[2]
    await desk.ask("POST", f"/api/runs/{run}/stop", {"reason": "seen enough"})
    cancelled = page.locator(".bar-cancelled text").first
    await expect(cancelled).to_have_text(re.compile("^\N{EN DASH} "))


async def test_signs_tell_the_health_of_vehicles(desk: Desk) -> None:
    page = desk.page

    def pass_on(route: WebSocketRoute) -> None:
        server = route.connect_to_server()
        route.on_message(server.send)
        server.on_message(lambda message: route.send(changed(str(message))))

    await page.route_web_socket(re.compile("/api/live"), pass_on)
    await page.goto(f"{desk.executive.origin}/fleet")
    await force_colours(page)
    for name, said, sign in (
        ("evsg1", "OK", "●"),
        ("evsg2", "Lost", "✕"),
        ("evsg3", "Not ready", "!"),
        ("uav1", "Weak link", "~"),
    ):
        pill = page.get_by_role("row").filter(has_text=name).locator(".fleet-pill")
        await expect(pill).to_have_text(said)
        shown = await pill.evaluate("it => getComputedStyle(it, '::before').content")
        assert shown == f'"{sign}"', name
