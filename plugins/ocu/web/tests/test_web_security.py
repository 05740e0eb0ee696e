"""What the page refuses: foreign pages and names, strangers, and whatever is too much."""

import asyncio
import http.client
import socket
from collections.abc import AsyncIterator
from typing import Any
from urllib.parse import urlsplit

import httpx
import pytest
import websockets
from m2pem_plugin_web.access.requests import LARGEST_BYTES, BoundedBodies
from m2pem_plugin_web.access.sign_in import WITHIN_S
from m2pem_plugin_web.live.socket import BURST, FLOOD, LONGEST_MESSAGE, MALFORMED
from m2pem_plugin_web.pages import ADDRESSES
from starlette.requests import Request
from starlette.responses import PlainTextResponse
from web_world import Browser, MakeWorld, World, connect, token_of

STOP = "/api/stop"
EVIL = "http://evil.example"


async def refused_socket(world: World, **how: Any) -> int:
    """The status with which a WebSocket is refused."""
    browser = await world.browser()
    with pytest.raises(websockets.InvalidStatus) as refused:
        await connect(world.base, **{"cookie": browser.cookie, "key": browser.key, **how})
    return refused.value.response.status_code


# --- foreign pages ------------------------------------------------------------------------------


async def test_a_request_of_another_page_is_refused(world: MakeWorld) -> None:
    async with world() as here:
        browser = await here.browser()
        for origin in (EVIL, "null", "http://localhost:1", "", "https://127.0.0.1"):
            answer = await browser.http.post(STOP, json={}, headers={"Origin": origin})
            assert answer.status_code == 403, origin
            assert answer.headers["content-type"] == "application/problem+json"


async def test_a_request_that_changes_something_says_its_origin(world: MakeWorld) -> None:
    async with world() as here:
        browser = await here.browser()
        del browser.http.headers["Origin"]
        answer = await browser.http.post(STOP, json={})
        assert answer.status_code == 403
        assert here.base in answer.json()["detail"]
        assert (await browser.http.get("/api/session")).status_code == 200


async def test_a_websocket_of_another_page_is_refused(world: MakeWorld) -> None:
    async with world() as here:
        for origin in (EVIL, "null", None):
            assert await refused_socket(here, origin=origin) == 403, origin


async def test_what_a_browser_says_comes_from_another_site_is_refused(world: MakeWorld) -> None:
    async with world() as here:
        browser = await here.browser()
        for site in ("cross-site", "same-site"):
            said = {"Sec-Fetch-Site": site}
            assert (await browser.http.post(STOP, json={}, headers=said)).status_code == 403, site
            assert (await browser.http.get("/api/runs", headers=said)).status_code == 403, site
            assert (await browser.http.get("/", headers=said)).status_code == 200, site


async def test_what_a_form_could_send_is_refused(world: MakeWorld) -> None:
    async with world() as here:
        browser = await here.browser()
        for kind in ("text/plain", "application/x-www-form-urlencoded", "multipart/form-data", ""):
            said = {"Content-Type": kind}
            answer = await browser.http.post(STOP, content=b"{}", headers=said)
            assert answer.status_code == 415, kind


# --- names of this machine ----------------------------------------------------------------------


async def test_another_name_for_this_machine_is_refused(world: MakeWorld) -> None:
    async with world() as here:
        browser = await here.browser()
        for host in ("evil.example", "evil.example:8700", "127.0.0.1.evil.example"):
            for path in ("/", "/api/session", "/assets/x.js"):
                answer = await browser.http.get(path, headers={"Host": host})
                assert answer.status_code == 400, (host, path)


async def test_a_websocket_under_another_name_is_refused(world: MakeWorld) -> None:
    async with world() as here:
        port = urlsplit(here.base).port
        host = f"evil.example:{port}"
        assert await refused_socket(here, host=host, origin=f"http://{host}") == 400


async def test_a_port_that_is_forwarded_works(world: MakeWorld) -> None:
    async with world() as here:
        browser = await here.browser()
        said = {"Host": "localhost:9000", "Origin": "http://localhost:9000"}
        assert (await browser.http.post(STOP, json={}, headers=said)).status_code == 200


