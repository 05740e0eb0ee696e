"""The arbiter of cameras that turn. Its catalogue needs no library, and no connection."""

import asyncio
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from m2pem.api import (
    ArbiterContext,
    AsyncQueue,
    BehaviorId,
    BehaviorParameters,
    BehaviorReport,
    BehaviorRequest,
    BehaviorSpec,
    BehaviorState,
    BehaviorTracker,
    Connection,
    Limits,
    LinkState,
    PayloadState,
    ResourceId,
    VehicleState,
)
from m2pem_plugin_ptz.catalogue import offered
from m2pem_plugin_ptz.checkpoint import Kept, native_ref, read_native_ref
from m2pem_plugin_ptz.drivers import make_driver as _make_driver
from m2pem_plugin_ptz.drivers.driver import CameraDriver, Seat
from m2pem_plugin_ptz.settings import read_settings

if TYPE_CHECKING:
    from m2pem_plugin_ptz.behaviors.behavior import Behavior
    from m2pem_plugin_ptz.controller import Camera

LOST_AFTER_S = 3.0
HOLD_WITHIN_S = 1.0
CANCEL_TIMEOUT_S = 10.0

HEARD_WITHIN_S = 5.0
"""`connect` waits no longer for cameras to be heard."""

TELEMETRY_EVERY_S = 0.2
LATE = 2.0
"""So many times as long as that since the last look: this process was held up."""

STATES_WAITING = 1000


