"""Driving vehicles on the map of a run's page, looked at in Chromium: how fluently it shows them.

python -m bench.programs.web_map <vehicles> <seconds> [picture.png]

Each vehicle drives round a circle of its own and says five times a second where it is, as vehicles
of the simulator do; the page shows trails and names. Chromium draws without a graphics card.
`cpu_percent`: of a core, in the page's process.
"""

import asyncio
import json
import math
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from m2pem_plugin_web.ocu import WebOcu

from bench.graphs import file
from bench.programs.stage import asking, executive, flows
from bench.programs.web_chromium import Pictures, blank_page
from m2pem.api.arbiter import ArbiterContext, Connection
from m2pem.api.telemetry import GeoPosition, VehicleState
from m2pem.fleet.fleet import Domain, Fleet, Vehicle
from m2pem.journal.sqlite import SqliteJournal
from m2pem.mission.catalogue import ResourceId
from m2pem.testing.fake_arbiter import FakeArbiter

ORIGIN = (47.397742, 8.545594, 0.0)
METRE_DEG = 1 / 111_195
APART_M = 60
RADIUS_M = 25
SPEED_M_S = 5
STATES_PER_S = 5
SHARES = 5
"""Not all vehicles send at the same moment."""
GROW_S = 5
"""Trails grow meanwhile."""
DOMAINS = (Domain.GROUND, Domain.AIR, Domain.SURFACE, Domain.SUBSURFACE)

MISSION = file(
    f'<process id="BENCH" isExecutable="true"><startEvent id="start"/>{asking("u")}'
    f'<endEvent id="end"/>{flows(["start", "u", "end"])}</process>'
)


def fleet(count: int) -> Fleet:
    """Vehicles of all domains in turn."""
    vehicles = [
        Vehicle(ResourceId(f"v{each}"), DOMAINS[each % len(DOMAINS)], "bench", {})
        for each in range(count)
    ]
    return Fleet("bench", "bench.yaml", {each.id: each for each in vehicles}, origin=ORIGIN)


def state(number: int, count: int, now_us: int) -> VehicleState:
    """Of one vehicle, on its circle; the circles are in rows, as many as there are columns."""
    columns = math.ceil(math.sqrt(count))
    row, column = divmod(number, columns)
    angle = number + SPEED_M_S / RADIUS_M * now_us / 1e6
    north_m = row * APART_M + RADIUS_M * math.sin(angle)
    east_m = column * APART_M + RADIUS_M * math.cos(angle)
    latitude, longitude, altitude = ORIGIN
    wide = math.cos(math.radians(latitude))
    yaw = angle + math.pi / 2
    return VehicleState(
        resource=ResourceId(f"v{number}"),
        time_us=now_us,
        position=GeoPosition(
            latitude + north_m * METRE_DEG, longitude + east_m * METRE_DEG / wide, altitude
        ),
        velocity_enu_m_s=(SPEED_M_S * math.cos(yaw), SPEED_M_S * math.sin(yaw), 0.0),
        yaw_rad=math.remainder(yaw, math.tau),
        battery_fraction=0.8,
        mode="auto",
        armed=True,
        ready=True,
    )


class Driving(FakeArbiter):
    """Vehicles that drive, whatever they are told."""

    def __init__(
        self, connections: Mapping[ResourceId, Connection], context: ArbiterContext
    ) -> None:
        super().__init__(connections, context)
        self._count = len(connections)
        self._driving: asyncio.Task[None] | None = None

    async def connect(self) -> None:
        """See `Arbiter.connect`."""
        await super().connect()
        self._driving = asyncio.create_task(self._drive())

    async def close(self) -> None:
        """See `Arbiter.close`."""
        if self._driving is not None:
            self._driving.cancel()
        await super().close()

    async def _drive(self) -> None:
        share = 0
        while True:
            now_us = self.context.clock.now_us()
            for number in range(share, self._count, SHARES):
                self.say(state(number, self._count, now_us))
            share = (share + 1) % SHARES
            await asyncio.sleep(1 / STATES_PER_S / SHARES)


async def measure(
    count: int, seconds: float, folder: Path, picture: str | None = None
) -> dict[str, Any]:
    """What Chromium drew of one run."""
    journal = SqliteJournal.open(folder / "journal.db")
    async with executive(journal, fleet(count), Driving) as running, blank_page() as page:
        run = await running.control.start(MISSION)
        environment = {"M2PEM_WEB_PORT": "0", "XDG_STATE_HOME": str(folder)}
        ocu = WebOcu(running.control, environment=environment)
        address = ocu.url.replace("/?", f"/runs/{run}?")
        serving = asyncio.create_task(ocu.serve())
        try:
            pictures = Pictures(page)
            await pictures.open(address, GROW_S)
            answer = await pictures.count(seconds)
            if picture is not None:
                await page.screenshot(path=picture)
        finally:
            serving.cancel()
            await asyncio.gather(serving, return_exceptions=True)
        await running.control.stop(run)
        await running.control.wait(run)
    await journal.close()
    return answer


def main() -> None:
    """Measure, and print the answer."""
    count, seconds = int(sys.argv[1]), float(sys.argv[2])
    picture = sys.argv[3] if len(sys.argv) > 3 else None
    with tempfile.TemporaryDirectory() as scratch:
        print(json.dumps(asyncio.run(measure(count, seconds, Path(scratch), picture))))


if __name__ == "__main__":
    main()
