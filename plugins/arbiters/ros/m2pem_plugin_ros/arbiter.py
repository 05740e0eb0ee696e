"""The arbiter of ROS vehicles and payloads. Its catalogue needs no ROS, and no connection."""

import asyncio
import math
import os
from collections.abc import AsyncIterator, Callable, Collection, Mapping, Sequence
from dataclasses import replace

from m2pem.api import (
    ArbiterContext,
    AsyncQueue,
    BehaviorId,
    BehaviorReport,
    BehaviorRequest,
    BehaviorSpec,
    BehaviorState,
    BehaviorTracker,
    Connection,
    Limits,
    LinkState,
    PayloadState,
    ResolvedValue,
    ResourceId,
    VehicleState,
)
from m2pem_plugin_ros.catalogue import LEVEL, PAYLOAD
from m2pem_plugin_ros.checkpoint import Kept, native_ref, read_native_ref
from m2pem_plugin_ros.connections import Installation, Station
from m2pem_plugin_ros.drivers.driver import Driver, Seat
from m2pem_plugin_ros.drivers.driver import make_driver as driver_of_the_fleet
from m2pem_plugin_ros.log_throttle import Complaints
from m2pem_plugin_ros.settings import DriverName, read_detectors, read_payloads, read_settings
from m2pem_plugin_ros.vehicle import Post, Vehicle

LOST_AFTER_S = 3.0
HOLD_WITHIN_S = 6.0
BRAKING_BEGINS_WITHIN_S = 2.0
CANCEL_TIMEOUT_S = 10.0

HEARD_WITHIN_S = 5.0
"""In real time, as DDS takes it to find who is there; `connect` waits for vehicles no longer."""

ATTEND_EVERY_S = 0.2
PAYLOADS_EVERY = 5
"""Times that vehicles are attended to for each time that their payloads are told of."""

LATE = 2.0
"""So many times as long as that since the last look: this process was held up."""

STATES_WAITING = 1000

MakeStation = Callable[[Installation], Station]


def _station(installation: Installation) -> Station:
    from m2pem_plugin_ros.connections import DdsStation  # noqa: PLC0415  # starting up must be fast

    return DdsStation(installation)


