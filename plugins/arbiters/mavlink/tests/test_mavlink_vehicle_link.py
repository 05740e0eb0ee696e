"""Exchanges with the same key follow one another; nothing is kept of those that are over."""

import asyncio

from m2pem_plugin_mavlink.link.vehicle_link import KeyedLock
from mavlink_memory import held_bytes


async def test_who_comes_first_is_served_first() -> None:
    turns = KeyedLock()
    order: list[int] = []
    go_on = asyncio.Event()

    async def take(number: int) -> None:
        async with turns.locked("key"):
            order.append(number)
            await go_on.wait()
            order.append(number)

    taking = [asyncio.create_task(take(number)) for number in range(3)]
    for _ in range(5):
        await asyncio.sleep(0)
    assert order == [0]
    go_on.set()
    await asyncio.gather(*taking)
    assert order == [0, 0, 1, 1, 2, 2]


async def test_who_is_cancelled_while_waiting_leaves_no_gap() -> None:
    turns = KeyedLock()
    before = held_bytes(turns)
    held = asyncio.Event()

    async def hold() -> None:
        async with turns.locked("key"):
            await held.wait()

    async def take() -> bool:
        async with turns.locked("key"):
            return True

    holding = asyncio.create_task(hold())
    waiting, last = asyncio.create_task(take()), asyncio.create_task(take())
    await asyncio.sleep(0)
    waiting.cancel()
    held.set()
    assert await last
    await holding
    assert held_bytes(turns) - before < 400, "the lock of the key is not kept"


async def test_other_keys_do_not_wait_and_none_is_kept() -> None:
    turns = KeyedLock()
    sizes = []
    for number in range(1000):
        async with turns.locked(f"key {number}"), turns.locked("other"):
            pass
        if number in (100, 999):
            sizes.append(held_bytes(turns))
    assert sizes[0] == sizes[1]
