"""Where vehicles were over mission time."""

from collections.abc import Iterator
from itertools import pairwise

import pytest

from m2pem.api.telemetry import VehicleState
from m2pem.mission.catalogue import ResourceId
from m2pem.rehearsal import sampling
from m2pem.rehearsal.sampling import Sampler

START_US = 1_000_000_000


def states_at(time_us: int) -> Iterator[VehicleState]:
    yield VehicleState(ResourceId("a"), time_us)


def test_samples_stand_at_even_times_whatever_time_jumps_over() -> None:
    sampler = Sampler(0.5, START_US, states_at)
    for until_s in (0.2, 0.5, 0.6, 2.1):
        sampler.before(START_US + round(until_s * 1_000_000))
    assert [each.t_s for each in sampler.samples] == [0, 0.5, 1, 1.5, 2]
    assert sampler.samples[1].vehicles[ResourceId("a")].time_us == START_US + 500_000


def test_a_long_rehearsal_has_samples_farther_from_each_other(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(sampling, "MOST_SAMPLES", 8)
    sampler = Sampler(1, START_US, states_at)
    sampler.before(START_US + 100_000_000)
    times = [each.t_s for each in sampler.samples]
    assert len(times) <= 8
    assert {after - before for before, after in pairwise(times)} == {16}
