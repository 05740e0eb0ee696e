"""Plans, fences and rally points of ground stations, and a kill (SIGKILL) of the executive.

The next executive, or a standby, has them as they were uploaded; a run of a plan goes on.
"""

import asyncio
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
from mavlink_gcs import FLEET, GroundStation, ground_station, write_fleet
from mavlink_mavsdk_world import free_port
from mavlink_plan_upload import TAKEOFF, WAYPOINT, Item, download, upload
from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import offset
from tests.command_line import CommandLine, Program, command_line
from tests.postgres_server import PostgresServer, postgres, postgres_url

__all__ = ["PostgresServer", "postgres", "postgres_url"]

ROVER1, UAV1 = 1, 2
START = dialect.MAV_CMD_MISSION_START
ACCEPTED = dialect.MAV_RESULT_ACCEPTED
HOME = (38.1075, -77.3192)
SPEED_ITEM = Item(178, params=(1.0, 3.0, -1.0, 0.0), frame=dialect.MAV_FRAME_MISSION)
KINDS = (0, 1, 2)
"""MAV_MISSION_TYPE: mission, fence, rally points."""


def at(east_m: float, north_m: float, up_m: float = 15.0) -> tuple[float, float, float]:
    return (*offset(HOME, east_m, north_m), up_m)


def waypoints(*places: tuple[float, float]) -> list[Item]:
    return [Item(WAYPOINT, at(*each)) for each in places]


ROVERS = [*waypoints((30, 0), (60, 0)), SPEED_ITEM, *waypoints((60, 60), (-60, 60), (-60, -60))]
"""Its last legs take longer than an executive needs to begin."""
OTHER = waypoints((10, 10), (20, 10))
COPTERS = [Item(TAKEOFF, at(0, 60)), *waypoints((20, 80), (0, 80))]
FENCE = [
    Item(5001, (*at(*each)[:2], 0.0), params=(4.0, 0.0, 0.0, 0.0), frame=dialect.MAV_FRAME_GLOBAL)
    for each in ((-100, -100), (200, -100), (200, 300), (-100, 300))
]
RALLY = [Item(5100, at(*each), params=(0.0, 0.0, 0.0, 0.0)) for each in ((5, 5), (40, 40))]


def of(system: int, **fields: Any) -> Any:
    return lambda each: (
        each.get_srcSystem() == system
        and all(getattr(each, name) == value for name, value in fields.items())
    )


def as_sent(items: Sequence[Item]) -> list[tuple[Any, ...]]:
    return [(each.command, each.frame, each.x, each.y, each.z) for each in items]


async def as_kept(station: GroundStation, system: int, kind: int) -> list[tuple[Any, ...]]:
    items = await download(station, system, kind)
    return [(each.command, each.frame, each.x, each.y, each.z) for each in items]


def serve(m2pem: CommandLine, journal: str, *words: str) -> Program:
    program = m2pem.start(
        "serve", "--fleet", "fleet.yaml", "--ocu", "none", "--speed", "2", "--journal", journal,
        *words, M2PEM_LEASE_S="2",
    )  # fmt: skip
    program.until_said("standing by for" if words else "serving")
    return program


@pytest.fixture
def m2pem(tmp_path: Path) -> Iterator[CommandLine]:
    yield from command_line(tmp_path)


