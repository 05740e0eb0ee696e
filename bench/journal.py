"""Measure the journals: bulk records, many runs at once, one run alone, replay. Prints JSON.

    python bench/journal.py [folder] [URL]

The folder (default: the current one) should be on the disk that a journal would be on. With the URL
of an empty database of PostgreSQL, a journal there is measured, too, in turns with SQLite.
"""

import asyncio
import json
import os
import sys
import tempfile
import time
from collections.abc import Awaitable, Callable, Sequence
from pathlib import Path

from m2pem.engine.inputs import BehaviorReported, Continue, Input
from m2pem.engine.records import (
    BehaviorEnded,
    BehaviorRequested,
    DataWritten,
    FlowTaken,
    Record,
    TokenEntered,
    TokenLeft,
    TokenOutcome,
)
from m2pem.journal import Entry, Journal, MemoryJournal, RunHeader, open_journal
from m2pem.journal.database_journal import DatabaseJournal
from m2pem.journal.sqlite import SqliteJournal
from m2pem.mission.catalogue import BehaviorState

HEADER = RunHeader("bench.bpmn", b"<definitions/>" * 1000, "PATROL")
P, E = "PATROL", "Activity_0x81c2"


def element(n: int) -> Sequence[Record]:
    """What a script task costs: four records."""
    return (
        TokenEntered(n, P, E, 1, flow="Flow_1"),
        DataWritten(n, P, E, 1, "mission.round", n, 1),
        TokenLeft(n, P, E, 1, TokenOutcome.COMPLETED),
        FlowTaken(n, P, E, 1, "Flow_2"),
    )


def behavior(n: int) -> Sequence[Record]:
    """What a behavior's end, and the request of the next one, cost: five records."""
    return (
        BehaviorEnded(n, P, E, 1, f"b{n}", BehaviorState.SUCCEEDED, ""),
        TokenLeft(n, P, E, 1, TokenOutcome.COMPLETED),
        FlowTaken(n, P, E, 1, "Flow_2"),
        TokenEntered(n, P, E, 1, flow="Flow_2"),
        BehaviorRequested(
            n, P, E, 1, f"b{n + 1}", "goto", "vehicle", ("evsg1",), {"driver": ("evsg1",)},
            {"target": "alpha", "speed": 5.0},
        ),
    )  # fmt: skip


def entry(run: str, seq: int, given: Input, records: Sequence[Record]) -> Entry:
    """An entry of a run's first epoch."""
    return Entry(run, 1, seq, 1_800_000_000_000_000 + seq, seq * 1000, given, tuple(records))


async def bulk(journal: Journal, inputs: int, elements: int) -> dict[str, float]:
    """One run; every input gives `elements` elements of four records."""
    run = await journal.create(HEADER)
    records = [record for n in range(elements) for record in element(n)]
    began = time.perf_counter()
    for n in range(inputs):
        await journal.append([entry(run, 1 + n * len(records), Continue(), records)])
    took = time.perf_counter() - began
    return {
        "elements_per_s": round(inputs * elements / took),
        "records_per_s": round(inputs * len(records) / took),
    }


async def replay(journal: Journal) -> dict[str, float]:
    """Read the first run back."""
    began = time.perf_counter()
    count = 0
    async for found in journal.read("r1"):
        count += len(found.records)
    return {"records_read_per_s": round(count / (time.perf_counter() - began))}


async def bulk_and_replay(journal: Journal) -> dict[str, float]:
    """One run, written and read."""
    return await bulk(journal, 200, 1000) | await replay(journal)


async def drive(journal: Journal, run: str, inputs: int) -> None:
    """One input after the other, each durable before the next."""
    seq = 1
    for n in range(inputs):
        records = behavior(n)
        given = BehaviorReported(f"b{n}", 3, BehaviorState.SUCCEEDED)
        await journal.append([entry(run, seq, given, records)])
        seq += len(records)


