"""Says when who is in shared space, or waits for it, has changed.

Vehicles enter and leave it as they move, which no record has: it is looked at once a second.
"""

from collections.abc import Callable, Hashable, Sequence

from m2pem.api.allocation import SharedSpaceChanged, SharedSpaceState
from m2pem.api.clock import Clock

LOOK_EVERY_S = 1.0


async def watch_shared_space(
    clock: Clock,
    look: Callable[[], Sequence[SharedSpaceState]],
    publish: Callable[[SharedSpaceChanged], None],
) -> None:
    """Publish an event after each change, for ever. `look`: returns all shared spaces."""
    known = _who(look())
    while True:
        await clock.sleep(LOOK_EVERY_S)
        found = _who(look())
        if found != known:
            known = found
            publish(SharedSpaceChanged())


def _who(spaces: Sequence[SharedSpaceState]) -> Hashable:
    """Return what is compared: not the times, which change with each look."""
    return tuple(
        (each.name, each.holders, tuple((task.allocation, task.reason) for task in each.waiting))
        for each in spaces
    )
