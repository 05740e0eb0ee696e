"""Long computations in a subprocess, so that they do not delay the executive.

    result = await run_in_subprocess("m2pem.executive.verification_worker", order, on_progress)
    serve(work)  # in the module that is named

The subprocess ends with the task that awaits it, and with the executive, however that ends.
"""

import asyncio
import logging
import os
import struct
import sys
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeAlias

import msgspec

from m2pem.api.authoring import Draft, MissionSource
from m2pem.errors import (
    AnswersError,
    FindingsError,
    FleetError,
    InternalError,
    M2pemError,
    MissionError,
    OperatorError,
)
from m2pem.findings import Finding
from m2pem.verify.requirements.requirement import RequirementsError

SendProgress: TypeAlias = Callable[[bytes], None]

log = logging.getLogger("m2pem.executive")

_HEAD = struct.Struct(">cQ")
_RESULT, _PROGRESS, _REFUSED = b"r", b"t", b"e"
_NICENESS = 10
_LAST_WORDS = 2_000
"""Bytes of what a process that broke off has said on standard error."""


class Refusal(msgspec.Struct):
    """An error as it is sent."""

    kind: str
    text: str
    findings: list[Finding] = []


_KINDS: dict[str, Callable[[str, Sequence[Finding]], M2pemError]] = {
    "AnswersError": AnswersError,
    "FleetError": FleetError,
    "MissionError": MissionError,
    "RequirementsError": lambda _, findings: RequirementsError(findings),
}


class EncodedSource(msgspec.Struct):
    """A mission source as it is sent. `kind`: the type of `MissionSource`; `source`: the BPMN."""

    kind: str
    place: str = ""
    source: bytes = b""

    def source_of(self) -> MissionSource:
        """Return the mission source that was encoded."""
        if self.kind == "bytes":
            return self.source
        if self.kind == "str":
            return self.place
        path = Path(self.place)
        return Draft(path, self.source) if self.kind == "Draft" else path


def encode_source(mission: MissionSource) -> EncodedSource:
    """Encode a mission source for the subprocess."""
    match mission:
        case bytes():
            return EncodedSource("bytes", source=mission)
        case Draft(path, source):
            return EncodedSource("Draft", str(path), source)
        case str():
            return EncodedSource("str", mission)
        case _:
            return EncodedSource("Path", str(mission))


async def run_in_subprocess(
    module: str, order: bytes, on_progress: SendProgress | None = None
) -> bytes:
    """Run a module's `serve` in a subprocess; returns the result of its work.

    `on_progress` is called with each progress message. Cancelling ends the subprocess.

    Raises:
        FindingsError: the work refused what it was given, with all findings.
        OperatorError: it refused something else.
        InternalError: it broke off.
    """
    path = os.pathsep.join(each or os.curdir for each in sys.path)
    process = await asyncio.create_subprocess_exec(
        sys.executable,
        "-m",
        module,
        stdin=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": path},
        start_new_session=True,
    )
    assert process.stdin and process.stdout and process.stderr
    words = asyncio.ensure_future(_last_words(process.stderr))
    try:
        with suppress(ConnectionError):
            process.stdin.write(_HEAD.pack(_RESULT, len(order)) + order)
            await process.stdin.drain()
        while True:
            try:
                kind, size = _HEAD.unpack(await process.stdout.readexactly(_HEAD.size))
                content = await process.stdout.readexactly(size)
            except asyncio.IncompleteReadError:
                await process.wait()
                # What it said may have paths of this host, which no client is to see.
                status = process.returncode
                log.error("%s broke off with status %s: %s", module, status, await words)
                raise InternalError(
                    f"{module} broke off with status {status}; the log of the executive says why"
                ) from None
            if kind == _RESULT:
                return content
            if kind == _REFUSED:
                raise _error(content)
            if on_progress is not None:
                on_progress(content)
    finally:
        words.cancel()
        if process.returncode is None:
            with suppress(ProcessLookupError):
                process.kill()
        process.stdin.close()
        await asyncio.shield(process.wait())


async def _last_words(stream: asyncio.StreamReader) -> str:
    said = b""
    while more := await stream.read(_LAST_WORDS):
        said = (said + more)[-_LAST_WORDS:]
    return said.decode("utf-8", "replace").strip()


def _error(content: bytes) -> M2pemError:
    refusal = msgspec.msgpack.decode(content, type=Refusal)
    make = _KINDS.get(refusal.kind)
    return make(refusal.text, refusal.findings) if make else OperatorError(refusal.text)


# --- in the subprocess -------------------------------------------------------------------------


def serve(work: Callable[[bytes, SendProgress], bytes]) -> None:
    """Read the order, do the work, write progress and the result or the error, and end."""
    answers = os.dup(1)
    os.dup2(2, 1)  # whatever prints does not print into the answer
    with suppress(OSError):
        os.nice(_NICENESS)
    _, size = _HEAD.unpack(_read(_HEAD.size))
    order = _read(size)
    threading.Thread(target=_end_with_the_executive, daemon=True).start()

    def send(content: bytes, kind: bytes = _PROGRESS) -> None:
        _write(answers, _HEAD.pack(kind, len(content)) + content)

    try:
        send(work(order, send), _RESULT)
    except FindingsError as error:
        findings = [_plain(each) for each in error.findings]
        refusal = Refusal(type(error).__name__, error.what, findings)
        send(msgspec.msgpack.encode(refusal), _REFUSED)
    except M2pemError as error:
        send(msgspec.msgpack.encode(Refusal(type(error).__name__, str(error))), _REFUSED)


def _plain(finding: Finding) -> Finding:
    """Return the finding without what only the command line shows."""
    said: Any = {name: getattr(finding, name) for name in Finding.__dataclass_fields__}
    return Finding(**said)


def _read(size: int) -> bytes:
    parts: list[bytes] = []
    while size and (part := os.read(0, min(size, 1 << 20))):
        parts.append(part)
        size -= len(part)
    return b"".join(parts)


def _write(to: int, content: bytes) -> None:
    view = memoryview(content)
    while view:
        view = view[os.write(to, view) :]


def _end_with_the_executive() -> None:
    """End this process when standard input closes: the executive has ended."""
    os.read(0, 1)
    os._exit(1)
