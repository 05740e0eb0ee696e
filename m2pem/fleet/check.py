"""The static check: whether a mission fits a fleet, before anything moves (paper, section 4.2)."""

from collections.abc import Collection, Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from m2pem.findings import Finding, Severity, has_errors
from m2pem.fleet.allocation import resources_of
from m2pem.fleet.behaviors import SHARED
from m2pem.fleet.fleet import SIMULATED, Fleet
from m2pem.fleet.graph import Catalogue, ResourceGraph
from m2pem.fleet.need_check import KnownFits, check_needs, places_of
from m2pem.fleet.operator_roles import check_operator_roles
from m2pem.fleet.parameters import ParameterProblem, examine_behavior
from m2pem.fleet.same_vehicle import check_same_vehicle
from m2pem.fleet.shortage import Demand, check_shortages
from m2pem.fleet.space_check import check_space
from m2pem.fleet.speed_check import check_speeds
from m2pem.fleet.takeoff_check import check_takeoffs
from m2pem.fleet.task_findings import TaskFindings
from m2pem.geo.positions import NO_ORIGIN, geometry_out_of_reach
from m2pem.mission.behavior import Behavior, BehaviorType, Role, RoleKind, ServiceCall
from m2pem.mission.catalogue import BehaviorSpec, ParameterKind, ResourceId
from m2pem.mission.elements import Activity, ScriptTask, SendTask, ServiceTask
from m2pem.mission.mission import Mission
from m2pem.suggestions import did_you_mean, suggest
from m2pem.units import Dimension, UnitError, article, quantity

if TYPE_CHECKING:
    from m2pem.fleet.terrain_check import GroundCheck

_ROUTE = ("single_vehicle_routing",)

TEAM_NEEDS: Mapping[str, tuple[tuple[str, ...], ...]] = {
    "formation": (_ROUTE,),
    "road_following_formation": (_ROUTE,),
    "road_sweep": (_ROUTE,),
    "bridge_crossing": (_ROUTE,),
    "area_survey": ((*_ROUTE, "area_survey"),),
    "area_observe": (_ROUTE,),
    "escort": (_ROUTE, ("follow",)),
}
"""By the team behavior's name: the vehicle behaviors of which each member must have one each."""


def lacking(team_behavior: str, offered: Collection[str]) -> tuple[str, ...]:
    """What a vehicle with these behaviors lacks to be a member.

    Nothing for a behavior that cannot be made of others: then there is nothing to be said.
    """
    needs = TEAM_NEEDS.get(team_behavior, ())
    return tuple(" or ".join(each) for each in needs if not any(name in offered for name in each))


def place(fleet: Fleet, resource: str) -> str:
    """A vehicle, payload or team with its line: `evsg1 (fleet.yaml:7)`."""
    entry = (
        fleet.vehicles.get(ResourceId(resource))
        or fleet.payloads.get(ResourceId(resource))
        or fleet.teams.get(resource)
    )
    line = f":{entry.line}" if entry and entry.line else ""
    return f"{resource} ({fleet.file}{line})"


def check_roles(roles: Sequence[Role], fleet: Fleet, findings: TaskFindings) -> tuple[Role, ...]:
    """The roles that the fleet fills. What is wrong with the others goes to `findings`.

    An optional role that the fleet lacks is left out; a warning says so if it looks mistyped.
    """
    names: set[str] = set()
    owners: dict[ResourceId, str] = {}
    filled: list[Role] = []
    for role in roles:
        if role.name in names:
            message = "stands twice in one task"
            findings.add("duplicate-role", message, "rename one", line=role.line, role=role.name)
        names.add(role.name)
        if not _check_role(role, fleet, findings):
            continue
        filled.append(role)
        for resource in resources_of(role, fleet):
            if resource in owners:
                message = f"{resource} fills role '{owners[resource]}' already"
                remedy = "give every role a resource of its own"
                findings.add("resource-twice", message, remedy, line=role.line, role=role.name)
            owners.setdefault(resource, role.name)
    return tuple(filled)