# --- strangers ----------------------------------------------------------------------------------


async def test_a_stranger_gets_the_page_and_nothing_else(world: MakeWorld) -> None:
    async with world() as here:
        stranger = here.stranger()
        for path in ("/api/session", "/api/runs", "/api/openapi.json", "/api/nothing", "/api"):
            assert (await stranger.http.get(path)).status_code == 401, path
        assert (await stranger.http.post(STOP, json={})).status_code == 401
        with pytest.raises(websockets.InvalidStatus) as refused:
            await connect(here.base)
        assert refused.value.response.status_code == 401


async def test_a_made_up_cookie_is_refused(world: MakeWorld) -> None:
    async with world() as here:
        browser = await here.browser()
        name = next(iter(browser.http.cookies))
        for value in ("", "x" * 43, "x" * 4000):
            stranger = here.stranger()
            said = {**browser.secrets, "Cookie": f"{name}={value}"}
            answer = await stranger.http.get("/api/session", headers=said)
            assert answer.status_code == 401


async def redeem(browser: Browser, token: str) -> httpx.Response:
    """What a page does with the token of its address."""
    return await browser.http.post("/api/session", json={"token": token})


async def test_a_token_works_once(world: MakeWorld) -> None:
    async with world() as here:
        url = here.ocu.url
        await here.browser()
        again = await redeem(here.stranger(), token_of(url))
        assert again.status_code == 401
        assert "m2pem web url" in again.json()["detail"]
        assert "set-cookie" not in again.headers
        assert here.ocu.url != url
        assert (await here.browser()).cookie


async def test_a_wrong_token_lets_nobody_in_and_too_many_not_even_the_right_one(
    world: MakeWorld,
) -> None:
    async with world() as here:
        stranger = here.stranger()
        for _ in range(25):
            assert (await redeem(stranger, "wrong")).status_code in (401, 429)
        late = await redeem(stranger, token_of(here.ocu.url))
        assert late.status_code == 429
        assert 0 < int(late.headers["retry-after"]) <= WITHIN_S


async def test_an_address_alone_signs_nobody_in_and_the_cookie_is_out_of_reach(
    world: MakeWorld,
) -> None:
    async with world() as here:
        stranger = here.stranger()
        opened = await stranger.http.get(here.ocu.url)
        assert opened.status_code == 200
        assert "set-cookie" not in opened.headers
        answer = await redeem(stranger, token_of(here.ocu.url))
        assert len(answer.json()["key"]) == 43
        assert answer.json()["key"] not in answer.headers["set-cookie"]
        cookie = answer.headers["set-cookie"].lower()
        assert cookie.startswith(f"m2pem_{urlsplit(here.base).port}=")
        assert "httponly" in cookie
        assert "samesite=strict" in cookie


async def test_another_programs_cookies_do_not_hide_ours(world: MakeWorld) -> None:
    async with world() as here:
        browser = await here.browser()
        cookie = f'other={{"a": [1, 2]}}; {browser.cookie}; more=x'
        said = {**browser.secrets, "Cookie": cookie}
        answer = await here.stranger().http.get("/api/session", headers=said)
        assert answer.status_code == 200


# --- headers ------------------------------------------------------------------------------------


async def test_every_answer_tells_the_browser_what_to_refuse(world: MakeWorld) -> None:
    async with world() as here:
        browser = await here.browser()
        for path in ("/", "/api/session", "/api/nothing", "/nothing", "/assets/../x"):
            answer = await browser.http.get(path)
            policy = answer.headers["content-security-policy"]
            assert "script-src 'self'" in policy
            assert "frame-ancestors 'none'" in policy
            assert answer.headers["x-content-type-options"] == "nosniff"
            assert "server" not in answer.headers
        assert (await browser.http.get("/api/session")).headers["cache-control"] == "no-store"


# --- paths --------------------------------------------------------------------------------------


def raw(base: str, method: str, path: str, headers: dict[str, str]) -> int:
    """The status of a request whose path nobody has tidied up."""
    parts = urlsplit(base)
    connection = http.client.HTTPConnection(parts.hostname or "", parts.port, timeout=10)
    try:
        connection.putrequest(method, path, skip_accept_encoding=True)
        for name, value in headers.items():
            connection.putheader(name, value)
        connection.endheaders()
        return connection.getresponse().status
    finally:
        connection.close()


