"""Which random models a test tries: a few, the same each time; a long one others, and many."""

import os
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from random import Random

from hypothesis import settings


def examples(few: int, many: int) -> int:
    """How many examples of hypothesis to try: many where they are others each time."""
    return many if settings.get_current_profile_name() == "random" else few


def seeds_for(seconds: float) -> Iterator[int]:
    """One after another from a random one on, one at least; `named` says which one has failed.

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


@contextmanager
def named(seed: int) -> Iterator[None]:
    """Have the failure of what is done with a seed say the seed."""
    try:
        yield
    except BaseException as error:  # the timeout of a test is no Exception
        error.add_note(f"seed {seed}")
        raise
