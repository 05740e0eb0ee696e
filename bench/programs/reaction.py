"""From a signal to the arbiter: the time until `Arbiter.start` is called, while others wait.

python -m bench.programs.reaction memory|sqlite <waiting tokens> <signals>
"""

import asyncio
import json
import sys
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from statistics import quantiles

from bench.programs.stage import executive, flows, opened, waiting
from m2pem.api.arbiter import ArbiterContext, BehaviorRequest, Connection
from m2pem.engine.records import TokenEntered
from m2pem.model.catalogue import BehaviorState, ResourceId
from m2pem.resources.fleet import Domain, Fleet, Vehicle
from m2pem.testing.fakes import FakeArbiter

FLEET = Fleet(
    "bench", "bench.yaml", {ResourceId("ugv"): Vehicle(ResourceId("ugv"), Domain.GROUND, "own", {})}
)
GO = '<signal id="go" name="go"/>'
BEHAVIOR = """
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
    mission = waiting(tokens, GO, BEHAVIOR + flows(["fork", "c", "b", "c"]))
    made: list[Waited] = []

    def make(connections: Mapping[ResourceId, Connection], context: ArbiterContext) -> Waited:
        made.append(Waited(connections, context))
        return made[-1]

    journal = opened(kind, folder)
    took = []
    async with executive(journal, FLEET, make) as running:
        run = await running.control.start(mission)
        notices = running.control.subscribe(size=100_000)
        for _ in range(signals):
            began = time.perf_counter()
            await running.control.signal("go", run=run)
            called, behavior = await made[0].started.get()
            took.append(called - began)
            made[0].report(behavior, BehaviorState.SUCCEEDED)
            async for notice in notices:
                record = getattr(notice, "record", None)
                if isinstance(record, TokenEntered) and record.element == "c":
                    break
    await journal.close()
    cuts = quantiles(took, n=100)
    return {"p50_ms": cuts[49] * 1000, "p99_ms": cuts[98] * 1000}


if __name__ == "__main__":
    with tempfile.TemporaryDirectory(dir=Path.cwd()) as scratch:
        kind, tokens, signals = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
        print(json.dumps(asyncio.run(measure(kind, tokens, signals, Path(scratch)))))
