"""A WebSocket server for Foxglove and other viewers of its protocol.

Viewers only read. The server has threads of its own; of a viewer that does not keep up it drops the
oldest messages (`backlog`), and nothing else is delayed.
"""

import asyncio
import logging
import threading
import time
from contextlib import suppress

import foxglove
from foxglove.websocket import WebSocketServer

from m2pem.api import (
    US_PER_S,
    Alert,
    LocalFrame,
    MissionControl,
    RunId,
    RunView,
    StampedRecord,
    follow,
    shown_geometries,
)
from m2pem.api import records as r
from m2pem.api.follower import Listener
from m2pem.errors import PluginError
from m2pem_plugin_recorder.channels import (
    Channel,
    ChannelMessage,
    pictures_channel,
    prompts_channel,
    records_channel,
    telemetry_channel,
)
from m2pem_plugin_recorder.foxglove_messages import (
    log_channel,
    log_message,
    removal_messages,
    scene_channels,
    scene_messages,
)
from m2pem_plugin_recorder.record_messages import RecordEncoder
from m2pem_plugin_recorder.settings import FoxgloveSettings
from m2pem_plugin_recorder.telemetry_messages import RateLimit, TelemetryEncoder

STATES_WAITING = 1000

SCENE_AGAIN_S = 5.0
"""Seconds after which the scene is sent again, for viewers that have come since."""

STOP_WITHIN_S = 2.0
"""How long viewers may take to close their connections."""

log = logging.getLogger("m2pem.face.foxglove")


class LiveServer(Listener):
    """Serves viewers."""

    def __init__(self, control: MissionControl, settings: FoxgloveSettings) -> None:
        self._settings = settings
        fleet = control.fleet()
        self._control = control
        self._frame = LocalFrame(fleet.origin)
        self._fence = fleet.fence
        self._context = foxglove.Context()
        self._channels: dict[Channel, foxglove.Channel] = {}
        self._encoders: dict[RunId, RecordEncoder] = {}
        self._telemetry = TelemetryEncoder(self._frame, ros=settings.ros)
        self._limit = RateLimit(settings.rate_hz)
        # A viewer subscribes to channels that it knows: it misses the first message of a new one.
        for channel in (
            records_channel(),
            prompts_channel(),
            pictures_channel(),
            telemetry_channel(),
            log_channel(),
            *scene_channels(),
        ):
            self._channels[channel] = self._made(channel)
        self._of_records = [
            self._channels[each]
            for each in (records_channel(), prompts_channel(), pictures_channel())
        ]
        self._scene_changed = asyncio.Event()
        self._follower = follow(control, self)

    async def run(self) -> None:
        """Serve until cancelled.

        Raises:
            PluginError: the port cannot be opened.
        """
        server = self._open()
        log.info("Foxglove viewers connect to ws://%s:%d", self._settings.host, server.port)
        try:
            async with asyncio.TaskGroup() as tasks:
                tasks.create_task(self._follower.run(), name="foxglove: records")
                tasks.create_task(self._take_states(), name="foxglove: telemetry")
                tasks.create_task(self._show_scene(), name="foxglove: scene")
        except ExceptionGroup as group:
            raise group.exceptions[0] from None
        finally:
            await _stop(server)

    def _open(self) -> WebSocketServer:
        try:
            return foxglove.start_server(
                name=f"m2pem {self._control.fleet().name}",
                host=self._settings.host,
                port=self._settings.port,
                capabilities=[],  # no viewer may publish, call or set anything
                context=self._context,
                message_backlog_size=self._settings.backlog,
            )
        except (OSError, RuntimeError, ValueError) as error:
            where = f"{self._settings.host}:{self._settings.port}"
            raise PluginError(f"faces.foxglove.port: {where} cannot be opened: {error}") from error

    # --- what the executive publishes -----------------------------------------------------------

    def recorded(self, view: RunView, stamped: StampedRecord, *, is_new: bool) -> None:
        """Send a record; those of before are only taken note of."""
        encoder = self._encoders.get(view.run)
        if encoder is None:
            encoder = self._encoders[view.run] = RecordEncoder(view.run)
        if not is_new:
            encoder.take(stamped)
            return
        if any(channel.has_sinks() for channel in self._of_records):
            for message in encoder.messages(stamped):
                self._send(message)
        else:
            encoder.take(stamped)
        if isinstance(stamped.record, r.RunEnded):
            self._forget()
        if isinstance(stamped.record, r.RunStarted | r.GeometryReceived):
            self._scene_changed.set()

    def alerted(self, alert: Alert) -> None:
        """Send an alert."""
        self._send(log_message(alert, round(time.time() * US_PER_S)))

    def _forget(self) -> None:
        for run in self._encoders.keys() - self._follower.views.keys():
            del self._encoders[run]

    async def _take_states(self) -> None:
        async for state in self._control.telemetry(STATES_WAITING):
            if self._limit.passes(state):
                for message in self._telemetry.messages(state):
                    self._send(message)

    async def _show_scene(self) -> None:
        shown: set[str] = set()
        while True:
            now_us = round(time.time() * US_PER_S)
            geometries = shown_geometries(self._control)
            gone, shown = shown - geometries.keys(), set(geometries)
            for message in (
                *removal_messages(gone, now_us),
                *scene_messages(geometries, self._frame, self._fence, now_us),
            ):
                self._send(message)
            with suppress(TimeoutError):
                async with asyncio.timeout(SCENE_AGAIN_S):
                    await self._scene_changed.wait()
            self._scene_changed.clear()

    def _send(self, message: ChannelMessage) -> None:
        channel = self._channels.get(message.channel)
        if channel is None:
            channel = self._channels[message.channel] = self._made(message.channel)
        channel.log(message.data, log_time=max(0, message.time_us) * 1000)

    def _made(self, channel: Channel) -> foxglove.Channel:
        kind = channel.schema
        return foxglove.Channel(
            channel.topic,
            message_encoding=channel.encoding,
            schema=foxglove.Schema(name=kind.name, encoding=kind.encoding, data=kind.data),
            context=self._context,
        )


async def _stop(server: WebSocketServer) -> None:
    """Stop the server. It waits for each viewer to close its connection, which one that never reads
    does not: that is left to a thread which ends with the process."""
    loop, stopped = asyncio.get_running_loop(), asyncio.Event()

    def stop() -> None:
        server.stop()
        with suppress(RuntimeError):  # nobody waits any more
            loop.call_soon_threadsafe(stopped.set)

    threading.Thread(target=stop, name="end of foxglove", daemon=True).start()
    with suppress(TimeoutError):
        async with asyncio.timeout(STOP_WITHIN_S):
            await stopped.wait()
