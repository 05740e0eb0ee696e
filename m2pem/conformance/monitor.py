"""Watches every behavior that is under way, beside the link monitor and for every arbiter.

A deviation is said at once, and ends the behavior at its arbiter; its end then is FAILED. A success
without evidence of what it promises is FAILED with code `INCOMPLETE`.
"""

import asyncio
import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

from m2pem.api.alerts import DEVIATION, NOT_STOPPED, AlertSeverity
from m2pem.api.arbiter import BehaviorReport, BehaviorRequest
from m2pem.api.clock import Clock
from m2pem.api.commanded import Commanded
from m2pem.api.epoch_fence import run_of
from m2pem.api.runs import Alert, RunId
from m2pem.api.telemetry import VehicleState
from m2pem.conformance.bounds import SEEN_WITHIN_S, Bounds
from m2pem.conformance.derivation import commanded_by
from m2pem.conformance.watch import Deviation, Watch
from m2pem.fleet.fleet import Domain, Fleet
from m2pem.geo.fence import Fence
from m2pem.geo.local_frame import EastNorth
from m2pem.mission.catalogue import BehaviorState, ResourceId
from m2pem.mission.losses import FAILED, INCOMPLETE
from m2pem.mission.values import Value
from m2pem.units import US_PER_S

log = logging.getLogger("m2pem.conformance")

LOOK_EVERY_US = 500_000
"""Of states that come more often, some are left out, but for one that says that a vehicle is
disarmed: a look takes some 60 us, and 600 vehicles may send 50 states a second."""

SETTLES_WITHIN_S = 3.0
"""How long a success waits for the telemetry that shows it: a report may overtake states."""

SETTLES_WITHIN_REAL_S = 0.5
"""The same of the clock on the wall, for executives with a faster one."""

_DOWN = "it comes home or down, and goes on"


@dataclass(slots=True)
class _Watched:
    """A behavior that is under way. `kept`: the report of its success, which waits for telemetry;
    `seen`: whether a state came since. `deviation`: why it fails, whatever is reported."""

    request: BehaviorRequest
    straight: bool
    adopted: bool
    watches: dict[ResourceId, Watch] = field(default_factory=dict)
    looked_us: dict[ResourceId, int] = field(default_factory=dict)
    begun: bool = False
    ending: bool = False
    deviation: str = ""
    kept: BehaviorReport | None = None
    seen: bool = False
    timer: asyncio.Task[None] | None = None


@dataclass(slots=True)
class _Stopping:
    """A vehicle whose behavior `request` was cancelled has until `due_us` to stop near `place`."""

    request: BehaviorRequest
    watch: Watch
    place: EastNorth | None
    due_us: int


