"""The simulated arbiter: commands behaviors on simulated vehicles and payloads."""

import asyncio
import json
import math
from collections.abc import AsyncIterator, Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import count
from pathlib import Path

from m2pem.api.arbiter import (
    ArbiterContext,
    BehaviorId,
    BehaviorReport,
    BehaviorRequest,
    Connection,
    Limits,
    ResolvedValue,
)
from m2pem.api.capabilities import ArbiterCapabilities
from m2pem.api.epoch_fence import EpochFence, run_of
from m2pem.api.telemetry import Detection, PayloadState, VehicleState
from m2pem.mission.catalogue import BehaviorSpec, BehaviorState, ResourceId
from m2pem.simulation.broadcast import DEFAULT_HZ, Broadcast
from m2pem.simulation.detectors import Detectors
from m2pem.simulation.event_queue import EventQueue
from m2pem.simulation.executions import Body, Effect, Execution, Strike
from m2pem.simulation.faults import DEVIATING, Fault, FaultList, altered
from m2pem.simulation.frame import FlatFrame
from m2pem.simulation.links import Links
from m2pem.simulation.payloads import SimPayload
from m2pem.simulation.planning import Planner
from m2pem.simulation.settings import own_faults, read_settings
from m2pem.simulation.simulation import SCRIPTED, Simulation
from m2pem.simulation.state_file import Memory, StateFile
from m2pem.simulation.trajectory import Warp
from m2pem.simulation.vehicles import SimVehicle, carrier_of
from m2pem.units import US_PER_S


@dataclass(eq=False)
class RadioRange:
    """Commands wait for a broken link; when it is broken for `lost_after_s`, all is lost."""

    _links: Links
    _event_queue: EventQueue
    _memory: Memory
    _simulation: Simulation
    _lost_after_s: Callable[[ResourceId], float]

    def command(
        self, execution: Execution, name: str, act: Callable[[int], None], now_us: int
    ) -> None:
        """Do something with a behavior, now or when the links to its vehicles are restored."""
        vehicle = self._links.broken_of(execution)
        if vehicle is None:
            act(now_us)
        elif self._links.lost(vehicle):
            self._simulation.abandon(execution, f"the link to {vehicle} is lost", now_us)
        else:
            # Another of its links may be broken still when this one is mended.
            self._links.defer(
                vehicle,
                f"{name} {execution.id}",
                lambda at_us: self.command(execution, name, act, at_us),
            )

    def lose(self, vehicle: ResourceId, now_us: int) -> None:
        """Cut the link to a vehicle; harmless when it is cut already."""
        if not self._links.up(vehicle):
            return
        self._simulation.tell_progress(vehicle, now_us)
        self._links.cut(vehicle)
        cuts = self._links.cuts(vehicle)
        after_us = round(self._lost_after_s(vehicle) * US_PER_S)
        self._event_queue.at(now_us + after_us, lambda at_us: self._give_up(vehicle, cuts, at_us))

    def _give_up(self, vehicle: ResourceId, cuts: int, now_us: int) -> None:
        if self._links.up(vehicle) or self._links.cuts(vehicle) != cuts:
            return  # it was mended in time
        self._links.give_up(vehicle)
        reason = f"no telemetry of {vehicle} for {self._lost_after_s(vehicle):g} s"
        for execution in list(self._memory.executions.values()):
            if vehicle in execution.carriers and not execution.reported_end:
                self._simulation.abandon(execution, reason, now_us)


LOST_AFTER_S = 3.0


def bodies_at_home(
    connections: Mapping[ResourceId, Connection], origin: tuple[float, float, float], now_us: int
) -> dict[ResourceId, Body]:
    """Return simulated resources that stand where their settings say.

    Raises:
        FleetError: a setting cannot be used.
    """
    frame, places = FlatFrame(origin), count()
    bodies: dict[ResourceId, Body] = {}
    for resource, connection in connections.items():
        settings = read_settings(connection, origin)
        if "/" in resource:
            bodies[resource] = SimPayload(connection, settings, now_us)
        else:
            bodies[resource] = SimVehicle(connection, settings, frame, next(places), now_us)
    return bodies


_ENDS = {
    "fail": "failed",
    "stall": "stalled",
    "lose_link": "lose_link",
    "disarm": "disarmed",
    "fall": "falling",
    "end_early": "succeeded",
    "go_on": "goes_on",
    "jump": "jumped",
}
"""The end of a `Strike` by the kind of a fault."""


