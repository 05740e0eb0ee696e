"""When to judge whether somebody is silent: not just after this process itself was asleep."""

from collections.abc import AsyncIterator

from m2pem.api import Clock

LATE = 2.0
"""Who comes so many times later than it was to, was not running: on a busy computer, say."""


async def rounds(clock: Clock, every_s: float) -> AsyncIterator[None]:
    """Once in `every_s`, of the clock.

    After a round that came late, what arrived meanwhile is not read yet: the round is left out, but
    never two in a row, so that a computer that is always late does not go without.
    """
    left_out = False
    while True:
        began_us = clock.now_us()
        await clock.sleep(every_s)
        late = (clock.now_us() - began_us) / 1e6 > LATE * every_s
        left_out = late and not left_out
        if not left_out:
            yield
