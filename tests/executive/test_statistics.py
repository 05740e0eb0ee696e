"""What an executive counts, and what it says of its queues."""

import asyncio
from collections.abc import Callable

import msgspec

from m2pem.api.clock import SystemClock
from m2pem.api.operations import OPERATIONS
from m2pem.api.runs import RunStatus
from m2pem.api.statistics import ExecutiveStatistics
from m2pem.api.telemetry import LinkState
from m2pem.executive.counts import Durations
from m2pem.executive.executive import Executive
from m2pem.journal import MemoryJournal
from m2pem.plugins import PluginManager
from m2pem.testing import scenarios

FLEET = scenarios.fleet("sim", {"ugv1": {}, "ugv2": {}})


async def until(condition: Callable[[], bool]) -> None:
    async with asyncio.timeout(20):
        while not condition():  # noqa: ASYNC110  # any event may change it
            await asyncio.sleep(0.01)


def test_a_histogram_is_cumulative_and_its_bounds_belong_to_what_is_below() -> None:
    durations = Durations((0.1, 1.0))
    for took_s in (0.05, 0.1, 0.5, 7.0):
        durations.add(took_s)
    counts = durations.counts()
    assert counts.counts == (2, 3, 4)
    assert (counts.count, counts.sum_s, counts.longest_s) == (4, 7.65, 7.0)


async def test_what_a_run_decides_is_counted_once_a_commit() -> None:
    async with Executive(FLEET, MemoryJournal(), PluginManager(), SystemClock()) as executive:
        control = executive.control
        before = await control.statistics()
        run = await control.start(scenarios.question("Road?"))
        await until(lambda: bool(control.prompts()))
        asked = await control.statistics()
        (prompt,) = control.prompts()
        await control.answer(run, prompt.prompt, prompt.decisions[0].value, by="anna")
        summary = await control.wait(run)
        after = await control.statistics()
    assert (before.inputs, before.records, before.commits.count, before.runs_ended) == (0, 0, 0, {})
    assert asked.runs == {"running": 1, "paused": 0}
    assert (asked.prompts, asked.inboxes) == (1, {run: 0})
    assert summary.status is RunStatus.COMPLETED
    assert after.records == summary.records
    assert 0 < after.commits.count <= after.inputs < after.records
    assert after.commits.sum_s >= after.commits.longest_s > 0
    assert (after.prompts, after.runs_ended) == (0, {"completed": 1})
    assert after.runs == {"running": 0, "paused": 0}


async def test_links_and_lateness_are_those_of_now() -> None:
    async with Executive(FLEET, MemoryJournal(), PluginManager(), SystemClock()) as executive:
        latest = executive.bus.latest
        await until(lambda: all(latest(each) for each in FLEET.vehicles))
        await until(lambda: executive.stalls.lateness.counts().count > 0)
        found = await executive.control.statistics()
    assert {str(each) for each in found.links} >= {"ugv1", "ugv2"}
    for name in FLEET.vehicles:
        link = found.links[name]
        assert link.state is LinkState.CONNECTED
        assert link.age_s is not None
        assert 0 <= link.age_s < 60
    assert found.loop.count > 0


async def test_telemetry_that_a_slow_reader_lost_stays_counted_when_it_is_gone() -> None:
    async with Executive(FLEET, MemoryJournal(), PluginManager(), SystemClock()) as executive:
        slow = executive.control.telemetry(size=1)
        await until(lambda: executive.bus.dropped > 2)
        behind = await executive.control.statistics()
        del slow
        after = await executive.control.statistics()
    full = [each for each in behind.subscriptions if each.size == 1]
    assert [each.waiting for each in full] == [1]
    assert full[0].dropped == behind.telemetry_dropped > 2
    assert not [each for each in after.subscriptions if each.size == 1]
    assert after.telemetry_dropped >= behind.telemetry_dropped


async def test_subscribers_that_are_cut_off_are_counted() -> None:
    async with Executive(FLEET, MemoryJournal(), PluginManager(), SystemClock()) as executive:
        slow = executive.control.subscribe(size=2)
        run = await executive.control.start(scenarios.question("Road?"))
        found = await executive.control.statistics()
        await executive.control.stop(run)
        assert slow is not None
    assert found.events_cut_off == 1
    assert found.events_waiting == 2


async def test_statistics_pass_through_the_control_socket() -> None:
    async with Executive(FLEET, MemoryJournal(), PluginManager(), SystemClock()) as executive:
        found = await executive.control.statistics()
    sent = msgspec.json.decode(msgspec.json.encode(OPERATIONS["statistics"].encode(found)))
    assert msgspec.convert(sent, ExecutiveStatistics) == found
