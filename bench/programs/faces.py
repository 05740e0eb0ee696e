"""What an executive's runs pay for faces, on the other side of which nobody reads.

python -m bench.programs.faces cost|stalled NAME[,NAME] <s> [turns]

The faces are served in every other turn; each turn is a run, watched by no face or by all. On the
other side, a program has connected, has asked for all there is, and never reads (a collector takes
the connection, and never answers). The disk of the recorder takes everything. Twenty simulated
vehicles send telemetry meanwhile.

`cost`: a run that never waits, of <s> rounds; `us`: CPU time of a record, until all faces have it,
`alone_us`: without faces; both with the share of whatever the process does meanwhile. `stalled`: a
run that waits for timers, 3,000 times a second one of its tokens comes to or leaves an element if
the engine is never late; `ratio`: records in a second with the faces, over those without.
"""

import asyncio
import json
import os
import sys
import tempfile
from collections.abc import AsyncIterator, Sequence
from contextlib import ExitStack, asynccontextmanager
from pathlib import Path
from statistics import median

from bench.graphs import loop
from bench.measured import Stopwatch
from bench.programs.face_readers import READERS, face
from bench.programs.stage import executive
from bench.programs.web import WARM_S, rings
from m2pem.executive.executive import Executive
from m2pem.fleet.fleet import Domain, Fleet, Vehicle
from m2pem.journal.sqlite import SqliteJournal
from m2pem.mission.catalogue import ResourceId

VEHICLES = 20
ORIGIN = (47.397742, 8.545594, 0.0)
APART_DEG = 0.001
ROUND_S = 0.4
"""30 tokens pass 20 elements in it: 3,000 token events in a second."""
SETTLE_S = 0.5


def fleet() -> Fleet:
    """Simulated vehicles, which stand."""
    latitude, longitude, _ = ORIGIN
    vehicles = [
        Vehicle(
            ResourceId(f"v{number}"),
            Domain.GROUND,
            "sim",
            {"home": [latitude, longitude + number * APART_DEG]},
        )
        for number in range(VEHICLES)
    ]
    return Fleet("bench", "bench.yaml", {each.id: each for each in vehicles}, origin=ORIGIN)


@asynccontextmanager
async def unread(running: Executive, names: Sequence[str], folder: Path) -> AsyncIterator[None]:
    """Serve faces, for readers that do not read."""
    readers = [READERS[name](folder) for name in names]
    serving = []
    for name, reader in zip(names, readers, strict=True):
        reader.vehicles = VEHICLES
        served = face(name, running.control, reader.settings).serve()
        serving.append(asyncio.create_task(served, name=name))
    try:
        for reader in readers:
            await asyncio.to_thread(reader.connect)
        await asyncio.sleep(SETTLE_S)
        yield
        for each in serving:
            if each.done():
                raise RuntimeError(f"the face {each.get_name()} has ended: {each.exception()}")
    finally:
        for each in serving:
            each.cancel()
        await asyncio.gather(*serving, return_exceptions=True)
        for reader in readers:
            reader.close()


async def turn(
    running: Executive, names: Sequence[str], seconds: float, folder: Path
) -> tuple[float, float]:
    """A run that waits for timers: its records in a second, and the CPU seconds of a second."""
    control = running.control
    watch = Stopwatch()
    async with unread(running, names, folder):
        run = await control.start(RINGS)
        await asyncio.sleep(WARM_S)
        state = running.runners[run].run.state
        seq = state.seq
        with watch:
            await asyncio.sleep(seconds)
        records = state.seq - seq
        await control.stop(run)
        await control.wait(run)
    return records / watch.wall_s, watch.cpu_s / watch.wall_s


async def endless(
    running: Executive, names: Sequence[str], rounds: int, folder: Path
) -> tuple[float, float]:
    """A run that never waits: CPU microseconds of a record, until all faces have taken it."""
    control = running.control
    watch = Stopwatch()
    async with unread(running, names, folder):
        with watch:
            run = await control.start(loop(rounds).xml, data={"n": 0})
            summary = await control.wait(run)
            while (await control.statistics()).events_waiting:  # noqa: ASYNC110  # nobody tells
                await asyncio.sleep(0.01)
            await asyncio.sleep(SETTLE_S)
    return 1e6 * watch.cpu_s / summary.records, watch.wall_s


async def measure(
    kind: str, names: Sequence[str], size: float, turns: int, folder: Path
) -> dict[str, float]:
    """Turns without and with the faces."""
    alone: list[tuple[float, float]] = []
    together: list[tuple[float, float]] = []
    for number in range(turns):
        for found, served in ((alone, ()), (together, names)):
            place = folder / f"{number}-{len(served)}"
            place.mkdir()
            journal = SqliteJournal.open(place / "journal.db")
            async with executive(journal, fleet()) as running:
                if kind == "cost":
                    found.append(await endless(running, served, int(size), place))
                else:
                    found.append(await turn(running, served, size / turns, place))
            await journal.close()
    before, after = median(each[0] for each in alone), median(each[0] for each in together)
    if kind == "cost":
        return {"alone_us": before, "us": after}
    return {
        "ratio": median(b[0] / a[0] for a, b in zip(alone, together, strict=True)),
        "records_per_s": after,
        "cpu_percent": 100 * median(each[1] for each in together),
        "alone_cpu_percent": 100 * median(each[1] for each in alone),
    }


RINGS = rings(ROUND_S)


def main() -> None:
    """Measure, and print the answer."""
    kind, chosen, size = sys.argv[1], sys.argv[2].split(","), float(sys.argv[3])
    turns = int(sys.argv[4]) if len(sys.argv) > 4 else 4
    with ExitStack() as stack:
        if "ros" in chosen:
            from bench.programs.ros_stage import own_domain  # noqa: PLC0415  # ROS is not always there

            os.environ["ROS_DOMAIN_ID"] = str(stack.enter_context(own_domain()))
        scratch = stack.enter_context(tempfile.TemporaryDirectory(dir=Path.cwd()))
        print(json.dumps(asyncio.run(measure(kind, chosen, size, turns, Path(scratch)))))


if __name__ == "__main__":
    main()