def _check_role(role: Role, fleet: Fleet, findings: TaskFindings) -> bool:
    if resources_of(role, fleet):
        return True
    kinds = [
        RoleKind.VEHICLE if role.resource in fleet.vehicles else None,
        RoleKind.PAYLOAD if role.resource in fleet.payloads else None,
        RoleKind.TEAM if role.resource in fleet.teams else None,
    ]
    kind = next((kind for kind in kinds if kind), None)
    if kind:
        message = f"{place(fleet, role.resource)} is a {kind.value}, not a {role.kind.value}"
        remedy = f'write {kind.value}="{role.resource}"'
        findings.add("wrong-kind", message, remedy, line=role.line, role=role.name)
    elif not role.optional:
        message, remedy = _unknown(role, fleet)
        findings.add(f"unknown-{role.kind}", message, remedy, line=role.line, role=role.name)
    elif meant := _meant(role, fleet):
        findings.add(
            "optional-role",
            f"{fleet.file} has no {role.kind.value} '{role.resource}', and the role is optional: "
            "the task is done without it",
            meant,
            line=role.line,
            role=role.name,
            severity=Severity.WARNING,
        )
    return False


def _meant(role: Role, fleet: Fleet) -> str:
    """What a mistyped optional role may have meant, as a remedy; "" when the fleet lacks it indeed.

    Names that differ only in their digits are not taken for typing errors: a fleet may have a
    `uav1` and no `uav2`.
    """
    vehicle, _, name = role.resource.rpartition("/")
    holder = fleet.vehicles.get(ResourceId(vehicle))
    known: list[str] = []
    if role.kind is RoleKind.TEAM:
        known, name = list(fleet.teams), role.resource
    elif role.kind is RoleKind.VEHICLE or holder is None:
        known = [str(each) for each in fleet.vehicles]
        name = role.resource if role.kind is RoleKind.VEHICLE else vehicle
    else:
        known = [each.rpartition("/")[2] for each in holder.payloads]
    digits = str.maketrans("", "", "0123456789")
    plain = name.translate(digits)
    return did_you_mean(name, [each for each in known if each.translate(digits) != plain])


def _unknown(role: Role, fleet: Fleet) -> tuple[str, str]:
    if role.kind is not RoleKind.PAYLOAD:
        known = fleet.teams if role.kind is RoleKind.TEAM else fleet.vehicles
        message = f"{fleet.file} has no {role.kind.value} '{role.resource}'"
        return message, suggest(role.resource, known, f"{role.kind.value}s")
    vehicle, slash, payload = role.resource.rpartition("/")
    elsewhere = [other for other in fleet.payloads if other.endswith(f"/{payload}")]
    exists = " and ".join(place(fleet, other) for other in elsewhere[:3])
    remedy = f"{exists} exist{'s' if len(elsewhere) == 1 else ''}" if exists else ""
    if not slash:
        message = f"'{role.resource}' is no payload of {fleet.file}"
        return message, remedy or "a payload is named vehicle/payload"
    if vehicle not in fleet.vehicles:
        hint = did_you_mean(vehicle, fleet.vehicles)
        message = f"{fleet.file} has no vehicle '{vehicle}' and so no payload '{role.resource}'"
        return message, remedy or hint
    own = [other.rpartition("/")[2] for other in fleet.vehicles[ResourceId(vehicle)].payloads]
    message = f"{place(fleet, vehicle)} has no payload '{payload}'"
    return message, remedy or suggest(payload, own, "payloads of it")


DETECTOR_SERVICE = "Detector"

FAST = 5
"""A speed of more than so many times that at which the vehicle cruises is a finding."""


def check_mission(
    mission: Mission, fleet: Fleet, catalogue: Catalogue, handed_over: Container[str] = ()
) -> list[Finding]:
    """Everything about a mission's roles, behaviors and parameters that does not fit the fleet.

    `catalogue` is what the arbiter of a resource offers. Findings come in the order of the mission.
    `handed_over`: names of geometries that operators have handed over already. Another one that the
    fleet lacks is a warning if the fleet says that operators hand it over, else an error.
    """
    graph = ResourceGraph(fleet, catalogue)
    check = _Check(mission, fleet, graph, catalogue, handed_over)
    findings = [finding for task in mission.activities() for finding in check.task(task)]
    shortages = check_shortages(mission, check.demands)
    shortages += check_same_vehicle(mission, check.demands)
    shortages += check_takeoffs(mission, check.commanded, fleet, catalogue)
    roles = check_operator_roles(mission, fleet)
    drawn = [*_out_of_reach(mission, fleet), *_of_files(mission, fleet)]
    return [*findings, *shortages, *_returned(mission, fleet), *roles, *drawn]


def _out_of_reach(mission: Mission, fleet: Fleet) -> Iterator[Finding]:
    """Geometries of the mission's own that are too far from the fleet's origin."""
    for name, geometry in mission.geometries.items():
        if fleet.origin != NO_ORIGIN and (wrong := geometry_out_of_reach(geometry, fleet.origin)):
            message = f"geometry '{name}': {wrong[0]}"
            yield Finding(Severity.ERROR, mission.file, 0, "", "out-of-reach", message, wrong[1])


