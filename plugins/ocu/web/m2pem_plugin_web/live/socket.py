"""/api/live: a WebSocket to each browser. What it sends is bounded in size and in rate."""

import asyncio
import logging
from collections.abc import Callable
from contextlib import suppress
from typing import Annotated

import msgspec
from fastapi import APIRouter, WebSocket
from starlette.websockets import WebSocketDisconnect, WebSocketDisconnected

from m2pem.errors import M2pemError
from m2pem_plugin_web.access.permissions import person_of
from m2pem_plugin_web.access.sign_in import SUBPROTOCOL, Entry, key_of
from m2pem_plugin_web.live import messages
from m2pem_plugin_web.live.hub import MOST_VIEWERS, Hub
from m2pem_plugin_web.live.viewer import HEARTBEAT_S, Viewer
from m2pem_plugin_web.missions.names import LONGEST

LONGEST_MESSAGE = 4096
"""Most bytes of a message from a browser."""

ABORT = "m2pem.abort"
"""The key in the ASGI scope of a function that ends a connection at once: a browser that receives
nothing cannot be disconnected by a close message."""

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

_encode = msgspec.json.Encoder().encode
log = logging.getLogger("m2pem.ocu.web")


class _Watch(msgspec.Struct, tag="watch", frozen=True):
    run: str | None = None


class _Ack(msgspec.Struct, tag="ack", frozen=True):
    seq: int


class _Edit(msgspec.Struct, tag="edit", frozen=True):
    """`mission`: the name of the one that the page edits now; None: none."""

    mission: Annotated[str, msgspec.Meta(max_length=LONGEST)] | None = None


_decoder: msgspec.json.Decoder[_Watch | _Ack | _Edit] = msgspec.json.Decoder(
    _Watch | _Ack | _Edit
)


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
        viewer, key = Viewer(person), key_of(socket)
        hub.viewers.add(viewer)
        try:
            await converse(socket, hub, viewer, lambda: entry.person(socket.cookies, key) == person)
        except _Leave as leave:
            await _close(socket, leave)
        finally:
            hub.viewers.discard(viewer)
            await hub.left(viewer)

    return routes


async def converse(
    socket: WebSocket, hub: Hub, viewer: Viewer, may_stay: Callable[[], bool]
) -> None:
    """Exchange messages until the browser disconnects or must be disconnected."""
    tasks = [
        asyncio.create_task(_speak(socket, hub, viewer)),
        asyncio.create_task(_listen(socket, hub, viewer)),
        asyncio.create_task(_look_after(viewer, may_stay)),
    ]
    try:
        done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        for task in done:
            task.result()
    except (WebSocketDisconnect, WebSocketDisconnected):
        return  # RuntimeError: another task has already found the browser disconnected
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


async def _speak(socket: WebSocket, hub: Hub, viewer: Viewer) -> None:
    loop = asyncio.get_running_loop()
    while True:
        await viewer.wake.wait()
        viewer.wake.clear()
        if viewer.overrun:
            raise _Leave(SILENT, "too slow")
        for message in hub.next_messages(viewer, loop.time()):
            await socket.send_text(_encode(message).decode())


async def _listen(socket: WebSocket, hub: Hub, viewer: Viewer) -> None:
    loop = asyncio.get_running_loop()
    left, at = float(BURST), loop.time()
    while True:
        text = await socket.receive_text()
        now = loop.time()
        left, at = min(BURST, left + (now - at) * RATE) - 1, now
        if left < 0:
            raise _Leave(FLOOD, "too many messages")
        try:
            said = _decoder.decode(text)
        except (msgspec.DecodeError, UnicodeError, RecursionError) as error:
            raise _Leave(MALFORMED, "not a message of this protocol") from error
        match said:
            case _Ack(seq=seq):
                viewer.acknowledge(seq)
            case _Edit(mission=mission):
                await hub.edit(viewer, mission or "")
            case _Watch(run=run):
                try:
                    await _watch(hub, viewer, run)
                except M2pemError as error:
                    viewer.refuse(messages.fault(str(error)))


async def _watch(hub: Hub, viewer: Viewer, run: str | None) -> None:
    """Watch a run; send `alive` while a long one is being read."""
    watching = asyncio.ensure_future(hub.watch(viewer, run))
    try:
        while not (await asyncio.wait({watching}, timeout=HEARTBEAT_S))[0]:
            viewer.refuse(messages.alive())
        await watching
    finally:
        watching.cancel()


async def _look_after(viewer: Viewer, may_stay: Callable[[], bool]) -> None:
    loop = asyncio.get_running_loop()
    while True:
        await asyncio.sleep(LOOK_EVERY_S)
        if viewer.is_silent(loop.time()):
            raise _Leave(SILENT, "the browser acknowledges nothing")
        if not may_stay():
            raise _Leave(SIGNED_OUT, "signed out")


async def _close(socket: WebSocket, leave: _Leave) -> None:
    """Close with a reason, and abort soon after: the browser may not read the reason."""
    abort = socket.scope.get(ABORT)
    if abort is not None:
        asyncio.get_running_loop().call_later(LAST_WORDS_S, abort)
    with suppress(TimeoutError, RuntimeError, WebSocketDisconnect):
        async with asyncio.timeout(LAST_WORDS_S):
            await socket.close(leave.code, leave.reason)
