"""`MissionControl` over an executive: what OCUs, scripts and the command line call."""

from m2pem.executive.mission_control.alerts import AlertOperations
from m2pem.executive.mission_control.authoring import AuthoringOperations
from m2pem.executive.mission_control.debugging import DebugOperations
from m2pem.executive.mission_control.executive import ExecutiveOperations
from m2pem.executive.mission_control.geometries import GeometryOperations
from m2pem.executive.mission_control.operators import OperatorOperations
from m2pem.executive.mission_control.resources import ResourceOperations
from m2pem.executive.mission_control.revisions import RevisionOperations
from m2pem.executive.mission_control.runs import RunOperations
from m2pem.executive.mission_control.schedule import ScheduleOperations
from m2pem.executive.mission_control.watching import WatchOperations


class Control(
    RunOperations,
    DebugOperations,
    RevisionOperations,
    ScheduleOperations,
    ResourceOperations,
    OperatorOperations,
    GeometryOperations,
    AlertOperations,
    AuthoringOperations,
    WatchOperations,
    ExecutiveOperations,
):
    """Implements `m2pem.api.control.MissionControl`; see there for every promise."""
