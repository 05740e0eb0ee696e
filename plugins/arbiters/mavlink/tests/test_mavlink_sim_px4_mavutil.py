"""pymavlink's mavutil with simulated PX4s, over UDP."""

import asyncio
from collections.abc import Callable, Iterator
from itertools import pairwise

import pytest
from m2pem_plugin_mavlink.simulator.faults import Faults
from m2pem_plugin_mavlink.simulator.simulator import Simulator
from m2pem_plugin_mavlink.simulator.specification import ZURICH, VehicleSpec
from mavlink_bench import item
from mavlink_ground import Ground

NAN = float("nan")
ARMED = 128


@pytest.fixture
def ground() -> Iterator[Ground]:
    station = Ground("udpin:127.0.0.1:0")
    yield station
    station.close()


async def at(
    ground: Ground, scene: Callable[[Simulator], None], *specs: VehicleSpec, speed: float = 20
) -> Simulator:
    """Play a scene in a thread, while vehicles send to the ground station."""
    async with Simulator(specs, speed=speed, to=("127.0.0.1", ground.port)) as sim:
        await asyncio.to_thread(scene, sim)
        return sim


PX4 = VehicleSpec(firmware="px4", estimator_s=6.0)


async def test_a_px4_is_flown_by_its_modes_and_a_mission(ground: Ground) -> None:
    plan = [item(0, 22, ZURICH[:2], 10.0), item(1, 16, (47.39790, 8.5456), 10.0), item(2, 20)]

    def scene(sim: Simulator) -> None:
        ground.link.wait_heartbeat(timeout=40)
        ground.wait("HOME_POSITION")
        ground.wait("ESTIMATOR_STATUS", that=lambda m: m.flags & 0x10)
        assert ground.command(400, 1) == 0
        assert ground.command(22, NAN, NAN, NAN, NAN, NAN, NAN, 498) == 0
        ground.wait("HEARTBEAT", that=lambda m: m.custom_mode == 4 << 16 | 2 << 24)
        ground.wait("HEARTBEAT", that=lambda m: m.custom_mode == 4 << 16 | 3 << 24)
        ground.link.mav.mission_count_send(1, 1, len(plan))
        asked: list[int] = []
        while asked[-1:] != [plan[-1].seq]:  # an answer that is late is asked for again
            asked.append(ground.wait("MISSION_REQUEST_INT").seq)
            ground.link.mav.send(plan[asked[-1]])
        assert sorted(set(asked)) == [each.seq for each in plan]
        assert asked == sorted(asked)
        assert ground.wait("MISSION_ACK").type == 0
        while ground.command(300) != 0:
            continue  # it checks the mission at first
        # The waypoint before the item to return is reached in the same moment as that one.
        ground.wait("MISSION_ITEM_REACHED", that=lambda m: m.seq == 2)
        ground.wait("HEARTBEAT", that=lambda m: not m.base_mode & ARMED)

    sim = await at(ground, scene, PX4)
    assert (sim[1].takeoffs, sim[1].missions_begun) == (1, 1)
    assert sim[1].location[:2] == pytest.approx(ZURICH[:2], abs=1e-5)


async def test_an_ardupilot_and_a_px4_share_a_port(ground: Ground) -> None:
    def scene(sim: Simulator) -> None:
        ground.wait("HEARTBEAT", that=lambda m: (m.get_srcSystem(), m.autopilot) == (1, 12))
        ground.wait("HEARTBEAT", that=lambda m: (m.get_srcSystem(), m.autopilot) == (2, 3))

    await at(ground, scene, PX4, VehicleSpec(system=2, estimator_s=6.0))


async def test_a_link_that_is_cut_is_silent_and_comes_back(ground: Ground) -> None:
    def scene(sim: Simulator) -> None:
        ground.link.wait_heartbeat(timeout=40)
        times_s = [ground.wait("SYSTEM_TIME").time_boot_ms / 1000]
        sim[1].faults.cut_link()
        sim[1].faults.after(40, Faults.restore_link)
        while times_s[-1] - times_s[0] < 45:
            times_s.append(ground.wait("SYSTEM_TIME").time_boot_ms / 1000)
        gaps_s = [after - before for before, after in pairwise(times_s)]
        assert 39 < max(gaps_s) < 45

    await at(ground, scene, PX4)