class ConformanceMonitor:
    """`latest`: the last state of a vehicle, if there is one. `fences_of`: where a vehicle may be.
    `end`: cancels a behavior at its arbiter. `say`: takes alerts for operators. `deliver`: takes
    the reports of successes that had to wait. `stops_within_s`: the bound of a vehicle's arbiter
    for a cancel; None: an operator has the vehicle. `speed`: of the clock."""

    def __init__(
        self,
        fleet: Fleet,
        clock: Clock,
        latest: Callable[[ResourceId], object],
        fences_of: Callable[[ResourceId], Sequence[Fence]],
        *,
        end: Callable[[str], None],
        say: Callable[[Alert], None],
        deliver: Callable[[BehaviorReport], None],
        stops_within_s: Callable[[ResourceId], float | None],
        speed: float = 1.0,
    ) -> None:
        self._fleet = fleet
        self._clock = clock
        self._latest = latest
        self._fences_of = fences_of
        self._end = end
        self._say = say
        self._deliver = deliver
        self._stops_within_s = stops_within_s
        self._settles_s = max(SETTLES_WITHIN_S, SETTLES_WITHIN_REAL_S * speed)
        self._watched: dict[str, _Watched] = {}
        self._by_vehicle: dict[ResourceId, _Watched] = {}
        self._stopping: dict[ResourceId, _Stopping] = {}

    # --- behaviors --------------------------------------------------------------------------------

    def begins(
        self, request: BehaviorRequest, *, straight: bool = True, adopted: bool = False
    ) -> None:
        """A behavior is handed to its arbiter, or (`adopted`) an arbiter has it since before this
        executive began. `straight`: see `ArbiterCapabilities`."""
        vehicles = [each for each in request.resources if each in self._fleet.vehicles]
        if not vehicles:
            return
        watched = _Watched(request, straight, adopted)
        self._watched[request.id] = watched
        for vehicle in vehicles:
            self._by_vehicle[vehicle] = watched
            self._stopping.pop(vehicle, None)
        if adopted:
            self._watch(watched, None)

    def cancelled(self, behavior: str) -> None:
        """A behavior is to end: it is not compared with what it commanded any more."""
        if (watched := self._watched.get(behavior)) is not None:
            watched.ending = True

    def ended(self, behavior: str) -> None:
        """The journal has its end, or it is commanded by another executive."""
        watched = self._watched.pop(behavior, None)
        if watched is None:
            return
        if watched.timer is not None:
            watched.timer.cancel()
        for vehicle in watched.request.resources:
            if self._by_vehicle.get(vehicle) is watched:
                del self._by_vehicle[vehicle]

    def close(self) -> None:
        """Let go of all behaviors."""
        for behavior in list(self._watched):
            self.ended(behavior)

    def _watch(self, watched: _Watched, commanded: Commanded | None) -> None:
        watched.begun = True
        request, now_us = watched.request, self._clock.now_us()
        for resource in request.resources:
            vehicle = self._fleet.vehicles.get(resource)
            bounds = None if vehicle is None else bounds_of(self._fleet, resource)
            if vehicle is None or bounds is None:
                continue
            flies = vehicle.domain is Domain.AIR
            straight = watched.straight or vehicle.domain is not Domain.GROUND
            start = self._latest(resource)
            fresh = isinstance(start, VehicleState) and (
                abs(now_us - start.time_us) <= SEEN_WITHIN_S * US_PER_S
            )
            watched.watches[resource] = Watch(
                commanded or commanded_by(request, flies=flies, straight=straight),
                bounds,
                flies=flies,
                fences=self._fences_of(resource),
                start=start if fresh and isinstance(start, VehicleState) else None,
                adopted=watched.adopted,
            )

    # --- telemetry --------------------------------------------------------------------------------

    def on_telemetry(self, state: object) -> None:
        """An arbiter published a state."""
        if not isinstance(state, VehicleState):
            return
        watched = self._by_vehicle.get(state.resource)
        if watched is None:
            if self._stopping:
                self._stops(state)
            return
        watch = watched.watches.get(state.resource)
        if watch is None:
            return
        looked_us = watched.looked_us.get(state.resource)
        too_soon = looked_us is not None and 0 <= state.time_us - looked_us < LOOK_EVERY_US
        if too_soon and watched.kept is None and state.armed is not False:
            return
        watched.looked_us[state.resource] = state.time_us
        deviation = watch.observe(state)
        if watched.kept is not None:
            watched.seen = True
            if not self._missing(watched):
                self._settle(watched)
        elif deviation is not None and not watched.ending and not watched.deviation:
            self._deviates(watched, state.resource, watch, deviation)

    def _stops(self, state: VehicleState) -> None:
        """Look whether a vehicle has stopped after a cancel; say once that it has not."""
        stopping = self._stopping.get(state.resource)
        if stopping is None:
            return
        watch, request = stopping.watch, stopping.request
        watch.observe(state)
        if watch.at_rest is False and self._clock.now_us() < stopping.due_us:
            return
        del self._stopping[state.resource]
        goes_on = watch.goes_on_from(stopping.place)
        if goes_on and self._stops_within_s(state.resource) is not None:
            text = (
                f"{state.resource} does NOT obey the cancel of {request.behavior} "
                f"({request.id}): {goes_on}. Use its own stop"
            )
            severity = AlertSeverity.CRITICAL
            self._say(Alert(_run(request.id), NOT_STOPPED, text, severity, (state.resource,)))

    def _deviates(
        self, watched: _Watched, vehicle: ResourceId, watch: Watch, deviation: Deviation
    ) -> None:
        behavior, name = watched.request.id, watched.request.behavior
        text = f"{vehicle}: {deviation.text}"
        ends = deviation.ends and not watch.commanded.comes_down
        what = f"{name} is ended" if ends else f"{name} goes on"
        if watch.commanded.comes_down and deviation.ends:
            what = f"{name}: {_DOWN}"
        severity = AlertSeverity.CRITICAL if deviation.ends else AlertSeverity.WARNING
        log.warning("%s: %s", behavior, text, extra={"resource": vehicle})
        self._say(Alert(_run(behavior), DEVIATION, f"{text}. {what}", severity, (vehicle,)))
        if deviation.ends:
            watched.deviation = text
        if ends:
            watched.ending = True
            self._end(behavior)

    # --- reports ----------------------------------------------------------------------------------

    def reported(self, report: BehaviorReport) -> BehaviorReport | None:
        """Take the report of an arbiter; return what goes on, None: it waits for telemetry."""
        watched = self._watched.get(report.id)
        if watched is None:
            return report
        if report.state is BehaviorState.RUNNING and not watched.begun:
            self._watch(watched, report.commanded)
        elif report.commanded is not None and watched.adopted:
            watched.watches.clear()
            self._watch(watched, report.commanded)
        if report.state is not BehaviorState.SUCCEEDED or watched.kept is not None:
            return report
        if watched.deviation or not self._missing(watched):
            return report
        watched.kept = report
        watched.timer = asyncio.create_task(self._settle_later(watched))
        return None

    def concluded(self, report: BehaviorReport) -> BehaviorReport:
        """Return an end as it is recorded: with the evidence, and as a failure where the vehicle
        was seen to do otherwise."""
        watched = self._watched.get(report.id)
        if watched is None or not report.state.terminal:
            return report
        if report.state is BehaviorState.CANCELLED:
            self._expect_stop(watched)
        report = replace(report, evidence=self._evidence(watched))
        if watched.deviation:
            if report.state in (BehaviorState.SUCCEEDED, BehaviorState.CANCELLED):
                return replace(
                    report, state=BehaviorState.FAILED, code=FAILED, reason=watched.deviation
                )
            reason = f"{watched.deviation}; {report.reason}" if report.reason else watched.deviation
            return replace(report, reason=reason)
        if report.state is BehaviorState.SUCCEEDED and not watched.ending:
            # Without a state since, the telemetry has nothing to say of the end.
            missing = self._missing(watched) if watched.seen or watched.kept is None else ""
            if missing:
                return replace(report, state=BehaviorState.FAILED, code=INCOMPLETE, reason=missing)
        return report

    def _expect_stop(self, watched: _Watched) -> None:
        for vehicle, watch in watched.watches.items():
            bound_s = self._stops_within_s(vehicle)
            if bound_s is None or self._by_vehicle.get(vehicle) is not watched:
                continue  # an operator, or another behavior, moves it now
            due_us = self._clock.now_us() + round(bound_s * US_PER_S)
            self._stopping[vehicle] = _Stopping(watched.request, watch, watch.here, due_us)

    async def _settle_later(self, watched: _Watched) -> None:
        await self._clock.sleep(self._settles_s)
        watched.timer = None
        self._settle(watched)

    def _settle(self, watched: _Watched) -> None:
        if watched.timer is not None:
            watched.timer.cancel()
            watched.timer = None
        report, behavior = watched.kept, watched.request.id
        if report is not None and self._watched.get(behavior) is watched:
            self._deliver(report)

    def _missing(self, watched: _Watched) -> str:
        parts = {vehicle: watch.missing() for vehicle, watch in watched.watches.items()}
        return "; ".join(f"{vehicle}: {text}" for vehicle, text in parts.items() if text)

    def _evidence(self, watched: _Watched) -> dict[str, Value]:
        """Of one vehicle; of several, by their names."""
        seen = {vehicle: watch.evidence() for vehicle, watch in watched.watches.items()}
        if len(seen) == 1:
            return next(iter(seen.values()))
        return {str(vehicle): evidence for vehicle, evidence in seen.items()}


def bounds_of(fleet: Fleet, vehicle: ResourceId) -> Bounds | None:
    """Return the bounds of a vehicle; None: the fleet says that it is not watched."""
    own = fleet.vehicles[vehicle].conformance or fleet.conformance
    return Bounds.of(fleet.conformance.bounds, own.bounds) if own.watched else None


def _run(behavior: str) -> RunId:
    return RunId(run_of(behavior))
