"""Loads a fleet file: YAML 1.2, its shape, the names in it, and the geometries that it names."""

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from pydantic import ValidationError

from m2pem.errors import FleetError
from m2pem.findings import Finding, Severity
from m2pem.fleet.approval import person_of
from m2pem.fleet.fleet import (
    Conformance,
    Domain,
    Fleet,
    LostMemberPolicy,
    OnConflict,
    Payload,
    SharedSpace,
    Team,
    Unanswered,
    Vehicle,
    Video,
    VideoKind,
)
from m2pem.fleet.fleet_schema import (
    BOUNDS,
    AllocationModel,
    ConformanceModel,
    DeconflictionModel,
    FleetModel,
    HandOverModel,
    HostModel,
    ScheduleModel,
    VehicleModel,
    VideoModel,
)
from m2pem.fleet.hosts import CutOffPolicy, Host, WhenCutOff, endpoint_problem
from m2pem.fleet.yaml_source import YamlSource, note_shape_findings, read_yaml
from m2pem.geo.files import GeometryError, read_geometry
from m2pem.geo.geometry_files import FileProblem
from m2pem.geo.local_frame import Origin
from m2pem.geo.positions import NO_ORIGIN, geometry_out_of_reach, positions
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.elements import ErrorPolicy
from m2pem.mission.geometry import Geometry
from m2pem.suggestions import suggest

_ADDRESS = re.compile(r"https?://[A-Za-z0-9.:\[\]-]+([/?][!-~]*)?")

_GEOMETRY_KINDS = {"routes": "route", "areas": "area", "points": "point"}


def load_fleet(path: str | Path) -> Fleet:
    """Read a fleet file and the geometry files that it names.

    Relative paths in it are relative to the file. Durations come out in seconds, distances in
    metres, positions as WGS-84 degrees.

    Raises:
        FleetError: with every finding, each with its line and the dotted path of the key.
    """
    path = Path(path)
    source = read_yaml(path)
    model: FleetModel | None = None
    geometries: dict[str, Geometry] = {}
    warnings: list[Finding] = []
    if source.data is None and not source.findings:
        source.error((), "empty", "is empty", "a fleet begins with 'version: 1'")
    elif source.data is not None:
        try:
            model = FleetModel.model_validate(source.data)
        except ValidationError as error:
            note_shape_findings(source, error, FleetModel)
        _check_names(source)
        _check_teams(source)
        _check_hosts(source)
        _check_videos(source)
        _check_roles(source)
        geometries = _read_geometries(source, path.parent, warnings)
        _check_fence(source)
        _check_shared_space(source)
        if model is not None:
            _check_distances(source, model, geometries)
    if source.findings or model is None:
        findings = sorted(source.findings, key=lambda finding: finding.line)
        raise FleetError(f"{path} cannot be used as a fleet", findings)
    return replace(_build(source, model, geometries), warnings=tuple(warnings))


# The checks look at the file's values as they were read, not at the models, so that a mistake in
# one corner does not hide the ones in another.


def _check_names(source: YamlSource) -> None:
    _check_one_space(source, ("vehicles", "teams"))
    _check_one_space(source, ("routes", "areas", "points"))
    # A position is the name of a point or of a vehicle.
    for name in source.mapping("points").keys() & source.mapping("vehicles").keys():
        _note_taken(source, "points", name, ("vehicles", name))


def _check_one_space(source: YamlSource, sections: tuple[str, ...]) -> None:
    owners: dict[str, str] = {}
    for section in sections:
        for name in source.mapping(section):
            if name in owners:
                _note_taken(source, section, name, (owners[name], name))
            owners.setdefault(name, section)


def _note_taken(source: YamlSource, section: str, name: str, first: tuple[str, str]) -> None:
    message = f"the name '{name}' is taken by {first[0]} (line {source.line(first)})"
    source.error((section, name), "duplicate-name", message, "choose another name")


def _check_teams(source: YamlSource) -> None:
    vehicles = source.mapping("vehicles")
    for name in source.mapping("teams"):
        team = source.mapping("teams", name)
        members = team.get("members")
        members = members if isinstance(members, list) else []
        for index, member in enumerate(members):
            path = ("teams", name, "members", index)
            if not isinstance(member, str):
                continue
            if member not in vehicles:
                hint = suggest(member, vehicles, "vehicles")
                source.error(path, "unknown-vehicle", f"no vehicle is named '{member}'", hint)
            elif member in members[:index]:
                source.error(path, "duplicate-member", f"'{member}' is a member already")
        lead = team.get("lead")
        if isinstance(lead, str) and lead not in members:
            hint = suggest(lead, [m for m in members if isinstance(m, str)], "members")
            message = f"the lead '{lead}' is not one of the members"
            source.error(("teams", name, "lead"), "lead-not-member", message, hint)


