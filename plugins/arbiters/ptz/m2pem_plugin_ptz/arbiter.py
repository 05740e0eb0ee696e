"""The arbiter of cameras that turn. Its catalogue needs no library and no connection."""

import asyncio
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from m2pem.api import (
    ArbiterCapabilities,
    ArbiterContext,
    BehaviorId,
    BehaviorParameters,
    BehaviorReport,
    BehaviorRequest,
    BehaviorSpec,
    BehaviorState,
    Connection,
    Limits,
    LinkState,
    PayloadState,
    ResourceId,
)
from m2pem.api.latest_task import cancel_and_wait
from m2pem.api.unit_arbiter import UnitArbiter
from m2pem_plugin_ptz.catalogue import offered
from m2pem_plugin_ptz.checkpoint import Checkpoint, decode_checkpoint, encode_checkpoint
from m2pem_plugin_ptz.drivers import make_driver as _make_driver
from m2pem_plugin_ptz.drivers.driver import FOUND_WITHIN_S, CameraDriver, Discovering, DriverSetup
from m2pem_plugin_ptz.settings import read_settings

if TYPE_CHECKING:
    from m2pem_plugin_ptz.behaviors.behavior import Behavior
    from m2pem_plugin_ptz.controller import CameraController

LOST_AFTER_S = 3.0
HOLD_WITHIN_S = 1.0
CANCEL_TIMEOUT_S = 10.0

FIRST_CONTACT_WITHIN_S = 5.0
"""`connect` waits no longer than this for cameras."""

TELEMETRY_EVERY_S = 0.2


