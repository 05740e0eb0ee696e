"""Plans that ground stations upload to vehicles of any kind; pymavlink is the other end."""

import asyncio
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from mavlink_gcs import FLEET, gateway, ground_station
from mavlink_plan_upload import LAND, RETURN, TAKEOFF, WAYPOINT, Item, download, upload
from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import RunStatus, distance_m
from m2pem.api.records import BehaviorRequested
from m2pem.testing import scenarios

ROVER1, UAV1 = 1, 2
A, B, C = (38.1076, -77.3191, 15.0), (38.1078, -77.3191, 20.0), (38.1078, -77.3193, 20.0)
START = dialect.MAV_CMD_MISSION_START
PAUSE = dialect.MAV_CMD_DO_PAUSE_CONTINUE


def of(system: int, **fields: Any) -> Callable[[Any], bool]:
    return lambda each: (
        each.get_srcSystem() == system
        and all(getattr(each, name) == value for name, value in fields.items())
    )


def test_a_plan_of_waypoints_is_one_run_of_a_rover_and_comes_back_as_it_was(tmp_path: Path) -> None:
    async def main() -> None:
        async with (
            gateway(tmp_path, speed=5.0, commands="all") as (control, port),
            ground_station(port) as station,
        ):
            await station.hears("HEARTBEAT", of(ROVER1))
            items = [Item(WAYPOINT, each) for each in (A, B, C)]
            assert await upload(station, ROVER1, items) == dialect.MAV_MISSION_ACCEPTED
            back = await download(station, ROVER1)
            assert [(each.x, each.y, each.z, each.frame, each.command) for each in back] == [
                (each.x, each.y, each.z, each.frame, each.command) for each in items
            ]
            await station.hears("MISSION_CURRENT", of(ROVER1, mission_state=2, total=3))
            assert not await control.runs()
            assert await station.command(ROVER1, START) == dialect.MAV_RESULT_ACCEPTED
            for number in range(3):
                await station.hears("MISSION_ITEM_REACHED", of(ROVER1, seq=number))
            await station.hears("MISSION_CURRENT", of(ROVER1, mission_state=5, seq=2))
            (run,) = await control.runs()
            assert run.mission == "plan of rover1" and run.status is RunStatus.COMPLETED
            records = [each.record for each in await control.records(run.run)]
            assert any("mavlink 254/190 at 127.0.0.1:" in str(record) for record in records)
            await station.hears(
                "GLOBAL_POSITION_INT",
                lambda each: (
                    each.get_srcSystem() == ROVER1
                    and distance_m((each.lat / 1e7, each.lon / 1e7), C[:2]) < 2.0
                ),
            )

    asyncio.run(main())


def test_a_plan_with_takeoff_waits_and_return_is_flown_paused_and_continued(tmp_path: Path) -> None:
    async def main() -> None:
        async with (
            gateway(tmp_path, speed=5.0, commands="all") as (control, port),
            ground_station(port) as station,
        ):
            await station.hears("HEARTBEAT", of(UAV1))
            speed = Item(178, params=(1.0, 4.0, -1.0, 0.0), frame=dialect.MAV_FRAME_MISSION)
            waits = Item(WAYPOINT, B, params=(2.0, 0.0, 0.0, math.nan))
            items = [Item(TAKEOFF, A), speed, Item(WAYPOINT, A), waits, Item(WAYPOINT, C)]
            items.append(Item(RETURN, frame=dialect.MAV_FRAME_MISSION))
            assert await upload(station, UAV1, items) == dialect.MAV_MISSION_ACCEPTED
            arm = dialect.MAV_CMD_COMPONENT_ARM_DISARM
            assert await station.command(UAV1, arm, 1) == dialect.MAV_RESULT_ACCEPTED
            mode = dialect.MAV_CMD_DO_SET_MODE
            px4_mission = (1.0, 4.0, 4.0, math.nan)  # as MAVSDK sends it
            assert await station.command(UAV1, mode, *px4_mission) == dialect.MAV_RESULT_ACCEPTED
            await station.hears("MISSION_ITEM_REACHED", of(UAV1, seq=2))
            since = len(station.received)
            assert await station.command(UAV1, PAUSE, 0) == dialect.MAV_RESULT_ACCEPTED
            await station.hears("MISSION_CURRENT", of(UAV1, mission_state=4), since)
            (run,) = await control.runs()
            assert run.status is RunStatus.PAUSED
            assert await station.command(UAV1, START) == dialect.MAV_RESULT_ACCEPTED
            for number in range(3, 6):
                await station.hears("MISSION_ITEM_REACHED", of(UAV1, seq=number))
            await station.hears("MISSION_CURRENT", of(UAV1, mission_state=5))
            (run,) = await control.runs()
            assert run.status is RunStatus.COMPLETED
            records = [each.record for each in await control.records(run.run)]
            flown = [each.name for each in records if isinstance(each, BehaviorRequested)]
            assert flown == [
                *("takeoff", "single_vehicle_routing", "hold", "goto", "return_to_launch")
            ]

    asyncio.run(main())


