"""Runs whose every element waits for an operator's answer, on an SQLite journal.

python -m bench.programs.answering <runs> <answers to each>

Each run is a loop through one user task. `fsyncs_per_input`: an input's time over that of an fsync
of what it adds to the log, in the same folder, in turns.
"""

import asyncio
import json
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

from bench.graphs import file
from bench.journal import fsync_s
from bench.programs.stage import asking, executive, flows
from m2pem.executive.executive import Executive
from m2pem.journal.sqlite import SqliteJournal

MISSION = file(
    f'<process id="BENCH" isExecutable="true"><startEvent id="start"/>{asking("u")}'
    f"{flows(['start', 'u', 'u'])}</process>"
)
TURNS = 10


async def answer(running: Executive, run: str, times: int) -> None:
    """Answer a run's prompt, and the one that comes of that, and so on."""
    for _ in range(times):
        (prompt,) = running.runners[run].prompts
        await running.control.answer(run, prompt, "done")


async def measure(runs: int, answers: int, folder: Path) -> dict[str, float]:
    """In some turns, so that a disk that changes its pace does so for both."""
    journal = SqliteJournal.open(folder / "journal.db")
    turns = min(TURNS, answers)
    times, syncs = [], []
    async with executive(journal) as running:
        names = [await running.control.start(MISSION) for _ in range(runs)]
        commits = 0
        for turn in range(turns):
            syncs.append(fsync_s(folder / f"fsync{turn}", max(10, answers // turns)))
            before = journal.commits
            began = time.perf_counter()
            await asyncio.gather(*(answer(running, name, answers // turns) for name in names))
            times.append((time.perf_counter() - began) / (runs * (answers // turns)))
            commits += journal.commits - before
        for name in names:
            assert running.runners[name].run.state.last_token == 1
            assert len(running.runners[name].prompts) == 1
    await journal.close()
    return {
        "inputs_per_s": 1 / median(times),
        "commits_per_input": commits / (runs * turns * (answers // turns)),
        "fsync_ms": median(syncs) * 1000,
        "fsyncs_per_input": median(times) / median(syncs),
    }


if __name__ == "__main__":
    with tempfile.TemporaryDirectory(dir=Path.cwd()) as scratch:
        print(json.dumps(asyncio.run(measure(int(sys.argv[1]), int(sys.argv[2]), Path(scratch)))))
