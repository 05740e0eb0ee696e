"""MissionControl of an executive in another process: what `m2pem attach` gives to an OCU."""

import asyncio
import itertools
from collections.abc import AsyncIterator, Callable, Iterable, Mapping, Sequence
from inspect import iscoroutinefunction, signature
from pathlib import Path
from typing import Any, cast

import msgspec

from m2pem.api.allocation import StartPreview
from m2pem.api.approval import MissionApproval
from m2pem.api.authoring import MissionFiles, MissionSource, file_of
from m2pem.api.control import MissionControl
from m2pem.api.operations import OPERATIONS, STREAMED, Operation, mission_files
from m2pem.api.revision import RevisionPreview
from m2pem.api.runs import OpenPrompt, PromptClosed, RunId, StampedRecord
from m2pem.api.schedule import EntryId
from m2pem.bpmn import parse_mission
from m2pem.control_socket.client import LONG_TIMEOUT_S, ask
from m2pem.control_socket.paths import ControlSocketError, address
from m2pem.control_socket.protocol import LONGEST_LINE_BYTES, Request, line, result_of
from m2pem.engine.records import MissionRevised
from m2pem.errors import MissionError, OperatorError
from m2pem.findings import Finding
from m2pem.mission.library import KeptLibrary
from m2pem.mission.mission import Mission

REFUSED = {
    "simulate": "missions are rehearsed where the executive runs: m2pem simulate",
    "verify": "missions are verified where the executive runs: m2pem verify",
    "estimate": "missions are edited where the executive runs",
    "editable": "missions are edited where the executive runs",
    "outline": "missions are edited where the executive runs",
    "geometries": "geometries are listed where the executive runs",
    "run_geometries": "geometries are listed where the executive runs",
    "services": "services are listed where the executive runs",
}
"""The methods of `MissionControl` that the socket does not serve, and where to ask instead."""


