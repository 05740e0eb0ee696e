from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from m2pem.errors import JournalError
from m2pem.fleet.fleet import Domain, Fleet, Vehicle, dump, restore, simulated_fleet
from m2pem.fleet.fleet_file import load_fleet
from m2pem.mission.geometry import Area, Point, Route, VehiclePosition

from .fleets import write_fleet
from .test_fleet_file import FULL


def test_a_fleet_comes_back_as_it_was_without_its_files(tmp_path: Path) -> None:
    path = write_fleet(tmp_path, FULL)
    fleet = load_fleet(path)
    content = dump(fleet)
    for file in tmp_path.iterdir():
        file.unlink()
    restored = restore(content)
    assert restored == fleet
    assert dump(restored) == content
    assert isinstance(restored.vehicles["evsg1"].payloads, tuple)
    assert restored.vehicles["evsg1"].domain is Domain.GROUND


coordinates = st.tuples(st.floats(-90, 90), st.floats(-180, 180), st.none() | st.floats(-1e4, 1e4))
frames = st.sampled_from(["relative", "amsl", "terrain"])
lines = st.lists(coordinates, min_size=1, max_size=5).map(tuple)
geometries = st.one_of(
    st.builds(Point, coordinates, frames),
    st.builds(Route, lines, frames),
    st.builds(Area, st.lists(lines, min_size=1, max_size=3).map(tuple), frames),
    st.builds(VehiclePosition, st.text()),
)
json_values = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**63), 2**63 - 1)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=8,
)


@given(st.dictionaries(st.text(), geometries, max_size=4), st.dictionaries(st.text(), json_values))
def test_any_geometry_and_setting_survives(geometry: dict, settings: dict) -> None:
    vehicle = Vehicle("v", Domain.AIR, "sim", settings)
    fleet = Fleet("n", "f.yaml", {"v": vehicle}, geometries=geometry, origin=(1.0, 2.0, 3.0))
    assert restore(dump(fleet)) == fleet


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "not a fleet snapshot"),
        (b"[]", "not a fleet snapshot"),
        (b'{"version": 2}', "version 2; 1 is expected"),
        (b'{"version": 1}', "not a fleet snapshot"),
        (b'{"version": 1, "fleet": {"geometries": {}}}', "not a fleet snapshot"),
        (b'{"version": 1, "fleet": {"geometries": {"a": {"kind": "x"}}}}', "not a fleet snapshot"),
        (b'{"version": 1, "fleet": {"geometries": {}, "vehicles": 3}}', "not a fleet snapshot"),
        (b'{"version": 1, "fleet": null}', "not a fleet snapshot"),
    ],
)
def test_what_is_no_snapshot_is_refused(content: bytes, message: str) -> None:
    with pytest.raises(JournalError, match=message):
        restore(content)


def test_settings_of_a_simulated_fleet_replace_those_that_the_simulation_reads() -> None:
    real = {"address": "udp:127.0.0.1:14550", "sim": {"state": "kept", "battery": 0.5}}
    vehicles = {
        "real": Vehicle("real", Domain.AIR, "mavlink", real),
        "made": Vehicle("made", Domain.AIR, "sim", {"state": "kept"}),
    }
    fleet = simulated_fleet(Fleet("n", "f.yaml", vehicles), {"state": ""})
    assert fleet.vehicles["real"].settings == {**real, "sim": {"state": "", "battery": 0.5}}
    assert fleet.vehicles["made"].settings == {"state": ""}
