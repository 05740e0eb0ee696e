"""An executive whose run 50 browsers watch at once: what that costs the engine, and how late it is.

python -m bench.programs.web_crowd <seconds with the page> [turns] [browsers] [tabs]

The diagram is that of `bench.programs.web`: 12,000 token events a second if the engine is never
late, and a round begins when the one before has ended, so that all lateness adds up. Browsers
without a screen take in all that they are sent, in two processes; tabs of Chromium draw it as well.
Each turn is a run, in every other one it is watched. The executive has one processor for itself, as
browsers are on other machines; all browsers share the others, so that these may be too slow for all
frames: then they get fewer. `us_per_record`: CPU time of the executive's process.
"""

import asyncio
import json
import os
import sys
import tempfile
import time
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from bench.measured import peak_kb
from bench.programs.stage import executive
from bench.programs.web import MISSION, WARM_S, answer_of, counted, join, served
from m2pem.executive.executive import Executive
from m2pem.journal.sqlite import SqliteJournal
from m2pem.units import US_PER_S

PROCESSES = 2


@dataclass(frozen=True, slots=True)
class Crowd:
    """Browsers without a screen, and tabs of Chromium; the processors that they share."""

    browsers: int
    tabs: int
    cores: Collection[int]


@dataclass(frozen=True, slots=True)
class Turn:
    """What a run has made in a second, and the CPU time of the executive for it, in us."""

    records_per_s: float
    us_per_record: float


async def measured(running: Executive, run: str, seconds: float) -> Turn:
    """Measure a run that goes on."""
    state = running.runners[run].run.state
    seq, began, cpu_s = state.seq, time.perf_counter(), time.process_time()
    await asyncio.sleep(seconds)
    records = state.seq - seq
    took_s = time.perf_counter() - began
    return Turn(records / took_s, (time.process_time() - cpu_s) / records * US_PER_S)


async def alone(running: Executive, seconds: float) -> Turn:
    """A run without a browser; no page is served."""
    run = await running.control.start(MISSION)
    await asyncio.sleep(WARM_S)
    turn = await measured(running, run, seconds)
    await running.control.stop(run)
    await running.control.wait(run)
    return turn


async def together(
    running: Executive, seconds: float, folder: Path, crowd: Crowd
) -> tuple[Turn, dict[str, float]]:
    """A run that a crowd watches, and what the one of them has that lags most."""
    run = await running.control.start(MISSION)
    async with served(running, folder) as ocu:
        readers = []
        for index in range(PROCESSES):
            count = crowd.browsers // PROCESSES + (index < crowd.browsers % PROCESSES)
            if count:
                program = ("web_browsers", run, str(count), "0")
                readers.append(await join(ocu, count, *program, cores=crowd.cores))
        tabs = [
            await join(ocu, 1, "web_tab", run, str(seconds), cores=crowd.cores)
            for _ in range(crowd.tabs)
        ]
        for tab in tabs:
            assert tab.stdout is not None
            await tab.stdout.readline()
        await asyncio.sleep(WARM_S)
        for tab in tabs:
            assert tab.stdin is not None
            tab.stdin.write(b"count\n")
        turn = await measured(running, run, seconds)
        await running.control.stop(run)
        await running.control.wait(run)
        entered, _, last = await counted(running, run)
        answers = await asyncio.gather(*(answer_of(each) for each in readers))
        drawn = await asyncio.gather(*(answer_of(each, f"{last}\n") for each in tabs))
    for each in answers:
        assert each["events"] == last, f"{each['events']} of {last} records were counted"
        assert each["hits"] == entered, f"{each['hits']} of {entered} entries were counted"
    return turn, {**_worst(answers), **{f"tab_{k}": v for k, v in _worst(drawn).items()}}


def _worst(answers: list[Mapping[str, float]]) -> dict[str, float]:
    """Of each figure, the lowest rate and the longest time."""
    return {
        name: (max if name.endswith("_ms") else min)(each[name] for each in answers)
        for name in (answers[0] if answers else {})
    }


async def measure(seconds: float, turns: int, folder: Path, crowd: Crowd) -> dict[str, float]:
    """Turns without and with the crowd, one after the other."""
    journal = SqliteJournal.open(folder / "journal.db")
    pairs: list[tuple[Turn, Turn]] = []
    seen: list[dict[str, float]] = []
    async with executive(journal) as running:
        for _ in range(turns):
            unwatched = await alone(running, seconds / turns)
            watched, answer = await together(running, seconds / turns, folder, crowd)
            pairs.append((unwatched, watched))
            seen.append(answer)
    await journal.close()
    return {
        "ratio": median(b.records_per_s / a.records_per_s for a, b in pairs),
        "records_per_s": median(b.records_per_s for _, b in pairs),
        "us_per_record": median(b.us_per_record for _, b in pairs),
        "alone_us_per_record": median(a.us_per_record for a, _ in pairs),
        "peak_mb": peak_kb() / 1000,
        **{name: median(each[name] for each in seen) for name in seen[0]},
    }


def main() -> None:
    """Measure, and print the answer."""
    seconds, *more = sys.argv[1:]
    turns, browsers, tabs = (int(each) for each in [*more, *("3", "50", "2")[len(more) :]])
    own, *others = sorted(os.sched_getaffinity(0))
    os.sched_setaffinity(0, {own})
    crowd = Crowd(browsers, tabs, others or [own])
    with tempfile.TemporaryDirectory() as scratch:
        print(json.dumps(asyncio.run(measure(float(seconds), turns, Path(scratch), crowd))))


if __name__ == "__main__":
    main()