class RosArbiter:
    """Implements `m2pem.api.AdjustingArbiter`, `ReclaimingArbiter` and `DetectingArbiter`. What a
    fleet may say of it: docs/ros.md.

    `make_driver` and `make_station` are for tests without ROS.

    Raises:
        PluginError: a connection cannot be used; the text names the resource and the key.
    """

    takes_one_vehicle = True

    def __init__(
        self,
        connections: Mapping[ResourceId, Connection],
        context: ArbiterContext,
        make_driver: Callable[[Seat], Driver] = driver_of_the_fleet,
        make_station: MakeStation = _station,
    ) -> None:
        self._connections = connections
        self._context = context
        vehicles = read_settings(connections)
        self._settings = {**vehicles, **read_payloads(connections, vehicles)}
        self._detectors = read_detectors(connections, self._settings)
        self._make_driver = make_driver
        self._make_station = make_station
        self._station: Station | None = None
        self._ledger = BehaviorTracker(self._taken, context.logger)
        self._states: AsyncQueue[VehicleState | PayloadState] = AsyncQueue(
            STATES_WAITING, _may_be_missed
        )
        self._vehicles: dict[ResourceId, Vehicle] = {}
        self._asked: set[BehaviorId] = set()
        self._unknown: dict[BehaviorId, tuple[Kept, str | None]] = {}
        self._attending: asyncio.Task[None] | None = None

    # --- what is offered ------------------------------------------------------------------------

    def catalogue(self, resource: ResourceId) -> Sequence[BehaviorSpec]:
        """What a vehicle, or a payload with a node, can do; other payloads are carried, no more."""
        if resource not in self._settings:
            return ()
        own, usual = self._settings[resource].own_behaviors, PAYLOAD if "/" in resource else LEVEL
        known = {spec.name for spec in usual}
        return (*usual, *(spec for spec in own if spec.name not in known))

    @property
    def detectors(self) -> Collection[ResourceId]:
        """Payloads that are listened to: they have a `topic`, or are marked `detector: true`."""
        return self._detectors.keys()

    def _taken(self, resource: ResourceId) -> Sequence[BehaviorSpec]:
        """A payload may be held by what its vehicle does; what it does itself comes first."""
        vehicle = ResourceId(resource.partition("/")[0])
        of_vehicle = self.catalogue(vehicle) if vehicle != resource else ()
        return (*of_vehicle, *self.catalogue(resource))

    def limits(self, resource: ResourceId) -> Limits:
        """The bounds that hold for a vehicle or a payload. Detectors may be silent for ever."""
        if resource not in self._settings:
            return Limits(math.inf, HOLD_WITHIN_S, CANCEL_TIMEOUT_S)
        own = self._connections[resource].lost_after_s
        settings = self._settings[resource]
        hold_within_s = HOLD_WITHIN_S
        if settings.driver is DriverName.BASE:
            braking_s = settings.bounds.speed_m_s / settings.bounds.acceleration_m_s2
            hold_within_s = max(hold_within_s, BRAKING_BEGINS_WITHIN_S + braking_s)
        cancel_timeout_s = max(CANCEL_TIMEOUT_S, 1.5 * hold_within_s)
        return Limits(LOST_AFTER_S if own is None else own, hold_within_s, cancel_timeout_s)

    def addresses(self, resource: ResourceId) -> Sequence[str]:
        """The namespace in its ROS domain."""
        settings = self._settings.get(resource)
        if settings is None:
            return []
        domain: int | str | None = settings.domain_id
        if domain is None:
            domain = os.environ.get("ROS_DOMAIN_ID") or 0
        return [f"domain {domain}, namespace {settings.namespace or '/'}"]

    # --- life -----------------------------------------------------------------------------------

    async def connect(self) -> None:
        """Listen to all vehicles; returns when all were heard, or soon.

        Raises:
            RosError: ROS, or a package of it that a driver needs, is not installed or not usable.
        """
        self._station = self._make_station(
            Installation(
                self._connections,
                self._settings,
                self._detectors,
                self._context,
                self._states.put,
            )
        )
        try:
            instruments = await self._station.open()
            for resource, settings in self._settings.items():
                connection, limits = self._connections[resource], self.limits(resource)
                post = Post(connection, settings, self._context, self._ledger, limits)
                self._vehicles[resource] = Vehicle(post, instruments[resource], self._make_driver)
            opened = await asyncio.gather(
                *(vehicle.open() for vehicle in self._vehicles.values()), return_exceptions=True
            )
            for outcome in opened:
                if isinstance(outcome, BaseException):
                    raise outcome
        except BaseException:
            await self._disconnect()
            raise
        await self._until_heard()
        for vehicle in self._vehicles.values():
            vehicle.listen_from_now()
        self._attending = asyncio.get_running_loop().create_task(self._attend())

    async def close(self) -> None:
        """Listen no more. Vehicles keep doing what they do."""
        await self._disconnect()
        self._states.close()
        self._ledger.close()

    # --- behaviors ------------------------------------------------------------------------------

    async def start(self, request: BehaviorRequest) -> None:
        """Start a behavior; see `BehaviorRequest`."""
        asked = request.id in self._asked
        self._asked.discard(request.id)
        kept = Kept(request.resources, request.behavior, request.epoch, request.parameters)
        if self._ledger.admit(request, lambda: native_ref(kept), self._refusal):
            vehicle = self._vehicles[self._doers(request.resources)[0]]
            await vehicle.take(request, look_first=asked)

    async def cancel(self, behavior: BehaviorId, epoch: int) -> None:
        """Stop the vehicle that does it, or that may do it although it said that it does not."""
        self._take_up(behavior)
        if self._ledger.may_cancel(behavior, epoch):
            for vehicle in self._doing(behavior):
                vehicle.cancel(behavior)

    async def adjust(
        self, behavior: BehaviorId, epoch: int, parameters: Mapping[str, ResolvedValue]
    ) -> None:
        """Go on with these parameters; those that have no sense are left as they are."""
        if self._ledger.may_adjust(behavior, epoch):
            sane = {name: value for name, value in parameters.items() if _is_sane(value)}
            for vehicle in self._doing(behavior) if sane else ():
                vehicle.adjust(behavior, sane)

    async def hold(self, resource: ResourceId) -> None:
        """Have a vehicle stand still at once."""
        if resource in self._vehicles:
            self._vehicles[resource].hold()

    async def resume(self, resource: ResourceId) -> None:
        """Have a vehicle go on."""
        if resource in self._vehicles:
            self._vehicles[resource].resume()

    async def reclaim(self, resource: ResourceId) -> str:
        """A vehicle that was lost is heard again: have it end what it goes on with."""
        return await self._vehicles[resource].reclaim() if resource in self._vehicles else ""

    async def query(self, behavior: BehaviorId, native_ref: str | None) -> BehaviorReport:
        """What is known; after a restart, what the vehicle itself says. Nothing is begun."""
        known = self._ledger.last(behavior)
        if known.state is not BehaviorState.UNKNOWN:
            return known
        kept = read_native_ref(native_ref) if native_ref else None
        if kept is None:
            return await self._search(behavior, known)
        resource = next(iter([*self._doers(kept.resources), *kept.resources]), ResourceId(""))
        if resource not in self._vehicles:
            kind = "payload with a node" if "/" in resource else "vehicle"
            return replace(known, reason=f"there is no {kind} '{resource}' any more")
        return await self._look(self._vehicles[resource], behavior, kept, native_ref)

    # --- streams --------------------------------------------------------------------------------

    def reports(self) -> AsyncIterator[BehaviorReport]:
        """Reports as they come, for one reader, until `close`."""
        return self._ledger.reports()

    def telemetry(self) -> AsyncIterator[VehicleState | PayloadState]:
        """States as they come, for one reader, until `close`; a slow one misses old states, but no
        detection."""
        return self._states.read()

    # --- inside ---------------------------------------------------------------------------------

    async def _until_heard(self) -> None:
        waits = [asyncio.ensure_future(v.heard_once.wait()) for v in self._vehicles.values()]
        if not waits:
            return
        try:
            await asyncio.wait(waits, timeout=HEARD_WITHIN_S)
        finally:
            for wait in waits:
                wait.cancel()
            await asyncio.gather(*waits, return_exceptions=True)
        for resource, vehicle in self._vehicles.items():
            if not vehicle.heard_once.is_set():
                where = vehicle.absence
                self._context.logger.warning("%s: it was not heard yet: %s", resource, where)

    async def _disconnect(self) -> None:
        attending, self._attending = self._attending, None
        if attending is not None:
            attending.cancel()
            await asyncio.gather(attending, return_exceptions=True)
        vehicles, self._vehicles = self._vehicles, {}
        await asyncio.gather(*(vehicle.close() for vehicle in vehicles.values()))
        station, self._station = self._station, None
        if station is not None:
            await station.close()

    def _refusal(self, request: BehaviorRequest) -> str:
        doers = self._doers(request.resources)
        if len(doers) != 1:
            return f"{request.behavior} takes one vehicle or payload, and has {len(doers)}"
        resource = doers[0]
        if all(spec.name != request.behavior for spec in self.catalogue(resource)):
            return f"{resource} has no behavior '{request.behavior}'; its vehicle is to have a role"
        allowed = self._connections[resource].behaviors
        if allowed is not None and request.behavior not in allowed:
            return f"the fleet does not allow {resource} the behavior '{request.behavior}'"
        if resource not in self._vehicles:
            return "the arbiter is not connected"
        return self._vehicles[resource].refusal(request)

    def _doers(self, resources: Sequence[ResourceId]) -> list[ResourceId]:
        """Who is commanded: vehicles, or without any, payloads with a node of their own."""
        vehicles = [resource for resource in resources if "/" not in resource]
        return vehicles or [resource for resource in resources if resource in self._settings]

    def _doing(self, behavior: BehaviorId) -> list[Vehicle]:
        return [vehicle for vehicle in self._vehicles.values() if vehicle.doing == behavior]

    async def _search(self, behavior: BehaviorId, unknown: BehaviorReport) -> BehaviorReport:
        """Nothing was kept of it: ask every vehicle that could do it without us."""
        self._asked.add(behavior)
        candidates = [
            vehicle
            for resource, vehicle in self._vehicles.items()
            if vehicle.settings.driver is not DriverName.BASE
            and self._ledger.holder(resource) is None
        ]
        looks = []
        for vehicle in candidates:
            kept = Kept((vehicle.resource,), "", 0, {})
            looks.append(self._look(vehicle, behavior, kept, None))
        for found in await asyncio.gather(*looks):
            if found.state is not BehaviorState.UNKNOWN:
                self._asked.discard(behavior)
                return found
        return unknown

    def _take_up(self, behavior: BehaviorId) -> None:
        """To be ended, what a vehicle did not know after a restart is its behavior once more."""
        kept, reference = self._unknown.pop(behavior, (None, None))
        if kept is None or self._ledger.last(behavior).state is not BehaviorState.UNKNOWN:
            return
        resource = next(iter([*self._doers(kept.resources), *kept.resources]))
        vehicle = self._vehicles.get(resource)
        if vehicle is not None and self._ledger.holder(resource) is None:
            order = vehicle.order_for(behavior, kept.epoch, kept.behavior, kept.parameters)
            self._ledger.adopt(behavior, kept.resources, reference)
            vehicle.adopt(order)

    async def _look(
        self, vehicle: Vehicle, behavior: BehaviorId, kept: Kept, reference: str | None
    ) -> BehaviorReport:
        """Ask a vehicle. Nothing is awaited between its answer and what follows from it, so that
        no end of the behavior is missed."""
        order = vehicle.order_for(behavior, kept.epoch, kept.behavior, kept.parameters)
        outcome = await vehicle.look(order)
        if self._ledger.last(behavior).state is not BehaviorState.UNKNOWN:
            return self._ledger.last(behavior)  # it was asked for twice at the same time
        if outcome.state in (BehaviorState.ACCEPTED, BehaviorState.RUNNING):
            self._ledger.adopt(behavior, kept.resources, reference)
            vehicle.adopt(order)
            return replace(self._ledger.last(behavior), held=outcome.held)
        if outcome.state is BehaviorState.UNKNOWN:
            vehicle.leave(order)
            if kept.behavior:
                self._unknown[behavior] = (kept, reference)
        return BehaviorReport(
            behavior,
            3 if outcome.is_end else 0,
            outcome.state,
            outcome.code,
            outcome.reason,
            reference,
            outcome.outputs,
        )

    async def _attend(self) -> None:
        """Look after all vehicles, again and again."""
        clock = self._context.clock
        complaints = Complaints(self._context.logger, "the arbiter of ROS vehicles")
        looked_us, was_late, turn = clock.now_us(), False, 0
        while True:
            now_us = clock.now_us()
            # After a pause of our own, what vehicles said meanwhile is still to be read.
            late = not was_late and now_us - looked_us > LATE * ATTEND_EVERY_S * 1e6
            looked_us, was_late = now_us, late
            for vehicle in self._vehicles.values():
                try:
                    state = vehicle.attend(may_lose=not late)
                except Exception as error:  # one vehicle's bug must not stop the others
                    complaints.add(f"{vehicle.resource} cannot be attended to", repr(error))
                else:
                    if state is not None:
                        self._states.put(state)
            if self._station is not None:
                self._station.retry()
            if turn % PAYLOADS_EVERY == 0:
                self._tell_of_payloads(now_us)
            turn += 1
            await clock.sleep(ATTEND_EVERY_S)

    def _tell_of_payloads(self, now_us: int) -> None:
        for resource in self._connections:
            if resource not in self._settings:
                vehicle = self._vehicles.get(ResourceId(resource.partition("/")[0]))
                link = LinkState.CONNECTED if vehicle is None else vehicle.link
                self._states.put(PayloadState(resource, now_us, link=link))


def _may_be_missed(state: VehicleState | PayloadState) -> bool:
    return not (isinstance(state, PayloadState) and state.detections)


def _is_sane(value: ResolvedValue) -> bool:
    return value is not None and not (isinstance(value, float) and not math.isfinite(value))
