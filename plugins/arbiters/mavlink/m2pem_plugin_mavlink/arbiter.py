"""The arbiter of MAVLink vehicles. Its catalogue needs neither a MAVLink library nor a
connection."""

import asyncio
from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Protocol

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
    ResolvedValue,
    ResourceId,
)
from m2pem.api.latest_task import cancel_and_wait
from m2pem.api.unit_arbiter import LATE_FACTOR, UnitArbiter
from m2pem_plugin_mavlink.catalogue import offered
from m2pem_plugin_mavlink.checkpoint import Checkpoint, decode_checkpoint, encode_checkpoint
from m2pem_plugin_mavlink.protocol.url import chooses_port, parse_url
from m2pem_plugin_mavlink.settings import Settings, read_settings

if TYPE_CHECKING:
    from m2pem_plugin_mavlink.behaviors.behavior import Behavior
    from m2pem_plugin_mavlink.vehicle.failsafe import FailsafeMonitor
    from m2pem_plugin_mavlink.vehicle.takeover_monitor import TakeoverMonitor
    from m2pem_plugin_mavlink.vehicle.vehicle import Vehicle
    from m2pem_plugin_mavlink.vehicle_controller import VehicleController

LOST_AFTER_S = 3.0
HOLD_WITHIN_S = 6.0
"""BRAKE stops a copter from 10 m/s within 4 s; a command that is lost is sent again after 1.5 s."""

CANCEL_TIMEOUT_S = 10.0
RECEIVED_WITHIN_S = 5.0
"""Seconds for which `connect` waits; a running autopilot sends a heartbeat every second."""

TELEMETRY_EVERY_S = 0.2


class VehicleConnections(Protocol):
    """The vehicles of a fleet and the links to them."""

    async def open(self) -> Mapping[ResourceId, "Vehicle"]:
        """Open the links and return the vehicles; they need not have sent anything yet."""
        ...

    def watch(self, vehicle: "Vehicle") -> "TakeoverMonitor":
        """Return a monitor that detects takeovers of the vehicle; it is not open yet."""
        ...

    def failsafes(self, vehicle: "Vehicle") -> "FailsafeMonitor":
        """Return what compares the vehicle's failsafes with the fleet file."""
        ...

    async def close(self) -> None:
        """Close all vehicles, links and sockets."""
        ...


MakeVehicleConnections = Callable[
    [
        Mapping[ResourceId, Connection],
        Mapping[ResourceId, Settings],
        ArbiterContext,
        Mapping[ResourceId, float],
    ],
    VehicleConnections,
]
"""Of connections, their settings, the context, and after how many seconds each vehicle is lost."""


def _make_connections(
    connections: Mapping[ResourceId, Connection],
    settings: Mapping[ResourceId, Settings],
    context: ArbiterContext,
    lost_after_s: Mapping[ResourceId, float],
) -> VehicleConnections:
    from m2pem_plugin_mavlink.vehicle_connections import MavlinkVehicleConnections  # noqa: PLC0415  # it needs pymavlink

    return MavlinkVehicleConnections(connections, settings, context, lost_after_s)


