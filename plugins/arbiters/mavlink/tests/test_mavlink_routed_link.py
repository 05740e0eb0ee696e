"""A vehicle over several endpoints, and exchanges with it over real sockets."""

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import ClassVar

import pytest
from m2pem_plugin_mavlink.link.hub import shared_hub
from m2pem_plugin_mavlink.link.routed_link import SILENT_S, RoutedLink, open_link
from m2pem_plugin_mavlink.link.udp import UdpEndpoint
from m2pem_plugin_mavlink.protocol.messages import Address, Message, message_type
from m2pem_plugin_mavlink.protocol.transaction import ExchangeError, NoAnswerError, Transaction
from m2pem_plugin_mavlink.protocol.url import parse_url
from mavlink_wire import FarEnd, HandClock, udp_end, until

URLS = ["udpin://127.0.0.1:0", "udpin://localhost:0"]
VEHICLE = Address(1, 1)
ACK = message_type("COMMAND_ACK")
COMMAND_LONG = message_type("COMMAND_LONG")


class Ask(Transaction[int]):
    """Sends a command, up to three times, a second apart, until it is acknowledged."""

    wants: ClassVar[frozenset[int]] = frozenset({ACK.id})

    def __init__(self, command: int, key: str = "command") -> None:
        super().__init__(key)
        self.command = command
        self.tries = 0

    def begin(self, now_s: float) -> None:
        self.tries += 1
        self.deadline_s = now_s + 1.0
        self.outbox.append(
            COMMAND_LONG.make(target_system=1, target_component=1, command=self.command)
        )

    def receive(self, message: Message, sender: Address, now_s: float) -> None:
        if message.command == self.command:
            self.succeed(message.result)

    def expire(self, now_s: float) -> None:
        if self.tries == 3:
            self.fail(NoAnswerError("no answer"))
        else:
            self.begin(now_s)


def port(url: str) -> int:
    endpoint = shared_hub().endpoint(parse_url(url))
    assert isinstance(endpoint, UdpEndpoint)
    return endpoint.port


@asynccontextmanager
async def joined(
    may_send: Callable[[], bool] = lambda: True,
) -> AsyncIterator[tuple[HandClock, RoutedLink, list[FarEnd]]]:
    """A vehicle that is heard over both endpoints."""
    clock = HandClock()
    link = await open_link(VEHICLE, URLS, clock, may_send=may_send)
    ends = [await udp_end(port(url)) for url in URLS]
    for end, url in zip(ends, URLS, strict=True):
        end.beat()
        await until(lambda: link.qualities()[url])  # noqa: B023
    yield clock, link, ends
    await link.close()
    for end in ends:
        await end.close()


def send(link: RoutedLink) -> None:
    link.send(COMMAND_LONG.make(target_system=1, target_component=1, command=400))


def commands(end: FarEnd) -> list[int]:
    return [each.command for each in end.received if each.get_type() == "COMMAND_LONG"]


