"""From a signal to the arbiter: the time until `Arbiter.start` is called, while others wait.

python -m bench.programs.reaction memory|sqlite <waiting tokens> <signals>

As many signals are sent from outside, and thrown by an event of the mission (`thrown_`). The time
of those begins with the answer that lets a token go to the event.
"""

import asyncio
import json
import sys
import tempfile
import time
from collections.abc import Awaitable, Callable, Mapping
from pathlib import Path
from statistics import quantiles

from bench.programs.stage import asking, executive, flows, opened, waiting
from m2pem.api.arbiter import ArbiterContext, BehaviorRequest, Connection
from m2pem.engine.records import TokenEntered
from m2pem.executive.executive import Executive
from m2pem.fleet.fleet import Domain, Fleet, Vehicle
from m2pem.mission.catalogue import BehaviorState, ResourceId
from m2pem.testing.fake_arbiter import FakeArbiter

FLEET = Fleet(
    "bench", "bench.yaml", {ResourceId("ugv"): Vehicle(ResourceId("ugv"), Domain.GROUND, "own", {})}
)
GO = '<signal id="go" name="go"/>'
BEHAVIOR = """
<intermediateThrowEvent id="t"><signalEventDefinition signalRef="go"/></intermediateThrowEvent>
<intermediateCatchEvent id="c"><signalEventDefinition signalRef="go"/></intermediateCatchEvent>
<scriptTask id="b"><extensionElements><m2pem:behavior type="vehicle" name="drive_stop">
<m2pem:resources><m2pem:role name="driver" vehicle="ugv"/></m2pem:resources>
</m2pem:behavior></extensionElements></scriptTask>
"""


class Waited(FakeArbiter):
    """An arbiter that notes when it is called, and does everything at once."""

    def __init__(
        self, connections: Mapping[ResourceId, Connection], context: ArbiterContext
    ) -> None:
        super().__init__(connections, context)
        self.started: asyncio.Queue[tuple[float, str]] = asyncio.Queue()

    async def start(self, request: BehaviorRequest) -> None:
        """See `Arbiter.start`."""
        self.started.put_nowait((time.perf_counter(), request.id))


async def measure(kind: str, tokens: int, signals: int, folder: Path) -> dict[str, float]:
    """Signal, wait for the call, let the behavior succeed; and again."""
    behavior = BEHAVIOR + asking("a") + flows(["fork", "c", "b", "c"], ["fork", "a", "t", "a"])
    mission = waiting(tokens, GO, behavior)
    made: list[Waited] = []

    def make(connections: Mapping[ResourceId, Connection], context: ArbiterContext) -> Waited:
        made.append(Waited(connections, context))
        return made[-1]

    journal = opened(kind, folder)
    figures: dict[str, float] = {}
    async with executive(journal, FLEET, make) as running:
        run = await running.control.start(mission)
        sent = await reactions(
            running, made[0], signals, lambda: running.control.signal("go", run=run)
        )
        thrown = await reactions(
            running,
            made[0],
            signals,
            lambda: running.control.answer(run, prompt_of(running, run), "done"),
        )
        for name, took in (("", sent), ("thrown_", thrown)):
            cuts = quantiles(took, n=100)
            figures |= {f"{name}p50_ms": cuts[49] * 1000, f"{name}p99_ms": cuts[98] * 1000}
    await journal.close()
    return figures


async def reactions(
    running: Executive, arbiter: Waited, signals: int, go: Callable[[], Awaitable[None]]
) -> list[float]:
    """Seconds until `Arbiter.start` is called."""
    notices = running.control.subscribe(size=100_000)
    took = []
    for _ in range(signals):
        going = go()
        began = time.perf_counter()
        await going
        called, behavior = await arbiter.started.get()
        took.append(called - began)
        arbiter.report(behavior, BehaviorState.SUCCEEDED)
        async for notice in notices:
            record = getattr(notice, "record", None)
            if isinstance(record, TokenEntered) and record.element == "c":
                break
    return took


def prompt_of(running: Executive, run: str) -> str:
    """The prompt that stands before the event that throws."""
    prompts = running.runners[run].prompts.values()
    return next(prompt.prompt for prompt in prompts if prompt.element == "a")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory(dir=Path.cwd()) as scratch:
        kind, tokens, signals = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
        print(json.dumps(asyncio.run(measure(kind, tokens, signals, Path(scratch)))))