def _check_hosts(source: YamlSource) -> None:
    hosts = source.mapping("hosts")
    for name, value in source.mapping("vehicles").items():
        vehicle = value if isinstance(value, dict) else {}
        host = vehicle.get("host")
        if isinstance(host, str) and host not in hosts:
            hint = suggest(host, hosts, "hosts")
            path = ("vehicles", name, "host")
            source.error(path, "unknown-host", f"no host is named '{host}'", hint)
        elif "when_cut_off" in vehicle and host is None:
            message = "the vehicle's arbiter runs in the executive, which it cannot be cut off from"
            path = ("vehicles", name, "when_cut_off")
            source.error(path, "no-host", message, "add 'host', or leave 'when_cut_off' out")
    for name in hosts:
        _check_host(source, name)


def _check_host(source: YamlSource, name: str) -> None:
    host, tls = source.mapping("hosts", name), source.mapping("hosts", name, "tls")
    if bool(host.get("connect")) == bool(host.get("listen")):
        message = "say where the executive connects to, or else where it listens"
        remedy = "write 'connect: [tls/ADDRESS:PORT]', or 'listen' in place of it"
        source.error(("hosts", name), "host-endpoints", message, remedy)
    if bool(tls.get("certificate")) != bool(tls.get("key")):
        message = "a certificate and its key belong together"
        source.error(("hosts", name, "tls"), "host-tls", message, "write both or none")
    authenticated = bool(tls.get("certificate") and tls.get("key"))
    for key in ("connect", "listen"):
        endpoints = host.get(key)
        for index, each in enumerate(endpoints if isinstance(endpoints, list) else ()):
            if not isinstance(each, str) or not each:
                continue
            message, remedy = endpoint_problem(each, authenticated=authenticated)
            path = ("hosts", name, key, index)
            if message:
                source.error(path, "host-endpoint", message, remedy)
            elif each.startswith("tls/") and not tls:
                remedy = "add 'tls: {ca: ..., certificate: ..., key: ...}'"
                source.error(path, "host-tls", "the files of TLS are not named", remedy)


def _check_roles(source: YamlSource) -> None:
    operators = source.mapping("operators")
    for path, role in (
        (("incident_role",), source.mapping().get("incident_role")),
        (("approval", "role"), source.mapping("approval").get("role")),
        (("hand_over", "supervisor"), source.mapping("hand_over").get("supervisor")),
    ):
        if isinstance(role, str) and operators and role not in operators:
            hint = suggest(role, operators, "roles")
            message = f"'operators' names no operator with the role '{role}'"
            source.error(path, "no-operator", message, hint)
    asked, role = (source.mapping("approval").get(each) for each in ("persons", "role"))
    listed = operators.values() if role is None else [operators.get(role)]
    names = [name for each in listed if isinstance(each, list) for name in each]
    persons = {person_of(name) for name in names if isinstance(name, str)}
    if isinstance(asked, int) and 0 < len(persons) < asked:
        message = (
            f"{asked} persons must approve, and 'operators' names {', '.join(map(str, names))}"
        )
        same = ", some of whom are the same person" if len(persons) < len(names) else ""
        remedy = f"name {asked - len(persons)} more, or ask for fewer"
        source.error(("approval", "persons"), "approval-persons", f"{message}{same}", remedy)


def _check_videos(source: YamlSource) -> None:
    for vehicle in source.mapping("vehicles"):
        for payload in source.mapping("vehicles", vehicle, "payloads"):
            path = ("vehicles", vehicle, "payloads", payload, "video")
            video = source.mapping(*path)
            url = video.get("url")
            if isinstance(url, str) and url and (wrong := _address_problem(url)):
                source.error((*path, "url"), "video-url", *wrong)
            if "every" in video and video.get("kind") != VideoKind.IMAGE:
                message = "only pictures of kind 'image' are fetched one at a time"
                source.error((*path, "every"), "video-every", message, "leave 'every' out")


def _address_problem(url: str) -> tuple[str, str] | None:
    """What is wrong with the address of a video, and what would be right."""
    remedy = "write http://HOST:PORT/PATH"
    try:
        parts = urlsplit(url)
        fits = bool(parts.hostname) and parts.port != 0
    except ValueError:
        return f"{url!r} is not an address", remedy
    if parts.username is not None or parts.password is not None:
        message = "an address in a fleet has no user and no password: every page would show them"
        return message, "let a media server on the vehicle's network sign in to the camera"
    if not fits or not _ADDRESS.fullmatch(url):
        return f"{url!r} is not an address of http or https", remedy
    return None


