"""A tab of Chromium, in a process of its own, that shows a run: how fluently it draws.

python -m bench.programs.web_tab <address with its token> <run> <seconds>

It prints a line when the run is shown, and reads a line before it counts; then it reads how many
records the run had in the end, and waits until the page shows so many.
"""

import asyncio
import json
import sys
from typing import Any

from bench.programs.web_chromium import Pictures, blank_page, counted_all

WARM_S = 1.0


async def look(url: str, run: str, seconds: float) -> dict[str, Any]:
    """Count pictures for some seconds, and wait for the end of the run."""
    async with blank_page() as page:
        pictures = Pictures(page)
        await pictures.open(url.replace("/?", f"/runs/{run}?"), WARM_S)
        print("shown", flush=True)
        await asyncio.to_thread(sys.stdin.readline)
        answer = await pictures.count(seconds)
        await counted_all(page, int(await asyncio.to_thread(sys.stdin.readline)))
        return answer


if __name__ == "__main__":
    print(json.dumps(asyncio.run(look(sys.argv[1], sys.argv[2], float(sys.argv[3])))))
