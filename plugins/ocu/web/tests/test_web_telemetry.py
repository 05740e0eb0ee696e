"""Where the vehicles of runs were, as the page is told: after a restart, and with a broken disk."""

import asyncio
import logging
import time
from collections.abc import Callable
from contextlib import AsyncExitStack
from itertools import pairwise
from pathlib import Path
from typing import Any

import msgspec
import pytest
from m2pem_plugin_web.tracks.stores import FolderStore
from m2pem_plugin_web.tracks.thinning import SPACING_S
from m2pem_plugin_web.tracks.track import Head, Track
from test_web_restart import left_by_a_crash
from web_world import PLUGINS, SPEED, VEHICLE, Browser, MakeWorld, World, executive, serving

from m2pem.api import OpenPrompt, RunStatus, VehicleState
from m2pem.api.clock import SystemClock
from m2pem.cli.journals import last_decided_us
from m2pem.executive.executive import Executive
from m2pem.journal.sqlite import SqliteJournal
from m2pem.testing import scenarios

WITHIN_S = 60.0
DISTANCES = [*["20 m"] * 6, "5 km"]
"""The last one takes longer than any of these tests: a run is crashed or stopped on its way."""
BACK = scenarios.in_sequence("reverse", VEHICLE, *({"distance": each} for each in DISTANCES))
SHORT = scenarios.in_sequence("reverse", VEHICLE, *({"distance": each} for each in DISTANCES[:-1]))

Samples = list[dict[str, Any]]


async def track_of(browser: Browser, run: str, limit: int = 1000) -> Samples:
    """All that is told, page by page."""
    samples: Samples = []
    asked: dict[str, float] = {"limit": limit}
    while True:
        answer = await browser.http.get(f"/api/runs/{run}/telemetry", params=asked)
        assert answer.status_code == 200, answer.text
        page = answer.json()
        assert page["problem"] is None
        samples += page["samples"]
        if page["next"] is None:
            return samples
        asked["after"] = page["next"]


async def tracked(browser: Browser, run: str, enough: Callable[[Samples], bool]) -> Samples:
    """Wait until enough of a run is kept."""
    async with asyncio.timeout(WITHIN_S):
        while True:
            if enough(samples := await track_of(browser, run)):
                return samples
            await asyncio.sleep(0.05)


def states_of(samples: Samples) -> list[tuple[float, VehicleState]]:
    """What was said of the vehicle, and when."""
    return [
        (each["t"], msgspec.convert(each["vehicles"][VEHICLE], VehicleState))
        for each in samples
        if VEHICLE in each["vehicles"]
    ]


