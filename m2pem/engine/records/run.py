"""Records about the run as a whole."""

from m2pem.engine.inputs import Input
from m2pem.engine.records.base import BaseRecord, RunOutcome
from m2pem.mission.values import Value


class RunStarted(BaseRecord, frozen=True):
    """`started_us`: microseconds since the Unix epoch; mission time counts from it."""

    process: str
    started_us: int
    by: str = ""


class RunClaimed(BaseRecord, frozen=True):
    """Another executive, or the same after a restart, drives the run from here.

    `lost`: how many records the journal had lost; so many ids are left out.
    """

    epoch: int
    by: str = ""
    lost: int = 0


class RunPaused(BaseRecord, frozen=True):
    """No token moves, and mission time stands, until `RunResumed`."""

    at_us: int
    by: str = ""


class RunResumed(BaseRecord, frozen=True):
    at_us: int
    by: str = ""


class RunEnded(BaseRecord, frozen=True):
    """Nothing follows but reports of behaviors that were still being cancelled."""

    outcome: RunOutcome
    detail: str


class RunYielded(BaseRecord, frozen=True):
    """One input caused more steps than a batch; these are left, in order, for `Continue`.

    A positive number is a token to execute, a negative one a scope to look at.
    """

    steps: tuple[int, ...]


class InputIgnored(BaseRecord, frozen=True):
    """A redundant or late input; it changed nothing else."""

    reason: str


class InputDeferred(BaseRecord, frozen=True):
    """An input that came during a pause; it is decided at resume."""

    input: Input


class InputSeen(BaseRecord, frozen=True):
    """An input that carried an id was taken; another with the same id will be ignored."""

    id: str


class OperatorTookControl(BaseRecord, frozen=True):
    """`resource` is with an operator: it gets no behavior until it is given back."""

    resource: str
    by: str


class OperatorGaveControlBack(BaseRecord, frozen=True):
    """`resource` is the missions' again."""

    resource: str
    by: str


class GeometryReceived(BaseRecord, frozen=True):
    """A route, area or point that an OCU handed over (GeoJSON geometry)."""

    name: str
    geometry: dict[str, Value]
    by: str = ""