def _check_fence(source: YamlSource) -> None:
    fence = source.mapping().get("fence")
    if isinstance(fence, str) and fence not in source.mapping("areas"):
        hint = suggest(fence, source.mapping("areas"), "areas")
        source.error(("fence",), "unknown-area", f"no area is named '{fence}'", hint)


def _check_shared_space(source: YamlSource) -> None:
    """Each names an area, or a route with the width of its corridor."""
    areas, routes = source.mapping("areas"), source.mapping("routes")
    for name, value in source.mapping("shared_space").items():
        path = ("shared_space", name)
        width = value.get("width") if isinstance(value, dict) else None
        if name in areas:
            if width is not None:
                message = f"'{name}' is an area, which has no width"
                source.error((*path, "width"), "corridor", message, "leave 'width' out")
        elif name in routes:
            if width is None:
                message = f"'{name}' is a route, and the width of its corridor is not said"
                remedy = f"write {name}: {{capacity: 1, width: 5 m}}"
                source.error(path, "corridor", message, remedy)
        else:
            known = [*areas, *routes]
            hint = suggest(name, known, "areas and routes")
            source.error(path, "unknown-area", f"no area or route is named '{name}'", hint)


def _check_distances(
    source: YamlSource, model: FleetModel, geometries: dict[str, Geometry]
) -> None:
    origin = _origin(model, geometries)
    for section in _GEOMETRY_KINDS:
        for name in source.mapping(section):
            geometry = geometries.get(name)
            if geometry and (wrong := geometry_out_of_reach(geometry, origin)):
                file = source.mapping(section)[name]
                source.error((section, name), "out-of-reach", f"{file}: {wrong[0]}", wrong[1])


def _read_geometries(
    source: YamlSource, folder: Path, warnings: list[Finding]
) -> dict[str, Geometry]:
    geometries: dict[str, Geometry] = {}
    for section, kind in _GEOMETRY_KINDS.items():
        for name, file in source.mapping(section).items():
            if not isinstance(file, str) or not file:
                continue
            problems: list[FileProblem] = []
            try:
                geometries[name] = read_geometry(folder / file, kind, problems.append)
            except GeometryError as error:
                source.error((section, name), "geometry", str(error))
            warnings += [
                Finding(
                    Severity.WARNING,
                    source.file,
                    source.line((section, name)),
                    f"{section}.{name}",
                    "geometry",
                    f"{file}: {each.feature}: {each.message}".replace(": :", ":"),
                    each.remedy,
                )
                for each in problems
            ]
    return geometries


def _build(source: YamlSource, model: FleetModel, geometries: dict[str, Geometry]) -> Fleet:
    vehicles: dict[ResourceId, Vehicle] = {}
    payloads: dict[ResourceId, Payload] = {}
    for name, vehicle in model.vehicles.items():
        own = list(_payloads(source, name, vehicle))
        payloads.update((payload.id, payload) for payload in own)
        vehicles[ResourceId(name)] = Vehicle(
            id=ResourceId(name),
            domain=Domain(vehicle.domain),
            arbiter=vehicle.arbiter,
            settings=dict(vehicle.connection),
            behaviors=_names(vehicle.behaviors),
            payloads=tuple(payload.id for payload in own),
            manned=vehicle.manned,
            sitl=vehicle.sitl,
            lost_after_s=vehicle.lost_after,
            failsafe=vehicle.failsafe or "",
            cruise_speed_m_s=vehicle.cruise_speed,
            endurance_s=vehicle.endurance,
            tags=tuple(vehicle.tags),
            host=vehicle.host or "",
            when_cut_off=_cut_off(vehicle),
            conformance=None if vehicle.conformance is None else _conformance(vehicle.conformance),
            line=source.line(("vehicles", name)),
        )
    teams = {
        name: Team(
            name=name,
            members=tuple(ResourceId(member) for member in team.members),
            lead=ResourceId(team.lead or team.members[0]),
            on_lost_member=LostMemberPolicy(team.on_lost_member),
            line=source.line(("teams", name)),
        )
        for name, team in model.teams.items()
    }
    apart = model.deconfliction
    said = apart or DeconflictionModel()
    handing_over = model.hand_over or HandOverModel()
    costs = model.allocation or AllocationModel()
    later = model.schedule or ScheduleModel()
    return Fleet(
        name=model.name or Path(source.file).stem,
        file=source.file,
        vehicles=vehicles,
        payloads=payloads,
        teams=teams,
        geometries=geometries,
        origin=_origin(model, geometries),
        max_outage_s=model.max_outage,
        steps_between_waits=model.steps_between_waits,
        fence=model.fence or "",
        vertical_separation_m=apart.vertical if apart else None,
        horizontal_separation_m=said.horizontal,
        time_separation_s=said.time,
        surface_separation_m=_surface_separation(said),
        on_conflict=OnConflict(said.on_conflict),
        conflict_wait_s=said.wait,
        shared_space=_shared_space(source, model, closed=False),
        closed_space=_shared_space(source, model, closed=True),
        handed_over=tuple(model.handed_over),
        battery_cost_s=costs.battery,
        switching_cost_s=costs.switching,
        on_error=ErrorPolicy(model.on_error),
        debugging=model.debugging,
        conformance=_conformance(model.conformance or ConformanceModel()),
        unattended=later.unattended,
        start_warning_s=later.warning,
        preemption=costs.preemption,
        incident_role=model.incident_role or "",
        operators={role: tuple(names) for role, names in model.operators.items()},
        approval_persons=model.approval.persons if model.approval else 0,
        approval_role=(model.approval.role if model.approval else None) or "",
        control_answer_s=handing_over.answer_within,
        control_unanswered=Unanswered(handing_over.unanswered),
        control_gone_after_s=handing_over.gone_after,
        supervisor_role=handing_over.supervisor or "",
        terrain_folder=_beside(source, model.terrain.folder) if model.terrain else "",
        clearance_m=model.terrain.clearance if model.terrain else None,
        hosts={name: _host(source, name, each) for name, each in model.hosts.items()},
        faces={name: settings or {} for name, settings in model.faces.items()},
        videos={
            ResourceId(f"{vehicle}/{name}"): _video(payload.video)
            for vehicle, each in model.vehicles.items()
            for name, payload in each.payloads.items()
            if payload.video is not None
        },
    )


