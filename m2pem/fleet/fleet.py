"""The fleet: vehicles, payloads, teams and named geometries, also as self-contained JSON."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import partial
from typing import Any, Self, get_type_hints

import msgspec

from m2pem.errors import JournalError
from m2pem.findings import Finding
from m2pem.fleet.hosts import CutOffPolicy, Host
from m2pem.geo.geojson import kind_of
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.elements import ErrorPolicy
from m2pem.mission.geometry import Area, Geometry, Point, Route, VehiclePosition

SIMULATED = "sim"
"""The name of the arbiter that simulates vehicles and payloads."""


class Domain(StrEnum):
    """Where a vehicle moves."""

    GROUND = "ground"
    AIR = "air"
    SURFACE = "surface"
    SUBSURFACE = "subsurface"


class OnConflict(StrEnum):
    """What becomes of a task whose behavior another vehicle is in the way of."""

    REFUSE = "refuse"
    WAIT = "wait"


class Unanswered(StrEnum):
    """What becomes of a request for control that its holder does not answer in time."""

    KEEP = "keep"
    GIVE = "give"


class LostMemberPolicy(StrEnum):
    """What a team's behavior does when a member is lost."""

    STOP = "stop"
    CONTINUE = "continue"


class VideoKind(StrEnum):
    """How operator control units get the pictures of a camera."""

    HLS = "hls"
    WEBRTC = "webrtc"
    """By WHEP."""
    MJPEG = "mjpeg"
    IMAGE = "image"
    """One picture at a time."""


@dataclass(frozen=True, slots=True)
class Video:
    """Where the pictures of a camera come from; `every_s`: the time between two that are asked for,
    of `VideoKind.IMAGE`."""

    url: str
    kind: VideoKind
    every_s: float = 1.0


@dataclass(frozen=True, slots=True)
class Payload:
    """A payload mounted on a vehicle. `id` is "vehicle/name". `settings` has the vehicle's
    connection settings below its own. `behaviors` None: all that its arbiter offers."""

    id: ResourceId
    vehicle: ResourceId
    arbiter: str
    settings: Mapping[str, Any]
    behaviors: tuple[str, ...] | None = None
    detector: bool = False
    tags: tuple[str, ...] = ()
    line: int = 0


@dataclass(frozen=True, slots=True)
class Conformance:
    """How vehicles are compared with what they are commanded. `bounds`: those of
    `m2pem.conformance.bounds.Bounds` that differ from the default, by their names. `watched`:
    whether it is done."""

    bounds: Mapping[str, float] = field(default_factory=dict)
    watched: bool = True


@dataclass(frozen=True, slots=True)
class Vehicle:
    """A vehicle. `payloads`: the ids of what is mounted on it. `cruise_speed_m_s`: how fast it goes
    if no behavior says; `endurance_s`: how long it can, with a full battery. None: not said.
    `host`: the computer that its arbiters run on, and those of its payloads; "": the executive's
    own. `when_cut_off`: what that computer does without contact to the executive. `conformance`:
    its own bounds; None: those of the fleet."""

    id: ResourceId
    domain: Domain
    arbiter: str
    settings: Mapping[str, Any]
    behaviors: tuple[str, ...] | None = None
    payloads: tuple[ResourceId, ...] = ()
    manned: bool = False
    sitl: bool = False
    lost_after_s: float | None = None
    failsafe: str = ""
    cruise_speed_m_s: float | None = None
    endurance_s: float | None = None
    tags: tuple[str, ...] = ()
    host: str = ""
    when_cut_off: CutOffPolicy = field(default_factory=CutOffPolicy)
    conformance: Conformance | None = None
    line: int = 0


@dataclass(frozen=True, slots=True)
class Team:
    """Vehicles that a team behavior commands together. `lead` is one of `members`."""

    name: str
    members: tuple[ResourceId, ...]
    lead: ResourceId
    on_lost_member: LostMemberPolicy = LostMemberPolicy.STOP
    line: int = 0


CONFLICT_WAIT_S = 600.0
"""How long a task waits for space, if the fleet does not say."""


@dataclass(frozen=True, slots=True)
class SharedSpace:
    """A named area, or a corridor of `width_m` along a named route, in which no more than
    `capacity` vehicles of `domains` are at a time; 0: it is closed to them."""

    name: str
    capacity: int
    domains: tuple[Domain, ...] = (Domain.GROUND, Domain.SURFACE)
    width_m: float | None = None
    on_conflict: OnConflict = OnConflict.WAIT
    wait_s: float = CONFLICT_WAIT_S
    line: int = 0

    @property
    def waits(self) -> bool:
        """Whether a task waits for a place in it."""
        return self.on_conflict is OnConflict.WAIT