@pytest.mark.parametrize(
    ("system", "items", "result", "said"),
    [
        (UAV1, [Item(WAYPOINT, A), Item(82, B)], "UNSUPPORTED", "item 1: MAV_CMD_NAV_SPLINE"),
        (UAV1, [Item(WAYPOINT, A, frame=1)], "UNSUPPORTED", "item 0: MAV_CMD_NAV_WAYPOINT: MAV_FR"),
        (
            UAV1,
            [Item(LAND), Item(WAYPOINT, B)],
            "UNSUPPORTED",
            "item 1: MAV_CMD_NAV_WAYPOINT comes",
        ),
        (UAV1, [Item(WAYPOINT, A), Item(WAYPOINT, (38.13, -77.32, 9.0))], "UNSUPPORTED", "item 1"),
        (
            ROVER1,
            [Item(TAKEOFF, A), Item(WAYPOINT, B)],
            "UNSUPPORTED",
            "item 0: rover1 has no take",
        ),
        (ROVER1, [Item(206)], "DENIED", "no item of the plan moves it"),
        (
            UAV1,
            [Item(WAYPOINT, A), Item(WAYPOINT, (*B[:2], 0.0))],
            "UNSUPPORTED",
            "item 1: 0 m above home is on the ground",
        ),
    ],
)
def test_a_plan_that_a_vehicle_cannot_do_is_refused_with_its_item(
    tmp_path: Path, system: int, items: list[Item], result: str, said: str
) -> None:
    async def main() -> None:
        async with gateway(tmp_path, commands="all") as (_, port), ground_station(port) as station:
            await station.hears("HEARTBEAT", of(system))
            expected = getattr(dialect, f"MAV_MISSION_{result}")
            assert await upload(station, system, items) == expected
            await station.told(said)
            assert await download(station, system) == []
            assert await station.command(system, START) == dialect.MAV_RESULT_DENIED
            await station.told("MISSION_START: it has no plan")

    asyncio.run(main())


