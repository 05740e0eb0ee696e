"""The laws of a run's life.

    NEW --StartRun--> RUNNING <--PauseRun / ResumeRun--> PAUSED
    RUNNING, PAUSED --StopRun, or what the mission does--> ENDED

* NEW takes only StartRun.
* PAUSED takes what changes nothing in the mission (a claim, a second pause), ResumeRun and
  StopRun; every other input is deferred: journaled now, decided in order at resume.
* ENDED takes only claims, and what ends behaviors that are still being cancelled.
* What is not welcome is ignored with a reason, never an error.

`WELCOME` is the whole of it: what to do with an input, by status.
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
    PauseRun,
    ResourceFault,
    ResumeRun,
    StartRun,
    StopRun,
    Tick,
)
from m2pem.engine.state import RunStatus


class Welcome(Enum):
    """What becomes of an input."""

    DECIDE = "decide"
    DEFER = "defer"
    IGNORE = "ignore"


_EXCEPTIONS: dict[RunStatus, dict[type, Welcome]] = {
    RunStatus.NEW: {StartRun: Welcome.DECIDE},
    RunStatus.RUNNING: {StartRun: Welcome.IGNORE, ResumeRun: Welcome.IGNORE},
    RunStatus.PAUSED: {
        StartRun: Welcome.IGNORE,
        PauseRun: Welcome.IGNORE,
        Tick: Welcome.IGNORE,
        Continue: Welcome.IGNORE,
        ResumeRun: Welcome.DECIDE,
        StopRun: Welcome.DECIDE,
        GiveUp: Welcome.DECIDE,
        ClaimRun: Welcome.DECIDE,
        GeometrySet: Welcome.DECIDE,
    },
    RunStatus.ENDED: {
        BehaviorReported: Welcome.DECIDE,
        BehaviorMissing: Welcome.DECIDE,
        ResourceFault: Welcome.DECIDE,
        ClaimRun: Welcome.DECIDE,
    },
}

_OTHERWISE: dict[RunStatus, Welcome] = {
    RunStatus.NEW: Welcome.IGNORE,
    RunStatus.RUNNING: Welcome.DECIDE,
    RunStatus.PAUSED: Welcome.DEFER,
    RunStatus.ENDED: Welcome.IGNORE,
}


def welcome(status: RunStatus, item: Input) -> Welcome:
    """What to do with an input in a status."""
    return _EXCEPTIONS[status].get(type(item), _OTHERWISE[status])