async def concurrent(journal: DatabaseJournal, runs: int, inputs: int) -> dict[str, float]:
    """`runs` runs at once, each with one input after the other."""
    names = [await journal.create(HEADER) for _ in range(runs)]
    commits = journal.commits
    began = time.perf_counter()
    cpu = time.process_time()
    await asyncio.gather(*(drive(journal, run, inputs) for run in names))
    took = time.perf_counter() - began
    return {
        "inputs_per_s": round(runs * inputs / took),
        "cpu_us_per_input": round((time.process_time() - cpu) / (runs * inputs) * 1e6, 1),
        "commits_per_input": round((journal.commits - commits) / (runs * inputs), 4),
    }


def fsync_s(path: Path, count: int) -> float:
    """The mean time of an fsync after a write of what a small commit adds to the log."""
    file = os.open(path, os.O_RDWR | os.O_CREAT, 0o600)
    page = os.urandom(3 * 4096)
    took = 0.0
    for n in range(count):
        os.pwrite(file, page, n * len(page))
        began = time.perf_counter()
        os.fdatasync(file)
        took += time.perf_counter() - began
    os.close(file)
    return took / count


async def single(journal: DatabaseJournal, scratch: Path, inputs: int) -> dict[str, float]:
    """One run alone, beside the disk's own fsync, measured in turns."""
    syncs, appends = [], []
    for turn in range(5):
        syncs.append(fsync_s(scratch / f"fsync{turn}", inputs // 5))
        run = await journal.create(HEADER)
        began = time.perf_counter()
        await drive(journal, run, inputs // 5)
        appends.append((time.perf_counter() - began) / (inputs // 5))
    sync, append = sorted(syncs)[2], sorted(appends)[2]
    return {
        "fsync_ms": round(sync * 1000, 3),
        "append_ms": round(append * 1000, 3),
        "fsyncs_per_input": round(append / sync, 2),
    }


async def measure(folder: Path) -> dict[str, dict[str, float]]:
    """All cases, each with a journal of its own."""
    cases: dict[str, Callable[[SqliteJournal], Awaitable[dict[str, float]]]] = {
        "sqlite, bulk": bulk_and_replay,
        "sqlite, 100 runs": lambda journal: concurrent(journal, 100, 200),
        "sqlite, 1 run": lambda journal: single(journal, folder, 1000),
    }
    results = {"memory, bulk": await bulk(MemoryJournal(), 200, 1000)}
    for number, (name, case) in enumerate(cases.items()):
        journal = SqliteJournal.open(folder / f"{number}.db")
        results[name] = await case(journal)
        await journal.close()
    return results


async def compare(folder: Path, url: str) -> dict[str, dict[str, float]]:
    """Many runs and one run, in SQLite and in PostgreSQL by turns; the medians of their ratios."""
    many, one = [], []
    for turn in range(3):
        rates, appends = [], []
        for journal in (SqliteJournal.open(folder / f"turn{turn}.db"), open_journal(url)):
            assert isinstance(journal, DatabaseJournal)
            rates.append((await concurrent(journal, 100, 40))["inputs_per_s"])
            appends.append((await single(journal, folder, 50))["append_ms"])
            await journal.close()
        many.append((rates[1] / rates[0], rates[1]))
        one.append((appends[1] / appends[0], appends[1]))
    (rate_ratio, rate), (append_ratio, append) = sorted(many)[1], sorted(one)[1]
    return {
        "postgresql, 100 runs": {"inputs_per_s": rate, "of_sqlite": round(rate_ratio, 2)},
        "postgresql, 1 run": {"append_ms": append, "of_sqlite": round(append_ratio, 2)},
    }


if __name__ == "__main__":
    where = Path(sys.argv[1]) if len(sys.argv) > 1 else Path.cwd()
    with tempfile.TemporaryDirectory(dir=where) as scratch:
        found = asyncio.run(measure(Path(scratch)))
        for url in sys.argv[2:]:
            found |= asyncio.run(compare(Path(scratch), url))
        print(json.dumps(found, indent=2))
