"""Face `otlp`: sends traces and metrics to an OpenTelemetry collector."""

import asyncio
import os
import socket
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from m2pem import __version__
from m2pem.api.capabilities import FaceCapabilities
from m2pem.api.control import MissionControl
from m2pem.api.face import FaceSettings
from m2pem.units import Dimension
from m2pem_plugin_opentelemetry.metrics import snapshot
from m2pem_plugin_opentelemetry.run_observation import RunObservation
from m2pem_plugin_opentelemetry.spans import Span

if TYPE_CHECKING:
    from m2pem_plugin_opentelemetry.otlp_export import OtlpExport

CLOSED_WITHIN_S = 3.0
"""What the last spans and metrics are given to be sent."""


class OtlpFace:
    """One trace a run, and all metrics each `interval`. Missions never wait for the collector."""

    capabilities = FaceCapabilities(imports=("m2pem_plugin_opentelemetry.otlp_export",))

    def __init__(self, control: MissionControl, settings: FaceSettings) -> None:
        """Read the settings.

        Raises:
            PluginError: one is wrong.
        """
        settings.refuse_others(("endpoint", "traces", "metrics", "interval", "timeout", "queue"))
        self._control = control
        self._endpoint = settings.text("endpoint", "")
        if self._endpoint and not _is_http(self._endpoint):
            example = "http://127.0.0.1:4318"
            problem = f"{self._endpoint!r} is no address of a collector such as {example}"
            raise settings.error("endpoint", problem)
        self._traces = settings.flag("traces", True)
        self._metrics = settings.flag("metrics", True)
        self._interval_s = settings.quantity("interval", 10.0, Dimension.DURATION, 0.1, 3600.0)
        self._timeout_s = settings.quantity("timeout", 10.0, Dimension.DURATION, 0.1, 600.0)
        self._queue_size = settings.whole("queue", 10_000, 1, 1_000_000)
        self._observation: RunObservation | None = None
        if self._traces or self._metrics:
            self._observation = RunObservation(control, self._add if self._traces else None)
        self._export: OtlpExport | None = None

    async def serve(self) -> None:
        """Send until cancelled, and then what is left, within `CLOSED_WITHIN_S`."""
        # When it is made: a process whose fleet names it not has no such libraries.
        from m2pem_plugin_opentelemetry.otlp_export import (  # noqa: PLC0415
            Collector,
            OtlpExport,
        )

        fleet = self._control.fleet().name
        resource = {
            "service.name": "m2pem",
            "service.version": __version__,
            "service.instance.id": f"{socket.gethostname()}:{os.getpid()}",
            "m2pem.fleet.name": fleet,
        }
        collector = Collector(self._endpoint, self._timeout_s, resource)
        self._export = export = OtlpExport(collector, self._queue_size)
        observation = self._observation
        export.start()
        try:
            async with asyncio.TaskGroup() as group:
                if observation is not None:
                    group.create_task(observation.run(), name="runs for otlp")
                if observation is not None and self._metrics:
                    group.create_task(self._measure(export, observation, fleet))
                await asyncio.Event().wait()
        finally:
            if observation is not None:
                await observation.finish()
            if observation is not None and self._metrics:
                export.put(snapshot(await self._control.statistics(), observation.measures, fleet))
            await asyncio.to_thread(export.close, CLOSED_WITHIN_S)

    async def _measure(self, export: "OtlpExport", observation: RunObservation, fleet: str) -> None:
        while True:
            export.put(snapshot(await self._control.statistics(), observation.measures, fleet))
            await asyncio.sleep(self._interval_s)

    def _add(self, span: Span) -> None:
        if self._export is not None:
            self._export.add(span)


def _is_http(text: str) -> bool:
    try:
        parts = urlsplit(text)
        return parts.scheme in ("http", "https") and bool(parts.hostname) and parts.port != 0
    except ValueError:
        return False
