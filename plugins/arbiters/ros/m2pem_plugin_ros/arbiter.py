"""The arbiter of ROS vehicles and payloads. Its catalogue needs no ROS and no connection."""

import asyncio
import math
import os
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace

from m2pem.api import (
    ArbiterCapabilities,
    ArbiterContext,
    BehaviorId,
    BehaviorReport,
    BehaviorRequest,
    BehaviorSpec,
    BehaviorState,
    Connection,
    Limits,
    LinkState,
    PayloadState,
    ResolvedValue,
    ResourceId,
    VehicleState,
)
from m2pem.api.latest_task import cancel_and_wait
from m2pem.api.unit_arbiter import UnitArbiter
from m2pem_plugin_ros.catalogue import LEVEL, PAYLOAD
from m2pem_plugin_ros.checkpoint import Checkpoint, decode_checkpoint, encode_checkpoint
from m2pem_plugin_ros.connections import ConnectionsSetup, DdsConnections, VehicleConnections
from m2pem_plugin_ros.drivers.driver import Driver, DriverSetup
from m2pem_plugin_ros.drivers.driver import make_driver as make_fleet_driver
from m2pem_plugin_ros.log_throttle import LogThrottle
from m2pem_plugin_ros.settings import DriverName, read_detectors, read_payloads, read_settings
from m2pem_plugin_ros.vehicle import Vehicle, VehicleSetup

LOST_AFTER_S = 3.0
HOLD_WITHIN_S = 6.0
BRAKING_BEGINS_WITHIN_S = 2.0
CANCEL_TIMEOUT_S = 10.0

FIRST_CONTACT_WITHIN_S = 5.0
"""`connect` waits no longer than this for vehicles, in real time. DDS needs some of it for
discovery."""

NAMED_WITHIN_S = 2.5
"""It waits no longer than this for vehicles that are not there, or cannot be commanded."""

DISCOVERY_S = 0.5
"""It waits at least so long: a vehicle may be received before DDS has listed another one whose
namespace is the same, and which would obey the same commands."""

SEARCH_AFTER_S = 1.0
"""Vehicles that are not there by then are searched in other ROS domains."""

LOOK_EVERY_S = 0.1

ATTEND_EVERY_S = 0.2
PAYLOADS_EVERY = 5
"""The state of payloads is published in every fifth round of `_attend`."""

MakeConnections = Callable[[ConnectionsSetup], VehicleConnections]


