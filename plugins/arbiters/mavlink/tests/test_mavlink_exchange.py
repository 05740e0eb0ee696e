"""A transaction is run by the arbiter's clock, and whatever it raises is raised."""

import asyncio
from collections.abc import Callable, Iterable
from typing import Any, ClassVar

import pytest
from m2pem_plugin_mavlink.link.vehicle_link import Exchange, Listener
from m2pem_plugin_mavlink.protocol.messages import Address, Message, message_type
from m2pem_plugin_mavlink.protocol.quality import LinkQuality
from m2pem_plugin_mavlink.protocol.transaction import Transaction
from mavlink_wire import HandClock

VEHICLE = Address(1, 1)
PING = message_type("PING")


class Scripted:
    """A link without a wire."""

    address = VEHICLE

    def __init__(self, clock: HandClock) -> None:
        self._clock = clock
        self.sent: list[Message] = []
        self.listeners: list[Listener] = []

    def now_s(self) -> float:
        return self._clock.now_us() / 1e6

    def send(self, message: Message) -> None:
        self.sent.append(message)

    def listen(self, ids: Iterable[int], listener: Listener) -> Callable[[], None]:
        assert set(ids) == {PING.id}
        self.listeners.append(listener)
        return lambda: self.listeners.remove(listener)

    async def perform(self, transaction: Transaction[Any]) -> Any:
        raise NotImplementedError

    def refused(self) -> tuple[()]:
        return ()

    def quality(self) -> LinkQuality | None:
        return None

    def hear(self, number: int) -> None:
        for listener in list(self.listeners):
            listener(PING.make(seq=number), VEHICLE)


class Told(Transaction[list[str]]):
    """Does at each call what it is told: (seconds to the deadline, None for none; whether done)."""

    wants: ClassVar[frozenset[int]] = frozenset({PING.id})

    def __init__(self, *steps: tuple[float | None, bool] | Exception) -> None:
        super().__init__("key")
        self.steps = list(steps)
        self.calls: list[str] = []

    def _step(self, call: str, now_s: float) -> None:
        self.calls.append(f"{call} {now_s - 1_000:g}")
        self.outbox.append(PING.make(seq=len(self.calls)))
        step = self.steps.pop(0)
        if isinstance(step, Exception):
            raise step
        wait_s, done = step
        self.deadline_s = None if wait_s is None else now_s + wait_s
        if done:
            self.succeed(self.calls)

    def begin(self, now_s: float) -> None:
        self._step("begin", now_s)

    def receive(self, message: Message, sender: Address, now_s: float) -> None:
        assert sender == VEHICLE
        self._step(f"receive {message.seq}", now_s)

    def expire(self, now_s: float) -> None:
        self._step("expire", now_s)


async def ticks() -> None:
    for _ in range(10):
        await asyncio.sleep(0)


class Stage:
    def __init__(self, *steps: tuple[float | None, bool] | Exception) -> None:
        self.clock = HandClock()
        self.link = Scripted(self.clock)
        self.transaction = Told(*steps)
        exchange = Exchange(self.transaction, self.link, self.clock)
        self.running = asyncio.create_task(exchange.run())

    async def ended(self) -> list[str]:
        await self.running
        assert self.link.listeners == []
        assert len(asyncio.all_tasks()) == 1
        return self.transaction.outcome()


async def test_an_exchange_may_be_done_when_it_begins() -> None:
    stage = Stage((None, True))
    assert await stage.ended() == ["begin 0"]
    assert [each.seq for each in stage.link.sent] == [1]


async def test_a_message_is_handed_over_and_what_is_said_to_it_is_sent_at_once() -> None:
    stage = Stage((None, False), (None, False), (None, True))
    await ticks()
    stage.link.hear(7)
    assert [each.seq for each in stage.link.sent] == [1, 2]
    stage.link.hear(8)
    stage.link.hear(9)
    assert await stage.ended() == ["begin 0", "receive 7 0", "receive 8 0"]


async def test_a_deadline_passes_by_the_clock() -> None:
    stage = Stage((1.5, False), (1.0, False), (None, True))
    await ticks()
    await stage.clock.turn(1.4)
    assert stage.transaction.calls == ["begin 0"]
    await stage.clock.turn(5)
    assert await stage.ended() == ["begin 0", "expire 1.5", "expire 2.5"]


async def test_a_deadline_that_is_moved_on_passes_then() -> None:
    stage = Stage((1.0, False), (3.0, False), (None, True))
    await ticks()
    await stage.clock.turn(0.5)
    stage.link.hear(1)
    await stage.clock.turn(2.9)
    assert len(stage.transaction.calls) == 2
    await stage.clock.turn(0.2)
    assert (await stage.ended())[-1] == "expire 3.5"


async def test_a_deadline_that_is_moved_ahead_passes_then() -> None:
    stage = Stage((10.0, False), (1.0, False), (None, True))
    await ticks()
    stage.link.hear(1)
    await ticks()
    await stage.clock.turn(1.1)
    assert (await stage.ended())[-1] == "expire 1"


async def test_a_deadline_that_is_taken_away_does_not_pass_and_may_come_again() -> None:
    stage = Stage((1.0, False), (None, False), (1.0, False), (None, True))
    await ticks()
    stage.link.hear(1)
    await stage.clock.turn(5)
    assert len(stage.transaction.calls) == 2
    stage.link.hear(2)
    await ticks()
    await stage.clock.turn(1)
    assert (await stage.ended())[2:] == ["receive 2 5", "expire 6"]


@pytest.mark.parametrize("after", [0, 1, 2])
async def test_what_the_transaction_raises_is_raised(after: int) -> None:
    steps: list[tuple[float | None, bool] | Exception] = [(1.0, False)] * after
    stage = Stage(*steps, ValueError("wrong"))
    await ticks()
    if after:
        stage.link.hear(1)
    await stage.clock.turn(1.0)
    with pytest.raises(ValueError, match="wrong"):
        await stage.ended()


async def test_an_exchange_that_is_cancelled_hears_and_says_no_more() -> None:
    stage = Stage((1.0, False))
    await ticks()
    stage.running.cancel()
    with pytest.raises(asyncio.CancelledError):
        await stage.ended()
    await stage.clock.turn(5)
    assert stage.link.listeners == []
    assert len(stage.link.sent) == 1
