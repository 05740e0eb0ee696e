"""Replay of a loop's records: by applying them alone, and out of an SQLite journal.

python -m bench.programs.replaying <rounds>
"""

import asyncio
import json
import sys
import tempfile
from pathlib import Path

from bench.graphs import loop
from bench.measured import Stopwatch
from bench.play_m2pem import entry
from m2pem.bpmn import parse_mission
from m2pem.engine.inputs import Continue, StartRun
from m2pem.engine.records import Record
from m2pem.engine.run import MissionRun
from m2pem.executive.recovery import replay
from m2pem.journal import RunHeader
from m2pem.journal.sqlite import SqliteJournal


async def measure(rounds: int, folder: Path) -> dict[str, float]:
    """Play once into the journal, then replay in both ways."""
    graph = loop(rounds)
    mission = parse_mission(graph.xml, "bench.bpmn")
    journal = SqliteJournal.open(folder / "journal.db")
    name = await journal.create(RunHeader("bench.bpmn", graph.xml, "BENCH"))
    run = MissionRun(mission, None, name)
    records: list[Record] = []
    step = run.receive(StartRun("BENCH", dict(graph.given)), 0)
    while True:
        await journal.append([entry(name, step)])
        records.extend(step.records)
        if not run.wants_continue:
            break
        step = run.receive(Continue(), 0)

    fold, read = Stopwatch(), Stopwatch()
    for watch in (fold, read):
        again = MissionRun(mission, None, name)
        with watch:
            if watch is fold:
                again.replay(records)
            else:
                await replay(journal, again, None)
        assert again.state.seq == run.state.seq and again.state.outcome == "completed"
    await journal.close()
    count = len(records)
    return {"records_per_s": count / fold.cpu_s, "from_sqlite_per_s": count / read.cpu_s}


if __name__ == "__main__":
    with tempfile.TemporaryDirectory(dir=Path.cwd()) as scratch:
        print(json.dumps(asyncio.run(measure(int(sys.argv[1]), Path(scratch)))))
