"""The behaviors that all arbiters share, with their parameters (docs/fleets.md has the table).

An arbiter offers those of them that its vehicles and payloads can do, and may add its own.
`SHARED` is keyed by name and type: `area_survey` is both a vehicle's and a team's.
"""

import math
from collections.abc import Mapping

from m2pem.geo.geojson import ALTITUDE_FRAMES
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.catalogue import BehaviorSpec, ParameterKind, ParameterSpec, ResumePolicy

ALTITUDE_FRAME = ParameterSpec(
    "altitude_frame",
    ParameterKind.TEXT,
    choices=ALTITUDE_FRAMES,
    doc="What altitudes are above: home (relative), mean sea level (amsl) or the ground (terrain).",
)
"""Accepted by every behavior that takes an altitude or a position."""

ENDING_PARAMETERS = frozenset({"duration", "timeout", "turns"})
"""Parameters with which a behavior that would go on until it is interrupted ends by itself."""

ADJUSTABLE = frozenset({"single_vehicle_routing", "goto", "area_survey", "reverse"})
"""Behaviors of a vehicle whose speed can be changed on the way, if its arbiter adjusts: they are
over at a place, not after a time."""

ALONG_ROUTES = ("formation", "road_following_formation", "road_sweep", "bridge_crossing")
"""Behaviors of teams that move along their route."""

FLOWN = frozenset(
    {"single_vehicle_routing", "goto", "change_altitude", "area_survey", "orbit", "follow"}
) | {"area_observe"}
"""Behaviors of a vehicle that real aircraft on the ground refuse: only `takeoff` takes them off."""

ORBIT_RADIUS_M = 30.0
"""Of circles around a target that have no `radius`."""

_SLOWEST_M_S = 0.01
_SHORTEST_M = 0.1
_RIGHT_ANGLE = math.pi / 2

_SPEED = ParameterSpec(
    "speed",
    ParameterKind.SPEED,
    minimum=_SLOWEST_M_S,
    doc="Over ground; the vehicle's own if absent.",
)
_ALTITUDE = ParameterSpec("altitude", ParameterKind.ALTITUDE, doc="The present one if absent.")
_ALTITUDE_REQUIRED = ParameterSpec("altitude", ParameterKind.ALTITUDE, required=True)
_HEADING = ParameterSpec("heading", ParameterKind.ANGLE, doc="From true north, clockwise.")
_ROUTE = ParameterSpec("route", ParameterKind.ROUTE, doc="The route to move along.")
_AREA = ParameterSpec("area", ParameterKind.AREA)
_AREA_REQUIRED = ParameterSpec("area", ParameterKind.AREA, required=True)
_TARGET = ParameterSpec("target", ParameterKind.POSITION)
_TARGET_REQUIRED = ParameterSpec("target", ParameterKind.POSITION, required=True)
_DURATION = ParameterSpec("duration", ParameterKind.DURATION, minimum=0.0)
_SPACING = ParameterSpec("spacing", ParameterKind.DISTANCE, minimum=_SHORTEST_M)
_PAN_SPEED = ParameterSpec(
    "speed", ParameterKind.ANGULAR_SPEED, minimum=0.001, doc="Of the camera's turning."
)
_ELEVATION = ParameterSpec(
    "elevation",
    ParameterKind.ANGLE,
    minimum=-_RIGHT_ANGLE,
    maximum=_RIGHT_ANGLE,
    doc="Up from the horizon.",
)
_SHAPE = ParameterSpec(
    "shape",
    ParameterKind.TEXT,
    choices=("column", "line", "wedge", "vee", "diamond", "echelon_left", "echelon_right"),
    doc="How the members are placed to each other.",
)


def _behavior(
    type_: BehaviorType,
    name: str,
    doc: str,
    *parameters: ParameterSpec,
    required_one_of: tuple[tuple[str, ...], ...] = (),
    resume: ResumePolicy = ResumePolicy.HOLD,
    ends: bool = True,
    writes: tuple[str, ...] = (),
) -> BehaviorSpec:
    if takes_altitude(parameters):
        parameters = (*parameters, ALTITUDE_FRAME)
    return BehaviorSpec(name, type_, parameters, required_one_of, resume, ends, doc, writes)


def takeoff_first(aircraft: str) -> str:
    """Return why an aircraft on the ground refuses a behavior."""
    return f"{aircraft} is on the ground: take off first (takeoff)"


