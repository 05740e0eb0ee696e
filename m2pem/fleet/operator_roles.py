"""Roles of operators: who may answer a prompt, and who may decide about an incident.

A mission, or the fleet file, says which role may; the fleet file says who has it (`operators`).
Without `operators`, every operator has every role.
"""

from collections.abc import Iterable, Iterator

from m2pem.findings import Finding, Severity
from m2pem.fleet.fleet import Fleet
from m2pem.mission.elements import Activity, Process, UserTask
from m2pem.mission.mission import Mission
from m2pem.suggestions import suggest


def why_not_allowed(fleet: Fleet, role: str, by: str) -> str:
    """Return why an operator may not do what only a role may; "": the operator may.

    `by`: the name that is journaled with what the operator does.
    """
    if not role or not fleet.operators:
        return ""
    names = fleet.operators.get(role, ())
    if has_name(by, names):
        return ""
    who = f"{by!r} is not" if by else "who asks gave no name"
    said = f"only operators with the role {role!r} may: "
    return f"{said}{', '.join(names) or 'the fleet file names none'}; {who}"


def has_name(by: str, names: Iterable[str]) -> bool:
    """Whether an operator is among those that are named: "anna" also stands for "anna@gcs1"."""
    return bool(by) and any(each in (by, by.partition("@")[0]) for each in names)


def check_operator_roles(mission: Mission, fleet: Fleet) -> Iterator[Finding]:
    """Return a finding for each role that nobody of the fleet's operators has."""
    if not fleet.operators:
        return
    for process in mission.processes:
        if process.incident_role and process.incident_role not in fleet.operators:
            yield _unknown(mission, fleet, process, "m2pem:incidentRole", process.incident_role)
    for task in mission.activities():
        role = task.prompt.role if isinstance(task, UserTask) and task.prompt is not None else ""
        if role and role not in fleet.operators:
            yield _unknown(mission, fleet, task, "role", role)


def _unknown(
    mission: Mission, fleet: Fleet, element: Process | Activity, key: str, role: str
) -> Finding:
    return Finding(
        Severity.ERROR,
        mission.file_of(element),
        element.line,
        element.id,
        "no-operator",
        f"{key}='{role}': {fleet.file} names no operator with that role, who could decide",
        suggest(role, list(fleet.operators), "roles"),
    )
