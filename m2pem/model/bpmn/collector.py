"""Reading and checking without Python's cyclic garbage collector: it would look again and again."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def paused() -> Iterator[None]:
    """Keep the collector off: what is read all stays, so that it finds nothing however it looks."""
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            if not gc.get_freeze_count():
                # To the oldest generation unsearched: else all is searched next time.
                gc.freeze()
                gc.unfreeze()
            gc.enable()
