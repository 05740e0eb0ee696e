"""An ended run of many records, opened in Chromium at its end, and then at other moments.

python -m bench.programs.web_replay <records> <seeks> [--before FOLDER] [--picture FILE]

The run's records are those of a rehearsed example with loops, over and over. The page is opened
twice: the first time the index of the run is missing, and made. It is open when diagram, time line
and log are drawn, and a moment is there when what it has is drawn. With `--before`, the page of
another folder with m2pem (an older commit, whose page is built) is opened on the same journal.
Chromium draws without a graphics card.
"""

import argparse
import asyncio
import json
import os
import random
import shutil
import statistics
import sys
import tempfile
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

from m2pem_plugin_web.ocu import WebOcu
from playwright.async_api import CDPSession, Page, async_playwright

import m2pem
from bench.programs.stage import executive
from bench.programs.web_chromium import ARGUMENTS
from m2pem.engine.inputs import Continue
from m2pem.engine.records import Record, RunEnded, RunOutcome, RunStarted
from m2pem.fleet.fleet import dump
from m2pem.fleet.fleet_file import load_fleet
from m2pem.journal import Entry, RunHeader
from m2pem.journal.sqlite import SqliteJournal

EXAMPLE = Path(__file__).parents[2] / "examples" / "t20_loops"
WITHIN_MS = 600_000
STARTED_US = 1_800_000_000_000_000
ENTRIES_AT_ONCE = 200
LATE_EVERY_S = 0.01

# Diagram, time line and log are drawn; the picture with them is on the screen.
IS_OPEN = """() => document.querySelector('.drawing .djs-shape')
  && document.querySelector('.timeline .bar') && document.querySelector('.log-line')
  && document.querySelector('.player')"""

SEEK = """(t) => new Promise((resolve) => {
  const began = performance.now();
  const slider = document.querySelector('.player-position');
  const set = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, 'value').set;
  set.call(slider, t);
  slider.dispatchEvent(new Event('input', { bubbles: true }));
  const look = () => {
    const player = document.querySelector('.player');
    const there = Math.abs(Number(slider.value) - t) < 1 && player.ariaBusy !== 'true'
      && document.querySelector('.log-line');
    if (!there) return requestAnimationFrame(look);
    requestAnimationFrame(() => resolve(performance.now() - began));
  };
  requestAnimationFrame(look);
})"""


def entries() -> list[tuple[float, tuple[Record, ...]]]:
    """The inputs of one round of the example: mission time in seconds, and the records."""
    example = m2pem.rehearse(
        EXAMPLE / "mission.bpmn", EXAMPLE / "fleet.yaml", answers=EXAMPLE / "answers.yaml"
    )
    found: dict[float, list[Record]] = {}
    for stamped in example.records:
        if not isinstance(stamped.record, RunStarted | RunEnded):
            found.setdefault(stamped.t_s, []).append(stamped.record)
    return [(t_s, tuple(each)) for t_s, each in sorted(found.items())]


async def make(path: Path, count: int) -> str:
    """Write a run of about so many records into a new journal, and return its id."""
    journal = SqliteJournal.open(path)
    mission = (EXAMPLE / "mission.bpmn").read_bytes()
    process = m2pem.rehearse(
        EXAMPLE / "mission.bpmn", EXAMPLE / "fleet.yaml", answers=EXAMPLE / "answers.yaml"
    ).summary.process
    fleet = dump(load_fleet(EXAMPLE / "fleet.yaml"))
    run = await journal.create(RunHeader("mission.bpmn", mission, process, fleet, simulated=True))
    rounds = entries()
    seq, begun_s = 1, 0.0
    waiting: list[Entry] = []

    async def write(t_s: float, records: tuple[Record, ...], *, flush: bool = False) -> None:
        nonlocal seq
        t_us = round(t_s * 1_000_000)
        waiting.append(Entry(run, 1, seq, STARTED_US + t_us, t_us, Continue(), records))
        seq += len(records)
        if flush or len(waiting) >= ENTRIES_AT_ONCE:
            await journal.append(waiting)
            waiting.clear()

    await write(0.0, (RunStarted(process, STARTED_US, "bench"),))
    while seq < count:
        for t_s, records in rounds:
            await write(begun_s + t_s, records)
        begun_s += rounds[-1][0] + 1
    await write(begun_s, (RunEnded(RunOutcome.COMPLETED, ""),), flush=True)
    await journal.release(run)
    await journal.close()
    return run


class Lateness:
    """How late the event loop was at most, in seconds, since the last `take`."""

    def __init__(self) -> None:
        self._latest_s = 0.0

    async def watch(self) -> None:
        """Look until cancelled."""
        while True:
            began = time.perf_counter()
            await asyncio.sleep(LATE_EVERY_S)
            self._latest_s = max(self._latest_s, time.perf_counter() - began - LATE_EVERY_S)

    def take(self) -> float:
        """Return it, and begin again."""
        latest_s, self._latest_s = self._latest_s, 0.0
        return latest_s


@asynccontextmanager
async def served(path: Path) -> AsyncIterator[WebOcu]:
    """The page of an executive on the journal."""
    journal = SqliteJournal.open(path)
    async with executive(journal, load_fleet(EXAMPLE / "fleet.yaml")) as running:
        environment = {"M2PEM_WEB_PORT": "0", "XDG_STATE_HOME": str(path.parent)}
        ocu = WebOcu(running.control, environment=environment)
        serving = asyncio.create_task(ocu.serve())
        try:
            yield ocu
        finally:
            serving.cancel()
            await asyncio.gather(serving, return_exceptions=True)
    await journal.close()


