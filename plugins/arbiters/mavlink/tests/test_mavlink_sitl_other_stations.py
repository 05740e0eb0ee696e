"""What another ground station does to a real autopilot while m2pem runs a mission on it."""

import pytest
from mavlink_other_stations import ACTS, play
from mavlink_sitl import program

CASES = [
    pytest.param(name, marks=pytest.mark.sitl(vehicle.variable))
    for name, (vehicle, _) in ACTS.items()
]


@pytest.mark.long
@pytest.mark.timeout(600)
@pytest.mark.parametrize("name", CASES)
def test_operators_read_what_another_station_did_and_m2pem_leaves_it_the_vehicle(name: str) -> None:
    vehicle, act = ACTS[name]
    binary = program(vehicle.variable)
    assert binary is not None
    seen = play(vehicle, act, binary, 11 if vehicle.firmware == "px4" else 74)
    at_s = seen.at_s(act.says)
    assert at_s is not None, seen
    # Lines are read at the wall clock, of which the vehicle's runs ahead: a fifth of a second.
    assert at_s <= act.within_s + 0.2 * vehicle.speed, seen
    assert not set(seen.modes) & set(act.not_in), seen
    assert act.status in (None, seen.status), seen
