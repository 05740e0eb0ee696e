"""Event loops that do not wait, with real sockets."""

import asyncio
import time

import pytest

from m2pem.api.clock import DeadlockError
from m2pem.testing.loopback import loop_clock, on_loopback, run_on_loopback

HOURS_S = 7200.0


class Echo(asyncio.DatagramProtocol):
    """Sends a datagram back after a time of the event loop; `heard`: when which one came."""

    def __init__(self, after_s: float) -> None:
        self.after_s = after_s
        self.heard: list[tuple[float, bytes]] = []

    def connection_made(self, transport) -> None:
        self.transport = transport

    def datagram_received(self, data: bytes, sender: tuple[str, int]) -> None:
        loop = asyncio.get_running_loop()
        self.heard.append((loop.time(), data))
        loop.call_later(self.after_s, self.transport.sendto, data + b"!", sender)


async def echo(after_s: float) -> Echo:
    loop = asyncio.get_running_loop()
    address = ("127.0.0.1", 0)
    _, made = await loop.create_datagram_endpoint(lambda: Echo(after_s), local_addr=address)
    return made


def test_datagrams_pass_while_no_time_does_and_hours_pass_at_once() -> None:
    async def main(clock) -> None:
        began_us = clock.now_us()
        one, other = await echo(HOURS_S), await echo(1.0)
        one.transport.sendto(b"?", other.transport.get_extra_info("sockname"))
        await asyncio.sleep(2 * HOURS_S)
        one.transport.close()
        other.transport.close()
        assert other.heard == [(0.0, b"?"), (HOURS_S + 1.0, b"?!!")]
        assert one.heard == [(1.0, b"?!"), (HOURS_S + 2.0, b"?!!!")]
        assert clock.now_us() - began_us == 2 * HOURS_S * 1e6 * 20

    run_on_loopback(main, 20.0)


def test_a_stream_of_a_server_and_its_client_is_read() -> None:
    async def main(_) -> None:
        async def serve(reader, writer) -> None:
            writer.write(await reader.readline())
            await asyncio.sleep(HOURS_S)
            writer.close()

        async with await asyncio.start_server(serve, "127.0.0.1", 0) as server:
            address = server.sockets[0].getsockname()
            reader, writer = await asyncio.open_connection(*address)
            writer.write(b"hello\n")
            assert await reader.read() == b"hello\n"
            assert asyncio.get_running_loop().time() == pytest.approx(HOURS_S)
            writer.close()

    run_on_loopback(main)


def test_while_a_thread_works_time_is_that_of_the_wall() -> None:
    async def main(_) -> None:
        loop = asyncio.get_running_loop()
        ticked = asyncio.Event()
        loop.call_later(0.02, ticked.set)
        began_s = time.monotonic()

        def work() -> None:
            asyncio.run_coroutine_threadsafe(ticked.wait(), loop).result()

        await asyncio.to_thread(work)
        assert 0.02 <= loop.time() <= time.monotonic() - began_s + 0.001

    run_on_loopback(main)


@pytest.mark.parametrize("speed", [1.0, 3.0, 20.0])
@on_loopback
async def test_a_fast_clock_sleeps_until_its_time_comes(speed: float) -> None:
    clock = loop_clock(speed)
    began_us = clock.now_us()
    for step_us in (1, 7, 1_000_001):
        until_us = clock.now_us() + step_us
        await clock.sleep_until(until_us)
        assert until_us <= clock.now_us() <= until_us + speed
    assert asyncio.get_running_loop().time() >= (clock.now_us() - began_us) / 1e6 / speed - 1e-6


def test_what_can_never_happen_is_named() -> None:
    async def waits_for_ever() -> None:
        await asyncio.Event().wait()

    with pytest.raises(DeadlockError, match="waits_for_ever"):
        run_on_loopback(lambda _: asyncio.create_task(waits_for_ever()))
