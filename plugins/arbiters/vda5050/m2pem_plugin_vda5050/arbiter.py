"""The arbiter of vehicles that speak VDA 5050. Its catalogue needs no connection."""

import asyncio
import uuid
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial

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
    ResourceId,
)
from m2pem.api.latest_task import cancel_and_wait
from m2pem.api.unit_arbiter import UnitArbiter
from m2pem.errors import OperatorError
from m2pem_plugin_vda5050.broker import Broker
from m2pem_plugin_vda5050.catalogue import STOPS, USUAL
from m2pem_plugin_vda5050.checkpoint import (
    Checkpoint,
    decode_checkpoint,
    encode_checkpoint,
    order_id,
)
from m2pem_plugin_vda5050.messages import FROM_VEHICLE, QOS, State
from m2pem_plugin_vda5050.reading import action_state, base_end, is_executing
from m2pem_plugin_vda5050.settings import BrokerSettings, Settings, read_settings
from m2pem_plugin_vda5050.vehicle import OTHER_VERSION, Vehicle, VehicleSetup

LOST_AFTER_S = 35.0
"""The standard's vehicles send a state every 30 s at the latest."""

HOLD_WITHIN_S = 6.0
FIRST_CONTACT_WITHIN_S = 3.0
"""`connect` waits no longer than this for vehicles, in real time."""

ATTEND_EVERY_S = 0.2


