import asyncio
import gc
import weakref
from collections import Counter

import pytest

from m2pem.api.bus import FleetBus
from m2pem.api.telemetry import TeamState, VehicleState
from m2pem.mission.catalogue import ResourceId
from m2pem.telemetry.bus import Bus, State, Subscription


def state(number: int, vehicle: str = "evsg1") -> VehicleState:
    return VehicleState(ResourceId(vehicle), time_us=number)


async def numbers(subscription: Subscription) -> list[int]:
    return [heard.time_us async for heard in subscription]


def test_bus_is_a_fleet_bus() -> None:
    bus: FleetBus = Bus()
    assert bus.latest(ResourceId("evsg1")) is None


def test_latest_is_the_last_state_of_each_resource() -> None:
    bus = Bus()
    for heard in (state(1), state(2), state(7, "evsg2")):
        bus.publish(heard)
    assert bus.latest(ResourceId("evsg1")) == state(2)
    assert bus.latest(ResourceId("evsg2")) == state(7, "evsg2")


async def test_every_subscriber_gets_what_is_published_from_the_moment_it_subscribed() -> None:
    bus = Bus()
    first = bus.subscribe()
    bus.publish(state(1))
    second = bus.subscribe()
    bus.publish(state(2))
    bus.close()
    assert await numbers(first) == [1, 2]
    assert await numbers(second) == [2]


async def test_a_slow_reader_loses_the_oldest_and_the_loss_is_counted() -> None:
    bus = Bus()
    subscription = bus.subscribe(size=2)
    for number in range(5):
        bus.publish(state(number))
    bus.close()
    assert subscription.dropped == 3
    assert await numbers(subscription) == [3, 4]


async def test_a_waiting_reader_is_woken_by_a_state() -> None:
    bus = Bus()
    subscription = bus.subscribe()
    reader = asyncio.create_task(anext(subscription))
    await asyncio.sleep(0)
    bus.publish(state(1))
    bus.publish(state(2))
    assert await reader == state(1)
    assert await anext(subscription) == state(2)


async def test_close_ends_a_waiting_reader_and_later_subscriptions() -> None:
    bus = Bus()
    reader = asyncio.create_task(numbers(bus.subscribe()))
    await asyncio.sleep(0)
    bus.close()
    assert await reader == []
    assert await numbers(bus.subscribe()) == []


def test_nothing_changes_after_close() -> None:
    bus = Bus()
    bus.publish(state(1))
    bus.close()
    bus.publish(state(2))
    assert bus.latest(ResourceId("evsg1")) == state(1)


async def test_cancelled_readers_leave_no_subscriptions_behind() -> None:
    bus = Bus()

    def kept() -> Counter[str]:
        """How many subscriptions there are, and references by which a bus finds them."""
        gc.collect()
        return Counter(
            type(each).__name__
            for each in gc.get_objects()
            if isinstance(each, Subscription | weakref.ref)
        )

    async def read() -> None:
        async for _ in bus.subscribe():
            pass

    before = kept()
    readers = [asyncio.create_task(read()) for _ in range(100)]
    await asyncio.sleep(0)
    subscriptions = kept() - before
    assert subscriptions["Subscription"] == 100
    assert subscriptions.total() >= 200
    for reader in readers:
        reader.cancel()
    await asyncio.wait(readers)
    del reader, readers
    subscriptions = kept() - before
    assert subscriptions["Subscription"] == 0
    assert subscriptions.total() < 50, "the bus itself keeps no reference either"


async def test_a_reader_may_go_on_after_a_cancelled_wait() -> None:
    bus = Bus()
    subscription = bus.subscribe()
    with pytest.raises(TimeoutError):
        await asyncio.wait_for(anext(subscription), 0)
    bus.publish(state(1))
    assert await anext(subscription) == state(1)


async def test_aclose_ends_one_subscription_only() -> None:
    bus = Bus()
    ended, going_on = bus.subscribe(), bus.subscribe()
    bus.publish(state(1))
    await ended.aclose()
    bus.publish(state(2))
    bus.close()
    assert await numbers(ended) == []
    assert await numbers(going_on) == [1, 2]


async def test_a_second_reader_of_one_subscription_is_refused() -> None:
    bus = Bus()
    subscription = bus.subscribe()
    first = asyncio.create_task(anext(subscription))
    await asyncio.sleep(0)
    with pytest.raises(RuntimeError, match="one reader"):
        await anext(subscription)
    bus.publish(state(1))
    assert await first == state(1)


async def test_subscribers_are_woken_in_the_order_in_which_they_subscribed() -> None:
    bus = Bus()
    woken: list[int] = []

    async def read(number: int, subscription: Subscription) -> None:
        heard: State = await anext(subscription)
        woken.append(number + heard.time_us)

    readers = [asyncio.create_task(read(n, bus.subscribe())) for n in range(20)]
    await asyncio.sleep(0)
    bus.publish(state(100))
    await asyncio.gather(*readers)
    assert woken == list(range(100, 120))


def test_a_subscription_that_could_hold_nothing_is_refused() -> None:
    with pytest.raises(ValueError, match="at least one"):
        Bus().subscribe(size=0)


async def test_what_a_team_tells_passes_and_is_nobodys_latest() -> None:
    bus = Bus()
    states = bus.subscribe()
    team = TeamState("r1.b1", "road_sweep", 1, (), 15.0)
    bus.publish(team)
    bus.publish(state(2))
    assert [await anext(states), await anext(states)] == [team, state(2)]
    assert bus.latest(ResourceId("r1.b1")) is None
