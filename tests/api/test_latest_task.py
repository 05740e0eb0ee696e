"""Work of which only the latest goes on."""

import asyncio

from m2pem.api import LatestTask


async def test_new_work_begins_when_the_work_before_it_has_ended() -> None:
    done: list[str] = []
    begun = asyncio.Event()

    async def slow() -> None:
        begun.set()
        try:
            await asyncio.Event().wait()
        finally:
            await asyncio.sleep(0)
            done.append("slow has ended")

    async def fast() -> None:
        done.append("fast")
        finished.set()

    finished = asyncio.Event()
    work = LatestTask()
    work.replace(slow)
    await begun.wait()
    work.replace(fast)
    await finished.wait()
    assert done == ["slow has ended", "fast"]
    await work.close()
    assert not work.is_running


async def test_what_is_added_goes_on_beside_other_work_until_it_is_replaced() -> None:
    async def for_ever() -> None:
        await asyncio.Event().wait()

    work = LatestTask()
    work.replace(for_ever)
    added = work.add(for_ever())
    await asyncio.sleep(0)
    assert work.is_running
    assert not added.done()
    work.cancel()
    await asyncio.wait([added])
    assert added.cancelled()
    await work.close()
    assert not work.is_running
