"""/api/live: a WebSocket to each browser. What it sends is bounded in size and in rate."""

import asyncio
import logging
from collections.abc import Callable
from contextlib import suppress
from typing import Annotated

import msgspec
from fastapi import APIRouter, WebSocket
from starlette.websockets import WebSocketDisconnect

from m2pem.errors import M2pemError
from m2pem_plugin_web.access.permissions import person_of
from m2pem_plugin_web.access.sign_in import SUBPROTOCOL, Entry, key_of
from m2pem_plugin_web.live import messages
from m2pem_plugin_web.live.hub import MOST_VIEWERS, Hub
from m2pem_plugin_web.live.viewer import HEARTBEAT_S, Viewer
from m2pem_plugin_web.live.wire import WIRE, Wire
from m2pem_plugin_web.missions.names import LONGEST

LONGEST_MESSAGE = 4096
"""Most bytes of a message from a browser."""

LAST_WORDS_S = 1.0

RATE = 200
BURST = 400
"""Messages that a browser may send in a second, and at once: it acknowledges 25 in a second."""

LOOK_EVERY_S = 1.0

SILENT = 4008
FLOOD = 4029
SIGNED_OUT = 4401
MALFORMED = 4400
FULL = 1013

log = logging.getLogger("m2pem.ocu.web")


class _Watch(msgspec.Struct, tag="watch", frozen=True):
    run: str | None = None


class _Ack(msgspec.Struct, tag="ack", frozen=True):
    seq: int


class _Edit(msgspec.Struct, tag="edit", frozen=True):
    """`mission`: the name of the one that the page edits now; None: none."""

    mission: Annotated[str, msgspec.Meta(max_length=LONGEST)] | None = None


_decoder: msgspec.json.Decoder[_Watch | _Ack | _Edit] = msgspec.json.Decoder(_Watch | _Ack | _Edit)


class _Leave(Exception):  # noqa: N818  # nothing went wrong here
    """Close the connection with a code and a reason."""

    def __init__(self, code: int, reason: str) -> None:
        self.code = code
        self.reason = reason
        super().__init__(reason)


def router(hub: Hub, entry: Entry) -> APIRouter:
    """Return the route of the WebSocket, for all signed-in users."""
    routes = APIRouter()

    @routes.websocket("/api/live")
    async def live(socket: WebSocket) -> None:
        person = person_of(socket)
        if person is None:
            await socket.close(SIGNED_OUT, "sign in first")
            return
        offered: list[str] = socket.scope["subprotocols"]
        await socket.accept(SUBPROTOCOL if SUBPROTOCOL in offered else None)
        if len(hub.viewers) >= MOST_VIEWERS:
            await socket.close(FULL, "too many pages are open")
            return
        wire: Wire = socket.scope[WIRE]
        viewer, key = Viewer(wire, person), key_of(socket)
        hub.viewers.add(viewer)
        try:
            await converse(socket, hub, viewer, lambda: entry.person(socket.cookies, key) == person)
        except _Leave as leave:
            await _close(socket, wire, leave)
        finally:
            hub.viewers.discard(viewer)
            await hub.left(viewer)

    return routes


async def converse(
    socket: WebSocket, hub: Hub, viewer: Viewer, may_stay: Callable[[], bool]
) -> None:
    """Exchange messages until the browser disconnects or must be disconnected."""
    listener = _Listener(viewer)
    viewer.wire.listen(listener.take, viewer.flush)
    tasks = [
        asyncio.create_task(_until_closed(socket, listener)),
        asyncio.create_task(listener.serve(hub)),
        asyncio.create_task(_look_after(viewer, may_stay)),
    ]
    try:
        awaited = [*tasks, listener.leaving]
        done, _ = await asyncio.wait(awaited, return_when=asyncio.FIRST_COMPLETED)
        for each in done:
            each.result()
    except WebSocketDisconnect:
        return
    finally:
        viewer.wire.listen(_ignore, _ignore)
        for each in tasks:
            each.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


def _ignore(*_: object) -> None:
    pass


async def _until_closed(socket: WebSocket, listener: "_Listener") -> None:
    """Take what came before the wire was listened to, and wait for the end of the connection."""
    while True:
        listener.take((await socket.receive_text()).encode())


class _Listener:
    """Takes the messages of a browser as they come."""

    def __init__(self, viewer: Viewer) -> None:
        self.leaving: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        """Ends with `_Leave` when the browser is to be disconnected."""
        self._viewer = viewer
        self._requests: asyncio.Queue[_Watch | _Edit] = asyncio.Queue()
        self._left, self._at = float(BURST), asyncio.get_running_loop().time()

    def take(self, text: bytes) -> None:
        """Take a message; once the browser is to be disconnected, none."""
        if self.leaving.done():
            return
        now = asyncio.get_running_loop().time()
        self._left, self._at = min(BURST, self._left + (now - self._at) * RATE) - 1, now
        if self._left < 0:
            self.leaving.set_exception(_Leave(FLOOD, "too many messages"))
            return
        try:
            message = _decoder.decode(text)
        except (msgspec.DecodeError, UnicodeError, RecursionError):
            self.leaving.set_exception(_Leave(MALFORMED, "not a message of this protocol"))
            return
        match message:
            case _Ack(seq=seq):
                self._viewer.acknowledge(seq)
            case _Watch() | _Edit():
                self._requests.put_nowait(message)

    async def serve(self, hub: Hub) -> None:
        """Do what the browser asks for, one after the other."""
        while True:
            try:
                match await self._requests.get():
                    case _Watch(run=run):
                        await _watch(hub, self._viewer, run)
                    case _Edit(mission=mission):
                        await hub.edit(self._viewer, mission or "")
            except M2pemError as error:
                self._viewer.send(messages.message("fault", text=str(error)))


async def _watch(hub: Hub, viewer: Viewer, run: str | None) -> None:
    """Watch a run; send `alive` while a long one is being read."""
    watching = asyncio.ensure_future(hub.watch(viewer, run))
    try:
        while not (await asyncio.wait({watching}, timeout=HEARTBEAT_S))[0]:
            viewer.send(messages.message("alive"))
        await watching
    finally:
        watching.cancel()


async def _look_after(viewer: Viewer, may_stay: Callable[[], bool]) -> None:
    loop = asyncio.get_running_loop()
    while True:
        await asyncio.sleep(LOOK_EVERY_S)
        if viewer.overrun:
            raise _Leave(SILENT, "too slow")
        if viewer.is_silent(loop.time()):
            raise _Leave(SILENT, "the browser acknowledges nothing")
        if not may_stay():
            raise _Leave(SIGNED_OUT, "signed out")


async def _close(socket: WebSocket, wire: Wire, leave: _Leave) -> None:
    """Close with a reason, and abort soon after: the browser may not read the reason."""
    asyncio.get_running_loop().call_later(LAST_WORDS_S, wire.abort)
    with suppress(TimeoutError, RuntimeError, WebSocketDisconnect):
        async with asyncio.timeout(LAST_WORDS_S):
            await socket.close(leave.code, leave.reason)
