"""Which random models a long test tries: others each time, for as long as it may take."""

import time
from collections.abc import Iterator
from random import Random


def seeds_for(seconds: float) -> Iterator[int]:
    """One after another from a random one on, one at least; the test names the one that fails."""
    seed = Random().randrange(1_000, 1_000_000_000)
    until = time.monotonic() + seconds
    while True:
        yield seed
        seed += 1
        if time.monotonic() > until:
            return
