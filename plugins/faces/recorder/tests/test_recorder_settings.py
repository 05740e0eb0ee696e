"""Settings of the recorder, and how often states are recorded."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from m2pem_plugin_recorder.settings import default_rate_hz, recorder_settings
from m2pem_plugin_recorder.telemetry_messages import RateLimit
from recording_world import simulated_fleet

from m2pem.api import Detection, FaceSettings, GeoPosition, PayloadState, VehicleState
from m2pem.errors import PluginError

JOURNAL = Path("/data/journal.db")


@pytest.mark.parametrize(
    ("settings", "problem"),
    [
        ({"foldr": "x"}, "faces.recorder.foldr: there is no such setting; did you mean 'folder'"),
        ({"file_mb": 0}, "faces.recorder.file_mb: 0 is not a whole number from 1"),
        ({"rate_hz": "fast"}, "faces.recorder.rate_hz: 'fast' is not a number"),
        ({"ros": 1}, "faces.recorder.ros: 1 is neither true nor false"),
    ],
)
def test_wrong_settings_are_named(settings: dict[str, Any], problem: str) -> None:
    with pytest.raises(PluginError, match=problem):
        recorder_settings(FaceSettings("recorder", settings), simulated_fleet(), JOURNAL)


def test_recordings_are_beside_the_journal_unless_a_folder_is_named() -> None:
    fleet = simulated_fleet()
    assert recorder_settings(FaceSettings("recorder", {}), fleet, JOURNAL).folder == Path(
        "/data/journal.db-recordings"
    )
    named = FaceSettings("recorder", {"folder": "/flights"})
    assert recorder_settings(named, fleet, None).folder == Path("/flights")
    beside = FaceSettings("recorder", {"folder": "flights"})
    found = recorder_settings(beside, replace(fleet, file="/etc/m2pem/fleet.yaml"), None)
    assert found.folder == Path("/etc/m2pem/flights")
    with pytest.raises(PluginError, match=r"faces\.recorder\.folder: it is missing"):
        recorder_settings(FaceSettings("recorder", {}), fleet, None)


def test_a_large_fleet_is_recorded_less_often() -> None:
    fleet = simulated_fleet()
    assert default_rate_hz(fleet) == 10.0
    vehicle = fleet.vehicles["ugv1"]  # type: ignore[index]
    many = {f"ugv{n}": replace(vehicle, id=f"ugv{n}") for n in range(500)}
    large = replace(fleet, vehicles=many, payloads={})  # type: ignore[arg-type]
    assert default_rate_hz(large) == 2.0


def test_a_rate_counts_for_each_resource_and_survives_clocks_that_are_set_back() -> None:
    limit = RateLimit(10.0)

    def passes(name: str, time_us: int) -> bool:
        return limit.passes(VehicleState(name, time_us))  # type: ignore[arg-type]

    passed = [passes("ugv1", 1_000_000 + n * 20_000) for n in range(50)]
    assert sum(passed) == 10
    assert passes("ugv2", 1_000_000)
    assert passes("ugv1", 1_000)
    found = Detection("mine", "cam", GeoPosition(0.0, 0.0, 0.0), 1)  # type: ignore[arg-type]
    state = PayloadState("cam", 1, detections=(found,))  # type: ignore[arg-type]
    assert limit.passes(state)
    assert limit.passes(state)