def takes_altitude(parameters: tuple[ParameterSpec, ...]) -> bool:
    """Whether one of the parameters may hold an altitude."""
    return any(p.kind in (ParameterKind.ALTITUDE, ParameterKind.POSITION) for p in parameters)


def _vehicle_behaviors() -> tuple[BehaviorSpec, ...]:
    vehicle = BehaviorType.VEHICLE
    return (
        _behavior(
            vehicle,
            "single_vehicle_routing",
            "Move along a route.",
            ParameterSpec("route", ParameterKind.ROUTE, required=True),
            _SPEED,
            _ALTITUDE,
            ParameterSpec("loop", ParameterKind.BOOLEAN, doc="Begin again at the end."),
        ),
        _behavior(
            vehicle,
            "goto",
            "Move to a position.",
            _TARGET_REQUIRED,
            _SPEED,
            _ALTITUDE,
            _HEADING,
            ParameterSpec(
                "tolerance", ParameterKind.DISTANCE, minimum=0.0, doc="How near is there."
            ),
        ),
        _behavior(
            vehicle,
            "hold",
            "Stay at rest for a time; without a duration, end as soon as the vehicle is at rest.",
            _DURATION,
            resume=ResumePolicy.RESTART,
        ),
        _behavior(vehicle, "drive_stop", "Stop.", resume=ResumePolicy.RESTART),
        _behavior(vehicle, "land", "Land where it is."),
        _behavior(vehicle, "return_to_launch", "Go back to where it started."),
        _behavior(
            vehicle,
            "reverse",
            "Move backwards.",
            ParameterSpec(
                "distance", ParameterKind.DISTANCE, minimum=0.0, default=5.0, doc="How far."
            ),
            _SPEED,
        ),
        _behavior(vehicle, "takeoff", "Take off and climb.", _ALTITUDE_REQUIRED),
        _behavior(vehicle, "change_altitude", "Climb or descend.", _ALTITUDE_REQUIRED),
        _area_survey(vehicle),
        _behavior(
            vehicle,
            "orbit",
            "Circle a position: for a number of turns or a time, else once.",
            _TARGET_REQUIRED,
            ParameterSpec("radius", ParameterKind.DISTANCE, minimum=_SHORTEST_M),
            _ALTITUDE,
            _SPEED,
            ParameterSpec("turns", ParameterKind.NUMBER, minimum=0.0),
            _DURATION,
        ),
        _area_observe(vehicle),
        _behavior(
            vehicle,
            "follow",
            "Stay with another vehicle until interrupted.",
            ParameterSpec("target", ParameterKind.VEHICLE, required=True),
            ParameterSpec("offset", ParameterKind.DISTANCE, minimum=0.0, doc="From the target."),
            ParameterSpec(
                "bearing",
                ParameterKind.ANGLE,
                doc="Direction to keep: clockwise from the target's heading.",
            ),
            _ALTITUDE,
            ends=False,
        ),
        _behavior(
            vehicle,
            "teleop",
            "Let an operator drive, until interrupted or for the timeout.",
            ParameterSpec("timeout", ParameterKind.DURATION, minimum=0.0),
            ends=False,
        ),
        _behavior(
            vehicle,
            "set_speed",
            "Change the speed of what follows.",
            ParameterSpec("speed", ParameterKind.SPEED, required=True, minimum=_SLOWEST_M_S),
            resume=ResumePolicy.RESTART,
        ),
        _behavior(
            vehicle,
            "deploy",
            "Work an actuator: a gripper, a marker, a winch.",
            ParameterSpec("actuator", ParameterKind.TEXT, required=True, doc="Its name or number."),
            ParameterSpec("value", ParameterKind.NUMBER, doc="What to set it to."),
        ),
    )


def _area_survey(type_: BehaviorType) -> BehaviorSpec:
    return _behavior(
        type_,
        "area_survey",
        "Cover an area in parallel tracks.",
        _AREA_REQUIRED,
        ParameterSpec(
            "spacing", ParameterKind.DISTANCE, minimum=_SHORTEST_M, doc="Between the tracks."
        ),
        _ALTITUDE,
        _SPEED,
        ParameterSpec("heading", ParameterKind.ANGLE, doc="Of the tracks, from true north."),
        ParameterSpec(
            "overshoot", ParameterKind.DISTANCE, minimum=0.0, doc="Beyond the area, for turning."
        ),
    )