def _of_files(mission: Mission, fleet: Fleet) -> Iterator[Finding]:
    """What is doubtful of the files of the geometries that the mission names."""
    named = {
        each.value
        for _, behavior in mission.commands()
        for each in behavior.parameters
        if isinstance(each.value, str) and each.value not in mission.geometries
    }
    for warning in fleet.warnings:
        if warning.element.partition(".")[2] in named:
            yield warning


def _returned(mission: Mission, fleet: Fleet) -> Iterator[Finding]:
    """Signals that are thrown when a resource is given back: the fleet must have it."""
    known = [*fleet.vehicles, *fleet.payloads]
    for signal in mission.signals.values():
        if signal.returned and signal.returned not in known:
            yield Finding(
                Severity.ERROR,
                mission.file_of(signal),
                signal.line,
                signal.id,
                "unknown-resource",
                f"m2pem:returned='{signal.returned}': {fleet.file} has no such vehicle or payload",
                did_you_mean(signal.returned, known),
            )


def _member_lacks(name: str, offered: Sequence[BehaviorSpec], allowed: Sequence[str] | None) -> str:
    """What keeps a vehicle out of a team behavior that is made of behaviors of each member."""
    alone = [spec.name for spec in offered if spec.type is BehaviorType.VEHICLE]
    if needed := lacking(name, alone):
        return f"a member needs {' and '.join(needed)}, which it does not offer either"
    if needed := lacking(name, alone if allowed is None else allowed):
        return f"a member needs {' and '.join(needed)}, which the fleet does not let it do"
    return ""


def check_named(mission: Mission) -> list[Finding]:
    """Behaviors that name nothing to perform them: wrong whatever the fleet."""
    found: list[Finding] = []
    for task, behavior in mission.commands():
        findings = TaskFindings(mission.file_of(task), task)
        _check_named(behavior, findings)
        found += findings.found
    return found


def _check_named(behavior: Behavior, findings: TaskFindings) -> bool:
    """Whether a role names what the behavior's type wants; all vehicles hold without one."""
    wanted = behavior.type.value
    if any(role.kind.value == wanted for role in behavior.roles):
        return True
    if not behavior.roles and behavior.name == "hold" and wanted == BehaviorType.VEHICLE.value:
        return True
    message = f"the {wanted} behavior {behavior.name} has no role"
    if behavior.roles:
        message += f" with a {wanted}"
    findings.add("no-role", message, f"name a {wanted} for it", line=behavior.line)
    return False


@dataclass(frozen=True, slots=True)
class _Taker:
    """How a behavior takes its parameters, and on whose account: the first that takes them so."""

    spec: BehaviorSpec
    role: str
    place: str = ""


