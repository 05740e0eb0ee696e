"""Operators are told when who is in shared space, or waits for it, has changed."""

from dataclasses import replace

from m2pem.api.allocation import SharedSpaceState, SpaceHolder, WaitingTask
from m2pem.api.clock import run_virtual
from m2pem.executive.shared_space_watch import watch_shared_space
from m2pem.mission.catalogue import ResourceId

from .conftest import START_US

ONE = SpaceHolder(ResourceId("one"), "r1.b1")
WAITS = WaitingTask("r1", "r1.a2", "West", "West", "goto", 1.0, None, 0, "bridge", {})
BRIDGE = SharedSpaceState("bridge", 1)
TAKEN = replace(BRIDGE, holders=(ONE,))
WANTED = replace(TAKEN, waiting=(WAITS,))


def test_each_change_is_told_once_within_a_second():
    looks = [
        BRIDGE,
        BRIDGE,
        TAKEN,
        WANTED,
        replace(WANTED, waiting=(replace(WAITS, waited_s=9.0),)),
        BRIDGE,
    ]
    told = []

    async def main(clock):
        seen = iter(looks)

        class OverError(Exception):
            pass

        def look():
            found = next(seen, None)
            if found is None:
                raise OverError
            return [found]

        def publish(event):
            told.append((clock.now_us() - START_US) / 1_000_000)

        try:
            await watch_shared_space(clock, look, publish)
        except OverError:
            return

    run_virtual(main, START_US)
    assert told == [2.0, 3.0, 5.0]
