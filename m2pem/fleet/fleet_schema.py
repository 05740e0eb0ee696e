"""The shape of a fleet file, as pydantic models, and the JSON Schema that editors complete from.

Unknown keys are refused. Names in one file that refer to each other are checked by `fleet_file`.
"""

from collections.abc import Callable
from typing import Annotated, Any, Literal

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    NonNegativeInt,
    StringConstraints,
)
from pydantic.json_schema import WithJsonSchema

from m2pem.fleet.fleet import CONFLICT_WAIT_S
from m2pem.fleet.hosts import CutOffPolicy, Host
from m2pem.units import UNITS, Dimension, quantity


def _reader(dimension: Dimension, *, zero: bool = False) -> Callable[[object], float]:
    def read(value: object) -> float:
        result = quantity(value, dimension)
        if result < 0.0 or (result == 0.0 and not zero):
            raise ValueError(f"{value!r} is {'less than 0' if zero else 'not above 0'}")
        return result

    return read


def _quantity_schema(dimension: Dimension, bound: str = "exclusiveMinimum") -> dict[str, Any]:
    units = "|".join(UNITS[dimension])
    number = r"[0-9]+(\.[0-9]*)?([eE][+-]?[0-9]+)?"
    si = next(iter(UNITS[dimension]))
    return {
        "anyOf": [
            {"type": "number", bound: 0},
            {"type": "string", "pattern": rf"^\s*\+?{number}\s*({units})?\s*$"},
        ],
        "description": f"A {dimension.value}, for example '5 {si}'; a bare number is in {si}.",
    }


Duration = Annotated[
    float,
    BeforeValidator(_reader(Dimension.DURATION)),
    WithJsonSchema(_quantity_schema(Dimension.DURATION)),
]
DurationOrZero = Annotated[
    float,
    BeforeValidator(_reader(Dimension.DURATION, zero=True)),
    WithJsonSchema(_quantity_schema(Dimension.DURATION, "minimum")),
]
"""A duration, or 0."""

Distance = Annotated[
    float,
    BeforeValidator(_reader(Dimension.DISTANCE)),
    WithJsonSchema(_quantity_schema(Dimension.DISTANCE)),
]
Speed = Annotated[
    float,
    BeforeValidator(_reader(Dimension.SPEED)),
    WithJsonSchema(_quantity_schema(Dimension.SPEED)),
]
Name = Annotated[str, StringConstraints(pattern=r"^[^\s/\x00-\x1f\x7f-\x9f]+$")]
"""What missions call something: no white space, no control characters, no "/"."""

Text = Annotated[str, StringConstraints(min_length=1)]


class _Model(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)


class OriginModel(_Model):
    """Origin of the local ENU frame."""

    lat: Annotated[float, Field(ge=-90.0, le=90.0, description="Degrees (WGS-84).")]
    lon: Annotated[float, Field(ge=-180.0, le=180.0, description="Degrees (WGS-84).")]
    alt: Annotated[
        float, Field(allow_inf_nan=False, description="Metres above mean sea level.")
    ] = 0.0


class VideoModel(_Model):
    """Where operators' pictures of a camera come from."""

    url: Annotated[
        Text, Field(description="An address (http, https), without a user and a password.")
    ]
    kind: Annotated[
        Literal["hls", "webrtc", "mjpeg", "image"],
        Field(description="HLS, WebRTC by WHEP, Motion JPEG, or one picture at a time."),
    ]
    every: Annotated[
        Annotated[Duration, Field(gt=0)] | None,
        Field(description="How long after a picture the next one is fetched, of kind image; 1 s."),
    ] = None


class PayloadModel(_Model):
    """Something mounted on a vehicle that behaviors can command."""

    arbiter: Annotated[
        Text | None, Field(description="Which arbiter commands it; the vehicle's if left out.")
    ] = None
    connection: Annotated[
        dict[str, Any], Field(description="Settings of the arbiter, over the vehicle's own.")
    ] = {}
    behaviors: Annotated[
        list[Text] | None,
        Field(description="What missions may ask; all that is offered if left out."),
    ] = None
    detector: Annotated[
        bool, Field(description="Its detections complete the service Detector.")
    ] = False
    video: Annotated[
        VideoModel | None, Field(description="What operators see through it on the web page.")
    ] = None
    tags: Annotated[list[Text], Field(description="Words by which roles ask for it.")] = []