async def begun(stack: AsyncExitStack, folder: Path) -> World:
    """An executive with its page, as `m2pem serve` starts it: runs of before are taken up."""
    journal = SqliteJournal.open(folder / "journal.db")
    stack.push_async_callback(journal.close)
    open_ones = [line for line in await journal.runs() if line.outcome is None]
    decided_us = [await last_decided_us(journal, line) for line in open_ones]
    running = await stack.enter_async_context(
        Executive(
            scenarios.fleet("sim", {VEHICLE: {}}),
            journal,
            PLUGINS,
            SystemClock(SPEED, max([time.time_ns() // 1000, *decided_us])),
            speed=SPEED,
        )
    )
    for line in open_ones:
        await running.resume(line.run)
    return await stack.enter_async_context(serving(running.control, folder, {}))


async def resumed(world: World, run: str) -> None:
    """The simulation is new and knows nothing of before: what was done is to be done again."""
    async for notice in world.control.subscribe(run):
        if isinstance(notice, OpenPrompt):
            await world.control.answer(run, notice.prompt, "resume")
            return


async def test_a_track_is_kept_over_a_crash_and_told_by_pages(tmp_path: Path) -> None:
    async with AsyncExitStack() as stack:
        first = await begun(stack, tmp_path)
        run = await first.control.start(BACK)
        browser = await first.browser()
        before = await tracked(browser, run, lambda found: len(states_of(found)) > 5)
        copy = left_by_a_crash(tmp_path)
    stale = Track(FolderStore(copy / "journal.db-tracks"), Head("r7", 1), 0.0)
    stale.close()
    async with AsyncExitStack() as stack:
        second = await begun(stack, copy)
        browser = await second.browser()
        async with asyncio.timeout(WITHIN_S):
            await resumed(second, run)
            await tracked(
                browser, run, lambda found: states_of(found)[-1][0] > states_of(before)[-1][0] + 1
            )
            await second.control.stop(run)
            assert (await second.control.wait(run)).status is RunStatus.STOPPED
        samples = await track_of(browser, run)
        assert samples == await track_of(browser, run, limit=3)
        states = states_of(samples)
        assert states[0] == states_of(before)[0]
        assert states[-1][0] > states_of(before)[-1][0]
        assert all(b["t"] > a["t"] for a, b in pairwise(samples))
        assert all(b - a >= SPACING_S for (a, _), (b, _) in pairwise(states))
        places = [state.position for _, state in states]
        assert all(a != b for a, b in pairwise(places))
        assert [path.name for path in (copy / "journal.db-tracks").glob("*.jsonl")] == ["r1.jsonl"]
        missing = await browser.http.get("/api/runs/r7/telemetry")
        assert missing.status_code == 404


async def test_a_run_of_before_the_page_has_no_track(tmp_path: Path) -> None:
    journal = SqliteJournal.open(tmp_path / "journal.db")
    async with AsyncExitStack() as stack:
        stack.push_async_callback(journal.close)
        running = await stack.enter_async_context(executive(journal))
        run = await running.control.start(
            scenarios.one_behavior("reverse", VEHICLE, distance="1 m")
        )
        await running.control.wait(run)
        here = await stack.enter_async_context(serving(running.control, tmp_path, {}))
        answer = await (await here.browser()).http.get(f"/api/runs/{run}/telemetry")
        assert answer.json() == {"samples": [], "next": None, "problem": None}


async def test_of_a_journal_in_memory_no_file_is_written(world: MakeWorld, tmp_path: Path) -> None:
    async with world() as here:
        run = await here.control.start(BACK)
        await tracked(await here.browser(), run, lambda found: len(states_of(found)) > 2)
        found = [each.name for each in tmp_path.rglob("*.jsonl")]  # noqa: ASYNC240
    assert found == []


async def test_a_broken_disk_is_said_once_and_stops_nothing(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "journal.db-tracks").write_text("a file where the folder would be")
    async with AsyncExitStack() as stack:
        here = await begun(stack, tmp_path)
        browser = await here.browser()
        run = await here.control.start(SHORT)
        async with asyncio.timeout(WITHIN_S):
            while True:
                page = (await browser.http.get(f"/api/runs/{run}/telemetry")).json()
                if page["problem"]:
                    break
                await asyncio.sleep(0.05)
            assert (await here.control.wait(run)).status is RunStatus.COMPLETED
        assert f"the track of {run} cannot be written" in page["problem"]
        assert str(tmp_path) not in page["problem"]
        assert page["samples"] == []
    said = [each for each in caplog.records if "cannot be written" in each.getMessage()]
    assert [each.levelno for each in said] == [logging.WARNING]


async def test_a_run_began_when_the_clock_on_the_wall_said(world: MakeWorld) -> None:
    async with world() as here:
        browser = await here.browser()
        first = await here.asked()
        async with asyncio.timeout(WITHIN_S):  # until its clock is well ahead
            notices = here.control.telemetry()
            while await here.control.mission_time_s(first.run) < SPEED:
                await anext(notices)
        before_us = time.time_ns() // 1000
        prompt = await here.asked()
        after_us = time.time_ns() // 1000
        told = (await browser.http.get("/api/runs")).json()[-1]
        assert before_us <= told["began_us"] <= after_us < told["started_us"]
        assert told["took_s"] >= 0 and told["ended_us"] is None
        await here.control.answer(prompt.run, prompt.prompt, "abort")
        await here.control.wait(prompt.run)
        told = (await browser.http.get(f"/api/runs/{prompt.run}")).json()
        assert told["took_s"] == (told["ended_us"] - told["started_us"]) / 1e6
        live = await browser.live()
        runs = (await live.watch(None))["runs"]
        assert [each["began_us"] for each in runs][-1] == told["began_us"]
