"""/api/fleet, /api/behaviors, /api/services, /api/expressions: what missions are written with."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from fastapi import APIRouter
from pydantic import BaseModel

from m2pem.api import (
    Area,
    BehaviorSpec,
    BehaviorType,
    Fleet,
    MissionControl,
    ParameterKind,
    ResourceId,
    as_geojson,
    expression_dialects,
)
from m2pem.fleet.fleet import Video
from m2pem.mission.expression import Dialect
from m2pem.mission.expression.described import DialectWords
from m2pem_plugin_web.access.permissions import Viewer
from m2pem_plugin_web.problems import RESPONSES
from m2pem_plugin_web.rest.models import Answer

_UNITS = {
    ParameterKind.DURATION: "s",
    ParameterKind.DISTANCE: "m",
    ParameterKind.ALTITUDE: "m",
    ParameterKind.SPEED: "m/s",
    ParameterKind.ANGLE: "rad",
    ParameterKind.ANGULAR_SPEED: "rad/s",
}
"""Of bounds and defaults; people write others too."""


class OriginModel(BaseModel):
    """Of the local frame: degrees, and metres above mean sea level."""

    lat: float
    lon: float
    alt: float


class VehicleModel(Answer):
    """A vehicle. `host`: of its arbiter, "" for the executive's own. `failsafe`: what the fleet
    file says that the vehicle does by itself when its link is lost; "": nothing."""

    id: str
    domain: str
    manned: bool
    arbiter: str
    host: str
    failsafe: str
    payloads: list[str]


class PayloadModel(Answer):
    """What is mounted on a vehicle; `video`: null for none."""

    id: str
    vehicle: str
    detector: bool
    arbiter: str
    video: Video | None


class TeamModel(Answer):
    """Vehicles that are commanded together."""

    name: str
    members: list[str]
    lead: str


class FleetModel(Answer):
    """The fleet in use; `fence`: the area (GeoJSON) that no vehicle may leave, null for none.
    `approval_persons`: how many persons must approve a mission before it starts; 0 for none.
    `may_be_debugged`: whether its runs may: all of it is simulated, or its file allows that."""

    name: str
    origin: OriginModel
    vehicles: list[VehicleModel]
    payloads: list[PayloadModel]
    teams: list[TeamModel]
    fence: dict[str, Any] | None
    approval_persons: int
    may_be_debugged: bool


class ParameterModel(Answer):
    """A parameter; bounds and default are in `unit`."""

    name: str
    kind: ParameterKind
    unit: str
    required: bool
    minimum: float | None
    maximum: float | None
    choices: list[str]
    default: float | str | bool | None
    doc: str


class BehaviorModel(Answer):
    """A behavior with its parameters, and the vehicles, payloads or teams that can do it."""

    name: str
    type: BehaviorType
    doc: str
    ends: bool
    writes: list[str]
    required_one_of: list[list[str]]
    parameters: list[ParameterModel]
    resources: list[str]
    teams: list[str]


class ServiceModel(BaseModel):
    """A service-task class, and the names of data that it writes."""

    name: str
    writes: list[str]


def router(control: MissionControl) -> APIRouter:
    """The routes of the catalogue."""
    routes = APIRouter(prefix="/api", tags=["catalogue"], responses=RESPONSES)

    @routes.get("/fleet")
    async def fleet(_: Viewer) -> FleetModel:
        """The fleet in use."""
        return _fleet(control.fleet())

    @routes.get("/behaviors")
    async def behaviors(_: Viewer) -> list[BehaviorModel]:
        """Return the behaviors of this fleet by name; variants of one are separate entries."""
        return behaviors_of(control.fleet(), control.catalogue())

    @routes.get("/services")
    async def services(_: Viewer) -> list[ServiceModel]:
        """The service-task classes that there are."""
        return [
            ServiceModel(name=name, writes=list(writes))
            for name, writes in sorted(control.services().items())
        ]

    @routes.get("/expressions")
    async def expressions(_: Viewer) -> Mapping[Dialect, DialectWords]:
        """Return the dialects of expressions: m2pem (bare), juel, xpath and feel."""
        return expression_dialects()

    return routes


def _fleet(fleet: Fleet) -> FleetModel:
    lat, lon, alt = fleet.origin
    fence = fleet.geometries.get(fleet.fence)
    return FleetModel.of(
        fleet,
        origin=OriginModel(lat=lat, lon=lon, alt=alt),
        vehicles=list(fleet.vehicles.values()),
        payloads=[
            PayloadModel.of(each, video=fleet.videos.get(each.id))
            for each in fleet.payloads.values()
        ],
        teams=list(fleet.teams.values()),
        fence=as_geojson(fence)["geometry"] if isinstance(fence, Area) else None,
    )


def behaviors_of(
    fleet: Fleet, catalogue: Mapping[ResourceId, Sequence[BehaviorSpec]]
) -> list[BehaviorModel]:
    """Return every behavior with what can do it; a team can do what all its members can."""
    found: dict[str, tuple[BehaviorSpec, list[str], list[str]]] = {}
    # Large fleets have few objects, many times: to write each one each time takes a second.
    written: dict[int, str] = {}

    def key_of(spec: BehaviorSpec) -> str:
        key = written.get(id(spec))
        if key is None:
            key = written[id(spec)] = repr(spec)
        return key

    for resource, specs in catalogue.items():
        for spec in specs:
            entry = found.setdefault(key_of(spec), (spec, [], []))
            if spec.type is not BehaviorType.TEAM:
                entry[1].append(resource)
    for team in fleet.teams.values():
        members = dict.fromkeys((team.lead, *team.members))
        offered = [_team_behaviors(catalogue.get(each, ())) for each in members]
        for name, spec in offered[0].items():
            if all(name in each for each in offered):
                found[key_of(spec)][2].append(team.name)
    listed = [entry for entry in found.values() if entry[1] or entry[2]]
    listed.sort(key=lambda entry: (entry[0].type, entry[0].name))
    return [_behavior(*entry) for entry in listed]


def _team_behaviors(specs: Iterable[BehaviorSpec]) -> dict[str, BehaviorSpec]:
    return {each.name: each for each in specs if each.type is BehaviorType.TEAM}


def _behavior(spec: BehaviorSpec, resources: list[str], teams: list[str]) -> BehaviorModel:
    parameters = [
        ParameterModel.of(each, unit=_UNITS.get(each.kind, "")) for each in spec.parameters
    ]
    return BehaviorModel.of(spec, parameters=parameters, resources=resources, teams=teams)
