"""Executes behaviors on simulated resources, from start to end, and drains batteries."""

import logging
import math
from collections.abc import Callable, Collection, Container, Mapping

from msgspec.structs import replace

from m2pem.api.arbiter import BehaviorRequest
from m2pem.api.remaining import RemainingWork
from m2pem.fleet.behaviors import ADJUSTABLE
from m2pem.mission.catalogue import BehaviorState, ResourceId
from m2pem.simulation.course import RefusedError
from m2pem.simulation.event_queue import EventQueue, TimedCall
from m2pem.simulation.executions import (
    Aim,
    Body,
    Effect,
    EffectKind,
    Execution,
    Outcome,
    Part,
    Strike,
)
from m2pem.simulation.gimbals import aimed
from m2pem.simulation.kinematics import STANDING_LOAD
from m2pem.simulation.links import Links
from m2pem.simulation.payloads import SimPayload
from m2pem.simulation.planning import Assignment, Planner
from m2pem.simulation.pursuit import STEP_US, Pursuit, steer
from m2pem.simulation.state_file import Memory
from m2pem.simulation.trajectory import Plan
from m2pem.simulation.vehicles import SimVehicle

STEP = 0.05
"""Of a full battery."""


class Batteries:
    """`drained` is called when a battery has lost a step, and when it is empty."""

    def __init__(self, event_queue: EventQueue, drained: Callable[[SimVehicle, int], None]) -> None:
        self._event_queue = event_queue
        self._drained = drained
        self._entries: dict[ResourceId, TimedCall] = {}

    def look(self, vehicle: SimVehicle, now_us: int) -> None:
        """The vehicle's motion has changed: work out when its next step is lost."""
        entry = self._entries.pop(vehicle.id, None)
        if entry is not None:
            entry.cancel()
        left = vehicle.battery_at(now_us)
        if left <= 0:
            return
        level = max(0.0, (math.ceil(left / STEP - 1e-9) - 1) * STEP)
        due = vehicle.drained_us(level, now_us)
        if due is not None:
            self._entries[vehicle.id] = self._event_queue.at(
                due, lambda at_us: self._drained(vehicle, at_us), background=True
            )


def next_step(part: Part, planner: Planner, now_us: int) -> None:
    """Give the body its motion until it looks again; it waits for a target without telemetry."""
    body = part.body
    if isinstance(body, SimVehicle) and isinstance(part.chase, Pursuit):
        pose = body.pose(now_us)
        chase = part.chase
        station, velocity = pose.place, (0.0, 0.0, 0.0)
        if (target := planner.pose_of(chase.target, now_us)) is not None:
            station, velocity = chase.station(target), target.velocity
        phase = steer(
            body.kinematics,
            pose,
            station,
            velocity,
            speed_m_s=chase.speed_m_s,
            standing_load=1.0 if body.aloft(now_us) else STANDING_LOAD,
        )
        body.take(Plan([phase]), now_us)
    elif isinstance(body, SimPayload) and isinstance(part.chase, Aim):
        carrier = planner.pose_of(body.carrier, now_us)
        place = part.chase.place
        if part.chase.vehicle:
            target = planner.pose_of(part.chase.vehicle, now_us)
            place = target.place if target is not None else place
            carrier = carrier if target is not None else None
        if carrier is None:
            body.stop(now_us)
        else:
            gimbal = body.settings.gimbal
            body.take(Plan([aimed(gimbal, body.look(now_us), carrier, place)]), now_us)


SOONEST_US = 500_000
"""Between two looks at how far a vehicle has come."""

LEAST_PROGRESS_M = 1.0
"""Less than this is not reported."""

_ASIDE_M = 30.0
"""How much farther or nearer a vehicle may be on its way than its plan says, which rounds corners;
and a share of what is left."""

_ASIDE_SHARE = 0.1


def _look_at(part: Part, work: RemainingWork, now_us: int) -> None:
    """Find how far the body has come along its way, which ends with its plan."""
    body = part.body
    if not isinstance(body, SimVehicle):
        return
    tau, _ = body.track.warp.at(now_us)
    left_m = body.track.plan.level_m_left(tau)
    part.planned_m = expected_m = work.line.length_m - left_m
    aside_m = _ASIDE_M + _ASIDE_SHARE * max(0.0, left_m)
    if expected_m > 0:
        place = body.pose(now_us).place[:2]
        work.find(place, expected_m, expected_m - aside_m, expected_m + aside_m)


SCRIPTED = "a fault of the simulation"
"""The reason of what a fault of the fleet, or an answer, made fail."""