@pytest.mark.parametrize(
    ("stands_by", "database"),
    [
        (False, "sqlite"),
        (True, "sqlite"),
        pytest.param(True, "postgresql", marks=pytest.mark.long),
    ],
)
def test_uploads_outlive_a_killed_executive_and_a_run_of_a_plan_goes_on(
    m2pem: CommandLine, stands_by: bool, database: str, request: pytest.FixtureRequest
) -> None:
    sqlite = database == "sqlite"
    journal = "journal.db" if sqlite else str(request.getfixturevalue("postgres_url"))
    port = free_port()
    face = f'faces: {{mavlink: {{url: "udpin://127.0.0.1:{port}", commands: all}}}}\n'
    write_fleet(m2pem.folder, FLEET + face)

    async def main() -> None:
        owner = serve(m2pem, journal)
        standby = serve(m2pem, journal, "--standby") if stands_by else None
        async with ground_station(port) as station:
            await station.hears("HEARTBEAT", of(ROVER1))
            for kind, items in enumerate((ROVERS, FENCE, RALLY)):
                assert await upload(station, ROVER1, items, kind) == 0, station.texts()
            assert await upload(station, UAV1, COPTERS) == 0
            assert await station.command(ROVER1, START) == ACCEPTED
            await station.hears("MISSION_ITEM_REACHED", of(ROVER1, seq=1))
            # The run goes on with the plan that it began with; this one is for the next.
            assert await upload(station, ROVER1, OTHER) == 0
            since = len(station.received)
            station.mav.mission_count_send(UAV1, 1, 9, 0)  # never ends
            await station.hears("MISSION_REQUEST_INT", of(UAV1), since)
            await station.hears("MISSION_ITEM_REACHED", of(ROVER1, seq=3))
            owner.kill()
            since = len(station.received)
            if standby is not None:
                await asyncio.to_thread(standby.until_said, "serving")
            else:
                await asyncio.to_thread(serve, m2pem, journal)
            await station.hears("HEARTBEAT", of(ROVER1), since)
            current = of(ROVER1, mission_state=3, total=6)
            await station.hears(
                "MISSION_CURRENT", lambda each: current(each) and each.seq >= 3, since
            )
            for kind, items in enumerate((OTHER, FENCE, RALLY)):
                assert await as_kept(station, ROVER1, kind) == as_sent(items), kind
            assert await as_kept(station, UAV1, 0) == as_sent(COPTERS)
            await station.hears("MISSION_ITEM_REACHED", of(ROVER1, seq=5), since)
            reached = [
                each.seq
                for each in station.received[since:]
                if each.get_type() == "MISSION_ITEM_REACHED" and each.get_srcSystem() == ROVER1
            ]
            # Nothing of before the kill, but for the waypoint at which it was then.
            assert reached in ([3, 4, 5], [4, 5], [5])
            await station.hears("MISSION_CURRENT", of(ROVER1, total=2, mission_state=2), since)
            # What was uploaded before is carried out now, and its fence holds.
            for system, items in ((ROVER1, OTHER), (UAV1, COPTERS)):
                since = len(station.received)
                assert await station.command(system, START) == ACCEPTED
                last = len(items) - 1
                await station.hears("MISSION_ITEM_REACHED", of(system, seq=last), since)
                await station.hears("MISSION_CURRENT", of(system, mission_state=5), since)
            assert await station.go_to(ROVER1, at(-150, 0)[:2]) == dialect.MAV_RESULT_FAILED
            await station.told("the own fence of rover1")

    asyncio.run(main())


def test_a_plan_that_an_operator_deletes_is_no_plan_any_more(m2pem: CommandLine) -> None:
    port = free_port()
    face = f'faces: {{mavlink: {{url: "udpin://127.0.0.1:{port}", commands: all}}}}\n'
    write_fleet(m2pem.folder, FLEET + face)

    async def main() -> None:
        serve(m2pem, "journal.db")
        async with ground_station(port) as station:
            await station.hears("HEARTBEAT", of(ROVER1))
            assert await upload(station, ROVER1, OTHER) == 0
            words = ("geometries", "delete", "rover1.plan", "--fleet", "fleet.yaml")
            status, _, errors = m2pem.run(*words, "--journal", "journal.db")
            assert status == 0, errors
            assert await station.command(ROVER1, START) == dialect.MAV_RESULT_DENIED
            await station.told("MISSION_START: it has no plan")
            assert await as_kept(station, ROVER1, 0) == []

    asyncio.run(main())
