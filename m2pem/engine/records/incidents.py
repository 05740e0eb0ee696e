"""Records about incidents: errors that no event catches, about which an operator decides."""

import msgspec

from m2pem.engine.inputs import IncidentChoice
from m2pem.engine.records.base import BaseRecord


class IncidentOpened(BaseRecord, frozen=True):
    """An error that no event catches has stopped a token on its element; its own work is over.

    `choices`: what an operator can do about it. `resources`: what the failed work commanded: they
    are held, and stay with the run until the incident is over. `roles`: who filled the roles of the
    failed behavior. `rearm`: an event at the element could not be armed; a retry arms all of them.
    `operator_role`: which operators may decide; "": all.
    """

    token: int
    process: str
    element: str
    scope: int
    incident: str
    code: str
    reason: str
    choices: tuple[IncidentChoice, ...]
    resources: tuple[str, ...] = ()
    roles: dict[str, tuple[str, ...]] = msgspec.field(default_factory=dict)
    rearm: bool = False
    operator_role: str = ""


class IncidentUpdated(BaseRecord, frozen=True):
    """An operator has written data for an incident, which stays open."""

    token: int
    process: str
    element: str
    scope: int
    incident: str
    by: str


class IncidentResolved(BaseRecord, frozen=True):
    """An operator has decided about an incident. `to`: the element or sequence flow to which the
    token moves. `roles`: who fills roles of the behavior that starts again; those by need that are
    left out are chosen again; empty: as the mission says. `resources`: what is free now, unless the
    behavior takes it again.
    """

    token: int
    process: str
    element: str
    scope: int
    incident: str
    choice: IncidentChoice
    by: str
    to: str = ""
    roles: dict[str, tuple[str, ...]] = msgspec.field(default_factory=dict)
    resources: tuple[str, ...] = ()


class IncidentClosed(BaseRecord, frozen=True):
    """An incident is over without a decision: its token was interrupted, or the run has ended.
    `resources`: what is free now."""

    incident: str
    resources: tuple[str, ...] = ()