_Action = Literal["continue", "hold", "end"]


class CutOffModel(_Model):
    """What the host of a vehicle does without contact to the executive."""

    action: Annotated[_Action, Field(description="What it does with the vehicle's behavior.")] = (
        "hold"
    )
    after: Annotated[Duration, Field(description="How long it waits for the contact first.")] = (
        CutOffPolicy().after_s
    )
    behaviors: Annotated[
        dict[Text, _Action], Field(description="What it does with behaviors of these names.")
    ] = {}


def _cut_off(value: object) -> object:
    """A word alone is the action."""
    return value if isinstance(value, dict | list | CutOffModel) else {"action": value}


class TlsModel(_Model):
    """Files of TLS (PEM), relative to the fleet file. Each host has its own under these names."""

    ca: Annotated[Text, Field(description="The certificate of who signed the hosts'.")]
    certificate: Annotated[Text | None, Field(description="This host's certificate.")] = None
    key: Annotated[Text | None, Field(description="Its private key, of mode 0600.")] = None


class HostModel(_Model):
    """A computer that runs the arbiters of vehicles: `m2pem arbiter-host`."""

    connect: Annotated[
        list[Text],
        Field(description="Endpoints the executive connects to: tls/10.0.0.7:7447."),
    ] = []
    listen: Annotated[
        list[Text], Field(description="Where the executive listens, if the host connects to it.")
    ] = []
    telemetry_hz: Annotated[
        float, Field(gt=0, le=100, description="States of one vehicle in a second, at most.")
    ] = Host("").telemetry_hz
    round_trip: Annotated[
        Duration, Field(description="The longest usual time from a request to its answer.")
    ] = Host("").round_trip_s
    tls: Annotated[TlsModel | None, Field(description="Files of TLS.")] = None
    credentials: Annotated[
        Text | None, Field(description="A file of mode 0600 with lines 'user:password'.")
    ] = None


class ConformanceModel(_Model):
    """How far a vehicle may be from what it is commanded before its behavior is ended for it."""

    watch: Annotated[bool, Field(description="Whether it is compared at all.")] = True
    cross_track: Annotated[
        Distance | None, Field(description="From its way, beside what turns need; 10 m.")
    ] = None
    cross_track_time: Annotated[
        DurationOrZero | None, Field(description="For how long it may be farther; 5 s.")
    ] = None
    height: Annotated[Distance | None, Field(description="From its height; 15 m.")] = None
    height_time: Annotated[
        DurationOrZero | None, Field(description="For how long it may be farther; 5 s.")
    ] = None
    fence: Annotated[Distance | None, Field(description="Outside of a fence; 5 m.")] = None
    fall: Annotated[Speed | None, Field(description="How fast it may sink; 8 m/s.")] = None
    disarmed_above: Annotated[
        Distance | None, Field(description="Height above home at which it may be disarmed; 5 m.")
    ] = None
    jump: Annotated[Distance | None, Field(description="By which its position may jump; 25 m.")] = (
        None
    )
    waypoint: Annotated[
        Distance | None, Field(description="How near waypoints are passed; 10 m.")
    ] = None
    covered: Annotated[
        float | None, Field(ge=0, le=1, description="Least share of a survey's lines; 0.9.")
    ] = None
    rest: Annotated[Speed | None, Field(description="Of what is at rest; 1 m/s.")] = None
    drift: Annotated[Distance | None, Field(description="Of what is to stay; 30 m.")] = None
    stuck: Annotated[
        Duration | None, Field(description="Without progress, until operators are alerted; 2 min.")
    ] = None


