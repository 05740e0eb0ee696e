"""Work for minutes of a processor, in a process of its own: the executive must not feel it.

    result = await apart("m2pem.executive.verification_worker", order, tell)      # in the executive
    serve(work)                                                      # in the module that it names

The process ends with the task that awaits it, and with the executive, however that ends.
"""

import asyncio
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

Tell: TypeAlias = Callable[[bytes], None]

_HEAD = struct.Struct(">cQ")
_RESULT, _TOLD, _REFUSED = b"r", b"t", b"e"
_NICENESS = 10
_LAST_WORDS = 2_000
"""Bytes of what a process that broke off has said on standard error."""


class Refusal(msgspec.Struct):
    """An error, as it travels."""

    kind: str
    text: str
    findings: list[Finding] = []


_KINDS: dict[str, Callable[[str, Sequence[Finding]], M2pemError]] = {
    "AnswersError": AnswersError,
    "FleetError": FleetError,
    "MissionError": MissionError,
    "RequirementsError": lambda _, findings: RequirementsError(findings),
}


class Given(msgspec.Struct):
    """Where a mission is, as it travels. `kind`: of `MissionSource`; `source`: of the BPMN."""

    kind: str
    place: str = ""
    source: bytes = b""

    def source_of(self) -> MissionSource:
        """What was given."""
        if self.kind == "bytes":
            return self.source
        if self.kind == "str":
            return self.place
        path = Path(self.place)
        return Draft(path, self.source) if self.kind == "Draft" else path


def given(mission: MissionSource) -> Given:
    """A mission, for its journey."""
    match mission:
        case bytes():
            return Given("bytes", source=mission)
        case Draft(path, source):
            return Given("Draft", str(path), source)
        case str():
            return Given("str", mission)
        case _:
            return Given("Path", str(mission))


async def apart(module: str, order: bytes, told: Tell | None = None) -> bytes:
    """Run a module's `serve` in a process of its own; gives back what its work does.

    `told` gets what the work tells on the way. Cancelling ends the process.

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
                raise InternalError(
                    f"{module} broke off with status {process.returncode}: {await words}"
                ) from None
            if kind == _RESULT:
                return content
            if kind == _REFUSED:
                raise _error(content)
            if told is not None:
                told(content)
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


# --- in the process of its own ------------------------------------------------------------------


def serve(work: Callable[[bytes, Tell], bytes]) -> None:
    """Do what was ordered, tell what comes of it, and end."""
    answers = os.dup(1)
    os.dup2(2, 1)  # whatever prints does not print into the answer
    with suppress(OSError):
        os.nice(_NICENESS)
    _, size = _HEAD.unpack(_read(_HEAD.size))
    order = _read(size)
    threading.Thread(target=_end_with_the_executive, daemon=True).start()

    def tell(content: bytes, kind: bytes = _TOLD) -> None:
        _write(answers, _HEAD.pack(kind, len(content)) + content)

    try:
        tell(work(order, tell), _RESULT)
    except FindingsError as error:
        findings = [_plain(each) for each in error.findings]
        refusal = Refusal(type(error).__name__, error.what, findings)
        tell(msgspec.msgpack.encode(refusal), _REFUSED)
    except M2pemError as error:
        tell(msgspec.msgpack.encode(Refusal(type(error).__name__, str(error))), _REFUSED)


def _plain(finding: Finding) -> Finding:
    """Without what only the command line shows."""
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
    """Nothing more is ever sent: when reading ends, nobody is there."""
    os.read(0, 1)
    os._exit(1)
