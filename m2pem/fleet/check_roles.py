"""Checks that the roles of one task can be filled from the fleet."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from m2pem.findings import Finding, Severity
from m2pem.fleet.allocation import resources_of
from m2pem.fleet.fleet import Fleet
from m2pem.mission.behavior import Role, RoleKind
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.elements import Activity
from m2pem.suggestions import did_you_mean, suggest


@dataclass(frozen=True, slots=True)
class TaskFindings:
    """Collects the findings of one task; each says the task, its line, and the role if any."""

    file: str
    task: Activity
    found: list[Finding] = field(default_factory=list)

    def add(
        self,
        rule: str,
        message: str,
        remedy: str = "",
        *,
        line: int,
        role: str = "",
        severity: Severity = Severity.ERROR,
    ) -> None:
        """Note a finding at `line` of the mission, once."""
        where = f"{self.task.id} (line {self.task.line})" + (f", role '{role}'" if role else "")
        finding = Finding(
            severity, self.file, line, self.task.id, rule, f"{where}: {message}", remedy
        )
        if finding not in self.found:
            self.found.append(finding)


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
    if role.requires:
        message = "'requires' (dynamic allocation) is reserved and not understood yet"
        remedy = "name a vehicle, payload or team"
        findings.add("reserved", message, remedy, line=role.line, role=role.name)
        return False
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
    if role.kind is RoleKind.TEAM:
        return (
            f"{fleet.file} has no team '{role.resource}'",
            suggest(role.resource, fleet.teams, "teams"),
        )
    if role.kind is RoleKind.VEHICLE:
        return (
            f"{fleet.file} has no vehicle '{role.resource}'",
            suggest(role.resource, fleet.vehicles, "vehicles"),
        )
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