BOUNDS = {
    "cross_track": "cross_track_m",
    "cross_track_time": "cross_track_s",
    "height": "height_m",
    "height_time": "height_s",
    "fence": "fence_m",
    "fall": "fall_m_s",
    "disarmed_above": "disarmed_above_m",
    "jump": "jump_m",
    "waypoint": "waypoint_m",
    "covered": "covered",
    "rest": "rest_m_s",
    "drift": "drift_m",
    "stuck": "stuck_s",
}
"""The bound of `m2pem.conformance.bounds.Bounds` that each key sets."""


class VehicleModel(_Model):
    """A vehicle."""

    domain: Literal["ground", "air", "surface", "subsurface"]
    arbiter: Annotated[Text, Field(description="Which arbiter commands it: sim, ros, mavlink, ...")]
    connection: Annotated[dict[str, Any], Field(description="Settings of the arbiter.")] = {}
    behaviors: Annotated[
        list[Text] | None,
        Field(description="What missions may ask; all that is offered if left out."),
    ] = None
    payloads: Annotated[
        dict[Name, PayloadModel], Field(description="Missions call a payload vehicle/payload.")
    ] = {}
    manned: Annotated[bool, Field(description="A person drives it: it is never commanded.")] = False
    sitl: Annotated[
        bool, Field(description="Software in the loop: not real, so that it may run at --speed.")
    ] = False
    lost_after: Annotated[
        Duration | None, Field(description="Silence after which the link counts as lost.")
    ] = None
    failsafe: Annotated[
        Text | None, Field(description="What the vehicle does by itself when its link is lost.")
    ] = None
    cruise_speed: Annotated[
        Annotated[Speed, Field(gt=0)] | None,
        Field(description="How fast it goes if no behavior says."),
    ] = None
    endurance: Annotated[
        Annotated[Duration, Field(gt=0)] | None,
        Field(description="How long it can go at that speed, with a full battery."),
    ] = None
    host: Annotated[
        Name | None, Field(description="The host that its arbiter runs on; one of 'hosts'.")
    ] = None
    when_cut_off: Annotated[
        CutOffModel | None,
        BeforeValidator(_cut_off, json_schema_input_type=CutOffModel | _Action),
        Field(description="What its host does without contact to the executive."),
    ] = None
    conformance: Annotated[
        ConformanceModel | None,
        Field(description="Its bounds of what it does otherwise than commanded; the fleet's."),
    ] = None
    tags: Annotated[list[Text], Field(description="Words by which roles ask for it.")] = []


class TeamModel(_Model):
    """Vehicles that a team behavior commands together."""

    members: Annotated[list[Name], Field(min_length=1, description="Names of vehicles.")]
    lead: Annotated[
        Name | None, Field(description="One of the members; the first if left out.")
    ] = None
    on_lost_member: Literal["stop", "continue"] = "stop"


class SurfaceSeparationModel(_Model):
    """How far apart vehicles that do not fly are planned."""

    horizontal: Annotated[
        Distance, Field(gt=0, description="Least distance on the map between two of them.")
    ]


_ON_CONFLICT = Field(
    description="refuse: the behavior ends as REJECTED; wait: its task waits until there is space."
)
_WAIT = Field(gt=0, description="How long a task waits for space at most.")


class DeconflictionModel(_Model):
    """How far apart vehicles are planned. Of aircraft, one of the distances is always kept."""

    vertical: Annotated[
        Distance, Field(gt=0, description="Least difference of height between aircraft.")
    ] = 10.0
    horizontal: Annotated[
        Distance, Field(gt=0, description="Least distance on the map between aircraft.")
    ] = 20.0
    time: Annotated[
        Annotated[Duration, Field(gt=0)] | None,
        Field(
            description="Least time between aircraft at a place of crossing routes. Without it "
            "routes may not cross at one height.",
        ),
    ] = None
    ground: Annotated[
        SurfaceSeparationModel | None, Field(description="Of ground vehicles; none if left out.")
    ] = None
    surface: Annotated[
        SurfaceSeparationModel | None, Field(description="Of surface vehicles; none if left out.")
    ] = None
    subsurface: Annotated[
        SurfaceSeparationModel | None,
        Field(description="Of subsurface vehicles, at any depth; none if left out."),
    ] = None
    on_conflict: Annotated[Literal["refuse", "wait"], _ON_CONFLICT] = "refuse"
    wait: Annotated[Duration, _WAIT] = CONFLICT_WAIT_S