class MavlinkArbiter(UnitArbiter["VehicleController"]):
    """Implements `m2pem.api.Arbiter`. Its settings in a fleet file: docs/mavlink.md.

    Raises:
        PluginError: a connection cannot be used; the text names the resource and the key.
    """

    capabilities = ArbiterCapabilities(
        one_vehicle=True, adjusts=True, addresses=True, reclaims=True, fences=True, straight=True
    )

    def __init__(
        self,
        connections: Mapping[ResourceId, Connection],
        context: ArbiterContext,
        make_vehicle_connections: MakeVehicleConnections = _make_connections,
    ) -> None:
        super().__init__(connections, context)
        self._settings = read_settings(connections, context.state_folder)
        self._make_vehicle_connections = make_vehicle_connections
        self._vehicle_connections: VehicleConnections | None = None
        self._takeover_monitors: list[TakeoverMonitor] = []
        self._failsafe_problems: dict[ResourceId, tuple[str, ...]] = {}
        self._pending: dict[BehaviorId, Behavior] = {}
        self._queried: set[BehaviorId] = set()
        self._tasks: list[asyncio.Task[None]] = []

    # --- catalogue ------------------------------------------------------------------------------

    def catalogue(self, resource: ResourceId) -> Sequence[BehaviorSpec]:
        """Return the behaviors of a vehicle, by its domain; payloads have none."""
        if resource not in self._settings:
            return ()
        return offered(self._connections[resource].domain)

    def _may_take(self, resource: ResourceId) -> Sequence[BehaviorSpec]:
        """Return the behaviors of a vehicle or, for a payload, of the vehicle that carries it."""
        return self.catalogue(ResourceId(resource.partition("/")[0]))

    def limits(self, resource: ResourceId) -> Limits:
        """Return the time limits of a vehicle."""
        own = self._connections[resource].lost_after_s if resource in self._connections else None
        return Limits(LOST_AFTER_S if own is None else own, HOLD_WITHIN_S, CANCEL_TIMEOUT_S)

    def addresses(self, resource: ResourceId) -> Sequence[str]:
        """Return the system id with each of the vehicle's URLs; none for payloads.

        A port that the kernel chooses (0) is another one in each process: nothing is shared there.
        """
        settings = self._settings.get(resource)
        if settings is None:
            return ()
        return [
            f"system {settings.system_id} on {url}"
            for url in settings.urls
            if not chooses_port(parse_url(url))
        ]

    # --- life -----------------------------------------------------------------------------------

    async def connect(self) -> None:
        """Open all links; return when all vehicles have sent their state, or after
        `RECEIVED_WITHIN_S`."""
        from m2pem_plugin_mavlink.vehicle_controller import VehicleController  # noqa: PLC0415  # it needs pymavlink

        lost_after_s = {resource: self.limits(resource).lost_after_s for resource in self._settings}
        self._vehicle_connections = self._make_vehicle_connections(
            self._connections, self._settings, self._context, lost_after_s
        )
        vehicles = await self._vehicle_connections.open()
        create = asyncio.get_running_loop().create_task
        for resource, vehicle in vehicles.items():
            watch = self._vehicle_connections.watch(vehicle)
            watch.open()
            self._takeover_monitors.append(watch)
            limits = self.limits(resource)
            self._units[resource] = VehicleController(
                vehicle, watch, self._tracker, limits, self._context.logger
            )
            self._publish_mode_changes(self._units[resource])
            self._tasks.append(create(self._monitor_vehicle(resource)))
        known = await asyncio.gather(
            *(controller.wait_until_known(RECEIVED_WITHIN_S) for controller in self._units.values())
        )
        for vehicle in vehicles.values():  # the first behavior may follow another vehicle
            self._states.put(vehicle.telemetry())
        self._tasks += [create(self._check(vehicle)) for vehicle in vehicles.values()]
        for resource, is_known in zip(vehicles, known, strict=True):
            if not is_known:
                self._context.logger.warning(
                    "%s: the vehicle has not reported its position yet", resource
                )

    async def close(self) -> None:
        """Close all links. The vehicles continue what they do."""
        await cancel_and_wait(*self._tasks)
        self._tasks = []
        for controller in self._units.values():
            await controller.close()
        for watch in self._takeover_monitors:
            await watch.close()
        self._takeover_monitors = []
        vehicle_connections, self._vehicle_connections = self._vehicle_connections, None
        if vehicle_connections is not None:
            await vehicle_connections.close()
        self._states.close()
        self._tracker.close()

    # --- behaviors ------------------------------------------------------------------------------

    async def start(self, request: BehaviorRequest) -> None:
        """Start a behavior; see `BehaviorRequest`."""
        queried = request.id in self._queried
        self._queried.discard(request.id)
        try:
            if self._tracker.admit(request, lambda: self._native_ref(request), self._refusal):
                resource, behavior = _vehicles(request)[0], self._pending[request.id]
                self._units[resource].start(request.id, behavior, look_first=queried)
        finally:
            self._pending.pop(request.id, None)

    async def adjust(
        self, behavior: BehaviorId, epoch: int, parameters: Mapping[str, ResolvedValue]
    ) -> Awaitable[str] | None:
        """Change the `speed` of a behavior; other parameters stay. Return the vehicle's answer."""
        speed_m_s = parameters.get("speed")
        if not isinstance(speed_m_s, int | float) or speed_m_s <= 0:
            return None
        if self._tracker.may_adjust(behavior, epoch):
            for controller in self._executing(behavior):
                return controller.adjust(behavior, float(speed_m_s))
        return None

    async def reclaim(self, resource: ResourceId) -> str:
        """Stop a vehicle that was lost and is connected again, unless it executes a failsafe."""
        return await self._units[resource].reclaim() if resource in self._units else ""

    async def disown(self, run: str) -> None:
        """End setpoints, repeated commands and further steps of a run's behaviors."""
        held = {resource: self._tracker.holder(resource) for resource in self._units}
        behaviors = self._tracker.disown(run)
        for resource, controller in self._units.items():
            if held[resource] in behaviors:
                controller.release()

    # --- inside ---------------------------------------------------------------------------------

    def _refusal(self, request: BehaviorRequest) -> str:
        from m2pem_plugin_mavlink.behaviors.behavior import (  # noqa: PLC0415
            BehaviorFailedError,
        )

        vehicles = _vehicles(request)
        if len(vehicles) != 1:
            return f"{request.behavior} takes one vehicle, and has {len(vehicles)}"
        resource = vehicles[0]
        if prohibition := self._prohibition(resource, request.behavior):
            return prohibition
        checkpoint = Checkpoint(resource, request.behavior, request.parameters, {})
        try:
            behavior = self._make(checkpoint)
            self._pending[request.id] = behavior
            return behavior.refusal()
        except BehaviorFailedError as error:
            return error.reason

    def _make(self, checkpoint: Checkpoint) -> "Behavior":
        from m2pem_plugin_mavlink.behaviors import BEHAVIORS  # noqa: PLC0415
        from m2pem_plugin_mavlink.behaviors.behavior import BehaviorContext  # noqa: PLC0415

        controller, clock = self._units[checkpoint.resource], self._context.clock
        context = BehaviorContext(
            controller.vehicle,
            checkpoint.parameters,
            self._context.bus,
            self._context.origin,
            lambda: clock.now_us() / 1e6,
            self._connections[checkpoint.resource].fence,
            controller.cruise_m_s,
            self._settings[checkpoint.resource].actuators,
        )
        return BEHAVIORS[checkpoint.behavior](context)

    def _native_ref(self, request: BehaviorRequest) -> str:
        from m2pem_plugin_mavlink.reattachment import take_snapshot  # noqa: PLC0415

        state = self._pending[request.id].checkpoint()
        resource = _vehicles(request)[0]
        before = take_snapshot(self._units[resource].vehicle, self._context.clock.now_us() / 1e6)
        return encode_checkpoint(
            Checkpoint(resource, request.behavior, request.parameters, state, before)
        )

    async def _find(self, unknown: BehaviorReport, native_ref: str | None) -> BehaviorReport:
        """Only questions are sent to the vehicle."""
        checkpoint = decode_checkpoint(native_ref) if native_ref else None
        if checkpoint is None or checkpoint.resource not in self._units:
            self._queried.add(unknown.id)
            return unknown
        return await self._reattach(unknown.id, checkpoint, native_ref or "")

    async def _reattach(
        self, id_: BehaviorId, checkpoint: Checkpoint, reference: str
    ) -> BehaviorReport:
        from m2pem_plugin_mavlink.behaviors import BEHAVIORS  # noqa: PLC0415
        from m2pem_plugin_mavlink.behaviors.behavior import (  # noqa: PLC0415
            BehaviorFailedError,
        )
        from m2pem_plugin_mavlink.protocol.transaction import ExchangeError  # noqa: PLC0415
        from m2pem_plugin_mavlink.reattachment import shows_not_begun  # noqa: PLC0415

        controller = self._units[checkpoint.resource]
        vehicle = controller.vehicle
        unknown = replace(self._tracker.last(id_), native_ref=reference, reason="")
        if checkpoint.behavior not in BEHAVIORS:
            return replace(unknown, reason=f"the behavior '{checkpoint.behavior}' no longer exists")
        if not await controller.wait_until_known(RECEIVED_WITHIN_S):
            controller.mark_commanded()
            return replace(unknown, reason=f"{checkpoint.resource} has not reported its state")
        try:
            behavior = self._make(checkpoint)
            behavior.restore(checkpoint.state)
            state = await behavior.reattach()
        except (BehaviorFailedError, ExchangeError) as error:
            return replace(unknown, reason=str(error))
        if state is BehaviorState.RUNNING:
            self._tracker.adopt(id_, [checkpoint.resource], reference)
            controller.adopt(id_, behavior)
            return self._tracker.last(id_)
        if state is BehaviorState.SUCCEEDED:
            return replace(unknown, number=3, state=state)
        if shows_not_begun(behavior, checkpoint.before, self._context.clock.now_us() / 1e6):
            self._queried.add(id_)
            reason = f"{checkpoint.resource} is as before, and has not begun the behavior"
            return replace(unknown, reason=reason, not_begun=True)
        mode = vehicle.telemetry().mode or "an unknown mode"
        return replace(
            unknown, reason=f"{checkpoint.resource} is in {mode}, and does not execute the behavior"
        )

    async def _check(self, vehicle: "Vehicle") -> None:
        """Log and publish the differences between the fleet file and the vehicle's failsafes, once
        it is identified, and whenever they have changed."""
        await vehicle.until(lambda: vehicle.identity is not None)
        resource = vehicle.resource
        if self._vehicle_connections is None or not self._connections[resource].failsafe:
            return
        monitor = self._vehicle_connections.failsafes(vehicle)
        while True:
            # What cannot be read while the link is lost is no difference.
            if vehicle.link_state is not LinkState.LOST:
                self._note_failsafes(resource, [each.text for each in await monitor.findings()])
            await monitor.wait_for_change()

    def _note_failsafes(self, resource: ResourceId, found: Sequence[str]) -> None:
        before = self._failsafe_problems.get(resource)
        if before == tuple(found):
            return
        self._failsafe_problems[resource] = tuple(found)
        for text in found:
            if text not in (before or ()):
                self._context.logger.warning("%s: %s", resource, text)
        if before and not found:
            self._context.logger.info("%s: its failsafes are as the fleet says now", resource)
        self._publish(self._units[resource])

    def _publish(self, controller: "VehicleController") -> None:
        vehicle = controller.vehicle
        problems = self._failsafe_problems.get(vehicle.resource)
        self._states.put(
            replace(vehicle.telemetry(), behavior=controller.behavior, failsafe_problems=problems)
        )

    async def _monitor_vehicle(self, resource: ResourceId) -> None:
        """Publish the state of a vehicle, and report its behavior LOST when it falls silent."""
        controller, clock = self._units[resource], self._context.clock
        vehicle = controller.vehicle
        bound_s = self.limits(resource).lost_after_s
        began_us = looked_us = clock.now_us()
        published, link, was_late = -1, LinkState.CONNECTED, False
        while True:
            now_us = clock.now_us()
            # After a suspension of this process, messages of the vehicle are still to be read.
            late = not was_late and now_us - looked_us > LATE_FACTOR * TELEMETRY_EVERY_S * 1e6
            looked_us, was_late = now_us, late
            silent_s = vehicle.silent_s
            never_received = silent_s is None
            if silent_s is None:
                silent_s = (now_us - began_us) / 1e6
            if silent_s >= bound_s and not late and self._tracker.holder(resource) is not None:
                controller.release()
                reason = (
                    self._never_received(controller.vehicle)
                    if never_received
                    else f"no message for {silent_s:.1f} s"
                )
                refused = vehicle.refused_frames()
                self._tracker.lose(resource, f"{reason}; {refused}" if refused else reason)
            new_refusal = vehicle.warn_of_refused_frames()
            if new_refusal or vehicle.state.changes != published or vehicle.link_state != link:
                published, link = vehicle.state.changes, vehicle.link_state
                self._publish(controller)
            left_s = bound_s - silent_s
            await clock.sleep(min(TELEMETRY_EVERY_S, left_s) if left_s > 0 else TELEMETRY_EVERY_S)

    def _never_received(self, vehicle: "Vehicle") -> str:
        settings = self._settings[vehicle.resource]
        where = ", ".join(map(str, settings.urls))
        if vehicle.refused_frames():
            return f"no message of system {settings.system_id} was accepted"
        return (
            f"no message of system {settings.system_id} has ever arrived on {where}: is its "
            "autopilot, or the simulation of it, running, and does it send there?"
        )

    def _publish_mode_changes(self, controller: "VehicleController") -> None:
        """Publish a change of mode or arming at once: it may end a run, and operators then read the
        last state of the vehicle."""
        state = controller.vehicle.state
        shown = state.custom_mode, state.armed

        def look() -> None:
            nonlocal shown
            if (state.custom_mode, state.armed) != shown:
                shown = state.custom_mode, state.armed
                self._publish(controller)

        controller.vehicle.watch(look)


def _vehicles(request: BehaviorRequest) -> list[ResourceId]:
    return [resource for resource in request.resources if "/" not in resource]
