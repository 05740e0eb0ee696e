"""A behavior in execution: its state, the part of each resource in it, and what it effected."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import TypeAlias, Union

import msgspec

from m2pem.api.arbiter import BehaviorId, BehaviorReport
from m2pem.api.commanded import Commanded
from m2pem.api.remaining import RemainingWork
from m2pem.mission.catalogue import BehaviorState, ResourceId
from m2pem.mission.values import Value
from m2pem.simulation.event_queue import TimedCall
from m2pem.simulation.gimbals import Shots
from m2pem.simulation.payloads import SimPayload
from m2pem.simulation.pursuit import Pursuit
from m2pem.simulation.segments import Vector
from m2pem.simulation.trajectory import Warp
from m2pem.simulation.vehicles import SimVehicle, carrier_of


class EffectKind(StrEnum):
    """What happened."""

    START = "start"
    HOLD = "hold"
    RESUME = "resume"
    CANCEL = "cancel"
    END = "end"


@dataclass(frozen=True, slots=True)
class Effect:
    """At `time_us` (microseconds since the Unix epoch). `resource` is a behavior's first one.

    `behavior` is "" for a hold or resume of a resource that has none.
    """

    time_us: int
    kind: EffectKind
    resource: ResourceId
    behavior: BehaviorId = ""


Body: TypeAlias = Union[SimVehicle, SimPayload]


class Aim(msgspec.Struct, frozen=True, tag=True):
    """What a payload keeps in view: a vehicle, or ("") a place."""

    vehicle: str
    place: Vector = (0.0, 0.0, 0.0)


Chase: TypeAlias = Union[Pursuit, Aim]


class Outcome(msgspec.Struct, frozen=True):
    """What became of a behavior. `outputs`: what it writes to the mission's data store.
    `remaining`: what is left of it; None: as reported before."""

    state: BehaviorState
    code: str = ""
    reason: str = ""
    outputs: dict[str, Value] = msgspec.field(default_factory=dict)
    remaining: dict[str, Value] | None = None


class Strike(msgspec.Struct, frozen=True):
    """What cuts a behavior short, `after_s` into it; holding it stops that time too.

    `end` is "failed", "succeeded", "stalled", "lost", "lose_link", "disarmed", "falling", "jumped"
    (by `by_m`) or "goes_on", after a cancel. `sole`: the behavior lasts until then, even if its
    motion is over.
    """

    after_s: float
    end: str
    error: str = ""
    sole: bool = False
    by_m: float = 0.0


@dataclass(slots=True)
class Part:
    """The share of one body. After its plan it keeps up `chase`, for ever, if there is one.

    `idle`: the body is held by the behavior but has nothing to do in it. `work`: what is left of
    it, if it can be said; `planned_m`: how far along its way it was by its plan when that was
    looked at last.
    """

    body: Body
    chase: Chase | None = None
    idle: bool = False
    chasing: bool = False
    done: bool = False
    timer: TimedCall | None = None
    work: RemainingWork | None = None
    work_timer: TimedCall | None = None
    planned_m: float = 0.0


@dataclass(slots=True)
class Execution:
    """One behavior. `watch` is its own time, which stops while its first body is held.

    `factor`: how many times as long it takes as by its motion. `last`: the report given last,
    `number` its number. `outcome`: what physically became of it,
    which may not have been reported yet; None while it lasts. `deaf`: it stalled. `shots`: what it
    takes.
    """

    id: BehaviorId
    epoch: int
    behavior: str
    resources: tuple[ResourceId, ...]
    watch: Warp
    factor: float = 1.0
    parts: list[Part] = field(default_factory=list)
    strike: Strike | None = None
    limit_s: float | None = None
    number: int = 0
    last: BehaviorReport | None = None
    outcome: Outcome | None = None
    deaf: bool = False
    cancelling: bool = False
    timer: TimedCall | None = None
    shots: Shots | None = None

    @property
    def ended(self) -> bool:
        """Whether nothing of it happens any more."""
        return self.outcome is not None

    @property
    def carriers(self) -> Sequence[ResourceId]:
        """The vehicles whose links matter to it."""
        return tuple(dict.fromkeys(carrier_of(resource) for resource in self.resources))

    @property
    def reported_end(self) -> bool:
        """Whether its terminal report was given."""
        return self.last is not None and self.last.state.terminal

    def next_report(self, outcome: Outcome) -> BehaviorReport:
        self.number += 1
        before = self.last.remaining if self.last is not None else None
        done = outcome.state is BehaviorState.SUCCEEDED
        self.last = BehaviorReport(
            self.id,
            self.number,
            outcome.state,
            outcome.code,
            outcome.reason,
            native_ref=self.id,
            outputs=outcome.outputs,
            remaining=None if done else outcome.remaining or before,
            # Where a test says how it ends, the vehicle need not have moved.
            commanded=Commanded() if self.strike is not None and self.strike.sole else None,
        )
        return self.last

    def forget_timers(self) -> None:
        timers = [timer for part in self.parts for timer in (part.timer, part.work_timer)]
        for entry in (self.timer, *timers):
            if entry is not None:
                entry.cancel()
        self.timer = None
        for part in self.parts:
            part.timer = part.work_timer = None
