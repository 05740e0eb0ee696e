"""Face `prometheus`: serves `/metrics`."""

import asyncio
import time
from http import HTTPStatus

from m2pem.api.capabilities import FaceCapabilities
from m2pem.api.control import MissionControl
from m2pem.api.face import FaceSettings
from m2pem.errors import PluginError
from m2pem_plugin_opentelemetry.metrics import snapshot
from m2pem_plugin_opentelemetry.run_observation import RunObservation

REQUEST_BYTES = 16_384
"""The longest request: its line and headers."""

WITHIN_S = 10.0
"""How long a client may take to ask, and again to read."""

PAGE_EVERY_S = 0.5
"""Between two pages: one of hundreds of vehicles takes 50 ms of the executive's time, and a client
could ask without a pause."""

CONNECTIONS = 16
"""Connections at one time; others are closed at once."""


class PrometheusFace:
    """Serves the metrics to programs that ask for them, one request a connection."""

    capabilities = FaceCapabilities(imports=("m2pem_plugin_opentelemetry.exposition",))

    def __init__(self, control: MissionControl, settings: FaceSettings) -> None:
        """Read the settings.

        Raises:
            PluginError: one is wrong.
        """
        settings.refuse_others(("port", "address"))
        self._control = control
        self._address = settings.text("address", "127.0.0.1")
        self._port = settings.whole("port", 9464, 1, 65_535)
        self._observation = RunObservation(control)
        self._connections: set[asyncio.Task[None]] = set()
        self._one = asyncio.Lock()
        self._rendered_s = -PAGE_EVERY_S

    async def serve(self) -> None:
        """Serve until cancelled.

        Raises:
            PluginError: the port cannot be opened.
        """
        try:
            server = await asyncio.start_server(
                self._connected, self._address, self._port, limit=REQUEST_BYTES
            )
        except OSError as error:
            where = f"{self._address}:{self._port}"
            raise PluginError(f"{where} cannot be opened: {error.strerror or error}") from error
        try:
            await self._observation.run()
            await asyncio.Event().wait()
        finally:
            server.close()
            for each in self._connections:
                each.cancel()
            await asyncio.gather(*self._connections, return_exceptions=True)

    async def _connected(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        if task is None or len(self._connections) >= CONNECTIONS:
            writer.transport.abort()
            return
        self._connections.add(task)
        try:
            await self._answer(reader, writer)
        except (OSError, TimeoutError, EOFError, ValueError):
            writer.transport.abort()  # gone, too slow, or no HTTP
        except asyncio.CancelledError:
            writer.transport.abort()  # the face ends
        finally:
            self._connections.discard(task)
            writer.close()

    async def _answer(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        async with asyncio.timeout(WITHIN_S):
            try:
                request = await reader.readuntil(b"\r\n\r\n")
            except asyncio.LimitOverrunError:
                request = b""
        status, page, content_type = await self._page(request.decode("latin-1"))
        head = (
            f"HTTP/1.1 {status.value} {status.phrase}\r\nContent-Type: {content_type}\r\n"
            f"Content-Length: {len(page)}\r\nConnection: close\r\n\r\n"
        )
        body = b"" if request.startswith(b"HEAD ") else page
        writer.transport.set_write_buffer_limits(0)  # so that `drain` waits for all of it
        writer.write(head.encode() + body)
        async with asyncio.timeout(WITHIN_S):
            await writer.drain()

    async def _page(self, request: str) -> tuple[HTTPStatus, bytes, str]:
        line, _, rest = request.partition("\r\n")
        words = line.split(" ")
        if len(words) != 3 or not words[2].startswith("HTTP/1."):
            return HTTPStatus.BAD_REQUEST, b"this is no HTTP/1.1\n", "text/plain"
        method, path, _ = words
        if method not in ("GET", "HEAD"):
            return HTTPStatus.METHOD_NOT_ALLOWED, b"GET /metrics\n", "text/plain"
        if path.partition("?")[0] != "/metrics":
            return HTTPStatus.NOT_FOUND, b"the metrics are at /metrics\n", "text/plain"
        fields = [each.partition(":") for each in rest.split("\r\n")]
        accept = ",".join(value for name, _, value in fields if name.strip().lower() == "accept")
        async with self._one:
            await asyncio.sleep(self._rendered_s + PAGE_EVERY_S - time.monotonic())
            page, content_type = await self._render(accept)
            self._rendered_s = time.monotonic()
        return HTTPStatus.OK, page, content_type

    async def _render(self, accept: str) -> tuple[bytes, str]:
        from m2pem_plugin_opentelemetry.exposition import rendered  # noqa: PLC0415  # see `otlp`

        found = await self._control.statistics()
        families = snapshot(found, self._observation.measures, self._control.fleet().name)
        return await asyncio.to_thread(rendered, families, accept)
