"""Many connections of strangers keep nobody from STOP."""

import asyncio
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from urllib.parse import urlsplit

import httpx
import pytest
from m2pem_plugin_web import server
from m2pem_plugin_web.server import MOST_KNOWN, MOST_OF_AN_ADDRESS, MOST_STRANGERS, Slots
from web_world import MakeWorld, World

HALF_OPEN = 290
HALVES = {
    "nothing": b"",
    "half a head": b"POST /api/stop-all HTTP/1.1\r\nHost: 127.0.0.1\r\n",
    "half a body": b"POST /api/session HTTP/1.1\r\nHost: %b\r\nOrigin: %b\r\n"
    b"Content-Type: application/json\r\nContent-Length: 100\r\n\r\n{",
}


@contextmanager
def half_open(world: World, sent: bytes, count: int = HALF_OPEN) -> Iterator[list[socket.socket]]:
    """Sockets on which a request never comes whole."""
    parts = urlsplit(world.base)
    said = sent.replace(b"Host: %b", b"Host: " + parts.netloc.encode())
    said = said.replace(b"Origin: %b", b"Origin: " + world.base.encode())
    sockets = []
    try:
        for _ in range(count):
            one = socket.create_connection((parts.hostname, parts.port), timeout=10)
            sockets.append(one)
            if said:
                one.sendall(said)
        yield sockets
    finally:
        for one in sockets:
            one.close()


@pytest.mark.parametrize("sent", HALVES.values(), ids=HALVES)
async def test_every_stop_passes_a_flood_of_requests_that_never_come_whole(
    world: MakeWorld, sent: bytes
) -> None:
    async with world() as here:
        browser = await here.browser()
        live = await browser.live()
        await live.watch(None)
        flood = half_open(here, sent)
        sockets = await asyncio.to_thread(flood.__enter__)
        try:
            # Each on a connection of its own, as a page that has lost its own would do.
            async with httpx.AsyncClient(
                base_url=here.base,
                cookies=browser.http.cookies,
                headers=browser.http.headers,
                limits=httpx.Limits(max_keepalive_connections=0),
                verify=False,
            ) as http:
                for _ in range(99):
                    assert (await http.post("/api/stop-all", json={})).status_code == 200
            assert len(sockets) == HALF_OPEN
            assert live.closed is None
        finally:
            flood.__exit__(None, None, None)


@pytest.mark.parametrize("which", ["nothing", "half a head"])
async def test_a_request_whose_head_does_not_come_is_ended(
    world: MakeWorld, monkeypatch: pytest.MonkeyPatch, which: str
) -> None:
    monkeypatch.setattr(server, "HEADERS_S", 0.2)
    async with world() as here:
        with half_open(here, HALVES[which], 1) as (waits,):
            received = await asyncio.to_thread(waits.recv, 100)  # its time limit is 10 s
    assert received == b""


class Dropped:
    """Connections that were ended."""

    def __init__(self) -> None:
        self.slots = Slots()
        self.dropped: list[tuple[str, int]] = []

    def open(self, address: str, port: int, *, known: bool = False) -> None:
        peer = (address, port)
        self.slots.opened(peer, lambda: self.dropped.append(peer))
        if known:
            self.slots.known(peer)


def test_an_address_loses_its_own_oldest_connection_first() -> None:
    there = Dropped()
    there.open("elsewhere", 1)
    there.open("here", 1, known=True)
    for port in range(2, MOST_OF_AN_ADDRESS + 4):
        there.open("here", port)
    assert there.dropped == [("here", 2), ("here", 3)]


def test_many_addresses_lose_the_oldest_and_none_of_who_has_signed_in() -> None:
    there = Dropped()
    there.open("anna", 1, known=True)
    for number in range(MOST_STRANGERS + 1):
        there.open(f"a{number}", 1)
    assert there.dropped == [("a0", 1)]


def test_too_many_connections_even_of_people_who_have_signed_in_leave_stop() -> None:
    there = Dropped()
    for port in range(MOST_KNOWN):
        there.open("anna", port, known=True)
    assert not there.slots.full
    there.open("anna", MOST_KNOWN, known=True)
    assert there.slots.full
    there.slots.closed(("anna", 0))
    assert not there.slots.full
    assert there.dropped == []


async def test_when_all_is_full_stop_is_not_refused(
    world: MakeWorld, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(server, "MOST_KNOWN", 2)
    async with world() as here:
        browser, *others = [await here.browser() for _ in range(3)]
        for other in others:
            await other.http.get("/api/runs")  # its connection stays open
        assert (await browser.http.get("/api/runs")).status_code == 503
        assert (await browser.http.post("/api/stop-all", json={})).status_code == 200