class PtzArbiter:
    """Implements `m2pem.api.Arbiter`. What a fleet may say of it: docs/ptz.md.

    Raises:
        PluginError: a connection cannot be used; the text names the resource and the key.
    """

    def __init__(
        self,
        connections: Mapping[ResourceId, Connection],
        context: ArbiterContext,
        make_driver: Callable[[Seat], CameraDriver] = _make_driver,
    ) -> None:
        self._connections = connections
        self._context = context
        self._settings = read_settings(connections)
        self._make_driver = make_driver
        self._ledger = BehaviorTracker(self.catalogue, context.logger)
        self._states: AsyncQueue[VehicleState | PayloadState] = AsyncQueue(STATES_WAITING)
        self._cameras: dict[ResourceId, Camera] = {}
        self._drivers: list[CameraDriver] = []
        self._pending: dict[BehaviorId, Behavior] = {}
        self._tasks: list[asyncio.Task[None]] = []

    # --- what is offered ------------------------------------------------------------------------

    def catalogue(self, resource: ResourceId) -> Sequence[BehaviorSpec]:
        """What payloads share. What a camera cannot do of it, its driver refuses."""
        return offered() if resource in self._settings else ()

    def limits(self, resource: ResourceId) -> Limits:
        """The bounds that hold for a camera."""
        own = self._connections[resource].lost_after_s if resource in self._connections else None
        return Limits(LOST_AFTER_S if own is None else own, HOLD_WITHIN_S, CANCEL_TIMEOUT_S)

    # --- life -----------------------------------------------------------------------------------

    async def connect(self) -> None:
        """Listen to all cameras; returns when all were heard, or soon.

        Raises:
            PluginError: what a driver needs is not installed, or its settings cannot be.
        """
        from m2pem_plugin_ptz.camera_model.model import Sight  # noqa: PLC0415
        from m2pem_plugin_ptz.controller import Camera  # noqa: PLC0415  # it needs NumPy

        context, cameras = self._context, self._cameras
        for resource, settings in self._settings.items():
            connection = self._connections[resource]

            def heard(resource: ResourceId = resource) -> None:
                if resource in cameras:
                    cameras[resource].heard_us = context.clock.now_us()

            driver = self._make_driver(Seat(connection, settings, context, heard))
            self._drivers.append(driver)
            sight = Sight(resource, connection.domain, driver, settings, context)
            limits = self.limits(resource)
            cameras[resource] = Camera(sight, self._ledger, limits, context.logger)
            await driver.open()
        create = asyncio.get_running_loop().create_task
        self._tasks = [create(self._attend(resource)) for resource in cameras]
        heard_of = await asyncio.gather(*(each.knows(HEARD_WITHIN_S) for each in cameras.values()))
        for resource, is_heard in zip(cameras, heard_of, strict=True):
            if not is_heard:
                context.logger.warning("%s: where it looks was not heard yet", resource)

    async def close(self) -> None:
        """Listen no more. Cameras keep doing what they do."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        self._tasks = []
        for camera in self._cameras.values():
            await camera.close()
        drivers, self._drivers = self._drivers, []
        for driver in drivers:
            await driver.close()
        self._states.close()
        self._ledger.close()

    # --- behaviors ------------------------------------------------------------------------------

    async def start(self, request: BehaviorRequest) -> None:
        """Start a behavior; see `BehaviorRequest`."""
        try:
            if self._ledger.admit(request, lambda: self._native_ref(request), self._refusal):
                camera = self._cameras[request.resources[0]]
                camera.take(request.id, self._pending[request.id])
        finally:
            self._pending.pop(request.id, None)

    async def cancel(self, behavior: BehaviorId, epoch: int) -> None:
        """Stop the camera that does it."""
        if self._ledger.may_cancel(behavior, epoch):
            for resource, camera in self._cameras.items():
                if self._ledger.holder(resource) == behavior:
                    camera.cancel(behavior)

    async def hold(self, resource: ResourceId) -> None:
        """Have a camera stop turning at once."""
        if resource in self._cameras:
            self._cameras[resource].hold()

    async def resume(self, resource: ResourceId) -> None:
        """Have a camera go on."""
        if resource in self._cameras:
            self._cameras[resource].resume()

    async def query(self, behavior: BehaviorId, native_ref: str | None) -> BehaviorReport:
        """What is known; after a restart, what can be told by where the camera looks."""
        known = self._ledger.last(behavior)
        if known.state is not BehaviorState.UNKNOWN:
            return known
        kept = read_native_ref(native_ref) if native_ref else None
        if kept is None or kept.resource not in self._cameras:
            return known
        return await self._recognise(behavior, kept, native_ref or "")

    # --- streams --------------------------------------------------------------------------------

    def reports(self) -> AsyncIterator[BehaviorReport]:
        """Reports as they come, for one reader, until `close`."""
        return self._ledger.reports()

    def telemetry(self) -> AsyncIterator[VehicleState | PayloadState]:
        """States as they come, for one reader, until `close`; a slow one misses old states."""
        return self._states.read()

    # --- inside ---------------------------------------------------------------------------------

    def _refusal(self, request: BehaviorRequest) -> str:
        if len(request.resources) != 1:
            return f"{request.behavior} takes one camera, and has {len(request.resources)}"
        resource = request.resources[0]
        allowed = self._connections[resource].behaviors
        if allowed is not None and request.behavior not in allowed:
            return f"the fleet does not allow {resource} the behavior '{request.behavior}'"
        if resource not in self._cameras:
            return "the arbiter is not connected"
        if reason := self._cameras[resource].driver.refusal(request.behavior):
            return reason
        behavior = self._make(request.id, self._kept(request))
        self._pending[request.id] = behavior
        return behavior.refusal()

    def _make(self, id_: BehaviorId, kept: Kept) -> "Behavior":
        from m2pem_plugin_ptz.behaviors import BEHAVIORS  # noqa: PLC0415
        from m2pem_plugin_ptz.behaviors.behavior import Job  # noqa: PLC0415

        sight = self._cameras[kept.resource].sight
        return BEHAVIORS[kept.behavior](Job(id_, BehaviorParameters(kept.parameters), sight))

    def _kept(self, request: BehaviorRequest) -> Kept:
        now_us = self._context.clock.now_us()
        return Kept(request.resources[0], request.behavior, request.parameters, now_us)

    def _native_ref(self, request: BehaviorRequest) -> str:
        return native_ref(self._kept(request))

    async def _recognise(self, id_: BehaviorId, kept: Kept, reference: str) -> BehaviorReport:
        from m2pem_plugin_ptz.behaviors import BEHAVIORS  # noqa: PLC0415
        from m2pem_plugin_ptz.behaviors.behavior import BehaviorFailedError  # noqa: PLC0415

        camera = self._cameras[kept.resource]
        unknown = BehaviorReport(id_, 0, BehaviorState.UNKNOWN, native_ref=reference)
        if kept.behavior not in BEHAVIORS:
            return replace(unknown, reason=f"there is no behavior '{kept.behavior}' any more")
        if not await camera.knows(HEARD_WITHIN_S):
            return replace(unknown, reason=f"where {kept.resource} looks was not heard")
        try:
            behavior = self._make(id_, kept)
            state = behavior.recognised()
        except (BehaviorFailedError, KeyError) as error:
            return replace(unknown, reason=str(error))
        if state is BehaviorState.RUNNING and self._ledger.holder(kept.resource) is None:
            self._ledger.adopt(id_, [kept.resource], reference)
            elapsed_s = (self._context.clock.now_us() - kept.began_us) / 1e6
            camera.adopt(id_, behavior, elapsed_s)
            return self._ledger.last(id_)
        if state is BehaviorState.SUCCEEDED:
            return replace(unknown, number=3, state=state)
        return replace(unknown, reason=f"where {kept.resource} looks does not tell")

    async def _attend(self, resource: ResourceId) -> None:
        """Tell where a camera looks, and notice when it falls silent."""
        camera, clock = self._cameras[resource], self._context.clock
        bound_us = self.limits(resource).lost_after_s * 1e6
        began_us = looked_us = clock.now_us()
        was_late = False
        while True:
            now_us = clock.now_us()
            # After a pause of our own, what the camera said meanwhile is still to be read.
            late = not was_late and now_us - looked_us > LATE * TELEMETRY_EVERY_S * 1e6
            looked_us, was_late = now_us, late
            silent_us = now_us - (began_us if camera.heard_us is None else camera.heard_us)
            lost = silent_us >= bound_us and not late
            if lost and self._ledger.holder(resource) is not None:
                camera.drop()
                self._ledger.lose(resource, f"not heard for {silent_us / 1e6:.1f} s")
            try:
                self._states.put(self._state(camera, now_us, lost=lost))
            except Exception:  # what one camera or vehicle says must not make us deaf
                self._context.logger.exception("%s: where it looks cannot be told", resource)
            await clock.sleep(TELEMETRY_EVERY_S)

    def _state(self, camera: "Camera", now_us: int, *, lost: bool) -> PayloadState:
        sight, look = camera.sight, camera.driver.look
        link = LinkState.LOST if lost else LinkState.CONNECTED
        if look is None or lost:
            return PayloadState(sight.resource, now_us, link=link, behavior=camera.behavior)
        return PayloadState(
            sight.resource,
            now_us,
            look.pan_rad + sight.settings.mounting.pan_rad,
            look.tilt_rad,
            look.zoom,
            link=link,
            behavior=camera.behavior,
            footprint=sight.footprint(look),
        )
