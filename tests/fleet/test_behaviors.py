import pytest

from m2pem.fleet.behaviors import ALTITUDE_FRAME, SHARED
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.catalogue import BehaviorSpec, ParameterKind, ResumePolicy

VEHICLE, PAYLOAD, TEAM = BehaviorType.VEHICLE, BehaviorType.PAYLOAD, BehaviorType.TEAM

# The catalogue as published: name -> types, parameters, required ones.
TEAM_PARAMETERS = "route speed spacing shape"
PUBLISHED = {
    ("single_vehicle_routing", VEHICLE): ("route speed altitude loop", "route"),
    ("goto", VEHICLE): ("target speed altitude heading tolerance", "target"),
    ("hold", VEHICLE): ("duration", ""),
    ("drive_stop", VEHICLE): ("", ""),
    ("land", VEHICLE): ("", ""),
    ("return_to_launch", VEHICLE): ("", ""),
    ("reverse", VEHICLE): ("distance speed", ""),
    ("takeoff", VEHICLE): ("altitude", "altitude"),
    ("change_altitude", VEHICLE): ("altitude", "altitude"),
    ("area_survey", VEHICLE): ("area spacing altitude speed heading overshoot", "area"),
    ("area_survey", TEAM): ("area spacing altitude speed heading overshoot", "area"),
    ("orbit", VEHICLE): ("target radius altitude speed turns duration", "target"),
    ("area_observe", VEHICLE): ("area target altitude duration", ""),
    ("area_observe", TEAM): ("area target altitude duration", ""),
    ("follow", VEHICLE): ("target offset bearing altitude", "target"),
    ("teleop", VEHICLE): ("timeout", ""),
    ("set_speed", VEHICLE): ("speed", "speed"),
    ("deploy", VEHICLE): ("actuator value", "actuator"),
    ("formation", TEAM): (f"{TEAM_PARAMETERS} offsets", ""),
    ("road_following_formation", TEAM): (TEAM_PARAMETERS, ""),
    ("road_sweep", TEAM): (TEAM_PARAMETERS, ""),
    ("bridge_crossing", TEAM): (TEAM_PARAMETERS, ""),
    ("escort", TEAM): ("target speed spacing shape", "target"),
    ("ptz_point_at", PAYLOAD): ("target bearing elevation", ""),
    ("ptz_scan_polygon", PAYLOAD): ("area overlap speed", "area"),
    ("ptz_scan_sector", PAYLOAD): ("heading sector elevation speed", "heading sector"),
    ("ptz_track", PAYLOAD): ("target duration", "target"),
    ("zoom", PAYLOAD): ("level", ""),
    ("take_picture", PAYLOAD): ("count interval", ""),
    ("record_video", PAYLOAD): ("duration", ""),
}


def test_the_catalogue_is_the_published_one() -> None:
    built = {
        key: (
            " ".join(p.name for p in spec.parameters if p is not ALTITUDE_FRAME),
            " ".join(p.name for p in spec.parameters if p.required),
        )
        for key, spec in SHARED.items()
    }
    assert built == PUBLISHED


def test_alternatives_are_required_as_groups() -> None:
    groups = {key: spec.required_one_of for key, spec in SHARED.items() if spec.required_one_of}
    observe = (("area",), ("target",))
    assert groups == {
        ("area_observe", VEHICLE): observe,
        ("area_observe", TEAM): observe,
        ("ptz_point_at", PAYLOAD): (("target",), ("bearing", "elevation")),
    }


def test_only_open_ended_behaviors_do_not_end_by_themselves() -> None:
    assert {name for (name, _), spec in SHARED.items() if not spec.ends} == {
        "follow",
        "escort",
        "ptz_track",
        "record_video",
        "teleop",
        "area_observe",
    }


def test_what_moves_holds_after_a_restart_and_what_does_not_begins_again() -> None:
    still = {key for key, spec in SHARED.items() if spec.resume is ResumePolicy.RESTART}
    assert still == {
        ("hold", VEHICLE),
        ("drive_stop", VEHICLE),
        ("set_speed", VEHICLE),
        *(key for key in SHARED if key[1] is PAYLOAD),
    }
    assert {s.resume for k, s in SHARED.items() if k not in still} == {ResumePolicy.HOLD}


@pytest.mark.parametrize("spec", SHARED.values(), ids=lambda spec: f"{spec.name}-{spec.type}")
def test_every_behavior_is_explained_and_takes_a_frame_where_it_takes_an_altitude(
    spec: BehaviorSpec,
) -> None:
    assert spec.doc.endswith(".")
    with_altitude = {ParameterKind.ALTITUDE, ParameterKind.POSITION}
    takes = any(p.kind in with_altitude for p in spec.parameters)
    assert (ALTITUDE_FRAME in spec.parameters) is takes