@dataclass(frozen=True, slots=True)
class Fleet:
    """A whole fleet file, with the geometries that it names read in.

    `origin`: of the local ENU frame, (latitude deg, longitude deg, altitude m above mean sea
    level). `fence`: name of an area that no vehicle may leave, or "". `vertical_separation_m`: of
    aircraft that are nearer than `horizontal_separation_m`; None: they are not kept apart.
    `time_separation_s`: between aircraft at a place of crossing routes; None: these conflict.
    `surface_separation_m`: between two vehicles of a domain other than air; they are kept apart in
    the domains that are named. `on_conflict`, `conflict_wait_s`: what becomes of a task whose
    behavior would bring two vehicles too near, and how long it waits.
    `closed_space`: shared space with no place. `handed_over`: names of geometries that missions may
    use and operators hand over.
    `battery_cost_s`, `switching_cost_s`: travel time that an empty battery, and a vehicle which is
    new to a run, count as when vehicles are chosen for roles. `on_error`: what an error does that
    no event of the mission catches, where the mission does not say. `unattended`: scheduled
    missions may start real vehicles with no operator present; `start_warning_s`: how long before a
    start operators are warned of it. `preemption`: whether a task may take vehicles from tasks of
    other runs with a lower priority. `incident_role`: which operators decide about incidents, where
    the mission does not say; "": all. `operators`: the names of those who have each role; none:
    every operator has every role. `approval_persons`: how many persons other than its last editor
    must have approved a mission before it starts; 0: none. `approval_role`: which operators may
    approve; "": all. `control_answer_s`: how long an operator who is asked for a vehicle or payload
    may take to answer; `control_unanswered`: what becomes of it then. `control_gone_after_s`: after
    how long at no unit an operator counts as gone, so that others may give back what that operator
    has; `supervisor_role`: which operators may at any time, "": none. `hosts`: the other computers
    that arbiters run on, by name. `faces`: the settings of each face; `videos`: of cameras that
    operators can look through. `terrain_folder`: of elevation files, "": none is named;
    `clearance_m`: the least height of aircraft above the ground, None: it is not checked;
    `warnings`: what is doubtful of files of geometries, with the path in the fleet file. No run
    depends on these five, and no journal has them.
    """

    name: str
    file: str
    vehicles: Mapping[ResourceId, Vehicle]
    payloads: Mapping[ResourceId, Payload] = field(default_factory=dict)
    teams: Mapping[str, Team] = field(default_factory=dict)
    geometries: Mapping[str, Geometry] = field(default_factory=dict)
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    max_outage_s: float | None = None
    steps_between_waits: int = 200_000
    fence: str = ""
    vertical_separation_m: float | None = None
    horizontal_separation_m: float = 20.0
    time_separation_s: float | None = None
    surface_separation_m: Mapping[Domain, float] = field(default_factory=dict)
    on_conflict: OnConflict = OnConflict.REFUSE
    conflict_wait_s: float = CONFLICT_WAIT_S
    shared_space: Mapping[str, SharedSpace] = field(default_factory=dict)
    closed_space: Mapping[str, SharedSpace] = field(default_factory=dict)
    handed_over: tuple[str, ...] = ()
    battery_cost_s: float = 60.0
    switching_cost_s: float = 10.0
    on_error: ErrorPolicy = ErrorPolicy.END
    unattended: bool = False
    start_warning_s: float = 10.0
    preemption: bool = False
    incident_role: str = ""
    operators: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    approval_persons: int = 0
    approval_role: str = ""
    control_answer_s: float = 30.0
    control_unanswered: Unanswered = Unanswered.KEEP
    control_gone_after_s: float = 60.0
    supervisor_role: str = ""
    hosts: Mapping[str, Host] = field(default_factory=dict)
    faces: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    videos: Mapping[ResourceId, Video] = field(default_factory=dict)
    terrain_folder: str = ""
    clearance_m: float | None = None
    debugging: bool = False
    conformance: Conformance = field(default_factory=Conformance)
    warnings: tuple[Finding, ...] = ()

    def __deepcopy__(self, memo: object) -> Self:
        return self  # it never changes

    @property
    def fenced(self) -> bool:
        """Whether there is anywhere that a vehicle may not be."""
        return bool(self.fence or self.closed_space)

    @property
    def detectors(self) -> tuple[ResourceId, ...]:
        """The payloads marked `detector: true`, in the file's order."""
        return tuple(payload.id for payload in self.payloads.values() if payload.detector)

    @property
    def kept_as(self) -> str:
        """The name by which a journal keeps the alerts and drawings of this fleet: apart from
        those of a fleet of the same name that commands real vehicles, if this one is simulated."""
        return f"{self.name} (simulated)" if self.simulated else self.name

    @property
    def simulated(self) -> bool:
        """Whether every vehicle and payload is of the simulated arbiter, in this process."""
        everything: list[Vehicle | Payload] = [*self.vehicles.values(), *self.payloads.values()]
        hosted = any(vehicle.host for vehicle in self.vehicles.values())
        return not hosted and all(each.arbiter == SIMULATED for each in everything)

    @property
    def may_be_debugged(self) -> bool:
        """Whether operators may set breakpoints in runs, execute single steps and change data."""
        return self.simulated or self.debugging


