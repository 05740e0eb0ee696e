"""Plays graphs with m2pem's engine: each line of standard input is an order, its answer a line.

    {"xml": ..., "given": {"n": 0}, "instances": 1, "journal": "none"}

`journal`: "none", where records are made and dropped; "memory"; or "sqlite", in a file of the
current folder. `enough_s`: short work is done again until that much CPU time is spent.
Run beside `peers/`, which answer the same order.
"""

import asyncio
import json
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeAlias

from bench.measured import ENOUGH_S, Stopwatch, again_and_again, peak_kb
from m2pem.bpmn import parse_mission
from m2pem.engine.inputs import Continue, Input, StartRun
from m2pem.engine.records import DataWritten, Record, TokenEntered
from m2pem.engine.run import MissionRun, Step
from m2pem.journal import Entry, Journal, MemoryJournal, RunHeader
from m2pem.journal.sqlite import SqliteJournal
from m2pem.mission.mission import Mission

PROCESS = "BENCH"
AT_ONCE = 100

Played: TypeAlias = tuple[float, list[dict[str, Any]]]
"""Real seconds, and what came of each instance."""


class Outcome:
    """What came of an instance, by its records."""

    def __init__(self, given: dict[str, Any]) -> None:
        self.data = dict(given)
        self.tasks = 0

    def see(self, records: Sequence[Record]) -> None:
        """Fold some records."""
        for each in records:
            if isinstance(each, TokenEntered):
                self.tasks += each.element[0] == "t"
            elif isinstance(each, DataWritten):
                self.data[each.key] = each.value

    def told(self, run: MissionRun) -> dict[str, Any]:
        """As the answer has it."""
        return {"ended": str(run.state.outcome), "data": self.data, "tasks": self.tasks}


def play(mission: Mission, order: dict[str, Any]) -> tuple[float, Played]:
    """All instances, one after the other, without a journal; CPU seconds and the rest."""
    watch = Stopwatch()
    seen = []
    for number in range(order["instances"]):
        item: Input = StartRun(PROCESS, order["given"])
        outcome = Outcome(order["given"])
        with watch:
            run = MissionRun(mission, None, f"r{number + 1}")
            step = run.receive(item, 0)
        outcome.see(step.records)
        while run.wants_continue:
            with watch:
                step = run.receive(Continue(), 0)
            outcome.see(step.records)
        seen.append(outcome.told(run))
    return watch.cpu_s, (watch.wall_s, seen)


async def play_into(
    journal: Journal, mission: Mission, order: dict[str, Any]
) -> tuple[float, Played]:
    """The same, with every step appended to the journal before the next one is taken, and
    `AT_ONCE` instances at a time."""
    whole, aside = Stopwatch(), Stopwatch()
    header = RunHeader("bench.bpmn", mission.source, PROCESS)
    names = [await journal.create(header) for _ in range(order["instances"])]

    async def instance(name: str) -> dict[str, Any]:
        outcome = Outcome(order["given"])
        run = MissionRun(mission, None, name)
        step = run.receive(StartRun(PROCESS, order["given"]), 0)
        while True:
            await journal.append([entry(name, step)])
            with aside:
                outcome.see(step.records)
            if not run.wants_continue:
                return outcome.told(run)
            step = run.receive(Continue(), 0)

    seen: list[dict[str, Any]] = []
    with whole:
        for first in range(0, len(names), AT_ONCE):
            some = names[first : first + AT_ONCE]
            seen += await asyncio.gather(*(instance(name) for name in some))
    for name in names:
        await journal.release(name)
    await journal.close()
    return whole.cpu_s - aside.cpu_s, (whole.wall_s - aside.wall_s, seen)


def entry(run: str, step: Step) -> Entry:
    """A step as a journal takes it."""
    return Entry(run, 1, step.seq, step.at_us, step.t_us, step.input, tuple(step.records))


def main() -> None:
    """Play each order, and answer."""
    for line in sys.stdin:
        print(json.dumps(played(json.loads(line))), flush=True)


def played(order: dict[str, Any]) -> dict[str, Any]:
    """Play an order, and return the answer."""
    watch = Stopwatch()
    with watch:
        mission = parse_mission(order["xml"].encode(), "bench.bpmn")
    given: str = order["journal"]
    enough_s = order.get("enough_s", ENOUGH_S)
    if given == "none":
        cpu_s, (wall_s, seen) = again_and_again(lambda: play(mission, order), enough_s)
    elif given == "memory":
        cpu_s, (wall_s, seen) = again_and_again(
            lambda: asyncio.run(play_into(MemoryJournal(), mission, order)), enough_s
        )
    else:
        with tempfile.TemporaryDirectory(dir=Path.cwd()) as scratch:
            journal = SqliteJournal.open(Path(scratch, "journal.db"))
            cpu_s, (wall_s, seen) = asyncio.run(play_into(journal, mission, order))
    different = [each for place, each in enumerate(seen) if each not in seen[:1] or not place]
    answer = {"parse_s": watch.cpu_s, "cpu_s": cpu_s, "wall_s": wall_s, "peak_kb": peak_kb()}
    return {**answer, "outcomes": different, "instances": len(seen)}


if __name__ == "__main__":
    main()
