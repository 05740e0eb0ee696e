"""Runs whose every element waits for an operator's answer, on an SQLite journal.

python -m bench.programs.answering <runs> <answers to each>

Each run is a loop through one user task. `fsyncs_per_input`: an input's time over that of an fsync
of what it adds to the log, in the same folder, in turns; `beyond_fsync_ms`: by how much it is more.
"""

import asyncio
import json
import os
import sys
import tempfile
import time
from pathlib import Path

from bench.graphs import file
from bench.programs.stage import asking, executive, flows
from m2pem.executive.executive import Executive
from m2pem.journal.sqlite import SqliteJournal

MISSION = file(
    f'<process id="BENCH" isExecutable="true"><startEvent id="start"/>{asking("u")}'
    f"{flows(['start', 'u', 'u'])}</process>"
)
COMMIT_BYTES = 3 * 4096
LOG_BYTES = 300 * COMMIT_BYTES


class Disk:
    """What an fsync takes after a write of what a small commit adds to the log.

    SQLite writes its log from the beginning again and again: none of the time goes into making a
    file longer.
    """

    def __init__(self, path: Path) -> None:
        self._file = os.open(path, os.O_RDWR | os.O_CREAT, 0o600)
        self._pages = os.urandom(COMMIT_BYTES)
        self._place = 0
        os.pwrite(self._file, os.urandom(LOG_BYTES), 0)
        os.fsync(self._file)

    def fsync_s(self) -> float:
        """Write and fsync once; seconds."""
        began = time.perf_counter()
        os.pwrite(self._file, self._pages, self._place)
        os.fdatasync(self._file)
        self._place = (self._place + COMMIT_BYTES) % LOG_BYTES
        return time.perf_counter() - began


async def answer(running: Executive, run: str, times: int) -> None:
    """Answer a run's prompt, and the one that comes of that, and so on."""
    for _ in range(times):
        (prompt,) = running.runners[run].prompts
        await running.control.answer(run, prompt, "done")


async def measure(runs: int, answers: int, folder: Path) -> dict[str, float]:
    """A single run takes turns with the fsyncs: a disk that changes its pace does so for both."""
    journal = SqliteJournal.open(folder / "journal.db")
    disk = Disk(folder / "log")
    turns = answers if runs == 1 else 1
    took_s = sync_s = 0.0
    commits = 0
    async with executive(journal) as running:
        names = [await running.control.start(MISSION) for _ in range(runs)]
        for _ in range(turns):
            sync_s += disk.fsync_s()
            before = journal.commits
            began = time.perf_counter()
            await asyncio.gather(*(answer(running, name, answers // turns) for name in names))
            took_s += time.perf_counter() - began
            commits += journal.commits - before
        for name in names:
            state = running.runners[name].run.state
            assert (state.last_prompt, len(state.prompts)) == (answers + 1, 1)
    await journal.close()
    inputs = runs * answers
    input_s, fsync_s = took_s / inputs, sync_s / turns
    return {
        "inputs_per_s": 1 / input_s,
        "commits_per_input": commits / inputs,
        "fsync_ms": fsync_s * 1000,
        "fsyncs_per_input": input_s / fsync_s,
        "beyond_fsync_ms": (input_s - fsync_s) * 1000,
    }


if __name__ == "__main__":
    with tempfile.TemporaryDirectory(dir=Path.cwd()) as scratch:
        print(json.dumps(asyncio.run(measure(int(sys.argv[1]), int(sys.argv[2]), Path(scratch)))))