def _video(model: VideoModel) -> Video:
    kind = VideoKind(model.kind)
    return Video(model.url, kind) if model.every is None else Video(model.url, kind, model.every)


def _conformance(model: ConformanceModel) -> Conformance:
    said = model.model_dump(exclude_none=True)
    return Conformance(
        {bound: said[key] for key, bound in BOUNDS.items() if key in said}, model.watch
    )


def _cut_off(vehicle: VehicleModel) -> CutOffPolicy:
    said = vehicle.when_cut_off
    if said is None:
        return CutOffPolicy()
    behaviors = {name: WhenCutOff(action) for name, action in said.behaviors.items()}
    return CutOffPolicy(WhenCutOff(said.action), said.after, behaviors)


def _beside(source: YamlSource, file: str) -> str:
    """Return a path that is relative to the fleet file."""
    return str(Path(source.file).parent / Path(file).expanduser())


def _host(source: YamlSource, name: str, model: HostModel) -> Host:
    def beside(file: str | None) -> str:
        return _beside(source, file) if file else ""

    tls = model.tls
    return Host(
        name,
        tuple(model.connect),
        tuple(model.listen),
        model.telemetry_hz,
        model.round_trip,
        beside(tls.ca) if tls else "",
        beside(tls.certificate) if tls else "",
        beside(tls.key) if tls else "",
        beside(model.credentials),
        source.line(("hosts", name)),
    )


def _surface_separation(model: DeconflictionModel) -> dict[Domain, float]:
    """The distances of the domains other than air."""
    said = {
        Domain.GROUND: model.ground,
        Domain.SURFACE: model.surface,
        Domain.SUBSURFACE: model.subsurface,
    }
    return {domain: each.horizontal for domain, each in said.items() if each is not None}


def _shared_space(source: YamlSource, model: FleetModel, *, closed: bool) -> dict[str, SharedSpace]:
    return {
        name: SharedSpace(
            name,
            each.capacity,
            tuple(map(Domain, each.domains)),
            each.width,
            OnConflict(each.on_conflict),
            each.wait,
            source.line(("shared_space", name)),
        )
        for name, each in model.shared_space.items()
        if closed is (each.capacity == 0)
    }


def _payloads(source: YamlSource, vehicle: str, model: VehicleModel) -> Iterator[Payload]:
    for name, payload in model.payloads.items():
        settings: dict[str, Any] = {**model.connection, **payload.connection}
        yield Payload(
            id=ResourceId(f"{vehicle}/{name}"),
            vehicle=ResourceId(vehicle),
            arbiter=payload.arbiter or model.arbiter,
            settings=settings,
            behaviors=_names(payload.behaviors),
            detector=payload.detector,
            tags=tuple(payload.tags),
            line=source.line(("vehicles", vehicle, "payloads", name)),
        )


def _names(names: list[str] | None) -> tuple[str, ...] | None:
    return None if names is None else tuple(names)


def _origin(model: FleetModel, geometries: dict[str, Geometry]) -> Origin:
    if model.origin is not None:
        return (model.origin.lat, model.origin.lon, model.origin.alt)
    for geometry in geometries.values():
        return (*next(positions(geometry))[:2], 0.0)
    return NO_ORIGIN