def real_resources(fleet: Fleet) -> list[ResourceId]:
    """The vehicles and payloads that are neither simulated nor software in the loop.

    What another host simulates counts as real: it has that host's clock.
    """
    everything: list[Vehicle | Payload] = [*fleet.vehicles.values(), *fleet.payloads.values()]
    sitl = {vehicle.id for vehicle in fleet.vehicles.values() if vehicle.sitl}
    hosted = {vehicle.id for vehicle in fleet.vehicles.values() if vehicle.host}
    return [
        each.id
        for each in everything
        if (owner := each.id.partition("/")[0]) in hosted
        or (each.arbiter != SIMULATED and owner not in sitl)
    ]


def simulated_fleet(fleet: Fleet, settings: Mapping[str, Any] | None = None) -> Fleet:
    """The fleet with the simulated arbiter in place of every other; `settings` are added to those
    that the simulation has of every resource, in place of those of the same names. Nothing moves,
    so that missions need no approval."""
    changed = partial(sim_settings, changed=settings or {})
    return replace(
        fleet,
        approval_persons=0,
        vehicles={
            id_: replace(each, arbiter=SIMULATED, settings=changed(each.settings), host="")
            for id_, each in fleet.vehicles.items()
        },
        payloads={
            id_: replace(each, arbiter=SIMULATED, settings=changed(each.settings))
            for id_, each in fleet.payloads.items()
        },
    )


def sim_settings(connection: Mapping[str, Any], changed: Mapping[str, Any]) -> dict[str, Any]:
    """Return a connection with other settings of the simulation: in `sim`, if it has that."""
    own = connection.get("sim")
    return {**connection, **({"sim": {**own, **changed}} if isinstance(own, Mapping) else changed)}


VERSION = 1

_TYPES: dict[str, type[Geometry]] = {
    "point": Point,
    "route": Route,
    "area": Area,
    "vehicle": VehiclePosition,
}


_NOT_IN_JOURNALS = ("faces", "videos", "terrain_folder", "clearance_m", "warnings")


def dump(fleet: Fleet) -> bytes:
    """The whole fleet, with its geometries, without what no run depends on."""
    content = {
        field: getattr(fleet, field)
        for field in fleet.__dataclass_fields__
        if field not in _NOT_IN_JOURNALS
    }
    content["geometries"] = {
        name: {"kind": kind_of(geometry), "geometry": geometry}
        for name, geometry in fleet.geometries.items()
    }
    return msgspec.json.encode({"version": VERSION, "fleet": content})


def digest_of(fleet: Fleet) -> str:
    """Return what is the same for fleets of the same content, whatever their files are named."""
    return hashlib.sha256(dump(replace(fleet, file=""))).hexdigest()[:16]


def restore(content: bytes) -> Fleet:
    """The fleet that `dump` was given.

    Raises:
        JournalError: not a snapshot, or one of a newer version.
    """
    try:
        snapshot: dict[str, Any] = msgspec.json.decode(content, type=dict[str, Any])
        version = snapshot.get("version")
        if version != VERSION:
            raise JournalError(f"fleet snapshot of version {version!r}; {VERSION} is expected")
        fields = snapshot["fleet"]
        geometries = {
            name: msgspec.convert(entry["geometry"], _TYPES[entry["kind"]])
            for name, entry in fields.pop("geometries").items()
        }
        hints = get_type_hints(Fleet)
        values = {name: msgspec.convert(value, hints[name]) for name, value in fields.items()}
        return Fleet(**values, geometries=geometries)
    except (msgspec.MsgspecError, KeyError, TypeError, AttributeError) as error:
        raise JournalError(f"not a fleet snapshot: {error}") from error
