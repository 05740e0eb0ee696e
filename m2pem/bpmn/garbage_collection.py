"""Pauses Python's cyclic garbage collector while missions are read and checked."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager

MANY = 100_000
"""Objects from which on a search through what was read takes long."""

AT_MOST_UNSEARCHED = 1_000_000
"""Objects that may wait for their first search: those of a mission of some 100,000 elements."""

_unsearched = 0


@contextmanager
def paused() -> Iterator[None]:
    """Pause the collector: all that is read stays in use, so there is no garbage to find.

    Of a large mission it does not look afterwards either. Missions that are read and dropped are
    garbage in time: it looks when many have been read so.
    """
    global _unsearched  # noqa: PLW0603  # of the process, as the collector is
    was_on = gc.isenabled()
    if was_on and _unsearched > AT_MOST_UNSEARCHED:
        gc.collect()
        _unsearched = 0
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            new = gc.get_count()[0]
            if new > MANY and not gc.get_freeze_count():
                # To the oldest generation unsearched: else all is searched next time. Nothing that
                # comes there so makes Python search it.
                gc.freeze()
                gc.unfreeze()
                _unsearched += new
            gc.enable()
