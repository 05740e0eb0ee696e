"""What an executive has counted since it began, and how long its queues are now.

`MissionControl.statistics` returns it: faces make metrics of it (docs/metrics.md). Counts are of
this process: they begin at 0 when an executive starts. Durations are real seconds.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

from m2pem.api.runs import RunId
from m2pem.api.telemetry import LinkState
from m2pem.mission.catalogue import ResourceId


@dataclass(frozen=True, slots=True)
class DurationCounts:
    """A histogram of durations: `counts[n]` of them were `bounds_s[n]` at most.

    `counts` is cumulative, and has one more, the last: all of them.
    """

    bounds_s: tuple[float, ...]
    counts: tuple[int, ...]
    sum_s: float = 0.0
    longest_s: float = 0.0

    @property
    def count(self) -> int:
        """How many there were."""
        return self.counts[-1]


@dataclass(frozen=True, slots=True)
class LinkStatistics:
    """The link to a resource. `age_s`: since its newest state was received; None: none was yet.

    Of a resource whose link is not watched, it is by the state's own time stamp.
    """

    state: LinkState | None
    age_s: float | None = None


@dataclass(frozen=True, slots=True)
class SubscriptionStatistics:
    """A reader of telemetry: how many states may wait and do, and how many were dropped."""

    size: int
    waiting: int
    dropped: int


@dataclass(frozen=True, slots=True)
class ExecutiveStatistics:
    """Counts since the executive began, and what there is now.

    Counts: `inputs` that runs have decided, with the `records` that this gave; `commits` of the
    journal, each of the inputs of a run that waited together; `runs_ended` by outcome;
    `telemetry_dropped`, of all subscriptions, also of those that are gone; `events_cut_off`, the
    subscribers of events that were too slow; `observations_dropped`, the inputs that slow
    observers did not see; `loop`, how late the event loop was, looked at a few times a second.

    Now: `runs` by status ("running", "paused"); `inboxes`, the inputs that each of these has not
    decided; `events_waiting`, of the subscriber that is furthest behind; `observers_waiting`, the
    inputs that observers have not seen; `calls_waiting`, calls of arbiters that are under way or
    wait for their turn; `behaviors` under way; `prompts` and `incidents` that are open.
    """

    inputs: int
    records: int
    commits: DurationCounts
    loop: DurationCounts
    runs: Mapping[str, int] = field(default_factory=dict)
    runs_ended: Mapping[str, int] = field(default_factory=dict)
    inboxes: Mapping[RunId, int] = field(default_factory=dict)
    behaviors: int = 0
    prompts: int = 0
    incidents: int = 0
    calls_waiting: int = 0
    events_waiting: int = 0
    events_cut_off: int = 0
    observers_waiting: int = 0
    observations_dropped: int = 0
    telemetry_dropped: int = 0
    subscriptions: tuple[SubscriptionStatistics, ...] = ()
    links: Mapping[ResourceId, LinkStatistics] = field(default_factory=dict)
