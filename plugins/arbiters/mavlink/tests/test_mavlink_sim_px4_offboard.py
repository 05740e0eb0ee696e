"""OFFBOARD of a simulated PX4."""

import pytest
from mavlink_px4_bench import ACCEPTED, ARM, LATER, Px4Bench
from pymavlink.dialects.v20 import ardupilotmega as dialect

OFFBOARD = 6


def stream(bench: Px4Bench, seconds: float, *velocity: float) -> None:
    for _ in range(round(seconds / 0.2)):
        bench.velocity(*velocity)
        bench.run(0.2)


def test_offboard_mode_is_not_entered_in_the_air_without_setpoints() -> None:
    bench = Px4Bench().airborne()
    assert bench.enter(OFFBOARD) == LATER
    assert bench.texts()[-1] == "Switching to Offboard is currently not available"
    assert bench.mode == "AUTO.LOITER"


def test_offboard_mode_flies_as_fast_as_setpoints_say_for_as_long_as_they_come() -> None:
    bench = Px4Bench().airborne()
    stream(bench, 1, 3.0, 1.0)
    assert not bench.autopilot.body.moving
    assert bench.enter(OFFBOARD) == ACCEPTED
    stream(bench, 10, 3.0, 1.0)
    assert bench.autopilot.body.north_mps == pytest.approx(3, abs=0.1)
    assert bench.autopilot.body.east_mps == pytest.approx(1, abs=0.1)
    assert bench.autopilot.log.counts["motion"] == 1


@pytest.mark.parametrize(("action", "mode"), [(0, "AUTO.RTL"), (3, "AUTO.RTL"), (5, "AUTO.LOITER")])
def test_without_setpoints_it_drops_out_into_the_mode_that_is_set(action: int, mode: str) -> None:
    bench = Px4Bench(parameters={"COM_OBL_RC_ACT": action}).airborne()
    stream(bench, 1, 3.0)
    bench.enter(OFFBOARD)
    stream(bench, 3, 3.0)
    bench.run(0.7)
    assert bench.mode == "OFFBOARD"
    bench.run(0.6)
    assert bench.mode == mode
    assert bench.texts()[-1] == "Failsafe activated"
    bench.velocity(3.0)
    bench.run(0.5)
    assert bench.mode == mode


def test_offboard_mode_is_chosen_on_the_ground_without_setpoints_but_not_armed_in() -> None:
    bench = Px4Bench()
    bench.run(10)
    assert bench.enter(OFFBOARD) == ACCEPTED
    assert bench.command(ARM, 1) == LATER
    assert "Preflight Fail: No offboard signal" in bench.texts()


def test_a_place_above_takes_it_from_the_ground() -> None:
    bench = Px4Bench()
    bench.run(10)
    there = dialect.MAVLink_set_position_target_local_ned_message(
        0, 1, 1, 1, 0xDF8, 5, 0, -8, 0, 0, 0, 0, 0, 0, 0, 0
    )
    bench.tell(there)
    assert bench.enter(OFFBOARD) == ACCEPTED
    assert bench.command(ARM, 1) == ACCEPTED
    for _ in range(100):
        bench.tell(there)
        bench.run(0.2)
    assert bench.autopilot.position == pytest.approx((5, 0, 8), abs=0.5)