LONGEST_CATCH_UP_US = 3_600_000_000
"""A pursuit that was not observed for longer begins again where it was so long ago."""


class Simulation:
    """Knows every behavior, running or remembered. All calls are made at their time `now_us`.

    `changed` is called with every body whose motion changes. `lose_link` is called with the vehicle
    by the fault of that name. `silent`: resources that do not report what is left of a behavior
    while it goes on.
    """

    def __init__(
        self,
        *,
        event_queue: EventQueue,
        memory: Memory,
        bodies: Mapping[ResourceId, Body],
        planner: Planner,
        links: Links,
        logger: logging.Logger,
        changed: Callable[[Body, int], None],
        lose_link: Callable[[ResourceId, int], None],
        silent: Container[ResourceId] = frozenset(),
    ) -> None:
        self.memory = memory
        self._silent = silent
        self._event_queue = event_queue
        self._bodies = bodies
        self._planner = planner
        self._links = links
        self._logger = logger
        self._tell_changed = changed
        self._lose_link = lose_link
        self._batteries = Batteries(event_queue, self._drained)

    # --- commands -------------------------------------------------------------------------------

    def start(
        self, execution: Execution, request: BehaviorRequest, strike: Strike | None, now_us: int
    ) -> None:
        """Start a behavior, or report why not. It must be registered."""
        try:
            assignments = self._planner.assign(request, now_us)
            self._check_free(request)
            if execution.factor != 1:
                assignments = [each.time_scaled(execution.factor) for each in assignments]
        except RefusedError as refused:
            self.reject(execution, refused.code, refused.reason)
            return
        taken = {assignment.body.id for assignment in assignments}
        for preempted in request.preempts:
            other = self.memory.executions.get(preempted)
            if other is not None and not other.ended:
                self._finish(other, Outcome(BehaviorState.CANCELLED), now_us, keep=taken)
        self._links.report(execution, Outcome(BehaviorState.ACCEPTED))
        execution.strike = strike
        for assignment in assignments:
            self._begin(execution, assignment, now_us)
        self.memory.note_of(execution, EffectKind.START, now_us)
        self._links.report(execution, Outcome(BehaviorState.RUNNING))
        self._reschedule(execution, now_us)
        self.memory.save(execution)

    def reject(self, execution: Execution, code: str, reason: str) -> None:
        """Refuse a behavior before anything of it has happened."""
        execution.outcome = Outcome(BehaviorState.REJECTED, code, reason)
        self._logger.info("%s refused: %s", execution.id, reason)
        self._links.report(execution, execution.outcome)
        self.memory.save(execution)

    def cancel(self, execution: Execution, now_us: int) -> None:
        """End a behavior: its vehicles come to a stop first."""
        if execution.ended or execution.cancelling:
            return
        self.memory.note_of(execution, EffectKind.CANCEL, now_us)
        execution.cancelling = True
        execution.forget_timers()
        if execution.deaf:
            # Known to `query`, but not reported.
            execution.next_report(Outcome(BehaviorState.CANCELLED))
            self._finish(execution, Outcome(BehaviorState.CANCELLED), now_us)
            return
        if execution.strike is not None and execution.strike.end == "goes_on":
            everything = {part.body.id for part in execution.parts}
            self._finish(execution, Outcome(BehaviorState.CANCELLED), now_us, keep=everything)
            return
        for part in execution.parts:
            body = part.body
            if part.done or part.idle or not isinstance(body, SimVehicle):
                part.done = True
            elif part.chasing:
                body.stop(now_us)
            elif not body.held:
                body.hold(now_us)
        self._reschedule(execution, now_us)
        self.memory.save(execution)
        self._finish_cancelled(execution, now_us)

    def adjust(self, execution: Execution, speed_m_s: float, now_us: int) -> None:
        """Let its vehicles go on at another speed, if that is all that changes."""
        if execution.ended or execution.cancelling or execution.deaf:
            return
        if execution.behavior not in ADJUSTABLE:
            return
        speed_m_s /= execution.factor
        for part in execution.parts:
            body = part.body
            if isinstance(body, SimVehicle) and not part.done and body.adjust(speed_m_s, now_us):
                self._schedule(execution, part)
                self._expect_progress(execution, part)
                self._changed(body, now_us)
                self.memory.save(execution, body)

    def abandon(self, execution: Execution, reason: str, now_us: int) -> None:
        """Give a behavior up, because its vehicle is out of reach."""
        outcome = Outcome(BehaviorState.LOST, "LINK_LOST", reason)
        if execution.ended:
            execution.outcome = outcome
            self._links.report(execution, outcome)
            self.memory.save(execution)
        else:
            self._finish(execution, outcome, now_us)

    def hold(self, resource: ResourceId, now_us: int) -> None:
        """Stop a body, keeping what it does."""
        body = self._bodies[resource]
        if body.held:
            return
        body.held = True
        self._turn(body, EffectKind.HOLD, now_us)

    def resume(self, resource: ResourceId, now_us: int) -> None:
        """Let a body go on with what `hold` stopped."""
        body = self._bodies[resource]
        if not body.held:
            return
        body.held = False
        self._turn(body, EffectKind.RESUME, now_us)

    def tell_progress(self, vehicle: ResourceId, now_us: int) -> None:
        """Report how far a vehicle has come with what it does: it is the last that is heard."""
        execution = self.memory.executions.get(self._bodies[vehicle].behavior)
        if execution is not None and not execution.ended:
            self._tell_left(execution, now_us)

    def restore(self, executions: Collection[Execution], now_us: int) -> None:
        """Go on with behaviors from a file: all that they did since is scheduled, as past."""
        for execution in executions:
            if any(resource not in self._bodies for resource in execution.resources):
                continue  # the fleet has changed: it cannot be known any more
            self.memory.register(execution)
            if execution.outcome is not None and not execution.reported_end:
                self._links.report(execution, execution.outcome)
            if execution.ended or execution.deaf:
                continue
            for part in execution.parts:
                if part.chasing and not part.body.held and not execution.cancelling:
                    since = max(part.body.track.started_us, now_us - LONGEST_CATCH_UP_US)
                    part.timer = self._next_step(execution, part, since)
                else:
                    self._schedule(execution, part)
                self._expect_progress(execution, part)
            self._watch(execution)
        for body in self._bodies.values():
            if isinstance(body, SimVehicle):
                self._batteries.look(body, body.track.started_us)

    # --- from start to end ----------------------------------------------------------------------

    def _check_free(self, request: BehaviorRequest) -> None:
        for resource in request.resources:
            busy = self._bodies[resource].behavior
            if busy and busy not in request.preempts:
                journal, _, own = busy.rpartition("/")
                if journal:
                    own += (
                        f" of journal {journal}: resume or stop it there, or remove the state file"
                    )
                raise RefusedError(f"{resource} is busy with {own}", "RESOURCE_UNAVAILABLE")

    def _begin(self, execution: Execution, assignment: Assignment, now_us: int) -> None:
        body = assignment.body
        body.behavior, body.doing, body.held = execution.id, execution.behavior, False
        nothing = assignment.plan is None and assignment.chase is None
        part = Part(body, assignment.chase, idle=nothing, work=assignment.work)
        execution.parts.append(part)
        if assignment.plan is not None:
            body.take(assignment.plan, now_us)
        elif assignment.chase is not None:
            part.chasing = True
            self._step(execution, part, now_us)
        if assignment.cruise_m_s is not None and isinstance(body, SimVehicle):
            body.cruise_m_s = assignment.cruise_m_s
        execution.shots = assignment.shots or execution.shots
        if assignment.limit_s is not None:
            execution.limit_s = max(execution.limit_s or 0.0, assignment.limit_s)

    def _plan_ended(self, execution: Execution, part: Part, now_us: int) -> None:
        part.timer = None
        if execution.cancelling:
            part.done = True
            self._finish_cancelled(execution, now_us)
        elif part.chase is not None:
            part.chasing = True
            self._chase(execution, part, now_us)
        else:
            part.done = True
            all_done = all(other.done or other.idle for other in execution.parts)
            if all_done and not (execution.strike and execution.strike.sole):
                self._finish(execution, Outcome(BehaviorState.SUCCEEDED), now_us)
            else:
                self.memory.save(execution)

    def _finish_cancelled(self, execution: Execution, now_us: int) -> None:
        if not execution.ended and all(part.done or part.idle for part in execution.parts):
            self._finish(execution, Outcome(BehaviorState.CANCELLED), now_us)

    def _finish(
        self, execution: Execution, outcome: Outcome, now_us: int, keep: Collection[ResourceId] = ()
    ) -> None:
        """End it; its bodies stop, but those in `keep`: another behavior takes them on the move."""
        if outcome.state is BehaviorState.FAILED:
            self._tell_left(execution, now_us)
        execution.forget_timers()
        execution.outcome = outcome = self._with_shots(execution, outcome, now_us)
        for part in execution.parts:
            body = part.body
            if body.behavior != execution.id:
                continue
            body.behavior, body.doing, body.held = "", "", False
            if body.id not in keep:
                body.stop(now_us)
                self._settle(body, now_us)
        if execution.parts:
            self.memory.note_of(execution, EffectKind.END, now_us)
        self._links.report(execution, outcome)
        self.memory.save(execution)

    def _with_shots(self, execution: Execution, outcome: Outcome, now_us: int) -> Outcome:
        """Report what was taken, unless the link to the camera is lost."""
        shots = execution.shots
        if shots is None or outcome.state in (BehaviorState.LOST, BehaviorState.REJECTED):
            return outcome
        camera = next(each for each in execution.resources if "/" in each)
        outputs = shots.outputs(
            execution.id,
            execution.watch.at(now_us)[0],
            now_us,
            self._planner.payload_position(camera, now_us) if shots.count else None,
            done=outcome.state is BehaviorState.SUCCEEDED,
        )
        return replace(outcome, outputs=dict(outputs))

    def _struck(self, execution: Execution, strike: Strike, now_us: int) -> None:
        execution.timer = None
        code, reason = strike.error, SCRIPTED
        match strike.end:
            case "failed":
                outcome = Outcome(BehaviorState.FAILED, code or "FAILED", reason)
                self._finish(execution, outcome, now_us)
            case "lost":
                outcome = Outcome(BehaviorState.LOST, code or "LINK_LOST", reason)
                self._finish(execution, outcome, now_us)
            case "stalled":
                execution.forget_timers()
                execution.deaf = True
                for part in execution.parts:
                    part.body.stop(now_us)
                    self._settle(part.body, now_us)
                self.memory.save(execution)
            case "disarmed" | "falling":
                execution.forget_timers()
                for part in execution.parts:
                    part.done = True
                    if isinstance(part.body, SimVehicle):
                        part.body.fall(now_us, disarmed=strike.end == "disarmed")
                        self._changed(part.body, now_us)
            case "jumped":
                execution.strike = None
                self._watch(execution)
                for part in execution.parts:
                    if isinstance(part.body, SimVehicle):
                        part.body.jumped_m += strike.by_m
                        self._changed(part.body, now_us)
            case "lose_link":
                execution.strike = None
                self._watch(execution)
                for vehicle in execution.carriers:
                    self._lose_link(vehicle, now_us)
            case _:
                self._finish(execution, Outcome(BehaviorState.SUCCEEDED), now_us)

    # --- motion ---------------------------------------------------------------------------------

    def _turn(self, body: Body, kind: EffectKind, now_us: int) -> None:
        """Begin or end a hold of a body."""
        execution = self.memory.executions.get(body.behavior)
        self.memory.note(Effect(now_us, kind, body.id, body.behavior))
        if execution is not None and not (execution.cancelling or execution.deaf):
            part = next(part for part in execution.parts if part.body is body)
            if not part.idle:
                self._turn_part(execution, part, kind is EffectKind.HOLD, now_us)
            if part is execution.parts[0]:
                rate = 0.0 if kind is EffectKind.HOLD else 1.0
                execution.watch = execution.watch.turned(now_us, rate, 0.0)
                self._watch(execution)
        self._changed(body, now_us)
        self.memory.save(execution, body)

    def _turn_part(self, execution: Execution, part: Part, held: bool, now_us: int) -> None:
        if part.chasing:
            if part.timer is not None:
                part.timer.cancel()
            if held:
                part.body.stop(now_us)
            else:
                self._chase(execution, part, now_us)
            return
        if held:
            part.body.hold(now_us)
        else:
            part.body.go_on(now_us)
        self._schedule(execution, part)
        self._expect_progress(execution, part)

    def _step(self, execution: Execution, part: Part, now_us: int) -> None:
        next_step(part, self._planner, now_us)
        part.timer = self._next_step(execution, part, now_us)

    def _chase(self, execution: Execution, part: Part, now_us: int) -> None:
        self._step(execution, part, now_us)
        if part.chase and (reason := self._planner.strays(part.body, part.chase, now_us)):
            self._finish(execution, Outcome(BehaviorState.FAILED, "FAILED", reason), now_us)
            return
        self._changed(part.body, now_us)
        self.memory.save(execution)

    def _next_step(self, execution: Execution, part: Part, now_us: int) -> TimedCall:
        return self._event_queue.at(
            now_us + STEP_US, lambda at_us: self._chase(execution, part, at_us), background=True
        )

    def _reschedule(self, execution: Execution, now_us: int) -> None:
        for part in execution.parts:
            self._schedule(execution, part)
            self._expect_progress(execution, part)
            self._changed(part.body, now_us)
        self._watch(execution)

    def _expect_progress(self, execution: Execution, part: Part, after_us: int = 0) -> None:
        """Wait until so much more is done that it is worth a report, and until after `after_us`."""
        if part.work_timer is not None:
            part.work_timer.cancel()
            part.work_timer = None
        work, track = part.work, part.body.track
        if work is None or part.done or execution.cancelling or execution.deaf:
            return
        if part.body.id in self._silent:
            return
        due_m = max(work.next_report_m, part.planned_m + LEAST_PROGRESS_M)
        due = track.warp.when(track.plan.when_level_m_left(work.line.length_m - due_m))
        if due is not None and due_m < work.line.length_m:
            part.work_timer = self._event_queue.at(
                max(due, after_us),
                lambda at_us: self._progressed(execution, part, at_us),
                background=True,
            )

    def _progressed(self, execution: Execution, part: Part, now_us: int) -> None:
        part.work_timer = None
        if self._links.broken_of(execution) is None:
            self._tell_left(execution, now_us, worth_it=True)
        self._expect_progress(execution, part, now_us + SOONEST_US)

    def _tell_left(self, execution: Execution, now_us: int, *, worth_it: bool = False) -> None:
        """Report what is left of a behavior, if it is any less. `worth_it`: if much less."""
        part = next((part for part in execution.parts if part.work is not None), None)
        if part is None or part.work is None or execution.deaf or not execution.parts:
            return
        _look_at(part, part.work, now_us)
        left = part.work.to_report(None if worth_it else LEAST_PROGRESS_M)
        if left is not None:
            self._links.report(execution, Outcome(BehaviorState.RUNNING, remaining=dict(left)))
            self.memory.save(execution)

    def _schedule(self, execution: Execution, part: Part) -> None:
        """Wait for the end of a part's plan, or for the end of its braking."""
        if part.chasing and not execution.cancelling:
            return
        if part.timer is not None:
            part.timer.cancel()
            part.timer = None
        if part.idle or part.done:
            return
        track = part.body.track
        due = track.end_us
        if execution.cancelling and track.warp.target == 0:
            due = track.warp.settled_us if due is None else min(due, track.warp.settled_us)
        if due is not None:
            part.timer = self._event_queue.at(
                due, lambda at_us: self._plan_ended(execution, part, at_us)
            )

    def _watch(self, execution: Execution) -> None:
        """Wait for what ends the behavior by its own time."""
        if execution.timer is not None:
            execution.timer.cancel()
            execution.timer = None
        if execution.cancelling or execution.deaf:
            return
        strike = execution.strike
        if execution.limit_s is not None and not (
            strike and (strike.sole or strike.after_s < execution.limit_s)
        ):
            strike = Strike(execution.limit_s, "succeeded")
        if strike is None or strike.end == "goes_on":
            return
        due = execution.watch.when(strike.after_s)
        if due is not None:
            execution.timer = self._event_queue.at(
                due, lambda at_us: self._struck(execution, strike, at_us)
            )

    def _changed(self, body: Body, now_us: int) -> None:
        if isinstance(body, SimVehicle):
            self._batteries.look(body, now_us)
        self._tell_changed(body, now_us)

    def _settle(self, body: Body, now_us: int) -> None:
        """A body comes to rest by itself: report now, and again when it stands."""
        self._changed(body, now_us)
        track, end_us = body.track, body.track.end_us
        if end_us is not None and end_us > now_us:
            self._event_queue.at(end_us, lambda at_us: self._settled(body, track, at_us))

    def _settled(self, body: Body, track: object, now_us: int) -> None:
        if body.track is track:
            self._changed(body, now_us)

    def _drained(self, vehicle: SimVehicle, now_us: int) -> None:
        """The battery reached the next level: report, and stop when it is empty."""
        if vehicle.battery_at(now_us) <= 0:
            execution = self.memory.executions.get(vehicle.behavior)
            if execution is not None:
                reason = f"the battery of {vehicle.id} is empty"
                outcome = Outcome(BehaviorState.FAILED, "BATTERY_LOW", reason)
                self._finish(execution, outcome, now_us)
            vehicle.come_down(now_us)
            self.memory.save(None, vehicle)
            self._settle(vehicle, now_us)
        else:
            self._changed(vehicle, now_us)
