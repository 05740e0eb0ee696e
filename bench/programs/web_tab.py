"""A tab of Chromium, in a process of its own, that shows a run: how fluently it draws.

python -m bench.programs.web_tab <address with its token> <run> <seconds>

It reads from its input how many records the run had in the end, and waits until it shows so many.
"""

import asyncio
import json
import sys
from typing import Any

from bench.programs.web_chromium import blank_page, count_pictures, counted_all

WARM_S = 1.0


async def look(url: str, run: str, seconds: float) -> dict[str, Any]:
    """Count pictures for some seconds, and wait for the end of the run."""
    async with blank_page() as page:
        answer = await count_pictures(page, url.replace("/?", f"/runs/{run}?"), WARM_S, seconds)
        await counted_all(page, int(await asyncio.to_thread(sys.stdin.readline)))
        return answer


if __name__ == "__main__":
    print(json.dumps(asyncio.run(look(sys.argv[1], sys.argv[2], float(sys.argv[3])))))
