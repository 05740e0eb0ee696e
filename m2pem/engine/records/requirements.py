"""Records about the requirements that a run is monitored for."""

from m2pem.engine.inputs import RequirementVerdict
from m2pem.engine.records.base import BaseRecord


class RequirementMonitored(BaseRecord, frozen=True):
    """A requirement is evaluated over the records of the run from here on.

    `formula`: the requirement (docs/requirements.md), with ids for names. `english`: the same in
    words. `elements`: those that it is about. `on_violation`: what a violation does to the mission,
    "error:CODE" or "signal:ID"; "": nothing. `conditions`: those on telemetry in the formula.
    """

    requirement: str
    formula: str
    english: str
    elements: tuple[str, ...] = ()
    on_violation: str = ""
    conditions: tuple[str, ...] = ()


class RequirementDropped(BaseRecord, frozen=True):
    """The run is no longer monitored for a requirement: the new version of its mission does not
    have it, or has another formula for it."""

    requirement: str


class RequirementDecided(BaseRecord, frozen=True):
    """It is certain that the run satisfies or violates a requirement, whatever follows.

    `decided_us`: since when, in microseconds of mission time. `because`: what made it certain.
    """

    requirement: str
    verdict: RequirementVerdict
    english: str
    decided_us: int
    because: str = ""


class RequirementLeftOpen(BaseRecord, frozen=True):
    """The run has ended, and that does not decide whether it satisfies a requirement. `because`:
    why not."""

    requirement: str
    english: str
    because: str


class TelemetryConditionChanged(BaseRecord, frozen=True):
    """What telemetry says of a condition in requirements; `holds` None: it says nothing."""

    condition: str
    holds: bool | None