class Vda5050Arbiter(UnitArbiter[Vehicle]):
    """The arbiter `vda5050` (docs/vda5050.md).

    Raises:
        PluginError: a connection cannot be used; the text names the resource and the key.
    """

    capabilities = ArbiterCapabilities(one_vehicle=True, addresses=True, reclaims=True, fences=True)

    def __init__(
        self, connections: Mapping[ResourceId, Connection], context: ArbiterContext
    ) -> None:
        super().__init__(connections, context)
        self._settings = read_settings(connections)
        self._brokers: dict[BrokerSettings, Broker] = {}
        self._topics: dict[str, tuple[Vehicle, str]] = {}
        self._attending: asyncio.Task[None] | None = None

    # --- catalogue ------------------------------------------------------------------------------

    def catalogue(self, resource: ResourceId) -> Sequence[BehaviorSpec]:
        """Return the behaviors of a vehicle. Payloads have none of their own."""
        settings = self._settings.get(resource)
        if settings is None:
            return ()
        return (*USUAL, *(own.spec for own in settings.own_behaviors))

    def limits(self, resource: ResourceId) -> Limits:
        settings = self._settings.get(resource)
        if settings is None:
            return Limits(LOST_AFTER_S, HOLD_WITHIN_S)
        own = self._connections[resource].lost_after_s
        lost_after_s = LOST_AFTER_S if own is None else own
        return Limits(lost_after_s, HOLD_WITHIN_S, settings.cancel_timeout_s)

    def addresses(self, resource: ResourceId) -> Sequence[str]:
        """Return the broker and the topics of a vehicle, as text."""
        settings = self._settings.get(resource)
        return [] if settings is None else [settings.address]

    # --- life -----------------------------------------------------------------------------------

    async def connect(self) -> None:
        """Connect to all brokers. Return when each vehicle was received, or soon.

        Raises:
            PluginError: a password or a certificate cannot be used.
        """
        for resource, settings in self._settings.items():
            setup = VehicleSetup(
                self._connections[resource],
                settings,
                self._context,
                self._tracker,
                self.limits(resource),
                partial(self._publish, settings),
            )
            vehicle = self._units[resource] = Vehicle(setup)
            for topic in FROM_VEHICLE:
                self._topics[f"{settings.broker.url} {settings.prefix}/{topic}"] = vehicle, topic
            for prefix in settings.other_prefixes:
                self._topics[f"{settings.broker.url} {prefix}/connection"] = vehicle, OTHER_VERSION
        try:
            for broker in {each.broker for each in self._settings.values()}:
                self._brokers[broker] = self._broker(broker)
        except BaseException:
            self._brokers.clear()
            raise
        for made in self._brokers.values():
            made.open()
        with suppress(TimeoutError):
            async with asyncio.timeout(FIRST_CONTACT_WITHIN_S):
                await asyncio.gather(*(v.first_answer.wait() for v in self._units.values()))
        for resource, vehicle in self._units.items():
            vehicle.listen_from_now()
            if not vehicle.first_contact.is_set():
                self._context.logger.warning("%s: %s", resource, vehicle.absence)
        self._attending = asyncio.get_running_loop().create_task(self._attend())

    async def close(self) -> None:
        """Close all connections. The vehicles go on to the last node that was released."""
        attending, self._attending = self._attending, None
        await cancel_and_wait(attending)
        await asyncio.gather(*(broker.close() for broker in self._brokers.values()))
        self._states.close()
        self._tracker.close()

    # --- behaviors ------------------------------------------------------------------------------

    async def start(self, request: BehaviorRequest) -> None:
        def reference() -> str:
            resource = request.resources[0]
            before = self._units[resource].order if resource in self._units else ""
            return encode_checkpoint(
                Checkpoint(resource, request.behavior, request.parameters, before)
            )

        if self._tracker.admit(request, reference, self._refusal):
            self._units[request.resources[0]].take(request)

    async def cancel(self, behavior: BehaviorId, epoch: int) -> None:
        """Stop the vehicle that executes the behavior.

        Raises:
            OperatorError: no state shows soon that the vehicle obeys. It is sent again all the
                same.
        """
        vehicles = self._executing(behavior)
        await super().cancel(behavior, epoch)
        await self._obeyed(vehicles)

    async def hold(self, resource: ResourceId) -> None:
        """Pause a vehicle at once; it keeps its order.

        Raises:
            OperatorError: as `cancel`.
        """
        await super().hold(resource)
        await self._obeyed([self._units[resource]] if resource in self._units else [])

    async def _obeyed(self, vehicles: Sequence[Vehicle]) -> None:
        for problem in await asyncio.gather(*(vehicle.obeyed() for vehicle in vehicles)):
            if problem:
                raise OperatorError(problem)

    async def reclaim(self, resource: ResourceId) -> str:
        """Cancel what a vehicle still does that was lost and is received again."""
        return await self._units[resource].reclaim() if resource in self._units else ""

    async def disown(self, run: str) -> None:
        """Send no more updates of the orders of a run. Vehicles go on to the last released node."""
        behaviors = self._tracker.disown(run)
        for vehicle in self._units.values():
            vehicle.forget(behaviors)

    # --- inside ---------------------------------------------------------------------------------

    def _broker(self, settings: BrokerSettings) -> Broker:
        vehicles = [
            self._units[resource]
            for resource, each in self._settings.items()
            if each.broker == settings
        ]
        topics = [
            (f"{vehicle.settings.prefix}/{topic}", QOS.get(topic, 0))
            for vehicle in vehicles
            for topic in FROM_VEHICLE
        ]
        topics += [
            (f"{prefix}/connection", QOS["connection"])
            for vehicle in vehicles
            for prefix in vehicle.settings.other_prefixes
        ]
        # A random part: of two clients with one name, a broker disconnects the first one.
        identifier = f"m2pem-{self._context.journal.hex[:8]}-{uuid.uuid4().hex[:8]}"

        def connected() -> None:
            for vehicle in vehicles:
                vehicle.listen()

        return Broker(
            settings,
            identifier,
            topics,
            partial(self._received, settings.url),
            connected,
            self._context.logger,
        )

    def _publish(self, settings: Settings, topic: str, payload: bytes, qos: int) -> bool:
        broker = self._brokers.get(settings.broker)
        return broker is not None and broker.publish(f"{settings.prefix}/{topic}", payload, qos)

    def _received(self, url: str, topic: str, payload: bytes) -> None:
        vehicle, name = self._topics.get(f"{url} {topic}", (None, ""))
        if vehicle is None:
            return
        try:
            state = vehicle.receive(name, payload)
        except Exception:  # an error of one vehicle must not stop the others
            self._context.logger.exception("%s: %s", vehicle.resource, topic)
        else:
            if state is not None:
                self._states.put(state)

    def _refusal(self, request: BehaviorRequest) -> str:
        if len(request.resources) != 1:
            return f"{request.behavior} takes one vehicle, not {len(request.resources)}"
        resource = request.resources[0]
        prohibition = self._prohibition(resource, request.behavior)
        return prohibition or self._units[resource].refusal(request)

    def _is_held(self, behavior: BehaviorId) -> bool:
        return any(vehicle.is_held for vehicle in self._executing(behavior))

    async def _find(self, unknown: BehaviorReport, native_ref: str | None) -> BehaviorReport:
        checkpoint = decode_checkpoint(native_ref) if native_ref else None
        if checkpoint is None:
            return await self._search(unknown.id, unknown)
        vehicle = self._units.get(checkpoint.resource)
        if vehicle is None:
            return replace(unknown, reason=f"the vehicle '{checkpoint.resource}' no longer exists")
        return await self._query(vehicle, unknown.id, checkpoint, native_ref)

    async def _search(self, behavior: BehaviorId, unknown: BehaviorReport) -> BehaviorReport:
        """Look for a behavior of which there is no checkpoint: an executive may have died between
        sending it and storing its report."""
        wanted = order_id(self._context.journal, behavior)
        states = await asyncio.gather(*(v.known_state() for v in self._units.values()))
        for vehicle, state in zip(self._units.values(), states, strict=True):
            if state is None:
                continue
            if state.order_id == wanted and is_executing(state):
                vehicle.leave_behind(behavior)
        return unknown

    async def _query(
        self, vehicle: Vehicle, behavior: BehaviorId, checkpoint: Checkpoint, reference: str | None
    ) -> BehaviorReport:
        """Ask the state of the vehicle. There is no `await` between it and `adopt`, so that no end
        of the behavior is missed."""
        state = await vehicle.known_state()
        known = self._tracker.last(behavior)
        if known.state is not BehaviorState.UNKNOWN:
            return known  # a query at the same time has adopted it
        if state is None:
            vehicle.leave_behind(behavior)
            return replace(known, native_ref=reference, reason=vehicle.absence)
        if not self._has_it(state, behavior):
            return self._unknown(known, state, checkpoint, reference)
        request = BehaviorRequest(
            behavior, 0, checkpoint.behavior, checkpoint.parameters, (checkpoint.resource,)
        )
        if reason := self._why_it_ends_early(checkpoint, state):
            vehicle.leave_behind(behavior)
            return replace(known, native_ref=reference, reason=reason)
        self._tracker.adopt(behavior, (checkpoint.resource,), reference)
        vehicle.adopt(request)
        last = self._tracker.last(behavior)
        return last if last.state.terminal else replace(last, held=vehicle.is_held)

    def _why_it_ends_early(self, checkpoint: Checkpoint, state: State) -> str:
        """Return why the rest of an order cannot be sent after a restart; "" if it can, or if the
        vehicle has all of it."""
        count = checkpoint.left_out
        if not count:
            return ""
        lacks = f"its route of {count} waypoints is too long to be stored, and"
        if checkpoint.parameters.get("loop") is True:
            return f"{lacks} the vehicle stops where it has no more of the loop"
        if checkpoint.behavior not in {spec.name for spec in USUAL}:
            return f"{lacks} whether its action is done cannot be seen"
        released = base_end(state)
        return "" if released >= count else f"{lacks} the vehicle stops at waypoint {released}"

    def _has_it(self, state: State, behavior: BehaviorId) -> bool:
        wanted = order_id(self._context.journal, behavior)
        return state.order_id == wanted or action_state(state, wanted) is not None

    def _unknown(
        self, known: BehaviorReport, state: State, checkpoint: Checkpoint, reference: str | None
    ) -> BehaviorReport:
        """The vehicle does not have the order. If it still has the one from before, it has not
        begun; without any, it may have been restarted, and has forgotten all."""
        before = checkpoint.order_before
        not_begun = checkpoint.behavior in STOPS or (before != "" and state.order_id == before)
        reason = f"the vehicle has the order {state.order_id!r}"
        return replace(known, native_ref=reference, not_begun=not_begun, reason=reason)

    async def _attend(self) -> None:
        """Look after all vehicles every 0.2 s."""
        async for _, late in self._rounds(ATTEND_EVERY_S):
            for vehicle in self._units.values():
                broker = self._brokers[vehicle.settings.broker]
                try:
                    state = vehicle.attend(may_lose=not late, problem=broker.problem)
                except Exception:  # an error of one vehicle must not stop the others
                    self._context.logger.exception("%s: its state", vehicle.resource)
                else:
                    if state is not None:
                        self._states.put(state)