def _area_observe(type_: BehaviorType) -> BehaviorSpec:
    return _behavior(
        type_,
        "area_observe",
        "Watch an area or a position, until interrupted or for the duration.",
        _AREA,
        _TARGET,
        _ALTITUDE,
        _DURATION,
        required_one_of=(("area",), ("target",)),
        ends=False,
    )


def _team_behaviors() -> tuple[BehaviorSpec, ...]:
    team = BehaviorType.TEAM
    common = (_SPEED, _SPACING, _SHAPE)
    return (
        _area_survey(team),
        _area_observe(team),
        _behavior(
            team,
            "formation",
            "Move in formation.",
            _ROUTE,
            *common,
            ParameterSpec(
                "offsets",
                ParameterKind.OFFSETS,
                doc="In place of shape and spacing: metres behind the lead and to its left.",
            ),
        ),
        _behavior(
            team, "road_following_formation", "Move in formation along a road.", _ROUTE, *common
        ),
        _behavior(team, "road_sweep", "Sweep a road side by side.", _ROUTE, *common),
        _behavior(team, "bridge_crossing", "Cross a bridge one by one.", _ROUTE, *common),
        _behavior(
            team,
            "escort",
            "Move around a target until interrupted.",
            _TARGET_REQUIRED,
            *common,
            ends=False,
        ),
    )


def _payload_behaviors() -> tuple[BehaviorSpec, ...]:
    payload, restart = BehaviorType.PAYLOAD, ResumePolicy.RESTART
    return (
        _behavior(
            payload,
            "ptz_point_at",
            "Point the camera at a position, or into a direction.",
            _TARGET,
            ParameterSpec(
                "bearing", ParameterKind.ANGLE, doc="Clockwise from the vehicle's heading."
            ),
            _ELEVATION,
            required_one_of=(("target",), ("bearing", "elevation")),
            resume=restart,
        ),
        _behavior(
            payload,
            "ptz_scan_polygon",
            "Look over an area once.",
            _AREA_REQUIRED,
            ParameterSpec(
                "overlap",
                ParameterKind.NUMBER,
                minimum=0.0,
                maximum=0.9,
                doc="Of neighbouring views, as a fraction.",
            ),
            _PAN_SPEED,
            resume=restart,
        ),
        _behavior(
            payload,
            "ptz_scan_sector",
            "Look over a sector once.",
            ParameterSpec(
                "heading",
                ParameterKind.ANGLE,
                required=True,
                doc="Middle of the sector, from true north, clockwise.",
            ),
            ParameterSpec(
                "sector",
                ParameterKind.ANGLE,
                required=True,
                minimum=0.0,
                maximum=2 * math.pi,
                doc="Its whole width.",
            ),
            _ELEVATION,
            _PAN_SPEED,
            resume=restart,
        ),
        _behavior(
            payload,
            "ptz_track",
            "Keep the camera on a position or vehicle, until interrupted or for the duration.",
            _TARGET_REQUIRED,
            _DURATION,
            resume=restart,
            ends=False,
        ),
        _behavior(
            payload,
            "zoom",
            "Set the zoom.",
            ParameterSpec(
                "level",
                ParameterKind.NUMBER,
                minimum=1.0,
                default=1.0,
                doc="Magnification: 1 is the widest view.",
            ),
            resume=restart,
        ),
        _behavior(
            payload,
            "take_picture",
            "Take pictures.",
            ParameterSpec("count", ParameterKind.COUNT, minimum=1, default=1),
            ParameterSpec(
                "interval", ParameterKind.DURATION, minimum=0.0, default=1.0, doc="Between them."
            ),
            resume=restart,
            writes=("picture.file", "picture.files", "picture.position", "picture.time"),
        ),
        _behavior(
            payload,
            "record_video",
            "Record, until interrupted or for the duration.",
            _DURATION,
            resume=restart,
            ends=False,
            writes=("video.file", "video.time"),
        ),
    )


SHARED: Mapping[tuple[str, BehaviorType], BehaviorSpec] = {
    (spec.name, spec.type): spec
    for spec in (*_vehicle_behaviors(), *_team_behaviors(), *_payload_behaviors())
}
"""Every shared behavior, by name and type."""
