"""Calls into MAVSDK that are on their way."""

import asyncio
import threading

import pytest
from m2pem_plugin_mavlink.mavsdk_driver.link import PendingCalls


async def test_a_call_gives_its_result_or_raises():
    calls = PendingCalls()

    async def works():
        return 7

    async def fails():
        raise ValueError("no")

    assert await calls.make(works()) == 7
    with pytest.raises(ValueError, match="no"):
        await calls.make(fails())
    assert not calls.pending


async def test_a_call_whose_caller_is_gone_is_still_waited_for():
    calls, go, back = PendingCalls(), threading.Event(), []

    async def blocks():
        await asyncio.get_running_loop().run_in_executor(None, go.wait, 10)
        back.append("back")

    caller = asyncio.create_task(calls.make(blocks()))
    await asyncio.sleep(0)
    await asyncio.sleep(0)
    caller.cancel()
    with pytest.raises(asyncio.CancelledError):
        await caller
    assert calls.pending
    finish = asyncio.create_task(calls.finish())
    await asyncio.sleep(0)
    assert not finish.done()
    go.set()
    await finish
    assert back == ["back"]
    assert not calls.pending


async def test_what_a_forgotten_call_raises_disturbs_nobody(caplog):
    calls = PendingCalls()

    async def fails():
        await asyncio.sleep(0)
        raise ValueError("no")

    caller = asyncio.create_task(calls.make(fails()))
    await asyncio.sleep(0)
    caller.cancel()
    await asyncio.wait([caller])
    await calls.finish()
    assert not caplog.records