OUTSIDE = [
    "/../settings.py",
    "/assets/../../settings.py",
    "/%2e%2e/settings.py",
    "/assets/%2e%2e%2f%2e%2e%2fsettings.py",
    "//etc/passwd",
    "/%2fetc%2fpasswd",
    "/..%5c..%5csettings.py",
    "/assets/%00",
    "/api/../settings.py",
]


async def test_no_path_leads_out_of_the_page(world: MakeWorld) -> None:
    async with world() as here:
        browser = await here.browser()
        for path in OUTSIDE:
            status = await asyncio.to_thread(raw, here.base, "GET", path, browser.secrets)
            assert status in (400, 401, 404), path


async def test_no_name_of_a_mission_leads_out_of_its_folder(world: MakeWorld) -> None:
    async with world() as here:
        (here.missions.parent / "secret.bpmn").write_text("<secret/>")
        browser = await here.browser()
        for name in ("../secret", "/etc/passwd", "a/b", "..", ".hidden", "a\0b", ""):
            answer = await browser.http.post("/api/runs", json={"mission": name})
            assert answer.status_code in (404, 422), name
            assert "secret/" not in answer.text, name


def test_every_address_of_the_page_is_one_of_it() -> None:
    assert all(address.startswith("/") and "path}" not in address for address in ADDRESSES)


# --- too much -----------------------------------------------------------------------------------


async def test_a_body_of_100_mb_is_refused_before_it_is_read(world: MakeWorld) -> None:
    async with world() as here:
        browser = await here.browser()
        parts = urlsplit(here.base)
        reader, writer = await asyncio.open_connection(parts.hostname, parts.port)
        writer.write(
            f"POST {STOP} HTTP/1.1\r\nHost: {parts.netloc}\r\nOrigin: {here.base}\r\n"
            f"Cookie: {browser.cookie}\r\nM2pem-Key: {browser.key}\r\n"
            "Content-Type: application/json\r\n"
            "Content-Length: 100000000\r\n\r\n".encode()
        )
        # Not a byte of the body was sent.
        async with asyncio.timeout(5):
            assert b"413" in await reader.readline()
        writer.close()


async def test_a_body_that_grows_too_large_is_refused_on_the_way(world: MakeWorld) -> None:
    async with world() as here:
        browser = await here.browser()
        sent = 0

        async def pieces() -> AsyncIterator[bytes]:
            nonlocal sent
            for _ in range(100):
                sent += 1_000_000
                yield b" " * 1_000_000

        said = {"Content-Type": "application/json"}
        try:
            answer = await browser.http.post(STOP, content=pieces(), headers=said)
            assert answer.status_code == 413
        except httpx.TransportError:
            pass  # the server hung up while it was being written to
        assert sent < 100_000_000
        assert (await browser.http.get("/api/session")).status_code == 200


async def test_a_body_that_does_not_come_is_given_up() -> None:
    async def takes(scope: Any, receive: Any, send: Any) -> None:
        body = await Request(scope, receive).body()
        await PlainTextResponse(body)(scope, receive, send)

    app = BoundedBodies(takes, longest_s=0.05)
    scope = {
        "type": "http",
        "method": "POST",
        "path": "/api/stop",
        "headers": [(b"content-type", b"application/json"), (b"content-length", b"2")],
    }
    told = iter([{"type": "http.request", "body": b"{", "more_body": True}])

    async def receive() -> Any:
        for each in told:
            return each
        await asyncio.Event().wait()

    with pytest.raises(Exception, match="was not received within"):
        await app(scope, receive, lambda _: None)  # type: ignore[arg-type, return-value]


def test_the_largest_body_holds_any_mission_of_people() -> None:
    assert LARGEST_BYTES == 10_000_000


