"""The executive's end of the socket.

async with ControlSocket(executive.control, journal_path):
    ...
"""

import asyncio
import logging
import os
import socket
import struct
from inspect import isawaitable
from pathlib import Path
from typing import Any, Self

import msgspec

from m2pem.api.control import MissionControl
from m2pem.api.operations import OPERATIONS, Operation
from m2pem.control_socket.paths import ControlSocketError, address, live_sockets, make_place
from m2pem.control_socket.protocol import (
    LONGEST_LINE_BYTES,
    Code,
    Fault,
    Request,
    Response,
    fault_of,
    line,
)
from m2pem.errors import M2pemError

log = logging.getLogger("m2pem.control_socket")


class ControlSocket:
    """Serves `control` to processes of this user, on a socket beside the journal.

    An executive without it still runs its missions: what keeps the socket from being made is
    logged. `journal` None (a journal in memory): no client could find the socket, so there is none.
    """

    def __init__(self, control: MissionControl, journal: Path | None) -> None:
        self._control = control
        self._journal = journal
        self._callers: set[asyncio.Task[None]] = set()
        self._server: asyncio.Server | None = None
        self.path: Path | None = None

    async def __aenter__(self) -> Self:
        if self._journal is not None:
            try:
                await self._listen(self._journal)
            except (ControlSocketError, OSError) as error:
                log.warning("m2pem answer, stop and attach will not reach this: %s", error)
        return self

    async def __aexit__(self, *reason: object) -> None:
        if self._server is None:
            return
        self._server.close()
        for caller in self._callers:
            caller.cancel()
        await asyncio.gather(*self._callers, return_exceptions=True)
        if self.path is not None:
            self.path.unlink(missing_ok=True)

    async def _listen(self, journal: Path) -> None:
        path = make_place(journal)
        for _ in live_sockets(journal):
            pass  # those of dead executives are removed on the way
        path.unlink(missing_ok=True)
        listening = socket.socket(socket.AF_UNIX)
        try:
            with address(path) as here:
                listening.bind(here)
            path.chmod(0o600)
            self._server = await asyncio.start_unix_server(
                self._serve, sock=listening, limit=LONGEST_LINE_BYTES
            )
        except OSError:
            listening.close()
            raise
        self.path = path

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None
        self._callers.add(task)
        try:
            if not is_same_user(writer.get_extra_info("socket")):
                log.warning("a process of another user was turned away")
                return
            while message := await _next_line(reader, writer):
                await self._answer(message, reader, writer)
        except OSError as error:
            log.debug("a caller is gone: %s", error)
        except asyncio.CancelledError:
            pass  # the executive ends
        finally:
            self._callers.discard(task)
            writer.close()

    async def _answer(
        self, message: bytes, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        try:
            request = msgspec.json.decode(message, type=Request)
        except msgspec.ValidationError as error:
            await _send(writer, _refusal(None, Code.INVALID_REQUEST, str(error)))
            return
        except (msgspec.DecodeError, UnicodeError, RecursionError) as error:
            reason = "nested too deep" if isinstance(error, RecursionError) else str(error)
            await _send(writer, _refusal(None, Code.PARSE_ERROR, f"this is no JSON: {reason}"))
            return
        number = None if request.id is msgspec.UNSET else request.id
        operation = OPERATIONS.get(request.method)
        if operation is not None and operation.stream:
            await self._stream(operation, request, number, reader, writer)
            return
        response = await self._call(operation, request, number)
        if request.id is not msgspec.UNSET:
            await _send(writer, response)

    async def _call(
        self, operation: Operation | None, request: Request, number: int | str | None
    ) -> Response:
        if operation is None:
            known = ", ".join(OPERATIONS)
            what = f"there is no method {request.method!r}; known: {known}"
            return _refusal(number, Code.METHOD_NOT_FOUND, what)
        try:
            params = msgspec.convert(request.params, operation.parameters)
            if operation.slow:
                result = await asyncio.to_thread(operation.call, self._control, params)
            else:
                result = operation.call(self._control, params)
            if isawaitable(result):
                result = await result
            result = operation.encode(result)
        except msgspec.ValidationError as error:
            return _refusal(number, Code.INVALID_PARAMS, f"{request.method}: {error}")
        except M2pemError as error:
            return Response(id=number, error=fault_of(error))
        except Exception as error:  # one caller's request must not end the executive
            log.exception("%s", request.method)
            return _refusal(number, Code.INTERNAL_ERROR, f"{type(error).__name__}: {error}")
        return Response(id=number, result=result)

    async def _stream(
        self,
        operation: Operation,
        request: Request,
        number: int | str | None,
        reader: asyncio.StreamReader,
        writer: asyncio.StreamWriter,
    ) -> None:
        try:
            params = msgspec.convert(request.params, operation.parameters)
            stream = operation.call(self._control, params)
        except msgspec.ValidationError as error:
            refusal = _refusal(number, Code.INVALID_PARAMS, f"{request.method}: {error}")
            await _send(writer, refusal)
            return
        await _send(writer, Response(id=number, result=None))
        hung_up = asyncio.create_task(reader.read())
        sending = asyncio.create_task(_send_all(request.method, stream, writer))
        try:
            await asyncio.wait((hung_up, sending), return_when=asyncio.FIRST_COMPLETED)
        finally:
            hung_up.cancel()
            sending.cancel()
            await asyncio.gather(hung_up, sending, return_exceptions=True)
            writer.close()


async def _next_line(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> bytes:
    """The next message; b"" at the end, also after one that is too long."""
    try:
        return await reader.readline()
    except ValueError:  # what has come of the line is lost, and where the next begins not known
        reason = f"a message is longer than {LONGEST_LINE_BYTES:,} bytes"
        await _send(writer, _refusal(None, Code.INVALID_REQUEST, reason))
        return b""


async def _send_all(method: str, stream: Any, writer: asyncio.StreamWriter) -> None:
    async for each in stream:
        params = {"kind": type(each).__name__, "value": msgspec.to_builtins(each)}
        await _send(writer, Request("2.0", method, params))


async def _send(writer: asyncio.StreamWriter, message: Request | Response) -> None:
    writer.write(line(message))
    await writer.drain()


def _refusal(number: int | str | None, code: Code, message: str) -> Response:
    return Response(id=number, error=Fault(int(code), message))


def is_same_user(peer: socket.socket) -> bool:
    """Whether the process at the other end belongs to this user; the folder's mode says so too."""
    if not hasattr(socket, "SO_PEERCRED"):
        return True
    credentials = peer.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, struct.calcsize("3i"))
    _, uid, _ = struct.unpack("3i", credentials)
    return bool(uid == os.geteuid())
