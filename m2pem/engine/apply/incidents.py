"""What records about incidents do to the state."""

from m2pem.engine import records as r
from m2pem.engine.apply.events import end_wait
from m2pem.engine.state import Incident, RunState, Token
from m2pem.mission.elements import Activity, BoundaryEvent


def incident_opened(state: RunState, record: r.IncidentOpened) -> None:
    token = state.tokens[record.token]
    state.last_incident += 1
    state.incidents[record.incident] = Incident(
        record.incident,
        token,
        record.code,
        record.reason,
        record.choices,
        record.resources,
        record.roles,
        record.operator_role,
    )
    token.incident = record.incident
    token.replacements = None
    _end_own_waits(state, token, also_boundary=record.rearm)


def _end_own_waits(state: RunState, token: Token, *, also_boundary: bool) -> None:
    """End what the element itself waits for; the boundary events of an activity stay armed."""
    activity = isinstance(token.node, Activity)
    for wait in list((token.waits or {}).values()):
        if also_boundary or not (activity and isinstance(wait.node, BoundaryEvent)):
            end_wait(state, wait)
    if also_boundary or not activity:
        token.waits = None
        token.armed = False


def incident_resolved(state: RunState, record: r.IncidentResolved) -> None:
    token = state.incidents.pop(record.incident).token
    token.incident = ""
    token.replacements = record.roles or None


def incident_closed(state: RunState, record: r.IncidentClosed) -> None:
    state.incidents.pop(record.incident).token.incident = ""
