"""Which random models a long test tries: others each time, for as long as it may take."""

import os
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from random import Random


def seeds_for(seconds: float) -> Iterator[int]:
    """One after another from a random one on, one at least; the test names the one that fails.

    A file in the folder for temporary files, `m2pem-seed-` and the process's number, has the last
    one: where the process is killed for want of memory, no test can name it.
    """
    seed = Random().randrange(1_000, 1_000_000_000)
    last = Path(tempfile.gettempdir(), f"m2pem-seed-{os.getpid()}")
    until = time.monotonic() + seconds
    while True:
        last.write_text(f"{seed}\n", encoding="ascii")
        yield seed
        seed += 1
        if time.monotonic() > until:
            last.unlink()
            return
