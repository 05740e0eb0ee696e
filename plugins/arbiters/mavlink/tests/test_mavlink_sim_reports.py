import math

import pytest
from m2pem_plugin_mavlink.simulator.specification import Kind
from mavlink_bench import Bench
from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import undulation_m


def test_a_long_text_comes_in_chunks() -> None:
    bench = Bench()
    text = "".join(chr(97 + n % 26) for n in range(120))
    bench.autopilot.say(text)
    bench.run(0.1)
    chunks = [m for m in bench.received if m.get_type() == "STATUSTEXT"]
    assert [m.chunk_seq for m in chunks] == [0, 1, 2]
    assert len({m.id for m in chunks}) == 1
    assert chunks[0].id != 0
    assert "".join(m.text for m in chunks) == text


@pytest.mark.parametrize("length", [1, 49, 50, 51, 99, 100])
def test_a_text_ends_with_a_chunk_that_is_not_full(length: int) -> None:
    bench = Bench()
    bench.autopilot.say("x" * length)
    bench.run(0.1)
    chunks = [m for m in bench.received if m.get_type() == "STATUSTEXT"]
    assert sum(len(m.text) for m in chunks) == length
    assert len(chunks[-1].text) < 50
    assert (chunks[0].id == 0) == (length < 50)


def test_positions_agree_in_all_messages() -> None:
    bench = Bench(heading_deg=90).airborne(20)
    bench.command_int(192, -1, 1, at=(*bench.offset(30, 40), 20))
    bench.run(20)
    place, local, hud = bench.report(33), bench.report(32), bench.report(74)
    expected = bench.offset(30, 40)
    assert (place.lat * 1e-7, place.lon * 1e-7) == pytest.approx(expected, abs=3e-6)
    assert (local.x, local.y, local.z) == pytest.approx((30, 40, -20), abs=0.3)
    assert place.relative_alt == pytest.approx(20_000, abs=300)
    assert hud.alt == pytest.approx(508, abs=0.3)
    fix = bench.report(24)
    assert fix.alt == pytest.approx(508_000, abs=300)
    undulation_mm = undulation_m(*expected) * 1e3
    assert fix.alt_ellipsoid - fix.alt == pytest.approx(undulation_mm, abs=2)
    assert place.hdg / 100 == pytest.approx(math.degrees(bench.report(30).yaw) % 360, abs=0.1)
    q = bench.report(31)
    yaw = math.atan2(2 * (q.q1 * q.q4 + q.q2 * q.q3), 1 - 2 * (q.q3**2 + q.q4**2))
    assert yaw == pytest.approx(bench.autopilot.body.yaw_rad, abs=1e-3)


def test_before_the_estimator_is_ready_no_position_is_told() -> None:
    bench = Bench(estimator_s=41)
    bench.run(20)
    assert (bench.report(33).lat, bench.report(33).lon) == (0, 0)
    assert bench.report(24).fix_type >= 3
    for missing in (32, 242, 259):  # acknowledged all the same
        assert bench.command(512, missing) == 0
        assert missing not in {m.get_msgId() for m in bench.received}
    assert bench.command(512, 150) == 4


def test_landed_or_in_the_air_is_told() -> None:
    bench = Bench().ready()
    assert (bench.report(245).landed_state, bench.report(245).vtol_state) == (1, 3)
    bench.command(22, *[0] * 6, 20)
    bench.run(4)
    assert bench.report(245).landed_state == 3
    bench.run(20)
    assert bench.report(245).landed_state == 2
    bench.command(21)
    bench.run(0.1)
    assert bench.report(245).landed_state == 4


def test_armed_on_the_ground_it_stands_by() -> None:
    bench = Bench().ready()
    assert (bench.report(0).system_status, bench.report(0).base_mode & 128) == (3, 128)
    bench.command(22, *[0] * 6, 20)
    bench.run(3)
    assert bench.report(0).system_status == 4


def test_a_rover_is_active_unless_it_holds() -> None:
    bench = Bench(Kind.ROVER)
    assert (bench.report(0).system_status, bench.report(0).base_mode) == (4, 0x41)
    bench.command(176, 1, 4)
    assert (bench.report(0).system_status, bench.report(0).base_mode) == (3, 0x01)
    bench.ready()
    assert (bench.report(0).system_status, bench.report(0).base_mode) == (4, 0x89)
    assert bench.texts() == ["Throttle armed"]


def test_without_terrain_data_the_height_is_that_above_the_sea() -> None:
    bench = Bench().airborne(20)
    report = bench.report(136)
    assert (report.spacing, report.terrain_height, report.loaded) == (0, 0, 0)
    assert report.current_height == pytest.approx(508, abs=0.3)
    assert (report.lat, report.lon) == (bench.report(33).lat, bench.report(33).lon)


def test_the_battery_drains_in_motion() -> None:
    bench = Bench(battery_s=100).airborne(10)
    before = bench.report(147).battery_remaining
    bench.run(20)
    after = bench.report(147)
    assert before - after.battery_remaining == pytest.approx(20, abs=2)
    assert bench.report(1).battery_remaining == after.battery_remaining
    assert bench.report(1).voltage_battery == after.voltages[0] < 12_600


def test_a_simulated_autopilot_says_who_it_is() -> None:
    bench = Bench(Kind.BOAT, system=1)
    bench.run(1.5)
    heartbeat = next(m for m in bench.received if m.get_type() == "HEARTBEAT")
    assert (heartbeat.type, heartbeat.autopilot) == (11, 3)
    assert (bench.report(245).vtol_state, bench.report(245).landed_state) == (0, 0)
    assert bench.command(511, 136, 1e6) == 0
    bench.run(2)
    assert "TERRAIN_REPORT" not in {m.get_type() for m in bench.received}
    version = bench.report(148)
    assert version.flight_sw_version >> 16 == 4 << 8 | 7
    assert version.capabilities & dialect.MAV_PROTOCOL_CAPABILITY_MISSION_INT