def test_clearing_and_uploading_while_a_plan_runs_changes_the_next_run_only(tmp_path: Path) -> None:
    async def main() -> None:
        far = (38.1095, -77.3192, 10.0)
        async with (
            gateway(tmp_path, speed=2.0, commands="all") as (control, port),
            ground_station(port) as station,
            ground_station(port, system=253) as other,
        ):
            await station.hears("HEARTBEAT", of(ROVER1))
            first = [Item(WAYPOINT, A), Item(WAYPOINT, far)]
            assert await upload(station, ROVER1, first) == 0
            assert await station.command(ROVER1, START) == dialect.MAV_RESULT_ACCEPTED
            (run,) = await control.runs()
            since = len(station.received)
            station.mav.mission_clear_all_send(ROVER1, 1, 0)
            await station.hears("MISSION_ACK", of(ROVER1, mission_type=0, type=0), since)
            await station.told(f"{run.run} goes on with the plan that it began with")
            assert await upload(station, ROVER1, [Item(WAYPOINT, B)]) == 0
            assert len(await download(station, ROVER1)) == 1
            await station.hears("MISSION_ITEM_REACHED", of(ROVER1, seq=0))
            # Another station neither holds nor restarts it; a run that a vehicle is in is said.
            for command, args in ((PAUSE, (0,)), (START, ()), (RETURN, ())):
                result = await other.command(ROVER1, command, *args)
                assert result == dialect.MAV_RESULT_TEMPORARILY_REJECTED
            await other.told("MISSION_START", run.run)
            assert [each.run for each in await control.runs()] == [run.run]
            # Its own station ends it by another order.
            assert await station.command(ROVER1, RETURN) == dialect.MAV_RESULT_ACCEPTED
            assert (await control.wait(run.run)).status is RunStatus.STOPPED

    asyncio.run(main())


def test_stop_of_all_ends_a_plan_and_a_mission_refuses_one(tmp_path: Path) -> None:
    async def main() -> None:
        far = (38.1095, -77.3192, 10.0)
        async with (
            gateway(tmp_path, commands=["rover1"]) as (control, port),
            ground_station(port) as station,
        ):
            await station.hears("HEARTBEAT", of(UAV1))
            assert await upload(station, UAV1, [Item(WAYPOINT, A)]) == dialect.MAV_MISSION_DENIED
            await station.told("uav1", "faces.mavlink.commands")
            assert await upload(station, ROVER1, [Item(WAYPOINT, far)]) == 0
            assert await station.command(ROVER1, START) == dialect.MAV_RESULT_ACCEPTED
            (run,) = await control.stop_all(by="anna")
            assert (await control.wait(run)).status is RunStatus.STOPPED
            target = f"[{far[0]}, {far[1]}]"
            mission = await control.start(scenarios.one_behavior("goto", "rover1", target=target))
            await station.told(mission, "rover1 begins goto")
            result = await station.command(ROVER1, START)
            assert result == dialect.MAV_RESULT_TEMPORARILY_REJECTED
            await station.told("MISSION_START", mission)

    asyncio.run(main())


def test_an_uploaded_fence_narrows_what_anybody_has_the_vehicle_do(tmp_path: Path) -> None:
    async def main() -> None:
        inside, outside = (38.1077, -77.3191, 10.0), (38.1090, -77.3192, 10.0)
        corners = [(38.1073, -77.3195), (38.1073, -77.3189), (38.1079, -77.3189)]
        corners.append((38.1079, -77.3195))
        fence = [
            Item(5001, (*each, 0.0), params=(4.0, 0.0, 0.0, 0.0), frame=dialect.MAV_FRAME_GLOBAL)
            for each in corners
        ]
        async with (
            gateway(tmp_path, speed=5.0, commands="all") as (control, port),
            ground_station(port) as station,
        ):
            await station.hears("HEARTBEAT", of(ROVER1))
            assert await upload(station, ROVER1, fence, type_=1) == dialect.MAV_MISSION_ACCEPTED
            assert len(await download(station, ROVER1, type_=1)) == 4
            assert "rover1.fence" in control.geometries()
            refused = await upload(
                station, ROVER1, [Item(WAYPOINT, inside), Item(WAYPOINT, outside)]
            )
            assert refused == dialect.MAV_MISSION_UNSUPPORTED
            await station.told("item 1", "outside")
            assert await station.go_to(ROVER1, outside[:2]) == dialect.MAV_RESULT_FAILED
            await station.told("the own fence of rover1")
            target = f"[{outside[0]}, {outside[1]}]"
            run = await control.start(scenarios.one_behavior("goto", "rover1", target=target))
            assert (await control.wait(run)).status is RunStatus.FAILED
            assert await upload(station, ROVER1, [Item(WAYPOINT, inside)]) == 0
            assert await station.command(ROVER1, START) == dialect.MAV_RESULT_ACCEPTED
            await station.hears("MISSION_CURRENT", of(ROVER1, mission_state=5))
            station.mav.mission_clear_all_send(ROVER1, 1, 1)
            await station.hears("MISSION_ACK", of(ROVER1, mission_type=1, type=0))
            assert await station.go_to(ROVER1, outside[:2]) == dialect.MAV_RESULT_ACCEPTED
            # The fleet's own fence holds as before.
            assert await station.go_to(ROVER1, (38.13, -77.32)) == dialect.MAV_RESULT_DENIED

    asyncio.run(main())


