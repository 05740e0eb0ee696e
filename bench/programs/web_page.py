"""A run of `bench.programs.web` that is also looked at in Chromium: how fluently the page shows it.

python -m bench.programs.web_page <seconds>

302 elements flash all the time, at 10,000 token events in a second or more. Besides Chromium, two
browsers without a screen read and one never does. Chromium draws without a graphics card.
"""

import asyncio
import json
import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any

from playwright.async_api import Page, async_playwright

from bench.programs.stage import executive
from bench.programs.web import MISSION, WARM_S, counted, watched
from m2pem.journal.sqlite import SqliteJournal

ARGUMENTS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
WITHIN_MS = 60_000

# Pictures that the browser drew, and the longest time between two.
COUNT_FRAMES = """(seconds) => new Promise((resolve) => {
  const times = [];
  const draw = (now) => {
    times.push(now);
    if (now - times[0] < seconds * 1000) return requestAnimationFrame(draw);
    const gaps = times.slice(1).map((time, index) => time - times[index]);
    const took_s = (times.at(-1) - times[0]) / 1000;
    resolve({ fps: gaps.length / took_s, longest_ms: Math.max(...gaps) });
  };
  requestAnimationFrame(draw);
})"""


async def look(page: Page, address: str, seconds: float) -> dict[str, Any]:
    """Open the run's page by an address that signs in, and count while it is drawn."""
    told = 0

    def received(text: str | bytes) -> None:
        nonlocal told
        told += str(text).startswith('{"type":"frame"')

    page.on("websocket", lambda socket: socket.on("framereceived", received))
    await page.goto(address)
    await page.locator(".drawing .djs-shape").first.wait_for()
    await asyncio.sleep(WARM_S)
    before = told
    answer: dict[str, Any] = await page.evaluate(COUNT_FRAMES, seconds)
    return {**answer, "told_per_s": (told - before) / seconds}


async def told(page: Page, last: int) -> None:
    """Until the page has counted every event of the run."""
    await page.wait_for_function(
        "last => document.querySelector('.run-bar .events')"
        "?.textContent.replace(/[^0-9]/g, '') === String(last)",
        arg=last,
    )


async def measure(seconds: float, folder: Path) -> dict[str, Any]:
    """One run; what Chromium drew, and how many token events came in a second."""
    journal = SqliteJournal.open(folder / "journal.db")
    async with executive(journal) as running, async_playwright() as playwright:
        chromium = await playwright.chromium.launch(
            executable_path=shutil.which("chromium-headless-shell") or shutil.which("chromium"),
            args=ARGUMENTS,
        )
        page = await chromium.new_page(viewport={"width": 1440, "height": 900})
        page.set_default_timeout(WITHIN_MS)
        run = await running.control.start(MISSION)
        async with watched(running, run, folder) as (said, url):
            state = running.runners[run].run.state
            before, began = state.seq, asyncio.get_running_loop().time()
            answer = await look(page, url().replace("/?", f"/runs/{run}?"), seconds)
            records = state.seq - before
            took_s = asyncio.get_running_loop().time() - began
            await running.control.stop(run)
            await running.control.wait(run)
            answer |= {"frames_per_s": (await said())["frames_per_s"]}
            _, tokens, last = await counted(running, run)
            await told(page, last)
            answer |= {"per_s": records / took_s * tokens / last, "events": last}
        await chromium.close()
    await journal.close()
    return answer


def main() -> None:
    """Measure, and print the answer."""
    with tempfile.TemporaryDirectory(dir=Path.cwd()) as scratch:
        print(json.dumps(asyncio.run(measure(float(sys.argv[1]), Path(scratch)))))


if __name__ == "__main__":
    main()
