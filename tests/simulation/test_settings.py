import math
from dataclasses import replace
from typing import Any

import pytest

from m2pem.api.arbiter import Connection
from m2pem.errors import FleetError
from m2pem.mission.catalogue import ResourceId
from m2pem.simulation.faults import Fault
from m2pem.simulation.settings import PlannedDetection, Settings, Target, read_settings

ORIGIN = (38.1, -77.3, 0.0)


def read(domain: str = "ground", **settings: Any) -> Settings:
    return read_settings(Connection(ResourceId("v"), domain, settings), ORIGIN)


def test_units_are_read_and_the_rest_is_the_domains_own() -> None:
    settings = read(max_speed="36 km/h", turn_rate="90 deg/s", endurance="2 h", battery="80 %")
    assert settings.kinematics.max_speed_m_s == pytest.approx(10)
    assert settings.kinematics.turn_rate_rad_s == pytest.approx(math.pi / 2)
    assert settings.kinematics.endurance_s == 7200
    assert settings.kinematics.deceleration_m_s2 == 3.0
    assert settings.battery == 0.8


def test_what_the_fleet_says_of_a_vehicle_holds_unless_its_simulation_says_otherwise() -> None:
    said = Connection(ResourceId("v"), "ground", cruise_speed_m_s=2.0, endurance_s=600.0)
    kinematics = read_settings(said, ORIGIN).kinematics
    assert (kinematics.cruise_speed_m_s, kinematics.endurance_s) == (2.0, 600.0)
    own = read_settings(replace(said, settings={"cruise_speed": 3.0}), ORIGIN).kinematics
    assert (own.cruise_speed_m_s, own.endurance_s) == (3.0, 600.0)


def test_settings_of_other_arbiters_are_left_alone() -> None:
    assert read(url="udpin://127.0.0.1:14550", system_id=1, driver="onvif") == read()


def test_a_map_named_sim_keeps_the_settings_apart_from_another_arbiters() -> None:
    assert read(state=3, home="preset 1", sim={"battery": 0.5}).battery == 0.5


def test_lists_are_read() -> None:
    settings = read(
        home={"lat": 38.1, "lon": -77.3, "alt": 60},
        detections=[{"at": "40 s", "type": "gpr"}],
        targets=[{"type": "mine", "position": [38.1, -77.3]}],
        faults=[{"kind": "fail", "after": "5 s", "error": "E", "times": 2}],
    )
    assert settings.home == (38.1, -77.3, 60.0)
    assert settings.detections == (PlannedDetection(40.0, "gpr"),)
    assert settings.targets == (Target("mine", (38.1, -77.3, None)),)
    assert settings.faults == (Fault("fail", "", 5.0, "E", 2),)


def test_faults_are_read_as_text() -> None:
    faults = ["goto, orbit: fail BLOCKED at 2 min", "refuse", "stall at 5 s", "cut link at 4 s"]
    assert read(faults=faults).faults == (
        Fault("fail", "goto", 120.0, "BLOCKED"),
        Fault("fail", "orbit", 120.0, "BLOCKED"),
        Fault("reject"),
        Fault("stall", after_s=5.0),
        Fault("lose_link", after_s=4.0),
    )


@pytest.mark.parametrize(
    ("settings", "element", "said"),
    [
        ({"max_speed": "5 kg"}, "max_speed", "kg"),
        ({"max_speed": 0}, "max_speed", "not above 0"),
        ({"turn_rate": 3}, "turn_rate", "deg/s"),
        ({"battery": "full"}, "battery", "percentage"),
        ({"home": [200, 10]}, "home", "latitude comes first"),
        ({"home": "here"}, "home", "[lat, lon]"),
        ({"kind": "laser"}, "kind", "ptz, camera, gpr"),
        ({"telemetry_hz": -1}, "telemetry_hz", "below 0"),
        ({"telemetry_hz": "fast"}, "telemetry_hz", "not a number"),
        ({"state": 5}, "state", "not a text"),
        ({"faults": "none"}, "faults", "not a list"),
        ({"faults": [{"kind": "explode"}]}, "faults[0]", "reject, fail, stall, lose_link"),
        ({"faults": [{"after": 3}]}, "faults[0]", "'kind' is missing"),
        ({"faults": [{"kind": "fail", "times": 0}]}, "faults[0]", "times"),
        ({"faults": [3]}, "faults[0]", "not a map"),
        ({"faults": ["explode"]}, "faults[0]", "'explode' is no action. Actions: refuse"),
        ({"faults": ["stall for 3 s"]}, "faults[0]", "'stall' has no end"),
        ({"detections": [{"at": "soon", "type": "x"}]}, "detections[0]", "soon"),
        ({"targets": [{"type": "x"}]}, "targets[0]", "'position' is missing"),
    ],
)
def test_what_is_wrong_is_said_with_its_place(
    settings: dict[str, Any], element: str, said: str
) -> None:
    with pytest.raises(FleetError) as caught:
        read(**settings)
    [finding] = caught.value.findings
    assert finding.element == f"v.connection.{element}"
    assert said in finding.message