def _capacity(value: object) -> object:
    if isinstance(value, bool) or not isinstance(value, int) or value < 0:
        raise ValueError(f"{value!r} is no number of vehicles; write a whole number, 0 or more")
    return value


class SharedSpaceModel(_Model):
    """How many vehicles may be in a named area, or in the corridor along a named route, at a
    time."""

    capacity: Annotated[
        int,
        Field(ge=0, description="How many vehicles at a time; 0: none may enter."),
        BeforeValidator(_capacity, json_schema_input_type=NonNegativeInt),
    ]
    width: Annotated[
        Annotated[Distance, Field(gt=0)] | None,
        Field(description="Of the corridor along a route; an area has none."),
    ] = None
    domains: Annotated[
        list[Literal["ground", "air", "surface", "subsurface"]],
        Field(min_length=1, description="The vehicles that count; others may pass."),
    ] = ["ground", "surface"]
    on_conflict: Annotated[Literal["refuse", "wait"], _ON_CONFLICT] = "wait"
    wait: Annotated[Duration, _WAIT] = CONFLICT_WAIT_S


def _shared_space(value: object) -> object:
    """A number alone is a capacity; so is what should be one."""
    return value if isinstance(value, dict | list | SharedSpaceModel) else {"capacity": value}


class AllocationModel(_Model):
    """What counts beside the travel time when vehicles are chosen for roles by need."""

    battery: Annotated[
        DurationOrZero,
        Field(description="Travel time that an empty battery counts as; a full one: 0."),
    ] = 60.0
    switching: Annotated[
        DurationOrZero,
        Field(description="Travel time that a vehicle which is new to the run counts as."),
    ] = 10.0
    preemption: Annotated[
        bool,
        Field(description="Whether a task takes vehicles from other runs with a lower priority."),
    ] = False


class ScheduleModel(_Model):
    """Missions that start without an operator: at a time, or when their vehicles are free."""

    unattended: Annotated[
        bool,
        Field(description="Real vehicles may start a scheduled mission with no operator present."),
    ] = False
    warning: Annotated[
        DurationOrZero,
        Field(description="How long before each start operators are warned of it."),
    ] = 10.0


class ApprovalModel(_Model):
    """Who must approve a mission before it may start."""

    persons: Annotated[
        int,
        Field(ge=1, le=10, description="How many others than who edited the mission last."),
    ]
    role: Annotated[
        Text | None,
        Field(description="The role of the operators who may approve; all if left out."),
    ] = None


class TerrainModel(_Model):
    """The ground: elevation files of this machine, and how far aircraft keep from it."""

    folder: Annotated[
        Text, Field(description="Of elevation files (SRTM tiles, GeoTIFF), relative to this file.")
    ]
    clearance: Annotated[
        Annotated[Distance, Field(gt=0)] | None,
        Field(description="Least height of aircraft above the ground on routes and at points."),
    ] = None


class HandOverModel(_Model):
    """How operators ask each other for vehicles and payloads."""

    answer_within: Annotated[
        Annotated[Duration, Field(gt=0)],
        Field(description="How long an operator who is asked for one may take to answer."),
    ] = 30.0
    unanswered: Annotated[
        Literal["keep", "give"],
        Field(description="Whether one that nobody answers for stays, or goes to who asks."),
    ] = "keep"
    gone_after: Annotated[
        Annotated[Duration, Field(gt=0)],
        Field(
            description="After how long at no page or terminal others may give back what an "
            "operator has."
        ),
    ] = 60.0
    supervisor: Annotated[
        Text | None,
        Field(description="The role of the operators who may give back what others have."),
    ] = None