class RosArbiter(UnitArbiter[Vehicle]):
    """The arbiter `ros` (docs/ros.md).

    `make_driver` and `make_connections` are replaced in tests without ROS.

    Raises:
        PluginError: a connection cannot be used; the text names the resource and the key.
    """

    capabilities = ArbiterCapabilities(
        one_vehicle=True, adjusts=True, addresses=True, reclaims=True, detects=True, fences=True
    )

    def __init__(
        self,
        connections: Mapping[ResourceId, Connection],
        context: ArbiterContext,
        make_driver: Callable[[DriverSetup], Driver] = make_fleet_driver,
        make_connections: MakeConnections = DdsConnections,
    ) -> None:
        super().__init__(connections, context, _may_be_missed)
        vehicles = read_settings(connections)
        self._settings = {**vehicles, **read_payloads(connections, vehicles)}
        self._detectors = read_detectors(connections, self._settings)
        self._make_driver = make_driver
        self._make_connections = make_connections
        self._vehicle_connections: VehicleConnections | None = None
        self._queried: set[BehaviorId] = set()
        self._unknown: dict[BehaviorId, tuple[Checkpoint, str | None]] = {}
        self._attending: asyncio.Task[None] | None = None

    # --- catalogue ------------------------------------------------------------------------------

    def catalogue(self, resource: ResourceId) -> Sequence[BehaviorSpec]:
        """Return the behaviors of a vehicle, or of a payload with a node of its own. Other payloads
        have none."""
        if resource not in self._settings:
            return ()
        own, usual = self._settings[resource].own_behaviors, PAYLOAD if "/" in resource else LEVEL
        known = {spec.name for spec in usual}
        return (*usual, *(spec for spec in own if spec.name not in known))

    @property
    def detectors(self) -> Collection[ResourceId]:
        """Payloads whose topic of detections is read: they have a `topic`, or `detector: true`."""
        return self._detectors.keys()

    def _may_take(self, resource: ResourceId) -> Sequence[BehaviorSpec]:
        """A payload may be used by a behavior of its vehicle, too."""
        vehicle = ResourceId(resource.partition("/")[0])
        of_vehicle = self.catalogue(vehicle) if vehicle != resource else ()
        return (*of_vehicle, *self.catalogue(resource))

    def limits(self, resource: ResourceId) -> Limits:
        """Return the limits of a vehicle or a payload. A detector may be silent for any time."""
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
        """Return the ROS domain and the namespace, as text."""
        settings = self._settings.get(resource)
        if settings is None:
            return []
        domain: int | str | None = settings.domain_id
        if domain is None:
            domain = os.environ.get("ROS_DOMAIN_ID") or 0
        return [f"domain {domain}, namespace {settings.namespace or '/'}"]

    # --- life -----------------------------------------------------------------------------------

    async def connect(self) -> None:
        """Subscribe to all vehicles. Return when each was received once and can be commanded, and
        `DISCOVERY_S` have passed. For those that are not there or cannot, wait for
        `NAMED_WITHIN_S`, for silent ones for `FIRST_CONTACT_WITHIN_S`.

        Raises:
            RosError: ROS, or a package of it that a driver needs, is not installed or not usable.
        """
        self._vehicle_connections = self._make_connections(
            ConnectionsSetup(
                self._connections,
                self._settings,
                self._detectors,
                self._context,
                self._states.put,
            )
        )
        try:
            connected = await self._vehicle_connections.open()
            for resource, settings in self._settings.items():
                connection, limits = self._connections[resource], self.limits(resource)
                setup = VehicleSetup(connection, settings, self._context, self._tracker, limits)
                self._units[resource] = Vehicle(setup, connected[resource], self._make_driver)
            opened = await asyncio.gather(
                *(vehicle.open() for vehicle in self._units.values()), return_exceptions=True
            )
            for outcome in opened:
                if isinstance(outcome, BaseException):
                    raise outcome
        except BaseException:
            await self._disconnect()
            raise
        await self._until_first_contact()
        for vehicle in self._units.values():
            vehicle.listen_from_now()
        self._attending = asyncio.get_running_loop().create_task(self._attend())

    async def close(self) -> None:
        """Close all subscriptions. The vehicles go on with what they do."""
        await self._disconnect()
        self._states.close()
        self._tracker.close()

    # --- behaviors ------------------------------------------------------------------------------

    async def start(self, request: BehaviorRequest) -> None:
        asked = request.id in self._queried
        self._queried.discard(request.id)
        checkpoint = Checkpoint(
            request.resources, request.behavior, request.epoch, request.parameters
        )
        if self._tracker.admit(request, lambda: encode_checkpoint(checkpoint), self._refusal):
            vehicle = self._units[self._commanded(request.resources)[0]]
            await vehicle.take(request, query_first=asked)

    async def cancel(self, behavior: BehaviorId, epoch: int) -> None:
        """Cancel the behavior on its vehicle. After a restart, also if the vehicle reported
        UNKNOWN."""
        self._readopt(behavior)
        await super().cancel(behavior, epoch)

    async def adjust(
        self, behavior: BehaviorId, epoch: int, parameters: Mapping[str, ResolvedValue]
    ) -> None:
        """Change parameters of a behavior that goes on. Values that are not finite are ignored."""
        if self._tracker.may_adjust(behavior, epoch):
            sane = {name: value for name, value in parameters.items() if _is_sane(value)}
            for vehicle in self._executing(behavior) if sane else ():
                vehicle.adjust(behavior, sane)

    async def reclaim(self, resource: ResourceId) -> str:
        """End what a vehicle still does that was lost and is received again; see
        `Vehicle.reclaim`."""
        return await self._units[resource].reclaim() if resource in self._units else ""

    async def fence(self, run: str, epoch: int) -> None:
        """Tell the nodes of all vehicles that the run has this epoch. Nav2 and plain bases know no
        epochs."""
        await super().fence(run, epoch)
        for vehicle in self._units.values():
            vehicle.claim(run, epoch)

    async def disown(self, run: str) -> None:
        """End velocities and repeated commands for a run. Nav2 and nodes go on with their goals."""
        behaviors = self._tracker.disown(run)
        for vehicle in self._units.values():
            vehicle.disown(behaviors)

    # --- inside ---------------------------------------------------------------------------------

    async def _until_first_contact(self) -> None:
        loop = asyncio.get_running_loop()
        began_s = loop.time()
        with suppress(TimeoutError):
            async with asyncio.timeout(min(SEARCH_AFTER_S, FIRST_CONTACT_WITHIN_S)):
                await asyncio.gather(*(v.first_contact.wait() for v in self._units.values()))
        absent = [
            resource
            for resource, vehicle in self._units.items()
            if not vehicle.first_contact.is_set() and not vehicle.endpoints.is_listed
        ]
        left_s = min(NAMED_WITHIN_S, FIRST_CONTACT_WITHIN_S) - (loop.time() - began_s)
        if absent and left_s > 0 and self._vehicle_connections is not None:
            await self._vehicle_connections.search(absent, left_s)
        while True:
            passed_s = loop.time() - began_s
            wrong = [vehicle for vehicle in self._units.values() if vehicle.problem]
            silent = [v for v in self._units.values() if not v.first_contact.is_set()]
            is_well = not (wrong or silent) and passed_s >= DISCOVERY_S
            if is_well or passed_s >= FIRST_CONTACT_WITHIN_S:
                break
            if passed_s >= NAMED_WITHIN_S and all(vehicle in wrong for vehicle in silent):
                break
            await asyncio.sleep(LOOK_EVERY_S)
        for resource, vehicle in self._units.items():
            if not vehicle.first_contact.is_set():
                self._context.logger.warning(
                    "%s: no message from the vehicle yet: %s", resource, vehicle.endpoints.absence
                )

    async def _disconnect(self) -> None:
        attending, self._attending = self._attending, None
        await cancel_and_wait(attending)
        vehicles, self._units = self._units, {}
        await asyncio.gather(*(vehicle.close() for vehicle in vehicles.values()))
        station, self._vehicle_connections = self._vehicle_connections, None
        if station is not None:
            await station.close()

    def _refusal(self, request: BehaviorRequest) -> str:
        doers = self._commanded(request.resources)
        if len(doers) != 1:
            return f"{request.behavior} takes one vehicle or payload, not {len(doers)}"
        resource = doers[0]
        if all(spec.name != request.behavior for spec in self.catalogue(resource)):
            return f"{resource} has no behavior '{request.behavior}'; its vehicle is to have a role"
        prohibition = self._prohibition(resource, request.behavior)
        return prohibition or self._units[resource].refusal(request)

    def _commanded(self, resources: Sequence[ResourceId]) -> list[ResourceId]:
        """Return the resources that are commanded: vehicles, or without any, payloads with a
        node."""
        vehicles = [resource for resource in resources if "/" not in resource]
        return vehicles or [resource for resource in resources if resource in self._settings]

    def _executing(self, behavior: BehaviorId) -> list[Vehicle]:
        """Of a behavior of a vehicle that only uses a payload, the vehicle alone."""
        return [vehicle for vehicle in self._units.values() if vehicle.doing == behavior]

    async def _find(self, unknown: BehaviorReport, native_ref: str | None) -> BehaviorReport:
        checkpoint = decode_checkpoint(native_ref) if native_ref else None
        if checkpoint is None:
            return await self._search(unknown.id, unknown)
        resource = next(
            iter([*self._commanded(checkpoint.resources), *checkpoint.resources]), ResourceId("")
        )
        if resource not in self._units:
            kind = "payload with a node" if "/" in resource else "vehicle"
            return replace(unknown, reason=f"the {kind} '{resource}' no longer exists")
        vehicle = self._units[resource]
        return await self._query_vehicle(vehicle, unknown.id, checkpoint, native_ref)

    async def _search(self, behavior: BehaviorId, unknown: BehaviorReport) -> BehaviorReport:
        """Query all vehicles about a behavior of which there is no checkpoint."""
        self._queried.add(behavior)
        candidates = [
            vehicle
            for resource, vehicle in self._units.items()
            if vehicle.settings.driver is not DriverName.BASE
            and self._tracker.holder(resource) is None
        ]
        looks = []
        for vehicle in candidates:
            checkpoint = Checkpoint((vehicle.resource,), "", 0, {})
            looks.append(self._query_vehicle(vehicle, behavior, checkpoint, None))
        for found in await asyncio.gather(*looks):
            if found.state is not BehaviorState.UNKNOWN or found.number:
                self._queried.discard(behavior)
                return found
        return unknown

    def _readopt(self, behavior: BehaviorId) -> None:
        """Adopt a behavior that its vehicle did not know after a restart, so that it can be
        cancelled."""
        checkpoint, reference = self._unknown.pop(behavior, (None, None))
        if checkpoint is None or self._tracker.last(behavior).state is not BehaviorState.UNKNOWN:
            return
        resource = next(iter([*self._commanded(checkpoint.resources), *checkpoint.resources]))
        vehicle = self._units.get(resource)
        if vehicle is not None and self._tracker.holder(resource) is None:
            order = vehicle.order_for(
                behavior, checkpoint.epoch, checkpoint.behavior, checkpoint.parameters
            )
            self._tracker.adopt(behavior, checkpoint.resources, reference)
            vehicle.adopt(order)

    async def _query_vehicle(
        self, vehicle: Vehicle, behavior: BehaviorId, checkpoint: Checkpoint, reference: str | None
    ) -> BehaviorReport:
        """Query a vehicle, and adopt the behavior if it goes on. There is no `await` between the
        answer and `adopt`, so that no end of the behavior is missed."""
        order = vehicle.order_for(
            behavior, checkpoint.epoch, checkpoint.behavior, checkpoint.parameters
        )
        outcome = await vehicle.query(order)
        if self._tracker.last(behavior).state is not BehaviorState.UNKNOWN:
            return self._tracker.last(behavior)  # a concurrent query has adopted it
        if outcome.state in (BehaviorState.ACCEPTED, BehaviorState.RUNNING):
            self._tracker.adopt(behavior, checkpoint.resources, reference)
            vehicle.adopt(order)
            if outcome.remaining is not None:
                vehicle.remains(order.goal, outcome.remaining)
            return replace(self._tracker.last(behavior), held=outcome.held)
        if outcome.state is BehaviorState.UNKNOWN:
            vehicle.mark_unresolved(order)
            if checkpoint.behavior:
                self._unknown[behavior] = (checkpoint, reference)
        return BehaviorReport(
            behavior,
            3 if outcome.is_end else int(outcome.known),
            outcome.state,
            outcome.code,
            outcome.reason,
            reference,
            outcome.outputs,
            epoch=self._tracker.last(behavior).epoch,
        )

    async def _attend(self) -> None:
        """Check all vehicles every 0.2 s, and put their states into the telemetry."""
        log_throttle = LogThrottle(self._context.logger, "the arbiter of ROS vehicles")
        round_number = 0
        async for now_us, late in self._rounds(ATTEND_EVERY_S):
            for vehicle in self._units.values():
                try:
                    state = vehicle.attend(may_lose=not late)
                except Exception as error:  # an error of one vehicle must not stop the others
                    log_throttle.log(
                        f"{vehicle.resource}: the check of its state failed", repr(error)
                    )
                else:
                    if state is not None:
                        self._states.put(state)
            if self._vehicle_connections is not None:
                self._vehicle_connections.retry()
            if round_number % PAYLOADS_EVERY == 0:
                self._publish_payload_states(now_us)
            round_number += 1

    def _publish_payload_states(self, now_us: int) -> None:
        for resource in self._connections:
            if resource not in self._settings:
                vehicle = self._units.get(ResourceId(resource.partition("/")[0]))
                link = LinkState.CONNECTED if vehicle is None else vehicle.link
                self._states.put(PayloadState(resource, now_us, link=link))


def _may_be_missed(state: VehicleState | PayloadState) -> bool:
    return not (isinstance(state, PayloadState) and state.detections)


def _is_sane(value: ResolvedValue) -> bool:
    return value is not None and not (isinstance(value, float) and not math.isfinite(value))
