"""The life cycle of a run, and which inputs it takes in which status.

    NEW --StartRun--> RUNNING <--PauseRun, a breakpoint / ResumeRun, StepRun--> PAUSED
    RUNNING, PAUSED --StopRun, or what the mission does--> ENDED

* NEW takes only StartRun.
* PAUSED takes ResumeRun, StepRun, StopRun, GiveUp, Revise, what is changed for debugging
  (breakpoints, data), and what moves no token (a claim, a geometry, a note). It ignores ticks.
  Every other input is deferred: journaled now, decided at resume.
* ENDED takes only claims, what ends behaviors that are still being cancelled, and verdicts on
  requirements, which the end of the run decides.
* An input that is not taken is ignored with a reason; it is never an error.

`admission` reads it from two tables.
"""

from enum import Enum

from m2pem.engine.inputs import (
    BehaviorMissing,
    BehaviorReported,
    ClaimRun,
    Continue,
    GeometrySet,
    GiveUp,
    Input,
    OperatorNoted,
    PauseRun,
    RequirementDecided,
    RequirementLeftOpen,
    ResourceFault,
    ResumeRun,
    Revise,
    SetBreakpoints,
    SetData,
    StartRun,
    StepRun,
    StopRun,
    Tick,
)
from m2pem.engine.state import RunStatus


class Admission(Enum):
    """What is done with an input."""

    DECIDE = "decide"
    DEFER = "defer"
    IGNORE = "ignore"


_EXCEPTIONS: dict[RunStatus, dict[type, Admission]] = {
    RunStatus.NEW: {StartRun: Admission.DECIDE},
    RunStatus.RUNNING: {
        StartRun: Admission.IGNORE,
        ResumeRun: Admission.IGNORE,
        StepRun: Admission.IGNORE,
        SetData: Admission.IGNORE,
    },
    RunStatus.PAUSED: {
        StartRun: Admission.IGNORE,
        PauseRun: Admission.IGNORE,
        Tick: Admission.IGNORE,
        Continue: Admission.IGNORE,
        ResumeRun: Admission.DECIDE,
        SetBreakpoints: Admission.DECIDE,
        StepRun: Admission.DECIDE,
        SetData: Admission.DECIDE,
        StopRun: Admission.DECIDE,
        GiveUp: Admission.DECIDE,
        ClaimRun: Admission.DECIDE,
        GeometrySet: Admission.DECIDE,
        OperatorNoted: Admission.DECIDE,
        Revise: Admission.DECIDE,
    },
    RunStatus.ENDED: {
        BehaviorReported: Admission.DECIDE,
        BehaviorMissing: Admission.DECIDE,
        ResourceFault: Admission.DECIDE,
        ClaimRun: Admission.DECIDE,
        RequirementDecided: Admission.DECIDE,
        RequirementLeftOpen: Admission.DECIDE,
    },
}

_OTHERWISE: dict[RunStatus, Admission] = {
    RunStatus.NEW: Admission.IGNORE,
    RunStatus.RUNNING: Admission.DECIDE,
    RunStatus.PAUSED: Admission.DEFER,
    RunStatus.ENDED: Admission.IGNORE,
}


def admission(status: RunStatus, item: Input) -> Admission:
    """Return what to do with an input in a status."""
    return _EXCEPTIONS[status].get(type(item), _OTHERWISE[status])
