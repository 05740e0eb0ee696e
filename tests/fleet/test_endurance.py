"""Whether a battery is enough for what is left of a behavior, and the way home."""

import math

import pytest

from m2pem.fleet.endurance import (
    MEASURED_S,
    RESERVE,
    BatteryReading,
    lasts_s,
    too_low_for_rest,
    use_per_s,
)

USE = 1 / 1000.0


@pytest.mark.parametrize(
    ("charge", "rest_s", "home_after_s", "home_now_s", "low"),
    [
        (0.9, 500.0, 100.0, 10.0, False),
        (0.5, 500.0, 100.0, 10.0, False),  # it cannot do all, but need not turn back yet
        (0.305, 500.0, 100.0, 95.0, True),
        (0.305, 50.0, 50.0, 95.0, False),  # what is left is on its way home
        (0.22, math.inf, 0.0, 10.0, True),
        (0.8, math.inf, 0.0, 10.0, False),
        (0.1, 1.0, 0.0, 0.0, True),
    ],
)
def test_a_battery_is_too_low_when_the_vehicle_must_turn_back_before_the_end(
    charge: float, rest_s: float, home_after_s: float, home_now_s: float, low: bool
) -> None:
    assert too_low_for_rest(charge, USE, rest_s, home_after_s, home_now_s) is low


def test_it_comes_home_with_the_reserve() -> None:
    """As it goes away from home, it is told while the way back leaves the reserve."""
    for away_s in range(1, 2000):
        charge = 1.0 - away_s * USE
        if too_low_for_rest(charge, USE, 5000.0 - away_s, 0.0, away_s):
            assert charge - away_s * USE >= RESERVE
            assert charge - away_s * USE < RESERVE + 0.02
            return
    pytest.fail("it was never told")


def test_the_use_of_a_battery_is_measured_once_it_was_long_enough() -> None:
    begin = BatteryReading(100.0, 1.0)
    early = BatteryReading(100.0 + MEASURED_S / 2, 0.5)
    later = BatteryReading(100.0 + MEASURED_S, 0.88)
    assert use_per_s(1000.0, begin, early) == pytest.approx(1 / 1000)
    assert use_per_s(1000.0, begin, later) == pytest.approx(0.12 / MEASURED_S)
    assert use_per_s(100.0, begin, later) == pytest.approx(1 / 100)


@pytest.mark.parametrize(
    ("charge", "lasts"), [(None, 800.0), (1.0, 800.0), (0.6, 400.0), (0.1, 0.0)]
)
def test_a_fifth_of_the_battery_is_left(charge: float | None, lasts: float) -> None:
    assert lasts_s(1000.0, charge) == pytest.approx(lasts)
