"""pymavlink's mavutil, which knows nothing of m2pem, with simulated vehicles over UDP."""

import asyncio
from collections.abc import Callable, Iterator

import pytest
from m2pem_plugin_mavlink.simulator.geometry import LocalFrame, Point
from m2pem_plugin_mavlink.simulator.simulator import Simulator
from m2pem_plugin_mavlink.simulator.specification import ZURICH, Kind, VehicleSpec
from mavlink_bench import item
from mavlink_ground import Ground

HOME = item(0, 16, frame=0)


def place(north_m: float, east_m: float) -> tuple[float, float]:
    location = LocalFrame(ZURICH).to_location(Point(north_m, east_m, 0.0))
    return location.latitude_deg, location.longitude_deg


@pytest.fixture
def ground() -> Iterator[Ground]:
    station = Ground("udpin:127.0.0.1:0")
    yield station
    station.close()


async def at(
    ground: Ground, speed: float, scene: Callable[[], None], *specs: VehicleSpec
) -> Simulator:
    """Play a scene in a thread, while vehicles send to the ground station."""
    async with Simulator(specs, speed=speed, to=("127.0.0.1", ground.port)) as sim:
        await asyncio.to_thread(scene)
        return sim


@pytest.mark.tried_with(
    "pymavlink",
    "lists and sets parameters of `m2pem sim mavlink`",
    kind="MAVLink clients",
    result="all are listed",
    package="pymavlink",
)
async def test_all_parameters_are_listed_and_one_is_set(ground: Ground) -> None:
    def scene() -> None:
        ground.link.wait_heartbeat(timeout=40)
        ground.link.param_fetch_all()
        last = ground.wait("PARAM_VALUE", that=lambda m: m.param_index == m.param_count - 1)
        assert len(ground.link.params) == last.param_count > 50
        ground.link.mav.param_set_send(1, 1, b"RTL_ALT", 3000, 9)
        assert ground.wait("PARAM_VALUE").param_value == 3000
        ground.link.param_fetch_one("RTL_ALT")
        assert ground.wait("PARAM_VALUE").param_value == 3000

    await at(ground, 10, scene, VehicleSpec(estimator_s=6.0))


async def test_arming_is_refused_with_the_reason_until_the_position_is_known(
    ground: Ground,
) -> None:
    def scene() -> None:
        ground.link.wait_heartbeat(timeout=40)
        ground.stream(193)
        ground.wait("EKF_STATUS_REPORT", that=lambda m: m.flags & 1)
        ground.link.set_mode("GUIDED")
        ground.wait("HEARTBEAT", that=lambda m: m.custom_mode == 4)
        assert ground.command(400, 1) == 4
        assert any(text.startswith("Arm: ") for text in ground.texts)
        ground.ready(4)
        assert ground.link.motors_armed()

    sim = await at(ground, 10, scene, VehicleSpec(estimator_s=20))
    assert sim[1].armed


async def test_a_copter_takes_off_goes_somewhere_and_stops_when_velocities_end(
    ground: Ground,
) -> None:
    def scene() -> None:
        ground.link.wait_heartbeat(timeout=40)
        ground.ready(4)
        assert ground.command(22, 0, 0, 0, 0, 0, 0, 15) == 0
        ground.stream(33, 32)
        ground.wait("GLOBAL_POSITION_INT", that=lambda m: m.relative_alt > 14_500)
        ground.link.mav.set_position_target_local_ned_send(
            0, 1, 1, 1, 0xFF8, 40, 30, -15, 0, 0, 0, 0, 0, 0, 0, 0
        )
        ground.wait("LOCAL_POSITION_NED", that=lambda m: abs(m.x - 40) + abs(m.y - 30) < 1)
        ground.link.mav.set_position_target_local_ned_send(
            0, 1, 1, 1, 0xFC7, 0, 0, 0, 5, 0, 0, 0, 0, 0, 0, 0
        )
        ground.wait("LOCAL_POSITION_NED", that=lambda m: m.vx > 4.5)
        ground.wait("LOCAL_POSITION_NED", that=lambda m: m.x > 45 and abs(m.vx) < 0.1)

    sim = await at(ground, 20, scene, VehicleSpec(estimator_s=6.0))
    assert (sim[1].takeoffs, sim[1].motions) == (1, 2)