class RemoteControl:
    """Entering it connects, and gives a `MissionControl`.

    Its methods are made from `OPERATIONS`. Those of `REFUSED` raise OperatorError: missions cannot
    be edited, verified or rehearsed through it. `read` reads missions, which are sent with all
    their files to be started or checked; without it only `MissionFiles` can be.
    """

    def __init__(self, path: Path, read: Callable[[MissionSource], Mission] | None = None) -> None:
        self._path = path
        self._read = read
        self._numbers = itertools.count(1)
        self._missions: dict[RunId, Mission] = {}
        self._prompts: dict[tuple[RunId, str], OpenPrompt] = {}
        self._kept: dict[str, Any] = {}
        self._one_call = asyncio.Lock()

    async def __aenter__(self) -> MissionControl:
        self._reader, self._writer = await self._connect()
        for operation in OPERATIONS.values():
            if operation.kept:
                self._kept[operation.name] = await self._call(operation)
        self._listening = asyncio.create_task(self._follow_prompts())
        return cast("MissionControl", self)

    async def __aexit__(self, *reason: object) -> None:
        self._listening.cancel()
        await asyncio.gather(self._listening, return_exceptions=True)
        self._writer.close()

    async def gone(self) -> None:
        """Return when the executive has ended, or the connection to it."""
        await asyncio.wait((self._listening,))

    def prompts(self) -> Sequence[OpenPrompt]:
        """The prompts that are open now."""
        return list(self._prompts.values())

    async def mission(self, run: RunId) -> Mission:
        """The mission of a run, read once for each version of it."""
        if run not in self._missions:
            sent: MissionFiles = await self._call(OPERATIONS["mission"], run=run)
            library = KeptLibrary(sent.library)
            self._missions[run] = await asyncio.to_thread(
                parse_mission, sent.source, sent.file, library
            )
        return self._missions[run]

    async def start(self, mission: MissionSource, **options: Any) -> RunId:
        """Send a mission's files to the executive, which starts it."""
        files = await asyncio.to_thread(self._files, mission)
        run: RunId = await self._call(OPERATIONS["start"], mission=files, **options)
        return run

    async def approval(self, mission: MissionSource) -> MissionApproval:
        """Send a mission's files to the executive, which says who has approved it."""
        files = await asyncio.to_thread(self._files, mission)
        state: MissionApproval = await self._call(OPERATIONS["approval"], mission=files)
        return state

    async def approve(self, mission: MissionSource, **options: Any) -> MissionApproval:
        """Send a mission's files to the executive, which notes the approval."""
        files = await asyncio.to_thread(self._files, mission)
        state: MissionApproval = await self._call(OPERATIONS["approve"], mission=files, **options)
        return state

    async def withdraw_approval(self, mission: MissionSource, *, by: str = "") -> MissionApproval:
        """Send a mission's files to the executive, which withdraws the approval."""
        files = await asyncio.to_thread(self._files, mission)
        operation = OPERATIONS["withdraw_approval"]
        state: MissionApproval = await self._call(operation, mission=files, by=by)
        return state

    async def plan_revision(
        self, run: RunId, mission: MissionSource, *, moves: Mapping[str, str] | None = None
    ) -> RevisionPreview:
        """Send the files of a new version to the executive, which says what it would do."""
        files = await asyncio.to_thread(self._files, mission)
        operation = OPERATIONS["plan_revision"]
        preview: RevisionPreview = await self._call(operation, run=run, mission=files, moves=moves)
        return preview

    async def revise(self, run: RunId, mission: MissionSource, plan: str, **options: Any) -> None:
        """Send the files of a new version to the executive, with which the run goes on."""
        files = await asyncio.to_thread(self._files, mission)
        operation = OPERATIONS["revise"]
        await self._call(operation, run=run, mission=files, plan=plan, **options)

    async def schedule(self, mission: MissionSource, **options: Any) -> EntryId:
        """Send a mission's files to the executive, which starts it later."""
        files = await asyncio.to_thread(self._files, mission)
        entry: EntryId = await self._call(OPERATIONS["schedule"], mission=files, **options)
        return entry

    def check(
        self, mission: MissionSource, *, process: str | None = None, data: Iterable[str] = ()
    ) -> Sequence[Finding]:
        """Send a mission's files to the executive, which checks it against its fleet."""
        try:
            files = self._files(mission)
        except MissionError as error:
            return error.findings
        params = {"mission": files, "process": process, "data": list(data)}
        found = ask(self._path, "check", timeout_s=LONG_TIMEOUT_S, **params)
        return msgspec.convert(found, list[Finding])

    async def preview_start(self, mission: MissionSource, **options: Any) -> StartPreview:
        """Send a mission's files to the executive, which says what would begin."""
        try:
            files = await asyncio.to_thread(self._files, mission)
        except MissionError as error:
            return StartPreview(file_of(mission), findings=error.findings)
        preview: StartPreview = await self._call(
            OPERATIONS["preview_start"], mission=files, **options
        )
        return preview

    def _files(self, mission: MissionSource) -> MissionFiles:
        if isinstance(mission, MissionFiles):
            return mission
        if self._read is None:
            raise OperatorError("only a mission that was read can be sent: give its MissionFiles")
        return mission_files(self._read(mission))

    # --- what goes through the socket -----------------------------------------------------------

    async def _connect(self) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
        try:
            with address(self._path) as there:
                return await asyncio.open_unix_connection(there, limit=LONGEST_LINE_BYTES)
        except OSError as error:
            raise ControlSocketError(f"the executive at {self._path} is gone: {error}") from error

    def _request(self, operation: Operation, arguments: dict[str, Any]) -> Request:
        """The call; what is None has a default at the other end."""
        wire_names = dict(
            zip(
                operation.parameters.__struct_fields__,
                operation.parameters.__struct_encode_fields__,
                strict=True,
            )
        )
        params = {wire_names[name]: each for name, each in arguments.items() if each is not None}
        return Request("2.0", operation.name, params, next(self._numbers))

    async def _call(self, operation: Operation, **arguments: Any) -> Any:
        request = self._request(operation, arguments)
        ask = self._ask_alone if operation.alone else self._ask
        sent = msgspec.convert(await ask(request), operation.result)
        return operation.decode(sent)

    async def _ask(self, request: Request) -> Any:
        """Calls take turns on one connection; one that was cancelled leaves its answer unread."""
        async with self._one_call:
            try:
                self._writer.write(line(request))
                await self._writer.drain()
                while answer := await self._reader.readline():
                    if msgspec.json.decode(answer).get("id") == request.id:
                        break
            except OSError as error:
                raise ControlSocketError(f"the executive is gone: {error}") from error
        return result_of(answer)

    async def _ask_alone(self, request: Request) -> Any:
        """On a connection of its own: STOP waits for no other call, and `wait` delays none."""
        reader, writer = await self._connect()
        try:
            writer.write(line(request))
            return result_of(await reader.readline())
        finally:
            writer.close()

    async def _stream(self, operation: Operation, **arguments: Any) -> AsyncIterator[Any]:
        reader, writer = await self._connect()
        try:
            writer.write(line(self._request(operation, arguments)))
            await writer.drain()
            result_of(await reader.readline())
            while message := await reader.readline():
                sent = msgspec.json.decode(message, type=Request).params
                if sent["kind"] not in STREAMED:  # an executive of a later release may send more
                    continue
                value: Any = msgspec.convert(sent["value"], STREAMED[sent["kind"]])
                if isinstance(value, StampedRecord) and isinstance(value.record, MissionRevised):
                    self._missions.pop(value.run, None)
                yield value
        finally:
            writer.close()

    async def _follow_prompts(self) -> None:
        async for event in self._stream(OPERATIONS["subscribe"]):
            if isinstance(event, OpenPrompt):
                self._prompts[event.run, event.prompt] = event
            elif isinstance(event, PromptClosed):
                self._prompts.pop((event.run, event.prompt), None)


def _forward(operation: Operation) -> Callable[..., Any]:
    """The method that sends an operation."""
    described = signature(getattr(MissionControl, operation.name))

    def arguments_of(self: RemoteControl, *given: Any, **named: Any) -> dict[str, Any]:
        bound = described.bind(self, *given, **named).arguments
        return {name: each for name, each in bound.items() if name != "self"}

    def stream(self: RemoteControl, *given: Any, **named: Any) -> Any:
        return self._stream(operation, **arguments_of(self, *given, **named))

    async def call(self: RemoteControl, *given: Any, **named: Any) -> Any:
        return await self._call(operation, **arguments_of(self, *given, **named))

    def kept(self: RemoteControl) -> Any:
        return self._kept[operation.name]

    if operation.stream:
        return stream
    return kept if operation.kept else call


def _refuse(name: str, why: str) -> Callable[..., Any]:
    def refuse(self: RemoteControl, *given: Any, **named: Any) -> Any:
        raise OperatorError(why)

    async def refuse_later(self: RemoteControl, *given: Any, **named: Any) -> Any:
        raise OperatorError(why)

    return refuse_later if iscoroutinefunction(getattr(MissionControl, name)) else refuse


for _operation in OPERATIONS.values():
    if _operation.name not in vars(RemoteControl):
        setattr(RemoteControl, _operation.name, _forward(_operation))
for _name, _why in REFUSED.items():
    setattr(RemoteControl, _name, _refuse(_name, _why))