@dataclass(frozen=True, slots=True)
class _Check:
    mission: Mission
    fleet: Fleet
    graph: ResourceGraph
    catalogue: Catalogue
    handed_over: Container[str]
    demands: dict[Activity, Demand] = field(default_factory=dict)
    """What tasks need whose roles can be filled."""
    commanded: dict[Activity, tuple[Behavior, Collection[ResourceId]]] = field(default_factory=dict)
    """What tasks command that are right, and all vehicles that may fill the roles."""
    known: KnownFits = field(default_factory=dict)
    grounds: "list[GroundCheck]" = field(default_factory=list)

    def __post_init__(self) -> None:
        if self.fleet.clearance_m is not None:
            from m2pem.fleet.terrain_check import GroundCheck  # noqa: PLC0415  # loads NumPy

            self.grounds.append(GroundCheck(self.fleet))

    def task(self, task: Activity) -> list[Finding]:
        findings = TaskFindings(self.mission.file_of(task), task)
        if isinstance(task, ScriptTask | ServiceTask | SendTask) and task.behavior:
            possible = self._behavior(task.behavior, findings)
            if not has_errors(findings.found):
                places = places_of(task.behavior, self.fleet, possible)
                self.demands[task] = Demand.of(task.behavior, places)
                able = (each for _, resources in places for each in resources)
                vehicles = {each: None for each in able if each in self.fleet.vehicles}
                self.commanded[task] = task.behavior, vehicles
        elif isinstance(task, ServiceTask) and task.call:
            self._service(task.call, findings)
        return findings.found

    def _behavior(
        self, behavior: Behavior, findings: TaskFindings
    ) -> dict[str, tuple[ResourceId, ...]]:
        """Check a behavior, and return what may fill its roles by need."""
        named = [role for role in behavior.roles if role.resource]
        filled = check_roles(named, self.fleet, findings)
        matching = [role for role in filled if role.kind.value == behavior.type.value]
        possible = check_needs(behavior, self.mission, self.fleet, self.graph, findings, self.known)
        check_space(behavior, self.fleet, self.mission.geometries, findings)
        if len(named) == len(behavior.roles):
            self._check_role_kinds(behavior, filled, findings)
        takers: list[_Taker] = []
        by_need = [(name, each) for name, found in possible.items() for each in found]
        by_name = [(role, each) for role in matching for each in resources_of(role, self.fleet)]
        acting = [*by_need, *((role.name, each) for role, each in by_name)]
        for role_name, resource in acting:
            spec = self.graph.spec(resource, behavior.name, behavior.type)
            if spec is not None and all(spec != taker.spec for taker in takers):
                takers.append(_Taker(spec, role_name, f"{place(self.fleet, resource)}: "))
        for role, resource in by_name:
            self._check_manned(role, resource, findings)
            if self.graph.spec(resource, behavior.name, behavior.type) is None:
                message, remedy, rule = self._not_offered(behavior, resource)
                findings.add(rule, message, remedy, line=behavior.line, role=role.name)
        shared = SHARED.get((behavior.name, behavior.type))
        if not takers and shared:
            takers = [_Taker(shared, behavior.roles[0].name if behavior.roles else "")]
        if not takers and not behavior.roles:
            findings.add(
                "unknown-behavior",
                f"there is no {behavior.type} behavior '{behavior.name}'",
                self._near_behavior(behavior, SHARED.values()),
                line=behavior.line,
            )
        for taker in takers:
            self._check_parameters(behavior, taker, [each for _, each in acting], findings)
        for role, resource in by_name:
            self._check_speed(behavior, role, resource, findings)
        return possible

    def _check_role_kinds(
        self, behavior: Behavior, filled: Sequence[Role], findings: TaskFindings
    ) -> None:
        wanted = behavior.type.value
        what = f"the {wanted} behavior {behavior.name}"
        if not _check_named(behavior, findings) or not behavior.roles:
            return
        if not any(role.kind.value == wanted for role in filled) and all(
            role.optional for role in behavior.roles if role.kind.value == wanted
        ):
            message = f"{self.fleet.file} fills none of the optional roles of {what}"
            findings.add("no-role", message, "at least one is needed", line=behavior.line)
        for role in filled:
            if role.kind.value != wanted and role.kind is not RoleKind.PAYLOAD:
                findings.add(
                    "idle-role",
                    f"{role.resource} is held while {what} runs, but takes no part in it",
                    line=role.line,
                    role=role.name,
                    severity=Severity.WARNING,
                )

    def _check_manned(self, role: Role, resource: ResourceId, findings: TaskFindings) -> None:
        vehicle = self.fleet.vehicles.get(resource)
        if vehicle and vehicle.manned:
            message = f"{place(self.fleet, resource)} is manned and cannot be commanded"
            remedy = "a target may be manned, a role may not"
            findings.add("manned", message, remedy, line=role.line, role=role.name)

    def _check_speed(
        self, behavior: Behavior, role: Role, resource: ResourceId, findings: TaskFindings
    ) -> None:
        """A speed far beyond that at which a vehicle cruises is likely in another unit."""
        vehicle = self.fleet.vehicles.get(resource)
        spec = self.graph.spec(resource, behavior.name, behavior.type)
        if vehicle is None or vehicle.cruise_speed_m_s is None or spec is None:
            return
        speeds = {each.name for each in spec.parameters if each.kind is ParameterKind.SPEED}
        for parameter in behavior.parameters:
            if parameter.name not in speeds or not isinstance(parameter.value, str):
                continue
            try:
                speed = quantity(parameter.value, Dimension.SPEED)
            except UnitError:
                continue  # a finding of its own
            if speed > FAST * vehicle.cruise_speed_m_s:
                findings.add(
                    "fast",
                    f"parameter '{parameter.name}': {speed:g} m/s is more than {FAST} times the "
                    f"{vehicle.cruise_speed_m_s:g} m/s at which {place(self.fleet, resource)} "
                    "cruises",
                    "is the unit right?",
                    line=parameter.line,
                    role=role.name,
                    severity=Severity.WARNING,
                )

    def _not_offered(self, behavior: Behavior, resource: ResourceId) -> tuple[str, str, str]:
        """Message, remedy and rule for a behavior that a resource does not take."""
        offered = self.catalogue(resource)
        holder = self.fleet.vehicles.get(resource) or self.fleet.payloads[resource]
        name, wanted = behavior.name, behavior.type
        if any(spec.name == name and spec.type is wanted for spec in offered):
            allowed = ", ".join(holder.behaviors or ()) or "none"
            message = f"the fleet does not let {place(self.fleet, resource)} do '{name}'"
            return message, f"it allows: {allowed}", "behavior-not-allowed"
        types = {s.type for s in (*offered, *SHARED.values()) if s.name == name} - {wanted}
        if types:
            other = sorted(types)[0]
            message = f"'{name}' is {article(f'{other} behavior')}, not {article(wanted)} behavior"
            return message, f'set type="{other}" and name a {other}', "wrong-type"
        simulated = holder.arbiter == SIMULATED
        arbiter = "the simulated arbiter" if simulated else f"arbiter '{holder.arbiter}'"
        message = f"{arbiter} of {place(self.fleet, resource)} offers no {wanted} behavior '{name}'"
        if wanted is BehaviorType.TEAM and (
            remedy := _member_lacks(name, offered, holder.behaviors)
        ):
            return message, remedy, "unknown-behavior"
        return message, self._near_behavior(behavior, offered), "unknown-behavior"

    def _near_behavior(self, behavior: Behavior, offered: Iterable[BehaviorSpec]) -> str:
        names = [spec.name for spec in offered if spec.type is behavior.type]
        hint = did_you_mean(behavior.name, names)
        others = self.graph.offering(behavior.name, behavior.type)
        if others and not hint:
            return f"it is offered on {', '.join(others[:3])}"
        return hint or f"it offers: {', '.join(sorted(names)) or 'nothing'}"

    def _check_parameters(
        self,
        behavior: Behavior,
        taker: _Taker,
        acting: Iterable[ResourceId],
        findings: TaskFindings,
    ) -> None:
        lines = {parameter.name: parameter.line for parameter in behavior.parameters}
        given = {parameter.name: parameter.value for parameter in behavior.parameters}
        geometry = {**self.fleet.geometries, **self.mission.geometries}.get
        values, problems = examine_behavior(behavior, taker.spec, geometry, self.fleet)
        for problem in problems:
            line = lines.get(problem.name, behavior.line)
            if problem.rule == "unknown-geometry":
                self._unknown_geometry(problem, str(given[problem.name]), line, taker, findings)
            else:
                message = taker.place + problem.message
                findings.add(problem.rule, message, problem.remedy, line=line, role=taker.role)
        if not problems:
            for ground in self.grounds:
                ground.check(acting, values, lines, findings)
            check_speeds(behavior, taker.spec, taker.place, values, findings)

    def _unknown_geometry(
        self, problem: ParameterProblem, name: str, line: int, taker: _Taker, findings: TaskFindings
    ) -> None:
        """An operator may still hand it over, if the fleet says so."""
        if name in self.handed_over:
            return
        message = f"{taker.place}{problem.message} in {self.fleet.file}"
        if name in self.fleet.handed_over:
            remedy = "an operator must hand it over before the task starts"
            severity = Severity.WARNING
        else:
            known = [*self.mission.geometries, *self.fleet.geometries]
            hint = problem.remedy or did_you_mean(name, known)
            listed = "if an operator hands it over, list it in the fleet's 'handed_over'"
            remedy = f"{hint} {listed}" if hint else listed
            severity = Severity.ERROR
        findings.add(problem.rule, message, remedy, line=line, role=taker.role, severity=severity)

    def _service(self, call: ServiceCall, findings: TaskFindings) -> None:
        filled = check_roles(call.roles, self.fleet, findings)
        if call.service != DETECTOR_SERVICE:
            return
        detectors = ", ".join(self.fleet.detectors) or "none"
        remedy = f"detectors of the fleet: {detectors}"
        for role in filled:
            if role.resource not in self.fleet.detectors:
                message = f"{place(self.fleet, role.resource)} is no detector payload"
                findings.add("no-detector", message, remedy, line=role.line, role=role.name)
        if not call.roles and not self.fleet.detectors:
            findings.add(
                "no-detector",
                f"{self.fleet.file} has no detector payload for service {call.service}",
                "mark one with 'detector: true'",
                line=call.line,
                severity=Severity.WARNING,
            )