def test_a_transfer_survives_lost_repeated_and_late_messages(tmp_path: Path) -> None:
    """As QGroundControl's `PlanManager` behaves on a bad link: MISSION_COUNT comes again, and
    items on request."""

    async def main() -> None:
        items = [Item(WAYPOINT, each) for each in (A, B, C)]
        async with (
            gateway(tmp_path, commands="all") as (_, port),
            ground_station(port) as station,
            ground_station(port, system=253) as other,
        ):
            await station.hears("HEARTBEAT", of(ROVER1))
            send = station.mav.mission_item_int_send
            station.mav.mission_count_send(ROVER1, 1, 3, 0)
            await station.hears("MISSION_REQUEST_INT", of(ROVER1, seq=0))
            assert await upload(other, ROVER1, items) == dialect.MAV_MISSION_DENIED
            since = len(station.received)
            station.mav.mission_count_send(ROVER1, 1, 3, 0)
            await station.hears("MISSION_REQUEST_INT", of(ROVER1, seq=0), since)
            since = len(station.received)
            send(ROVER1, 1, *items[2].fields(2), 0)  # out of order
            await station.hears("MISSION_REQUEST_INT", of(ROVER1, seq=0), since)
            for _ in range(2):  # twice
                send(ROVER1, 1, *items[0].fields(0), 0)
            # The next request is repeated until it is answered.
            await station.hears("MISSION_REQUEST_INT", of(ROVER1, seq=1), since)
            since = len(station.received)
            await station.hears("MISSION_REQUEST_INT", of(ROVER1, seq=1), since)
            send(ROVER1, 1, *items[1].fields(1), 0)
            send(ROVER1, 1, *items[2].fields(2), 0)
            acknowledged = await station.hears("MISSION_ACK", of(ROVER1, type=0))
            raw = next(each for each in reversed(station.raw) if each[7:10] == b"\x2f\0\0")
            opaque_id = int.from_bytes(raw[14:18].ljust(4, b"\0"), "little")
            assert acknowledged.mission_type == 0 and opaque_id
            assert len(await download(other, ROVER1)) == 3
            # The id of a plan changes with it, and an upload that stops is given up.
            station.mav.mission_count_send(ROVER1, 1, 9, 0)
            cancelled = dialect.MAV_MISSION_OPERATION_CANCELLED
            await station.hears("MISSION_ACK", of(ROVER1, type=cancelled))
            await station.told("the upload is given up: item 0 did not come within 8 s")
            assert len(await download(other, ROVER1)) == 3

    asyncio.run(main())


def test_a_plan_waits_for_the_approvals_that_the_fleet_asks_for(tmp_path: Path) -> None:
    async def main() -> None:
        fleet = FLEET + "approval: {persons: 1}\n"
        async with (
            gateway(tmp_path, fleet=fleet, commands="all") as (control, port),
            ground_station(port) as station,
        ):
            await station.hears("HEARTBEAT", of(ROVER1))
            assert await upload(station, ROVER1, [Item(WAYPOINT, A)]) == 0
            result = await station.command(ROVER1, START)
            assert result == dialect.MAV_RESULT_TEMPORARILY_REJECTED
            await station.told("MISSION_START", "approv")
            assert not await control.runs()

    asyncio.run(main())