class Sent:
    """Bytes that a page received, as they came over the network."""

    def __init__(self, tools: CDPSession) -> None:
        self.bytes = 0
        tools.on("Network.loadingFinished", self._finished)

    def _finished(self, event: dict[str, Any]) -> None:
        self.bytes += int(event["encodedDataLength"])


async def heap_mb(tools: CDPSession) -> float:
    """What the page holds in its heap, after a collection."""
    await tools.send("HeapProfiler.collectGarbage")
    answer = await tools.send("Performance.getMetrics")
    metrics = {each["name"]: each["value"] for each in answer["metrics"]}
    return float(metrics["JSHeapUsedSize"]) / 1e6


async def open_run(page: Page, base: str, run: str) -> float:
    """Open the run's page as at its end; seconds until it is drawn."""
    began = time.perf_counter()
    await page.goto(f"{base}/runs/{run}?t=1e9")
    await page.wait_for_function(IS_OPEN)
    await page.evaluate("() => new Promise((done) => requestAnimationFrame(done))")
    return time.perf_counter() - began


async def look(path: Path, run: str, seeks: int, picture: str | None) -> dict[str, float]:
    """Open the run twice and seek in it."""
    late = Lateness()
    async with served(path) as ocu, async_playwright() as made:
        watching = asyncio.create_task(late.watch())
        chromium = await made.chromium.launch(
            executable_path=shutil.which("chromium-headless-shell") or shutil.which("chromium"),
            args=[*ARGUMENTS, "--js-flags=--max-old-space-size=8000"],
        )
        context = await chromium.new_context(viewport={"width": 1440, "height": 900})
        page = await context.new_page()
        page.set_default_timeout(WITHIN_MS)
        await page.goto(ocu.url)
        await page.locator("header").first.wait_for()
        base = ocu.url.partition("/?")[0]
        late.take()
        first_s = await open_run(page, base, run)
        making_late_s = late.take()
        await page.goto("about:blank")
        tools = await context.new_cdp_session(page)
        await tools.send("Network.enable")
        await tools.send("Performance.enable")
        sent = Sent(tools)
        opens = []
        for _ in range(3):
            sent.bytes = 0
            opens.append(await open_run(page, base, run))
            opened_mb = sent.bytes / 1e6
            if first_s > 60:
                break
            await page.goto("about:blank")
        if first_s <= 60:
            await open_run(page, base, run)
        end_s = float(await page.locator(".player-position").evaluate("e => e.max"))
        chance = random.Random(1)
        places = [chance.uniform(0, end_s) for _ in range(seeks)]
        sent.bytes = 0
        late.take()
        took_ms = [float(await page.evaluate(SEEK, each)) for each in places]
        answer = {
            "first_s": first_s,
            "open_s": statistics.median(opens),
            "open_mb": opened_mb,
            "seek_p50_ms": statistics.median(took_ms),
            "seek_max_ms": max(took_ms),
            "seek_mb": sent.bytes / 1e6 / seeks,
            "heap_mb": await heap_mb(tools),
            "making_late_ms": making_late_s * 1000,
            "late_ms": late.take() * 1000,
        }
        if picture is not None:
            await page.screenshot(path=picture)
        await chromium.close()
        watching.cancel()
    return answer


async def before(folder: Path, path: Path, run: str, seeks: int) -> dict[str, float]:
    """The same with the m2pem of another folder, in a process of its own."""
    own = Path(__file__).parents[2]
    paths = os.environ.get("PYTHONPATH", "").replace(str(own), str(folder))
    paths = os.pathsep.join(filter(None, (paths, str(folder))))
    process = await asyncio.create_subprocess_exec(
        sys.executable,
        __file__,
        *("--journal", str(path), "--run", run, "0", str(seeks)),
        env={**os.environ, "PYTHONPATH": paths},
        cwd=folder,
        stdout=asyncio.subprocess.PIPE,
    )
    out, _ = await process.communicate()
    if process.returncode:
        raise RuntimeError(f"the page of {folder} ended with {process.returncode}")
    found: dict[str, float] = json.loads(out)
    return {f"before_{name}": value for name, value in found.items()}


async def measure(arguments: argparse.Namespace, folder: Path) -> dict[str, float]:
    """All that was asked for."""
    if arguments.journal is not None:
        return await look(arguments.journal, arguments.run, arguments.seeks, arguments.picture)
    path = folder / "journal.db"
    run = await make(path, arguments.records)
    answer = await look(path, run, arguments.seeks, arguments.picture)
    if arguments.before is not None:
        answer |= await before(arguments.before.resolve(), path, run, arguments.seeks)
    return answer


def main() -> None:
    """Measure, and print the answer."""
    parser = argparse.ArgumentParser()
    parser.add_argument("records", type=int)
    parser.add_argument("seeks", type=int)
    parser.add_argument("--before", type=Path)
    parser.add_argument("--picture")
    parser.add_argument("--journal", type=Path)
    parser.add_argument("--run")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        print(json.dumps(asyncio.run(measure(arguments, Path(scratch)))))


if __name__ == "__main__":
    main()
