"""A run of `bench.programs.web` that is also looked at in Chromium: how fluently the page shows it.

python -m bench.programs.web_page <seconds>

302 elements flash all the time, at 10,000 token events in a second or more. Besides Chromium, two
browsers without a screen read and one never does. Chromium draws without a graphics card.
"""

import asyncio
import json
import sys
import tempfile
from pathlib import Path
from typing import Any

from bench.programs.stage import executive
from bench.programs.web import MISSION, WARM_S, counted, watched
from bench.programs.web_chromium import Pictures, blank_page, counted_all
from m2pem.journal.sqlite import SqliteJournal


async def measure(seconds: float, folder: Path) -> dict[str, Any]:
    """One run; what Chromium drew, and how many token events came in a second."""
    journal = SqliteJournal.open(folder / "journal.db")
    async with executive(journal) as running, blank_page() as page:
        run = await running.control.start(MISSION)
        async with watched(running, run, folder) as (said, url):
            address = url().replace("/?", f"/runs/{run}?")
            pictures = Pictures(page)
            await pictures.open(address, WARM_S)
            state = running.runners[run].run.state
            before, began = state.seq, asyncio.get_running_loop().time()
            answer = await pictures.count(seconds)
            records = state.seq - before
            took_s = asyncio.get_running_loop().time() - began
            await running.control.stop(run)
            await running.control.wait(run)
            answer |= {"frames_per_s": (await said())["frames_per_s"]}
            _, tokens, last = await counted(running, run)
            await counted_all(page, last)
            answer |= {"per_s": records / took_s * tokens / last, "events": last}
    await journal.close()
    return answer


def main() -> None:
    """Measure, and print the answer."""
    with tempfile.TemporaryDirectory() as scratch:
        print(json.dumps(asyncio.run(measure(float(sys.argv[1]), Path(scratch)))))


if __name__ == "__main__":
    main()
