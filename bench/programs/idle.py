"""What an executive costs while a mission of many tokens waits: the share of a core, in percent.

python -m bench.programs.idle <tokens> <seconds>
"""

import asyncio
import json
import sys
import time

from bench.programs.stage import executive, waiting
from m2pem.journal import MemoryJournal


async def measure(tokens: int, seconds: float) -> dict[str, float]:
    """Begin, wait, and see what was spent meanwhile."""
    async with executive(MemoryJournal()) as running:
        run = await running.control.start(waiting(tokens))
        assert len(running.runners[run].prompts) == tokens
        await asyncio.sleep(0.1)
        began_s, cpu_s = time.perf_counter(), time.process_time()
        await asyncio.sleep(seconds)
        spent = time.process_time() - cpu_s
        return {"percent": 100 * spent / (time.perf_counter() - began_s)}


if __name__ == "__main__":
    print(json.dumps(asyncio.run(measure(int(sys.argv[1]), float(sys.argv[2])))))