@pytest.mark.tried_with(
    "pymavlink",
    "uploads a mission to `m2pem sim mavlink`",
    kind="MAVLink clients",
    result="is flown to its end",
    package="pymavlink",
)
async def test_a_mission_is_uploaded_flown_and_told_of_until_the_motors_stop(
    ground: Ground,
) -> None:
    plan = [HOME, item(1, 22, z=12.0), item(2, 16, place(50, 0), 12.0), item(3, 20)]

    def scene() -> None:
        ground.link.wait_heartbeat(timeout=40)
        ground.ready(4)
        assert ground.upload(*plan) == 0
        assert ground.command(300) == 0
        for number in (1, 2):
            ground.wait("MISSION_ITEM_REACHED", that=lambda m, number=number: m.seq == number)  # type: ignore[misc]
        ground.wait("HEARTBEAT", that=lambda m: not m.base_mode & 128)
        assert "Mission: 3 RTL" in ground.texts

    sim = await at(ground, 20, scene, VehicleSpec(estimator_s=6.0))
    assert (sim[1].takeoffs, sim[1].missions_begun) == (1, 1)
    assert abs(sim[1].up_m) < 0.1
    assert sim[1].location[:2] == pytest.approx(ZURICH[:2], abs=1e-5)


async def test_a_copter_and_a_rover_share_a_port(ground: Ground) -> None:
    latitude, longitude = place(15, 5)

    def scene() -> None:
        ground.wait("HEARTBEAT", that=lambda m: m.get_srcSystem() == 1)
        ground.wait("HEARTBEAT", that=lambda m: m.get_srcSystem() == 2)
        ground.link.target_system, ground.link.target_component = 2, 1
        ground.stream(193)
        ground.wait("EKF_STATUS_REPORT", that=lambda m: m.flags & 0x10)
        assert ground.command(176, 1, 15) == 0
        assert ground.command(400, 1) == 0
        x, y = round(latitude * 1e7), round(longitude * 1e7)
        ground.link.mav.command_int_send(2, 1, 6, 192, 0, 0, -1, 1, 0, 0, x, y, 0)
        assert ground.wait("COMMAND_ACK", that=lambda m: m.command == 192).result == 0
        ground.wait("MISSION_ITEM_REACHED", that=lambda m: m.seq == 0)

    rover = VehicleSpec(Kind.ROVER, system=2, estimator_s=6.0)
    sim = await at(ground, 20, scene, VehicleSpec(), rover)
    assert sim[2].location[:2] == pytest.approx((latitude, longitude), abs=3e-5)
    assert not sim[1].armed


async def test_a_second_ground_station_is_learned_and_its_upload_denied() -> None:
    async with Simulator([VehicleSpec(estimator_s=6.0)], speed=5, to=None) as sim:
        url = f"udpout:127.0.0.1:{sim[1].address[1]}"

        def scene() -> None:
            first, second = Ground(url), Ground(url, system=254)
            for each in (first, second):
                each.link.mav.heartbeat_send(6, 8, 0, 0, 0)
                each.link.wait_heartbeat(timeout=40)
            first.link.mav.mission_count_send(1, 1, 3)
            first.wait("MISSION_REQUEST")
            second.link.mav.mission_count_send(1, 1, 2)
            assert second.wait("MISSION_ACK").type == 14
            assert first.wait("MISSION_REQUEST").seq == 0
            first.wait("MISSION_ACK", that=lambda m: m.type == 15)
            first.close()
            second.close()

        await asyncio.to_thread(scene)
