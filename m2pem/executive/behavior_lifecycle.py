"""The life of a behavior, as the owners of its state see it together.

Several owners keep a part of a behavior's state, because each must act on its own: the engine
replays it from the journal, the dispatcher bounds the calls of arbiters, the availability keeps
runs from each other, the airspace keeps aircraft apart, the arbiter knows its requests, and the
vehicle does what it does. `JOINT_STATES` names what they may say at the same moment, and
`TRANSITIONS` what leads from one to the next.

The laws behind the table:

* What an arbiter has not ended, a behavior holds or nothing gets: a vehicle whose behavior has
  ended for its mission is withdrawn until it has stopped. The exceptions have names: `given up`,
  `out of reach`.
* The engine is the first to know of a behavior, and what it has ended, the dispatcher has let go.
* A behavior that waits for an operator does not move its vehicles.
"""

from collections.abc import Collection, Iterable
from dataclasses import dataclass, fields
from enum import StrEnum

from m2pem.engine.state import Behavior, BehaviorPhase
from m2pem.fleet.allocation import Availability
from m2pem.mission.catalogue import ResourceId


class EngineView(StrEnum):
    """What the run's state has of a behavior (`m2pem.engine.state.Behavior`)."""

    NONE = "-"
    REQUESTED = "requested"
    REPORTED = "reported"
    UNSETTLED = "unsettled"
    CANCELLING = "cancelling"


class DispatcherView(StrEnum):
    """Whether the dispatcher has handed a behavior, or its cancel, to the arbiter."""

    NONE = "-"
    COMMANDED = "commanded"
    CANCELLED = "cancelled"


class AvailabilityView(StrEnum):
    """Who has the behavior's resources: it, nothing, another behavior, or nothing may have them."""

    HELD = "held"
    FREE = "free"
    OTHER = "another's"
    WITHDRAWN = "withdrawn"


class AirspaceView(StrEnum):
    """Whether volumes are reserved for the behavior's aircraft."""

    NONE = "-"
    RESERVED = "reserved"


class ArbiterView(StrEnum):
    """What the arbiter answers to `query`."""

    UNKNOWN = "unknown"
    UNDER_WAY = "under way"
    ENDED = "ended"


class VehicleView(StrEnum):
    """What the vehicles do for the behavior; `OUT_OF_REACH`: a link is cut, so that is unknown."""

    IDLE = "idle"
    BUSY = "busy"
    HELD = "held"
    OUT_OF_REACH = "out of reach"


@dataclass(frozen=True, slots=True)
class ExecutiveViews:
    """What the owners within an executive say of one behavior at one moment."""

    engine: EngineView
    dispatcher: DispatcherView
    availability: AvailabilityView
    airspace: AirspaceView


@dataclass(frozen=True, slots=True)
class BehaviorViews(ExecutiveViews):
    """What all owners say of one behavior at one moment."""

    arbiter: ArbiterView
    vehicle: VehicleView


@dataclass(frozen=True, slots=True)
class JointState:
    """What the owners may say together of a behavior in one stage of its life."""

    name: str
    meaning: str
    engine: Collection[EngineView]
    dispatcher: Collection[DispatcherView]
    availability: Collection[AvailabilityView]
    airspace: Collection[AirspaceView]
    arbiter: Collection[ArbiterView]
    vehicle: Collection[VehicleView]

    def allows(self, views: BehaviorViews) -> bool:
        """Whether these views are those of this stage."""
        return all(getattr(views, owner) in getattr(self, owner) for owner in OWNERS)


OWNERS = tuple(field.name for field in fields(BehaviorViews))


def engine_view(behavior: Behavior | None) -> EngineView:
    """Return what a run's state says. `behavior`: None: it has none of that id."""
    if behavior is None:
        return EngineView.NONE
    match behavior.phase:
        case BehaviorPhase.UNSETTLED:
            return EngineView.UNSETTLED
        case BehaviorPhase.CANCELLING:
            return EngineView.CANCELLING
    return EngineView.REQUESTED if behavior.state is None else EngineView.REPORTED