class FleetModel(_Model):
    """A fleet of m2pem: vehicles, payloads, teams and named geometries."""

    version: Literal[1]
    name: Annotated[Text | None, Field(description="The file's name if left out.")] = None
    origin: Annotated[
        OriginModel | None,
        Field(description="Of the local ENU frame; where the first geometry begins if left out."),
    ] = None
    max_outage: Annotated[
        Duration | None,
        Field(description="A run that was down for longer holds and asks before it goes on."),
    ] = None
    steps_between_waits: Annotated[
        int,
        Field(
            ge=1000,
            description="A run that executes more elements without waiting once is paused.",
        ),
    ] = 200_000
    on_error: Annotated[
        Literal["end", "incident"],
        Field(
            description="An error that no event catches ends the run, or opens an incident, about "
            "which an operator decides. What a process of the mission says comes first."
        ),
    ] = "end"
    debugging: Annotated[
        bool,
        Field(
            description="Operators may set breakpoints in runs, execute single steps and change "
            "data, although vehicles are not simulated."
        ),
    ] = False
    incident_role: Annotated[
        Text | None,
        Field(
            description="The role of the operators who may decide about incidents; all if left "
            "out. What a process of the mission says comes first."
        ),
    ] = None
    operators: Annotated[
        dict[Text, Annotated[list[Text], Field(min_length=1)]],
        Field(
            description="Who has each role of operators, as the executive knows them: anna stands "
            "for her on every host, anna@gcs1 on one. If left out, every operator has every role."
        ),
    ] = {}
    approval: Annotated[
        ApprovalModel | None,
        Field(description="Missions start only when persons have approved exactly their content."),
    ] = None
    hand_over: Annotated[
        HandOverModel | None,
        Field(description="How operators ask each other for vehicles and payloads."),
    ] = None
    terrain: Annotated[
        TerrainModel | None,
        Field(description="Elevation files, and how far aircraft keep from the ground."),
    ] = None
    faces: Annotated[
        dict[Name, dict[str, Any] | None],
        Field(
            description="Programs of other protocols that see the fleet, by the name of the face "
            "that serves them, with its settings."
        ),
    ] = {}
    vehicles: dict[Name, VehicleModel] = {}
    hosts: Annotated[
        dict[Name, HostModel], Field(description="Other computers that run arbiters.")
    ] = {}
    teams: dict[Name, TeamModel] = {}
    routes: Annotated[
        dict[Name, Text], Field(description="Files of LineStrings or waypoints.")
    ] = {}
    areas: Annotated[dict[Name, Text], Field(description="Files of Polygons.")] = {}
    points: Annotated[dict[Name, Text], Field(description="Files of Points.")] = {}
    handed_over: Annotated[
        list[Name],
        Field(description="Routes, areas and points that operators hand over while missions run."),
    ] = []
    fence: Annotated[
        Name | None, Field(description="Name of the area that no vehicle may leave.")
    ] = None
    deconfliction: DeconflictionModel | None = None
    shared_space: Annotated[
        dict[
            Name,
            Annotated[
                SharedSpaceModel,
                BeforeValidator(
                    _shared_space, json_schema_input_type=SharedSpaceModel | NonNegativeInt
                ),
            ],
        ],
        Field(description="Areas and corridors that few vehicles may be in at a time."),
    ] = {}
    conformance: Annotated[
        ConformanceModel | None,
        Field(description="Bounds of what vehicles do otherwise than commanded."),
    ] = None
    allocation: AllocationModel | None = None
    schedule: ScheduleModel | None = None


def fleet_schema() -> dict[str, Any]:
    """The JSON Schema (draft 2020-12) of fleet files, for editors: `m2pem fleet --schema`."""
    schema = FleetModel.model_json_schema()
    models = (schema, *schema["$defs"].values())
    for properties in [p for model in models for p in model["properties"].values()]:
        if "patternProperties" in properties:  # keys that are no names: pydantic lets them pass
            properties["additionalProperties"] = False
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": "https://m2pem.org/schema/1/fleet.schema.json",
        **schema,
        "title": "m2pem fleet",
    }
