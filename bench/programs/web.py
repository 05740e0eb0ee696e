"""An executive whose runs are watched in three browsers, one of which never reads.

python -m bench.programs.web <seconds with the page> [turns]

A diagram of 302 elements, in which 30 tokens go round: 12,000 times a second one comes to or leaves
an element, if the engine is never late; a round begins when the one before has ended, so that all
lateness adds up. The page is served and looked at in every other turn; each turn is a run.
"""

import asyncio
import json
import os
import sys
import tempfile
import time
from collections.abc import AsyncIterator, Collection, Mapping
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from pathlib import Path
from statistics import median
from typing import Any

import m2pem_plugin_web.app  # noqa: F401  # the executive loads it before runs begin
from m2pem_plugin_web.ocu import WebOcu

from bench.graphs import file
from bench.programs.stage import executive, flows
from m2pem.api.records import TokenEntered, TokenLeft
from m2pem.executive.executive import Executive
from m2pem.journal.sqlite import SqliteJournal

RINGS = 15
TASKS = 18
TOKENS = 2
"""In each ring."""
ROUND_S = 0.1
"""In which each token passes 20 elements: 30 * 20 * 2 / 0.1 = 12,000 token events in a second."""
SPREAD_S = 0.003
"""From ring to ring, around that: else all would flash at once, and nothing between."""

WARM_S = 0.5


def rings(round_s: float = ROUND_S) -> bytes:
    """Rings of a gateway, tasks and a timer, with tokens in each. `round_s`: see `ROUND_S`."""
    parts = ['<startEvent id="start"/><parallelGateway id="fork"/>', flows(["start", "fork"])]
    for ring in range(RINGS):
        tasks = [f"t{ring}_{number}" for number in range(TASKS)]
        meet, timer = f"m{ring}", f"w{ring}"
        own_s = round_s + (ring - RINGS // 2) * SPREAD_S
        parts.append(f'<exclusiveGateway id="{meet}"/>')
        parts += [f'<task id="{task}"/>' for task in tasks]
        parts.append(
            f'<intermediateCatchEvent id="{timer}"><timerEventDefinition id="d{ring}">'
            f'<timeDuration xsi:type="tFormalExpression">PT{own_s:.3f}S</timeDuration>'
            "</timerEventDefinition></intermediateCatchEvent>"
        )
        parts.append(flows([meet, *tasks, timer, meet]))
        parts += [
            f'<sequenceFlow id="f{ring}_{number}" sourceRef="fork" targetRef="{meet}"/>'
            for number in range(TOKENS)
        ]
    return file(f'<process id="BENCH" isExecutable="true">{"".join(parts)}</process>')


@asynccontextmanager
async def served(running: Executive, folder: Path) -> AsyncIterator[WebOcu]:
    """Serve the page of an executive; its files are in the folder."""
    environment = {"M2PEM_WEB_PORT": "0", "XDG_STATE_HOME": str(folder)}
    ocu = WebOcu(running.control, environment=environment)
    serving = asyncio.create_task(ocu.serve())
    try:
        yield ocu
    finally:
        serving.cancel()
        with suppress(asyncio.CancelledError):
            await serving


async def join(
    ocu: WebOcu, viewers: int, *program: str, cores: Collection[int] = ()
) -> asyncio.subprocess.Process:
    """Start a program of this package that connects so many browsers; return when they are there.

    Its first argument is the address with a token; the others are those of `program`. `cores`: the
    processors that it and what it starts may use, if not all.
    """
    before = len(ocu.hub.viewers)
    name, *words = program
    command = (sys.executable, "-m", f"bench.programs.{name}", ocu.url, *words)
    pipe = asyncio.subprocess.PIPE
    process = await asyncio.create_subprocess_exec(*command, stdin=pipe, stdout=pipe)
    if cores:
        os.sched_setaffinity(process.pid, cores)
    while len(ocu.hub.viewers) < before + viewers:
        if process.returncode is not None:
            raise RuntimeError(f"{name} ended with {process.returncode}: its browsers did not come")
        await asyncio.sleep(0.02)
    return process


async def answer_of(process: asyncio.subprocess.Process, words: str = "") -> Mapping[str, float]:
    """Write words to a program and return its answer, when it has ended."""
    out, _ = await process.communicate(words.encode())
    if process.returncode:
        raise RuntimeError(f"the browsers ended with {process.returncode}")
    answer: Mapping[str, float] = json.loads(out)
    return answer


@asynccontextmanager
async def watched(running: Executive, run: str, folder: Path) -> AsyncIterator[Any]:
    """Serve the page and have it looked at.

    Yields what waits for the browsers' answer, and what says at which address one more comes in.
    """
    async with served(running, folder) as ocu:
        browsers = await join(ocu, 3, "web_browsers", run)
        yield lambda: answer_of(browsers), lambda: ocu.url


async def turn(running: Executive, seconds: float, folder: Path | None) -> dict[str, float]:
    """A run, with the page (in `folder`) or without; token events and CPU seconds in a second."""
    control = running.control
    run = await control.start(MISSION)
    async with AsyncExitStack() as stack:
        said = None
        if folder is not None:
            said, _ = await stack.enter_async_context(watched(running, run, folder))
        await asyncio.sleep(WARM_S)
        state = running.runners[run].run.state
        seq, began, cpu_s = state.seq, time.perf_counter(), time.process_time()
        await asyncio.sleep(seconds)
        took_s = time.perf_counter() - began
        cpu = (time.process_time() - cpu_s) / took_s
        records = state.seq - seq
        await control.stop(run)
        await control.wait(run)
        answer = dict(await said()) if said is not None else {}
    entered, tokens, last = await counted(running, run)
    # The share of token events among all records is that of the whole run.
    answer |= {"per_s": records / took_s * tokens / last, "cpu": cpu}
    if said is not None:
        assert answer["events"] == last, f"{answer['events']} of {last} records were counted"
        assert answer["hits"] == entered, f"{answer['hits']} of {entered} entries were counted"
    return answer


async def counted(running: Executive, run: str) -> tuple[int, int, int]:
    """Entered elements, token events and records of a run, by its journal."""
    entered = tokens = last = 0
    async for entry in running.journal.read(run):
        last = entry.seq + len(entry.records) - 1
        for record in entry.records:
            entered += isinstance(record, TokenEntered)
            tokens += isinstance(record, TokenEntered | TokenLeft)
    return entered, tokens, last


async def measure(seconds: float, turns: int, folder: Path) -> dict[str, float]:
    """Turns without and with the page, in turn."""
    journal = SqliteJournal.open(folder / "journal.db")
    alone, together = [], []
    async with executive(journal) as running:
        for _ in range(turns):
            alone.append(await turn(running, seconds / turns, None))
            together.append(await turn(running, seconds / turns, folder))
    await journal.close()
    names = ("frames_per_s", "frame_p50_ms", "frame_p99_ms", "event_p50_ms", "event_p99_ms")
    rates = [b["per_s"] / a["per_s"] for a, b in zip(alone, together, strict=True)]
    return {
        "ratio": median(rates),
        "per_s": median(each["per_s"] for each in together),
        "cpu_percent": median(each["cpu"] for each in together) * 100,
        "alone_cpu_percent": median(each["cpu"] for each in alone) * 100,
        **{name: median(each[name] for each in together) for name in names},
    }


MISSION = rings()


def main() -> None:
    """Measure, and print the answer."""
    seconds, turns = float(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 4
    with tempfile.TemporaryDirectory(dir=Path.cwd()) as scratch:
        print(json.dumps(asyncio.run(measure(seconds, turns, Path(scratch)))))


if __name__ == "__main__":
    main()