async def streamed(clock: HandClock, link: RoutedLink, end: FarEnd, keep: int, of: int) -> None:
    """Five seconds of frames, of which so many arrive."""
    seen: list[Message] = []
    stop = link.listen([0], lambda message, _: seen.append(message))
    for _ in range(5):
        seen.clear()
        for number in range(20):
            if number % of < keep:
                end.beat()
            else:
                end.mav.seq = (end.mav.seq + 1) % 256
        await until(lambda: len(seen) == 20 * keep // of)
        await clock.turn(1.0)
    stop()


async def test_the_first_endpoint_is_used_while_both_hear_the_vehicle() -> None:
    async with joined() as (_, link, ends):
        send(link)
        await until(lambda: commands(ends[0]))
        assert not commands(ends[1])


async def test_a_silent_endpoint_is_left_for_one_that_hears_and_not_at_once_returned_to() -> None:
    async with joined() as (clock, link, ends):
        heard: list[Message] = []
        link.listen([0], lambda message, _: heard.append(message))
        await clock.turn(SILENT_S + 0.1)
        ends[1].beat()
        await until(lambda: heard)
        send(link)
        await until(lambda: commands(ends[1]))
        ends[0].beat()
        await until(lambda: len(heard) == 2)
        send(link)
        await until(lambda: len(commands(ends[1])) == 2)
        assert not commands(ends[0])


async def test_an_endpoint_that_loses_much_is_left_for_a_better_one() -> None:
    async with joined() as (clock, link, ends):
        await streamed(clock, link, ends[0], keep=1, of=2)
        await streamed(clock, link, ends[1], keep=1, of=1)
        await streamed(clock, link, ends[0], keep=1, of=2)
        ends[1].beat()
        await until(lambda: link.qualities()[URLS[1]].age_s < 1)  # type: ignore[union-attr]
        losses = [quality.loss for quality in link.qualities().values() if quality]
        assert losses == pytest.approx([0.5, 0.0], abs=0.1)
        send(link)
        await until(lambda: commands(ends[1]))
        assert not commands(ends[0])


async def test_when_no_endpoint_hears_it_the_one_that_did_last_is_used() -> None:
    async with joined() as (clock, link, ends):
        heard: list[Message] = []
        link.listen([0], lambda message, _: heard.append(message))
        await clock.turn(1.0)
        ends[1].beat()
        await until(lambda: heard)
        await clock.turn(60.0)
        send(link)
        await until(lambda: commands(ends[1]))


async def test_what_is_heard_over_either_endpoint_is_handed_over() -> None:
    async with joined() as (_, link, ends):
        modes: list[int] = []
        stop = link.listen([0], lambda message, _: modes.append(message.custom_mode))
        for number, end in enumerate(ends):
            end.beat(mode=number)
        await until(lambda: sorted(modes) == [0, 1])
        stop()
        stop()
        ends[0].beat(mode=9)
        await until(lambda: link.qualities()[URLS[0]])
        assert 9 not in modes


async def test_an_exchange_returns_its_result() -> None:
    async with joined() as (_, link, ends):
        asking = asyncio.create_task(link.perform(Ask(400)))
        await until(lambda: commands(ends[0]) == [400])
        ends[0].acknowledge(401)
        ends[0].acknowledge(400, result=3)
        assert await asking == 3


async def test_an_exchange_asks_again_by_the_arbiters_clock_and_gives_up() -> None:
    async with joined() as (clock, link, ends):
        asking = asyncio.create_task(link.perform(Ask(400)))
        for tries in range(1, 4):
            await until(lambda: len(commands(ends[0])) == tries)  # noqa: B023
            await clock.turn(1.0)
            ends[0].beat()
        with pytest.raises(NoAnswerError):
            await asking


async def test_an_exchange_sends_nothing_again_while_the_executive_may_not() -> None:
    allowed = [True]
    async with joined(lambda: allowed[0]) as (clock, link, ends):
        asked = asyncio.create_task(link.perform(Ask(400)))
        await until(lambda: commands(ends[0]) == [400])
        allowed[0] = False
        await clock.turn(1.1)
        send(link)
        allowed[0] = True
        await clock.turn(1.1)
        await until(lambda: commands(ends[0]) == [400, 400])
        ends[0].acknowledge(400)
        assert await asked == 0


async def test_exchanges_with_the_same_key_wait_for_each_other() -> None:
    async with joined() as (_, link, ends):
        second_link = await open_link(VEHICLE, URLS, HandClock())
        first = asyncio.create_task(link.perform(Ask(1)))
        second = asyncio.create_task(second_link.perform(Ask(2)))
        other = asyncio.create_task(link.perform(Ask(3, key="another")))
        await until(lambda: commands(ends[0]) == [1, 3])
        ends[0].acknowledge(1)
        await first
        await until(lambda: commands(ends[0]) == [1, 3, 2])
        ends[0].acknowledge(2)
        ends[0].acknowledge(3)
        await asyncio.gather(second, other)
        await second_link.close()


async def test_a_cancelled_exchange_sends_no_more_and_lets_the_next_begin() -> None:
    async with joined() as (clock, link, ends):
        first = asyncio.create_task(link.perform(Ask(1)))
        second = asyncio.create_task(link.perform(Ask(2)))
        await until(lambda: commands(ends[0]) == [1])
        first.cancel()
        with pytest.raises(asyncio.CancelledError):
            await first
        await until(lambda: commands(ends[0]) == [1, 2])
        await clock.turn(1.0)
        await until(lambda: commands(ends[0]) == [1, 2, 2])
        ends[0].acknowledge(2)
        await second


async def test_closing_ends_what_goes_on() -> None:
    async with joined() as (_, link, ends):
        goes_on = asyncio.create_task(link.perform(Ask(1)))
        waits = asyncio.create_task(link.perform(Ask(2)))
        await until(lambda: commands(ends[0]))
        await link.close()
        for each in (goes_on, waits):
            with pytest.raises(ExchangeError, match="the link was closed"):
                await each
        send(link)
        with pytest.raises(ExchangeError, match="the link was closed"):
            await link.perform(Ask(3))