def availability_view(
    availability: Availability, behavior: str, resources: Iterable[ResourceId]
) -> AvailabilityView:
    """Return who has the resources of a behavior."""
    holders = {availability.holder(each) for each in resources}
    if holders == {behavior}:
        return AvailabilityView.HELD
    if holders != {None}:
        return AvailabilityView.OTHER
    withdrawn = any(availability.reason(each) for each in resources)
    return AvailabilityView.WITHDRAWN if withdrawn else AvailabilityView.FREE


_E, _D, _A, _R, _B, _V = (
    EngineView,
    DispatcherView,
    AvailabilityView,
    AirspaceView,
    ArbiterView,
    VehicleView,
)
_NOT_HELD = (_A.FREE, _A.OTHER, _A.WITHDRAWN)
_ANY_AIRSPACE = (_R.NONE, _R.RESERVED)
_SEEN = (_V.IDLE, _V.BUSY, _V.HELD)
_NOT_MOVING = (_V.IDLE, _V.HELD, _V.OUT_OF_REACH)

JOINT_STATES = (
    JointState(
        "requested",
        "It waits for its turn: the run is paused, or a call for one of its resources has not "
        "returned.",
        (_E.REQUESTED,),
        (_D.NONE,),
        _NOT_HELD,
        (_R.NONE,),
        (_B.UNKNOWN,),
        (_V.IDLE, _V.OUT_OF_REACH),
    ),
    JointState(
        "starting",
        "Its arbiter was asked to start it, or its aircraft wait for their volumes; no report has "
        "been decided.",
        (_E.REQUESTED,),
        (_D.COMMANDED,),
        (_A.HELD,),
        _ANY_AIRSPACE,
        (_B.UNKNOWN, _B.UNDER_WAY, _B.ENDED),
        (*_SEEN, _V.OUT_OF_REACH),
    ),
    JointState(
        "refused",
        "Its resources were not free; the refusal is decided when the paused run goes on.",
        (_E.REQUESTED,),
        (_D.COMMANDED,),
        _NOT_HELD,
        (_R.NONE,),
        (_B.UNKNOWN,),
        (_V.IDLE, _V.OUT_OF_REACH),
    ),
    JointState(
        "under way",
        "Its vehicles do it, or are held in it.",
        (_E.REPORTED,),
        (_D.COMMANDED,),
        (_A.HELD,),
        _ANY_AIRSPACE,
        (_B.UNDER_WAY,),
        (*_SEEN, _V.OUT_OF_REACH),
    ),
    JointState(
        "end unknown",
        "It has ended, or its arbiter knows it no more, and the run has not decided that: its "
        "report waits for the link, or for the end of a pause.",
        (_E.REPORTED,),
        (_D.COMMANDED,),
        (_A.HELD,),
        _ANY_AIRSPACE,
        (_B.ENDED, _B.UNKNOWN),
        (_V.IDLE, _V.OUT_OF_REACH),
    ),
    JointState(
        "unsettled",
        "After a restart it is not as it was: its vehicles stay held until an operator decides.",
        (_E.UNSETTLED,),
        (_D.COMMANDED,),
        (_A.HELD,),
        _ANY_AIRSPACE,
        (_B.UNKNOWN, _B.UNDER_WAY, _B.ENDED),
        _NOT_MOVING,
    ),
    JointState(
        "withdrawn",
        "It is cancelled before anything was commanded; the run decides that when it goes on.",
        (_E.CANCELLING,),
        (_D.NONE,),
        _NOT_HELD,
        (_R.NONE,),
        (_B.UNKNOWN,),
        (_V.IDLE, _V.OUT_OF_REACH),
    ),
    JointState(
        "cancelling",
        "Its vehicles stop, or a behavior that preempts it has them already.",
        (_E.CANCELLING,),
        (_D.COMMANDED, _D.CANCELLED),
        (_A.HELD, _A.OTHER),
        _ANY_AIRSPACE,
        (_B.UNKNOWN, _B.UNDER_WAY, _B.ENDED),
        (*_SEEN, _V.OUT_OF_REACH),
    ),
    JointState(
        "lost",
        "It is over for its mission, and its vehicle may still do it: nothing gets the vehicle "
        "before it was received again and has stopped.",
        (_E.NONE,),
        (_D.NONE,),
        (_A.WITHDRAWN,),
        _ANY_AIRSPACE,
        (_B.UNKNOWN, _B.UNDER_WAY, _B.ENDED),
        (_V.BUSY, _V.HELD, _V.OUT_OF_REACH),
    ),
    JointState(
        "given up",
        "It has not ended within its arbiter's limit for a cancel: its arbiter refuses another "
        "behavior until it has.",
        (_E.NONE,),
        (_D.NONE,),
        (_A.FREE, _A.OTHER),
        (_R.NONE,),
        (_B.UNDER_WAY,),
        (*_SEEN, _V.OUT_OF_REACH),
    ),
    JointState(
        "out of reach",
        "It is over for its mission, and the link of its vehicle is cut. The link monitor, or the "
        "next command, will notice that.",
        (_E.NONE,),
        (_D.NONE,),
        (_A.FREE, _A.OTHER),
        _ANY_AIRSPACE,
        (_B.UNKNOWN, _B.ENDED),
        (_V.OUT_OF_REACH,),
    ),
    JointState(
        "ended",
        "It is over everywhere.",
        (_E.NONE,),
        (_D.NONE,),
        _NOT_HELD,
        (_R.NONE,),
        (_B.UNKNOWN, _B.ENDED),
        (_V.IDLE,),
    ),
)