async def test_a_connection_that_says_nothing_is_let_go(
    world: MakeWorld, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("m2pem_plugin_web.server.HEADERS_S", 0.1)
    async with world() as here:
        parts = urlsplit(here.base)
        for begun in (b"", b"GET / HTTP/1.1\r\nHost: 127"):
            reader, writer = await asyncio.open_connection(parts.hostname, parts.port)
            writer.write(begun)
            async with asyncio.timeout(5):
                with pytest.raises((ConnectionResetError, asyncio.IncompleteReadError)):
                    assert not await reader.readexactly(1)
            writer.close()


async def test_a_flood_of_messages_ends_the_connection(world: MakeWorld) -> None:
    async with world() as here:
        browser = await here.browser()
        other = await (await here.browser()).live()
        await other.watch(None)
        flood = await browser.live()
        for _ in range(BURST * 2):
            try:
                await flood.send(type="ack", seq=0)
            except websockets.ConnectionClosed:
                break
        assert await flood.until_closed() == FLOOD
        asked = await here.asked()
        await other.until(lambda message: message.get("prompt", {}).get("run") == asked.run)


async def test_a_message_that_is_too_long_ends_the_connection(world: MakeWorld) -> None:
    async with world() as here:
        live = await (await here.browser()).live()
        await live.socket.send("x" * (LONGEST_MESSAGE + 1))
        assert await live.until_closed() == 1009


async def test_a_message_of_another_protocol_ends_the_connection(world: MakeWorld) -> None:
    async with world() as here:
        browser = await here.browser()
        for text in ("{", '{"type":"stop"}', "[]", '{"type":"ack","seq":"x"}'):
            live = await browser.live()
            await live.socket.send(text)
            assert await live.until_closed() == MALFORMED, text


async def test_a_request_that_is_none_is_refused(world: MakeWorld) -> None:
    async with world() as here:
        parts = urlsplit(here.base)
        with socket.create_connection((parts.hostname, parts.port)) as plain:
            plain.sendall(b"\x16\x03\x01\x02\x00 not http at all\r\n\r\n")
            answer = await asyncio.to_thread(plain.recv, 100)
        assert b" 400 " in answer


# --- bodies that are nested too deep, or no text ------------------------------------------------

NESTED = b"[" * 100_000 + b"]" * 100_000
DEEP = b"[" * 500 + b"]" * 500
BODIES = (
    NESTED,
    b'{"data": {"a": ' + NESTED + b"}}",
    b'{"a": "\xff"}',
    b'{"geometry": ' + DEEP + b"}",
)


async def test_every_route_refuses_a_body_that_is_nested_too_deep(world: MakeWorld) -> None:
    async with world() as here:
        browser = await here.browser()
        paths = (await browser.http.get("/api/openapi.json")).json()["paths"]
        routes = [
            (method, path.replace("{run}", "r1").replace("{name}", "x"))
            for path, methods in paths.items()
            for method, route in methods.items()
            if "requestBody" in route
        ]
        assert len(routes) > 5
        for method, path in routes:
            for body in BODIES:
                answer = await browser.http.request(
                    method, path, content=body, headers={"Content-Type": "application/json"}
                )
                assert 400 <= answer.status_code < 500, (method, path, body[:30], answer.text)
                assert answer.headers["content-type"] == "application/problem+json"
        assert (await browser.http.get("/api/session")).status_code == 200


async def test_data_and_geometries_that_are_nested_too_deep_are_refused(world: MakeWorld) -> None:
    async with world() as here:
        browser = await here.browser()
        deep = (
            b'{"geometry": {"type": "Point", "coordinates": [9, 53], "properties": ' + DEEP + b"}}"
        )
        answer = await browser.http.put(
            "/api/geometries/x", content=deep, headers={"Content-Type": "application/json"}
        )
        assert answer.status_code in (409, 422), answer.text
        assert "nested" in answer.json()["detail"]


async def test_a_websocket_message_that_is_nested_too_deep_ends_that_socket_alone(
    world: MakeWorld,
) -> None:
    async with world() as here:
        browser = await here.browser()
        live, other = await browser.live(), await browser.live()
        await live.socket.send('{"x": ' + "[" * 1500 + "]" * 1500 + "}")
        assert await live.until_closed() == MALFORMED
        assert await other.watch(None)
