"""A network that can die without a word: bytes pass no more, and nothing is closed."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from urllib.parse import urlsplit

CHUNK = 65536


class Proxy:
    """Passes bytes to a port of this machine, in each direction while its event is set.

    What was sent meanwhile is kept, and arrives when the direction heals; so do ends of streams.
    """

    def __init__(self, port: int) -> None:
        self.port = 0
        self.up = asyncio.Event()
        self.down = asyncio.Event()
        self.heal()
        self._to = port
        self._tasks: set[asyncio.Task[None]] = set()

    def stall(self, directions: str = "both") -> None:
        """Stop passing bytes `up` to the server, `down` to the browser, or `both`."""
        if directions in ("up", "both"):
            self.up.clear()
        if directions in ("down", "both"):
            self.down.clear()

    def heal(self) -> None:
        """Pass all that waits, and what comes."""
        self.up.set()
        self.down.set()

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None
        self._tasks.add(task)
        try:
            server_reader, server_writer = await asyncio.open_connection("127.0.0.1", self._to)
            await asyncio.gather(
                _pump(reader, server_writer, self.up), _pump(server_reader, writer, self.down)
            )
        except asyncio.CancelledError:
            pass  # the test is over; streams would log it
        except ConnectionRefusedError:
            writer.close()  # as the server's own port does while the server is down
        finally:
            self._tasks.discard(task)

    async def close(self) -> None:
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)


async def _pump(
    reader: asyncio.StreamReader, writer: asyncio.StreamWriter, passes: asyncio.Event
) -> None:
    with suppress(OSError):
        while chunk := await reader.read(CHUNK):
            await passes.wait()
            writer.write(chunk)
            await writer.drain()
    await passes.wait()
    with suppress(OSError):
        writer.close()


@asynccontextmanager
async def proxy_to(origin: str) -> AsyncIterator[Proxy]:
    """A proxy before a server; its own port is `port`."""
    proxy = Proxy(urlsplit(origin).port or 0)
    server = await asyncio.start_server(proxy.serve, "127.0.0.1", 0)
    proxy.port = server.sockets[0].getsockname()[1]
    try:
        yield proxy
    finally:
        server.close()
        await proxy.close()