@dataclass(frozen=True, slots=True)
class Transition:
    """What leads from one stage of a behavior's life to another."""

    source: str
    target: str
    when: str


TRANSITIONS = (
    Transition("requested", "starting", "its turn has come, or the run goes on"),
    Transition("requested", "refused", "its turn has come, and a resource is not free"),
    Transition("requested", "withdrawn", "its token moves on, or the run is stopped"),
    Transition("starting", "under way", "the arbiter reports ACCEPTED or RUNNING"),
    Transition("starting", "unsettled", "after a restart an operator is asked about it"),
    Transition("starting", "cancelling", "its token moves on, a fault, or the run is stopped"),
    Transition("starting", "out of reach", "the arbiter reports LOST"),
    Transition("starting", "ended", "it is refused, or has ended at once"),
    Transition("refused", "cancelling", "its token moves on, or the run is stopped"),
    Transition("refused", "ended", "the run decides the refusal"),
    Transition("under way", "end unknown", "it ends, and its report waits"),
    Transition("under way", "starting", "after a restart it is started again"),
    Transition("under way", "unsettled", "after a restart it is not as it was"),
    Transition("under way", "cancelling", "its token moves on, a fault, or the run is stopped"),
    Transition("under way", "lost", "the link monitor notices that its only vehicle is lost"),
    Transition("under way", "out of reach", "the arbiter reports LOST"),
    Transition("under way", "ended", "the arbiter reports an end"),
    Transition("end unknown", "starting", "after a restart it is started again"),
    Transition("end unknown", "unsettled", "after a restart an operator is asked about it"),
    Transition("end unknown", "cancelling", "its token moves on, or the run is stopped"),
    Transition("end unknown", "out of reach", "the arbiter reports LOST"),
    Transition("end unknown", "ended", "its report is decided"),
    Transition("unsettled", "starting", "the operator has it started again"),
    Transition("unsettled", "under way", "the operator lets it go on"),
    Transition("unsettled", "end unknown", "the operator lets it go on, and it has ended"),
    Transition("unsettled", "cancelling", "the operator skips it, or aborts the mission"),
    Transition("unsettled", "out of reach", "the arbiter reports LOST"),
    Transition("unsettled", "ended", "the arbiter reports an end"),
    Transition("withdrawn", "ended", "the run decides that nothing was commanded"),
    Transition("cancelling", "lost", "the link monitor notices that its only vehicle is lost"),
    Transition("cancelling", "out of reach", "the arbiter reports LOST, or a preempted one's end"),
    Transition("cancelling", "given up", "it does not end within the arbiter's limit"),
    Transition("cancelling", "ended", "the arbiter reports an end"),
    Transition("given up", "ended", "its vehicle has stopped after all"),
    Transition("given up", "out of reach", "the link of its vehicle is cut"),
    Transition("out of reach", "lost", "the link monitor notices it"),
    Transition("out of reach", "ended", "its vehicle was received again"),
    Transition("lost", "ended", "its vehicle was received again, and has stopped"),
    Transition("ended", "out of reach", "the link of its vehicle is cut afterwards"),
)
