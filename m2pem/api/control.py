"""MissionControl: the one interface of the executive for operators, scripts and OCU plugins."""

from typing import Protocol

from m2pem.api.mission_control.alerts import AlertControl
from m2pem.api.mission_control.authoring import AuthoringControl
from m2pem.api.mission_control.debugging import DebugControl
from m2pem.api.mission_control.executive import ExecutiveControl
from m2pem.api.mission_control.geometries import GeometryControl
from m2pem.api.mission_control.operators import OperatorControl
from m2pem.api.mission_control.resources import ResourceControl
from m2pem.api.mission_control.revisions import RevisionControl
from m2pem.api.mission_control.runs import RunControl
from m2pem.api.mission_control.schedule import ScheduleControl
from m2pem.api.mission_control.watching import WatchControl


class MissionControl(
    RunControl,
    DebugControl,
    RevisionControl,
    ScheduleControl,
    ResourceControl,
    OperatorControl,
    GeometryControl,
    AlertControl,
    AuthoringControl,
    WatchControl,
    ExecutiveControl,
    Protocol,
):
    """Every OCU, the command line and the web page use this, and nothing else of the executive.

    `by` names who asked, and is journaled. Requests that cannot be met raise
    `m2pem.errors.OperatorError` and change nothing.
    """