class PtzArbiter(UnitArbiter["CameraController"]):
    """The arbiter `ptz` (docs/ptz.md). Implements `m2pem.api.Arbiter`.

    Raises:
        PluginError: a connection cannot be used; the text names the resource and the key.
    """

    capabilities = ArbiterCapabilities(fences=True)

    def __init__(
        self,
        connections: Mapping[ResourceId, Connection],
        context: ArbiterContext,
        make_driver: Callable[[DriverSetup], CameraDriver] = _make_driver,
    ) -> None:
        super().__init__(connections, context)
        self._settings = read_settings(connections)
        self._make_driver = make_driver
        self._drivers: list[CameraDriver] = []
        self._pending: dict[BehaviorId, Behavior] = {}
        self._tasks: list[asyncio.Task[None]] = []

    # --- catalogue ------------------------------------------------------------------------------

    def catalogue(self, resource: ResourceId) -> Sequence[BehaviorSpec]:
        """Return the shared behaviors of payloads. The driver refuses what its camera cannot do."""
        return offered() if resource in self._settings else ()

    def limits(self, resource: ResourceId) -> Limits:
        """Return the limits of a camera."""
        own = self._connections[resource].lost_after_s if resource in self._connections else None
        return Limits(LOST_AFTER_S if own is None else own, HOLD_WITHIN_S, CANCEL_TIMEOUT_S)

    # --- life -----------------------------------------------------------------------------------

    async def connect(self) -> None:
        """Connect to all cameras. Return when each was received once, or after
        `FIRST_CONTACT_WITHIN_S`.

        Raises:
            PluginError: a library of a driver is missing, or its settings are invalid.
        """
        from m2pem_plugin_ptz.camera_model.model import CameraModel  # noqa: PLC0415
        from m2pem_plugin_ptz.controller import CameraController  # noqa: PLC0415  # it needs NumPy

        context, cameras = self._context, self._units
        for resource, settings in self._settings.items():
            connection = self._connections[resource]

            def on_telemetry(resource: ResourceId = resource) -> None:
                if resource in cameras:
                    cameras[resource].last_contact_us = context.clock.now_us()

            driver = self._make_driver(DriverSetup(connection, settings, context, on_telemetry))
            self._drivers.append(driver)
            model = CameraModel(resource, connection.domain, driver, settings, context)
            limits = self.limits(resource)
            cameras[resource] = CameraController(model, self._tracker, limits, context.logger)
            await driver.open()
        create = asyncio.get_running_loop().create_task
        self._tasks = [create(self._attend(resource)) for resource in cameras]
        are_received = await asyncio.gather(
            *(each.wait_for_ptz(FIRST_CONTACT_WITHIN_S) for each in cameras.values())
        )
        for resource, is_received in zip(cameras, are_received, strict=True):
            if not is_received:
                context.logger.warning(
                    "%s: the camera has not reported its direction yet", resource
                )

    async def close(self) -> None:
        """Close all connections. The cameras go on with what they do."""
        await cancel_and_wait(*self._tasks)
        self._tasks = []
        for camera in self._units.values():
            await camera.close()
        drivers, self._drivers = self._drivers, []
        for driver in drivers:
            await driver.close()
        self._states.close()
        self._tracker.close()

    # --- behaviors ------------------------------------------------------------------------------

    async def start(self, request: BehaviorRequest) -> None:
        try:
            if self._tracker.admit(
                request, lambda: self._encoded_checkpoint(request), self._refusal
            ):
                camera = self._units[request.resources[0]]
                camera.take(request.id, self._pending[request.id])
        finally:
            self._pending.pop(request.id, None)

    async def disown(self, run: str) -> None:
        """End the behaviors of a run; the cameras are not commanded."""
        held = {resource: self._tracker.holder(resource) for resource in self._units}
        behaviors = self._tracker.disown(run)
        for resource, camera in self._units.items():
            if held[resource] in behaviors:
                camera.drop()

    # --- inside ---------------------------------------------------------------------------------

    def _refusal(self, request: BehaviorRequest) -> str:
        if len(request.resources) != 1:
            return f"{request.behavior} takes one camera, and has {len(request.resources)}"
        resource = request.resources[0]
        if prohibition := self._prohibition(resource, request.behavior):
            return prohibition
        if reason := self._units[resource].driver.refusal(request.behavior):
            return reason
        behavior = self._make(request.id, self._make_checkpoint(request))
        self._pending[request.id] = behavior
        return behavior.refusal()

    def _make(self, id_: BehaviorId, checkpoint: Checkpoint) -> "Behavior":
        from m2pem_plugin_ptz.behaviors import BEHAVIORS  # noqa: PLC0415
        from m2pem_plugin_ptz.behaviors.behavior import BehaviorContext  # noqa: PLC0415

        model = self._units[checkpoint.resource].model
        return BEHAVIORS[checkpoint.behavior](
            BehaviorContext(id_, BehaviorParameters(checkpoint.parameters), model)
        )

    def _make_checkpoint(self, request: BehaviorRequest) -> Checkpoint:
        now_us = self._context.clock.now_us()
        return Checkpoint(request.resources[0], request.behavior, request.parameters, now_us)

    def _encoded_checkpoint(self, request: BehaviorRequest) -> str:
        return encode_checkpoint(self._make_checkpoint(request))

    async def _find(self, unknown: BehaviorReport, native_ref: str | None) -> BehaviorReport:
        checkpoint = decode_checkpoint(native_ref) if native_ref else None
        if checkpoint is None or checkpoint.resource not in self._units:
            return unknown
        return await self._reattach(unknown.id, checkpoint, native_ref or "")

    async def _reattach(
        self, id_: BehaviorId, checkpoint: Checkpoint, reference: str
    ) -> BehaviorReport:
        from m2pem_plugin_ptz.behaviors import BEHAVIORS  # noqa: PLC0415
        from m2pem_plugin_ptz.behaviors.behavior import BehaviorFailedError  # noqa: PLC0415

        camera = self._units[checkpoint.resource]
        unknown = replace(self._tracker.last(id_), native_ref=reference, reason="")
        if checkpoint.behavior not in BEHAVIORS:
            return replace(unknown, reason=f"the behavior '{checkpoint.behavior}' no longer exists")
        if not await camera.wait_for_ptz(FIRST_CONTACT_WITHIN_S):
            return replace(unknown, reason=f"{checkpoint.resource} has not reported its direction")
        try:
            behavior = self._make(id_, checkpoint)
            state = behavior.state_after_restart()
        except (BehaviorFailedError, KeyError) as error:
            return replace(unknown, reason=str(error))
        if state is BehaviorState.RUNNING and self._tracker.holder(checkpoint.resource) is None:
            self._tracker.adopt(id_, [checkpoint.resource], reference)
            elapsed_s = (self._context.clock.now_us() - checkpoint.began_us) / 1e6
            camera.adopt(id_, behavior, elapsed_s)
            return self._tracker.last(id_)
        if state is BehaviorState.SUCCEEDED:
            return replace(unknown, number=3, state=state)
        return replace(unknown, reason=f"the direction of {checkpoint.resource} proves nothing")

    async def _attend(self, resource: ResourceId) -> None:
        """Publish the state of a camera, and detect its silence."""
        camera = self._units[resource]
        bound_us = self.limits(resource).lost_after_s * 1e6
        began_us = self._context.clock.now_us()
        loop = asyncio.get_running_loop()
        found_by_s = loop.time() + FIRST_CONTACT_WITHIN_S + FOUND_WITHIN_S
        async for now_us, late in self._rounds(TELEMETRY_EVERY_S):
            silent_us = now_us - (
                began_us if camera.last_contact_us is None else camera.last_contact_us
            )
            is_young = isinstance(camera.driver, Discovering) and loop.time() < found_by_s
            is_awaited = camera.last_contact_us is None and (camera.is_awaited or is_young)
            lost = silent_us >= bound_us and not (late or is_awaited)
            if lost and self._tracker.holder(resource) is not None:
                camera.drop()
                self._tracker.lose(resource, f"no message for {silent_us / 1e6:.1f} s")
            try:
                self._states.put(self._state(camera, now_us, lost=lost))
            except Exception:  # a bad message must not end the telemetry
                self._context.logger.exception(
                    "%s: cannot publish the state of the camera", resource
                )

    def _state(self, camera: "CameraController", now_us: int, *, lost: bool) -> PayloadState:
        model, ptz = camera.model, camera.driver.ptz
        link = LinkState.LOST if lost else LinkState.CONNECTED
        if ptz is None or lost:
            return PayloadState(model.resource, now_us, link=link, behavior=camera.behavior)
        return PayloadState(
            model.resource,
            now_us,
            ptz.pan_rad + model.settings.mounting.pan_rad,
            ptz.tilt_rad,
            ptz.zoom,
            link=link,
            behavior=camera.behavior,
            footprint=model.footprint(ptz),
        )