class SimArbiter:
    """Implements `m2pem.api.Arbiter`; its settings in a fleet file: docs/simulation.md.

    `telemetry_hz`: of every resource that does not say its own; 0 reports changes alone, so that
    nothing happens while nothing moves, and then links can't be watched by silence. `bodies`: go on
    with these, in place of new ones at home.

    Beside the protocol, tests and rehearsals look at `effects`, `expects`, `searching`, `vehicles`
    and `broadcast`, and use `script`, `scale_time`, `inject`, `lose_link` and `restore_link`.
    """

    capabilities = ArbiterCapabilities(
        adjusts=True, sights=True, addresses=True, fences=True, straight=True
    )

    def __init__(
        self,
        connections: Mapping[ResourceId, Connection],
        context: ArbiterContext,
        telemetry_hz: float | None = None,
        bodies: Mapping[ResourceId, Body] | None = None,
    ) -> None:
        self._connections = dict(connections)
        self._clock = context.clock
        self._logger = context.logger
        self._context = context
        now_us = context.clock.now_us()
        self._frame = frame = FlatFrame(context.origin)
        self._bodies = dict(bodies or bodies_at_home(connections, context.origin, now_us))
        self._settings = {resource: body.settings for resource, body in self._bodies.items()}
        default_hz = DEFAULT_HZ if telemetry_hz is None else telemetry_hz
        self._rates_hz = {
            resource: default_hz if settings.telemetry_hz is None else settings.telemetry_hz
            for resource, settings in self._settings.items()
        }
        self._event_queue = EventQueue(context.clock, context.logger)
        self._links = Links()
        self._memory = Memory()
        self.broadcast = Broadcast(
            self._bodies, self._rates_hz, frame, self._event_queue, self._audible
        )
        self._planner = Planner(self._connections, context, frame, self._bodies)
        self._simulation = Simulation(
            event_queue=self._event_queue,
            memory=self._memory,
            bodies=self._bodies,
            planner=self._planner,
            links=self._links,
            logger=context.logger,
            changed=self._moved,
            lose_link=self._lose_link,
            silent={name for name, each in self._settings.items() if not each.reports_left},
        )
        self._reach = RadioRange(
            self._links, self._event_queue, self._memory, self._simulation, self._lost_after_s
        )
        self._detectors = Detectors(
            self._bodies, frame, self._event_queue, self._detected, self._keep_found
        )
        self._epochs = EpochFence()
        self._faults = {
            resource: FaultList(own_faults(resource, self._settings)) for resource in self._bodies
        }
        self._scripts: dict[BehaviorId, Strike] = {}
        self._factors: dict[BehaviorId, float] = {}
        self._connected = False
        self._late: list[tuple[SimPayload, Detection]] = []
        self._listener: asyncio.Task[None] | None = None

    # --- the protocol ---------------------------------------------------------------------------

    def catalogue(self, resource: ResourceId) -> Sequence[BehaviorSpec]:
        return self._planner.catalogue(resource)

    def limits(self, resource: ResourceId) -> Limits:
        """The bounds that hold for the resource: how long it takes to stop from full speed."""
        stopping_s = 0.0
        if "/" not in resource:
            stopping_s = self._settings[resource].kinematics.stopping_s
        silent = self._rates_hz[resource] == 0
        return Limits(
            lost_after_s=math.inf if silent else self._lost_after_s(resource),
            hold_within_s=stopping_s + 1.0,
            cancel_timeout_s=stopping_s + 5.0,
        )

    def addresses(self, resource: ResourceId) -> Sequence[str]:
        """A vehicle is what its state file says; without one it exists only here."""
        state = self._settings[resource].state
        return [f"{Path(state).resolve()}: {resource}"] if state else []

    async def connect(self) -> None:
        """Begin to simulate. What a state file knows goes on as if it had never been left.

        Raises:
            StateFileError: a state file cannot be used.
        """
        now_us = self._clock.now_us()
        began_us, known = self._open_files(now_us)
        self._detectors.begin(began_us, lambda payload: known.get(payload, ()))
        self._plan_link_losses(began_us)
        self._links.muted = True
        self._event_queue.run_due(now_us)
        self._links.muted = False
        self.broadcast.begin(now_us)
        for payload, detection in self._late:
            self.broadcast.send(payload, now_us, (detection,))
        self._late.clear()
        self._connected = True
        self._event_queue.wake()
        if self._detectors.strangers:
            self._listener = asyncio.get_running_loop().create_task(self._listen())

    async def start(self, request: BehaviorRequest) -> None:
        """Start a behavior; see `BehaviorRequest`."""
        now_us = self._catch_up()
        self._require("start", request.id, request.epoch)
        known = self._memory.executions.get(request.id)
        if known is not None and (not known.ended or request.epoch <= known.epoch):
            known.epoch = max(known.epoch, request.epoch)
            return
        execution = Execution(
            request.id, request.epoch, request.behavior, request.resources, Warp(now_us)
        )
        execution.number = known.number if known is not None else 0
        self._memory.register(execution)
        self._reach.command(
            execution, "start", lambda at_us: self._start(execution, request, at_us), now_us
        )

    async def cancel(self, behavior: BehaviorId, epoch: int) -> None:
        """End a behavior: a vehicle slows down first, a payload ends at once."""
        now_us = self._catch_up()
        self._require("cancel", behavior, epoch)
        execution = self._memory.executions.get(behavior)
        if execution is None or execution.ended:
            return
        self._reach.command(
            execution, "cancel", lambda at_us: self._simulation.cancel(execution, at_us), now_us
        )

    async def adjust(
        self, behavior: BehaviorId, epoch: int, parameters: Mapping[str, ResolvedValue]
    ) -> None:
        """Go on at another `speed`, in m/s; other parameters stay."""
        now_us = self._catch_up()
        speed = parameters.get("speed")
        execution = self._memory.executions.get(behavior)
        self._require("adjustment", behavior, epoch)
        if execution is None or execution.ended:
            return
        if isinstance(speed, int | float) and speed > 0:
            requested = float(speed)
            self._reach.command(
                execution,
                "adjust",
                lambda at_us: self._simulation.adjust(execution, requested, at_us),
                now_us,
            )

    async def query(self, behavior: BehaviorId, native_ref: str | None) -> BehaviorReport:
        """The report that holds now; UNKNOWN, with number 0, if the behavior is not known."""
        self._catch_up()
        self._admit(behavior, self._context.epoch_of(behavior))
        execution, epoch = self._memory.executions.get(behavior), self._epochs.newest(behavior)
        if execution is None or execution.last is None:
            reason = "the simulation knows no such behavior"
            return BehaviorReport(behavior, 0, BehaviorState.UNKNOWN, reason=reason, epoch=epoch)
        held = any(part.body.held for part in execution.parts)
        return replace(execution.last, held=held, epoch=epoch)

    async def fence(self, run: str, epoch: int) -> None:
        """Refuse commands of lower epochs of a run; the state files keep that."""
        self._admit(run, epoch)

    async def disown(self, run: str) -> None:
        """Do nothing: simulated vehicles go on by themselves, and nothing is sent to them again."""

    async def hold(self, resource: ResourceId) -> None:
        """Stop the resource, keeping its behavior. A vehicle brakes on its path."""
        self._turn(resource, "hold")

    async def resume(self, resource: ResourceId) -> None:
        self._turn(resource, "resume")

    def reports(self) -> AsyncIterator[BehaviorReport]:
        """Reports as they come, for one reader, until `close`."""
        return self._links.reports.read()

    def telemetry(self) -> AsyncIterator[VehicleState | PayloadState]:
        """States as they come, for one reader, until `close`; a slow one misses old states."""
        return self.broadcast.states.read()

    async def close(self) -> None:
        """Stop simulating. Without a state file the vehicles are gone."""
        await self._event_queue.close()
        listener, self._listener = self._listener, None
        if listener is not None:
            listener.cancel()
            await asyncio.gather(listener, return_exceptions=True)
        self._links.reports.close()
        self.broadcast.states.close()
        for file in dict.fromkeys(self._memory.files.values()):
            file.close()
        self._memory.files = {}

    def sight(self, resource: ResourceId) -> VehicleState | None:
        """How a vehicle is now, if its link is up."""
        body = self._bodies.get(resource)
        if not isinstance(body, SimVehicle) or not self._audible(resource):
            return None
        return body.state(self._catch_up(), self._frame)

    # --- for tests and rehearsals ---------------------------------------------------------------

    @property
    def effects(self) -> list[Effect]:
        """What physically happened, oldest first; the newest 10,000."""
        return list(self._memory.effects)

    @property
    def expects(self) -> bool:
        """Whether anything is to come by itself: a behavior's end, a planned detection, a fault.

        Not what may go on for ever: motion without an end, batteries that drain, telemetry.
        """
        return self._event_queue.expected > 0

    @property
    def searching(self) -> bool:
        """Whether a vehicle at work may yet come near something that its detector finds."""
        return self._detectors.searching

    @property
    def vehicles(self) -> Sequence[SimVehicle]:
        return [body for body in self._bodies.values() if isinstance(body, SimVehicle)]

    def doing(self, resource: ResourceId) -> BehaviorId:
        """Return the behavior that a resource does now, whatever was reported; "": none."""
        return self._bodies[resource].behavior

    def script(self, behavior: BehaviorId, after_s: float, end: str, error: str = "") -> None:
        """Say, before it starts, how a behavior ends, instead of by its motion.

        `end`: "failed", "succeeded", "stalled" or "lost". A pause does not count in `after_s`.
        """
        if end not in ("failed", "succeeded", "stalled", "lost"):
            raise ValueError(f"a behavior ends failed, succeeded, stalled or lost, not {end!r}")
        self._scripts[behavior] = Strike(after_s, end, error, sole=True)

    def scale_time(self, behavior: BehaviorId, factor: float) -> None:
        """Say, before it starts, how many times as long a behavior takes as by its motion."""
        self._factors[behavior] = factor

    def inject(self, resource: ResourceId, fault: Fault) -> None:
        """Let a fault strike the next behaviors of a resource."""
        self._faults[resource].add(fault)

    def lose_link(self, resource: ResourceId) -> None:
        """Cut the link to a vehicle and its payloads. It goes on with what it does; its behaviors
        are LOST, and it stops, when its `lost_after` is over."""
        self._reach.lose(carrier_of(resource), self._catch_up())

    def restore_link(self, resource: ResourceId) -> None:
        """Mend the link: what could not be said or commanded meanwhile is now."""
        self._restore_link(carrier_of(resource), self._catch_up())

    # --- behind it ------------------------------------------------------------------------------

    def _catch_up(self) -> int:
        now_us = self._clock.now_us()
        self._event_queue.run_due(now_us)
        return now_us

    def _admit(self, behavior: BehaviorId, epoch: int) -> None:
        before = self._epochs.newest(behavior)
        self._epochs.admit(behavior, epoch)
        if epoch > max(before, 1):  # the first is kept with the behaviors of the run
            for file in dict.fromkeys(self._memory.files.values()):
                file.keep_epoch(run_of(behavior), epoch)

    def _require(self, what: str, behavior: BehaviorId, epoch: int) -> None:
        self._admit(behavior, epoch)
        self._epochs.require(what, behavior, epoch)

    def _start(self, execution: Execution, request: BehaviorRequest, now_us: int) -> None:
        execution.watch = Warp(now_us)
        execution.factor = self._factors.pop(request.id, 1.0)
        strike = self._scripts.pop(request.id, None)
        fault = self._take_fault(request) if strike is None else None
        if fault is not None and fault.kind == "reject":
            self._simulation.reject(execution, fault.error or "REJECTED", SCRIPTED)
            return
        if fault is not None:
            if fault.kind in ("skip", "drift"):
                request = altered(request, fault)
            else:
                strike = Strike(fault.after_s, _ENDS[fault.kind], fault.error, by_m=fault.by_m)
        self._simulation.start(execution, request, strike, now_us)
        if fault is not None and fault.kind in DEVIATING:
            self._show(execution, now_us)

    def _show(self, execution: Execution, now_us: int) -> None:
        """Publish what a vehicle does that deviates, also where only changes are published."""
        bodies = [part.body for part in execution.parts]
        for body in bodies:
            self.broadcast.send(body, now_us)
        moves = any(isinstance(each, SimVehicle) and each.pose(now_us).speed for each in bodies)
        if not execution.ended or moves:
            again_us = now_us + US_PER_S
            self._event_queue.at(again_us, partial(self._show, execution), background=True)

    def _take_fault(self, request: BehaviorRequest) -> Fault | None:
        for resource in request.resources:
            if resource in self._faults:
                fault = self._faults[resource].take(request.behavior)
                if fault is not None:
                    self._keep_taken(resource, request.behavior)
                    return fault
        return None

    def _turn(self, resource: ResourceId, command: str) -> None:
        now_us = self._catch_up()
        if resource not in self._bodies:
            self._logger.warning("%s of %s ignored: it is not simulated here", command, resource)
            return
        act = self._simulation.hold if command == "hold" else self._simulation.resume
        vehicle = carrier_of(resource)
        if self._links.up(vehicle):
            act(resource, now_us)
        else:
            # Of hold and resume the newest counts.
            self._links.defer(vehicle, f"turn {resource}", lambda at_us: act(resource, at_us))

    def _lose_link(self, vehicle: ResourceId, now_us: int) -> None:
        self._reach.lose(vehicle, now_us)

    def _plan_link_losses(self, began_us: int) -> None:
        for resource, settings in self._settings.items():
            if "/" in resource:
                continue  # it has its vehicle's settings, and its link
            for loss in settings.link_lost:
                at_us = began_us + round(loss.at_s * US_PER_S)
                lose = partial(self._lose_link, resource)
                self._event_queue.at(at_us, lose, background=True)
                if loss.for_s < math.inf:
                    until_us = at_us + round(loss.for_s * US_PER_S)
                    self._event_queue.at(until_us, partial(self._restore_link, resource))

    def _restore_link(self, vehicle: ResourceId, now_us: int) -> None:
        self._links.mend(vehicle, now_us)
        for body in self._of_vehicle(vehicle):
            self.broadcast.send(body, now_us)

    def _lost_after_s(self, resource: ResourceId) -> float:
        own = self._connections[resource].lost_after_s if resource in self._connections else None
        return LOST_AFTER_S if own is None else own

    def _of_vehicle(self, vehicle: ResourceId) -> Iterable[Body]:
        return [body for body in self._bodies.values() if carrier_of(body.id) == vehicle]

    def _audible(self, resource: ResourceId) -> bool:
        return self._links.up(carrier_of(resource))

    def _moved(self, body: Body, now_us: int) -> None:
        self.broadcast.send(body, now_us)
        if isinstance(body, SimVehicle):
            self._detectors.moved(body.id, now_us)

    def _detected(self, payload: SimPayload, detection: Detection, now_us: int) -> None:
        if not self._connected:
            # What was found while no executive was there is reported when one is.
            self._late.append((payload, detection))
        elif self._links.up(payload.carrier):
            self.broadcast.send(payload, now_us, (detection,))
        else:
            self._links.defer(
                payload.carrier,
                f"detection {payload.id} {detection.time_us} {detection.type}",
                lambda at_us: self._detected(payload, detection, at_us),
            )

    async def _listen(self) -> None:
        async for state in self._context.bus.subscribe():
            if isinstance(state, VehicleState) and state.position is not None:
                self._detectors.vehicle_moved(state.resource, state.position, self._clock.now_us())

    # --- state files ----------------------------------------------------------------------------

    def _open_files(self, now_us: int) -> tuple[int, Mapping[ResourceId, Sequence[int]]]:
        """Read what the files know; when the simulation began, and what detectors had found."""
        files: dict[str, StateFile] = {}
        by_resource: dict[ResourceId, StateFile] = {}
        for resource, settings in self._settings.items():
            if settings.state:
                file = files.get(settings.state)
                file = file or StateFile(settings.state, str(self._context.journal))
                files[settings.state] = by_resource[resource] = file
        began_us = now_us
        found: dict[ResourceId, Sequence[int]] = {}
        executions: list[Execution] = []
        for file in files.values():
            began_us = min(began_us, int(file.meta("began_us", str(now_us))))
            file.load_bodies(self._bodies)
            executions += file.load_behaviors(self._bodies, self._frame)
        for resource, file in by_resource.items():
            found[resource] = json.loads(file.meta(f"found {resource}", "[]"))
            for behavior in json.loads(file.meta(f"struck {resource}", "[]")):
                self._faults[resource].take(behavior)
        self._memory.files = by_resource
        for execution in executions:
            self._epochs.admit(execution.id, execution.epoch)
        for file in files.values():
            for run, epoch in file.epochs().items():
                self._epochs.admit(run, epoch)
        self._links.muted = True
        self._simulation.restore(executions, now_us)
        return began_us, found

    def _keep_taken(self, resource: ResourceId, behavior: str) -> None:
        """Keep in the file that a fault has struck, which does not strike again after a restart."""
        file = self._memory.files.get(resource)
        if file is not None:
            taken = json.loads(file.meta(f"struck {resource}", "[]"))
            file.set_meta(f"struck {resource}", json.dumps([*taken, behavior]))

    def _keep_found(self, payload: ResourceId, found: Iterable[int]) -> None:
        file = self._memory.files.get(payload)
        if file is not None:
            file.set_meta(f"found {payload}", json.dumps(sorted(found)))
