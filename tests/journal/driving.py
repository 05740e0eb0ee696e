"""A process that drives runs of a journal until it is told to stop, or killed.

    python driving.py JOURNAL RUNS

JOURNAL is a path or a URL.

Makes RUNS runs and appends to all of them at once. Prints `RUN SEQ` for each entry, after `append`
has returned: what was printed is durable.
"""

import asyncio
import sys

from m2pem.engine.records import InputIgnored
from m2pem.journal import open_journal
from m2pem.testing.contracts.journal_harness import HEADER, entry


async def drive(journal, run):
    seq = 1
    while True:
        # One to three records, some of them larger than a page of the file.
        size = 1 if seq % 7 else 9000
        records = [InputIgnored(f"{seq + n}" + "x" * size) for n in range(1 + seq % 3)]
        await journal.append([entry(run, seq, *records)])
        print(run, seq, flush=True)
        seq += len(records)


async def main(path, runs):
    journal = open_journal(path)
    names = [await journal.create(HEADER) for _ in range(runs)]
    await asyncio.gather(*(drive(journal, run) for run in names))


if __name__ == "__main__":
    asyncio.run(main(sys.argv[1], int(sys.argv[2])))
