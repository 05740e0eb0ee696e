"""A server of another user at another port of this host: browsers send it the page's cookie."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

import httpx
import pytest
import websockets
from m2pem_plugin_web import server
from playwright.async_api import Browser, expect
from web_browsing import page_at
from web_desk import IN_ONE_LOOP
from web_world import MakeWorld, World, connect

from m2pem.testing import scenarios

pytestmark = IN_ONE_LOOP

METHODS = {"get", "post", "put", "patch", "delete"}


@dataclass
class Thief:
    """A server that keeps the cookies that browsers send it."""

    address: str = ""
    cookies: list[str] = field(default_factory=list)

    @property
    def cookie(self) -> str:
        """What it has received that is the page's."""
        return next(each for each in self.cookies if each.startswith("m2pem_"))


@contextmanager
def thief() -> Iterator[Thief]:
    """A plain server at a port of its own."""
    here = Thief()

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            here.cookies += self.headers.get_all("Cookie") or []
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(b"<title>harmless</title><link rel=icon href='data:,'>")

        def log_message(self, *_: Any) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        here.address = f"http://127.0.0.1:{server.server_port}/"
        serving = threading.Thread(target=server.serve_forever)
        serving.start()
        try:
            yield here
        finally:
            server.shutdown()
            serving.join()


async def see_that_replaying_gives_nothing(
    here: World, cookie: str, described: dict[str, Any]
) -> None:
    """Send a cookie to every address of the API, as a program does: with any header it likes."""
    headers = {"Cookie": cookie, "Origin": here.base}
    asked = 0
    async with httpx.AsyncClient(base_url=here.base, headers=headers, verify=False) as http:
        for path, methods in described["paths"].items():
            for method in METHODS & set(methods):
                if not path.startswith("/api/") or (path, method) == ("/api/session", "post"):
                    continue  # pictures below the map; signing in needs no session
                where = path.replace("{", "").replace("}", "")
                answer = await http.request(method, where, json={})
                assert answer.status_code == 401, (method, path, answer.text)
                assert answer.json()["missing"] == "M2pem-Key"
                asked += 1
        answer = await http.get("/api/openapi.json", headers={"M2pem-Key": "wrong"})
        assert answer.status_code == 401
        assert "sign in again" in answer.json()["detail"]
    assert asked > 40
    for key in ("", "wrong"):
        with pytest.raises(websockets.InvalidStatus) as refused:
            await connect(here.base, cookie=cookie, key=key)
        assert refused.value.response.status_code == 401


async def test_the_cookie_that_another_port_gets_from_chromium_is_worth_nothing(
    chromium: Browser, world: MakeWorld
) -> None:
    async with world() as here, page_at(chromium, here.ocu.url) as it:
        asked = await here.asked()
        await it.page.get_by_role("heading", name="Missions").wait_for()
        described = (await (await here.browser()).http.get("/api/openapi.json")).json()
        with thief() as other:
            tab = await it.context.new_page()
            await tab.goto(other.address)
            assert await tab.evaluate("localStorage.length") == 0
            await see_that_replaying_gives_nothing(here, other.cookie, described)
        assert [each.run for each in here.control.prompts()] == [asked.run]
        # The operator who was there goes on: after a reload as well.
        await it.page.reload()
        await expect(it.page.locator(".link-open")).to_have_count(1)
        it.assert_well()


async def test_the_cookie_that_another_port_gets_from_a_program_is_worth_nothing(
    world: MakeWorld,
) -> None:
    async with world() as here:
        browser = await here.browser()
        described = (await browser.http.get("/api/openapi.json")).json()
        with thief() as other:
            # Not the key: it is a header of this program's own for the page's address.
            async with httpx.AsyncClient(cookies=browser.http.cookies, verify=False) as http:
                await http.get(other.address)
            await see_that_replaying_gives_nothing(here, other.cookie, described)
        assert (await browser.http.get("/api/session")).status_code == 200
        assert (await browser.live()).closed is None


async def test_what_a_cookie_alone_gets_are_pictures_below_the_map(
    world: MakeWorld, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(server, "MOST_KNOWN", 1)
    async with world() as here:
        browser, stranger = await here.browser(), here.stranger()
        alone = {"Cookie": browser.cookie}
        assert (await stranger.http.get("/tiles/1/0/0.png")).status_code == 401
        assert (await stranger.http.get("/tiles/1/0/0.png", headers=alone)).status_code == 204
        # Its connection takes no place of a user's: one is open, as many as may be.
        assert (await browser.http.get("/api/session")).status_code == 200


async def test_a_page_whose_key_is_gone_says_so_and_is_signed_in_again(
    chromium: Browser, world: MakeWorld
) -> None:
    async with world() as here, page_at(chromium, here.ocu.url) as it:
        page = it.page
        run = (await here.asked(scenarios.question())).run
        await page.get_by_role("heading", name="Missions").wait_for()
        await page.evaluate("localStorage.clear()")
        await page.goto(f"{here.base}/runs/{run}")
        await expect(page.get_by_text("lost the key of its session")).to_be_visible()
        await page.goto(here.ocu.url.replace("/?", f"/runs/{run}?"))
        await expect(page.get_by_role("alertdialog")).to_be_visible()
        assert page.url == f"{here.base}/runs/{run}"
