"""MissionControl of an executive in another process: what `m2pem attach` gives to an OCU."""

import asyncio
import itertools
from base64 import b64decode
from collections.abc import AsyncIterator, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Self

import msgspec

from m2pem.api.authoring import Draft, Editable, MissionSource, Outline
from m2pem.api.control import (
    Alert,
    HandedOver,
    Notice,
    OpenPrompt,
    PromptClosed,
    RunId,
    RunSummary,
    SimulationResult,
    StampedRecord,
    TakeEffect,
)
from m2pem.api.telemetry import PayloadState, TeamState, Telemetry, VehicleState
from m2pem.bpmn import parse_mission
from m2pem.control_socket.paths import ControlSocketError, address
from m2pem.control_socket.protocol import LONGEST_LINE_BYTES, Request, line, result_of
from m2pem.errors import OperatorError
from m2pem.findings import Finding
from m2pem.fleet.fleet import Fleet, restore
from m2pem.mission.catalogue import BehaviorSpec, ResourceId
from m2pem.mission.library import KeptLibrary, Source
from m2pem.mission.mission import Mission
from m2pem.mission.values import Value

_KINDS: dict[str, type] = {
    kind.__name__: kind
    for kind in (
        StampedRecord,
        OpenPrompt,
        PromptClosed,
        Alert,
        VehicleState,
        PayloadState,
        TeamState,
    )
}


class RemoteControl:
    """Implements `m2pem.api.control.MissionControl`; enter it before use.

    Missions cannot be started, edited, checked, verified or rehearsed through it.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._numbers = itertools.count(1)
        self._missions: dict[RunId, Mission] = {}
        self._prompts: dict[tuple[RunId, str], OpenPrompt] = {}
        self._turn = asyncio.Lock()

    async def __aenter__(self) -> Self:
        self._reader, self._writer = await self._connect()
        self._fleet = restore(b64decode(await self._ask("fleet")))
        catalogue = await self._ask("catalogue")
        self._catalogue = msgspec.convert(catalogue, dict[ResourceId, tuple[BehaviorSpec, ...]])
        self._simulated = bool(await self._ask("simulated"))
        self._speed = float(await self._ask("speed"))
        self._journal_file: str | None = await self._ask("journal_file")
        self._listening = asyncio.create_task(self._follow_prompts())
        return self

    async def __aexit__(self, *reason: object) -> None:
        self._listening.cancel()
        await asyncio.gather(self._listening, return_exceptions=True)
        self._writer.close()

    async def _connect(self) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
        try:
            with address(self._path) as there:
                return await asyncio.open_unix_connection(there, limit=LONGEST_LINE_BYTES)
        except OSError as error:
            raise ControlSocketError(f"the executive at {self._path} is gone: {error}") from error

    async def _ask(self, method: str, **params: Any) -> Any:
        """Calls take turns on one connection; one that was cancelled leaves its answer unread."""
        number = next(self._numbers)
        async with self._turn:
            try:
                self._writer.write(line(Request("2.0", method, params, number)))
                await self._writer.drain()
                while answer := await self._reader.readline():
                    if msgspec.json.decode(answer).get("id") == number:
                        break
            except OSError as error:
                raise ControlSocketError(f"the executive is gone: {error}") from error
        return result_of(answer)

    async def _ask_at_once(self, method: str, **params: Any) -> Any:
        """On a connection of its own: STOP waits for no other call, and `wait` keeps none."""
        reader, writer = await self._connect()
        try:
            writer.write(line(Request("2.0", method, params, next(self._numbers))))
            return result_of(await reader.readline())
        finally:
            writer.close()

    async def _stream(self, method: str, **params: Any) -> AsyncIterator[Any]:
        reader, writer = await self._connect()
        try:
            writer.write(line(Request("2.0", method, params, next(self._numbers))))
            await writer.drain()
            result_of(await reader.readline())
            while message := await reader.readline():
                told = msgspec.json.decode(message, type=Request).params
                if told["kind"] in _KINDS:  # an executive of a later release may tell more
                    yield msgspec.convert(told["value"], _KINDS[told["kind"]])
        finally:
            writer.close()

    async def _follow_prompts(self) -> None:
        async for notice in self.subscribe():
            if isinstance(notice, OpenPrompt):
                self._prompts[notice.run, notice.prompt] = notice
            elif isinstance(notice, PromptClosed):
                self._prompts.pop((notice.run, notice.prompt), None)

    # --- runs -----------------------------------------------------------------------------------

    async def start(
        self,
        mission: MissionSource,
        *,
        process: str | None = None,
        data: Mapping[str, Value] | None = None,
        by: str = "",
        even_if_busy: bool = False,
    ) -> RunId:
        """Refused."""
        raise OperatorError("missions are started where the executive runs: m2pem run")

    async def stop(self, run: RunId, *, by: str = "", reason: str = "") -> None:
        """End every token, cancel every behavior."""
        await self._ask_at_once("stop", run=run, by=by, reason=reason)

    async def stop_all(self, *, by: str = "", reason: str = "") -> Sequence[RunId]:
        """Stop every run that has not ended."""
        stopped = await self._ask_at_once("stop_all", by=by, reason=reason)
        return msgspec.convert(stopped, list[RunId])

    async def pause(self, run: RunId, *, by: str = "") -> None:
        """Hold every commanded resource and freeze timers."""
        await self._ask_at_once("pause", run=run, by=by)

    async def resume(self, run: RunId, *, by: str = "") -> None:
        """Go on after a pause."""
        await self._ask("resume", run=run, by=by)

    async def signal(
        self,
        signal: str,
        *,
        run: RunId | None = None,
        data: Mapping[str, Value] | None = None,
        by: str = "",
    ) -> None:
        """Emit a signal to one run or to all."""
        await self._ask("signal", id=signal, run=run, data=data or {}, by=by)

    async def message(
        self, message: str, *, run: RunId, data: Mapping[str, Value] | None = None, by: str = ""
    ) -> None:
        """Send a message."""
        await self._ask("message", id=message, run=run, data=data or {}, by=by)

    async def answer(self, run: RunId, prompt: str, decision: str, *, by: str = "") -> None:
        """Answer a prompt; the first answer wins."""
        await self._ask("answer", run=run, prompt=prompt, decision=decision, by=by)

    async def set_geometry(
        self, name: str, geometry: Mapping[str, Value], *, run: RunId | None = None, by: str = ""
    ) -> None:
        """Hand over a route, area or point (GeoJSON)."""
        await self._ask("set_geometry", name=name, geometry=geometry, run=run, by=by)

    async def take(self, resource: str, *, by: str = "") -> None:
        """Take a vehicle or payload from the missions."""
        await self._ask("take", resource=resource, by=by)

    async def preview_take(self, resource: str) -> Sequence[TakeEffect]:
        """What `take` of a resource would end now."""
        effects = await self._ask("preview_take", resource=resource)
        return msgspec.convert(effects, list[TakeEffect])

    async def give_back(self, resource: str, *, by: str = "") -> None:
        """Give it back to the missions."""
        await self._ask("give_back", resource=resource, by=by)

    async def holders(self) -> Mapping[ResourceId, str]:
        """Who has each resource."""
        return msgspec.convert(await self._ask("holders"), dict[ResourceId, str])

    # --- watching -------------------------------------------------------------------------------

    def subscribe(self, run: RunId | None = None, size: int = 10_000) -> AsyncIterator[Notice]:
        """What is committed from now on, and first the prompts that stand now."""
        return self._stream("subscribe", run=run, size=size)

    def telemetry(self, size: int = 100) -> AsyncIterator[Telemetry]:
        """Telemetry from now on."""
        return self._stream("telemetry", size=size)

    async def records(
        self, run: RunId, after_seq: int = 0, limit: int = 1000
    ) -> Sequence[StampedRecord]:
        """A page of a run's records."""
        page = await self._ask("records", run=run, after_seq=after_seq, limit=limit)
        return msgspec.convert(page, list[StampedRecord])

    async def runs(self) -> Sequence[RunSummary]:
        """Every run of the journal."""
        return msgspec.convert(await self._ask("runs"), list[RunSummary])

    def prompts(self) -> Sequence[OpenPrompt]:
        """The prompts that stand now."""
        return list(self._prompts.values())

    async def mission(self, run: RunId) -> Mission:
        """The mission of a run."""
        if run not in self._missions:
            told = await self._ask("mission", run=run)
            source = b64decode(told["source"])
            library = KeptLibrary(msgspec.convert(told["library"], list[Source]))
            self._missions[run] = await asyncio.to_thread(
                parse_mission, source, told["file"], library
            )
        return self._missions[run]

    async def mission_time_s(self, run: RunId) -> float:
        """Seconds from the start of a run."""
        return float(await self._ask("mission_time_s", run=run))

    async def wait(self, run: RunId) -> RunSummary:
        """Wait until the run has ended and its vehicles are released."""
        return msgspec.convert(await self._ask_at_once("wait", run=run), RunSummary)

    # --- what there is --------------------------------------------------------------------------

    def fleet(self) -> Fleet:
        """The fleet in use."""
        return self._fleet

    def catalogue(self) -> Mapping[ResourceId, Sequence[BehaviorSpec]]:
        """What every resource can do."""
        return self._catalogue

    def simulated(self) -> bool:
        """Whether nothing real moves."""
        return self._simulated

    def speed(self) -> float:
        """Seconds of mission time in a real second."""
        return self._speed

    def journal_file(self) -> Path | None:
        """Where the journal is, on this same machine."""
        return None if self._journal_file is None else Path(self._journal_file)

    def check(
        self, mission: MissionSource, *, process: str | None = None, data: Iterable[str] = ()
    ) -> Sequence[Finding]:
        """Refused."""
        raise OperatorError("missions are checked where the executive runs: m2pem check")

    async def simulate(self, mission: MissionSource, **options: Any) -> SimulationResult:
        """Refused."""
        raise OperatorError("missions are rehearsed where the executive runs: m2pem simulate")

    async def verify(self, mission: MissionSource, **options: Any) -> Mapping[str, Any]:
        """Refused."""
        raise OperatorError("missions are verified where the executive runs: m2pem verify")

    def editable(self, mission: bytes, *, anew: bool = False) -> Editable:
        """Refused."""
        raise OperatorError("missions are edited where the executive runs")

    def outline(self, mission: bytes | Draft) -> Outline:
        """Refused."""
        raise OperatorError("missions are edited where the executive runs")

    def geometries(self) -> Mapping[str, HandedOver]:
        """Refused."""
        raise OperatorError("geometries are listed where the executive runs")

    def services(self) -> Mapping[str, Sequence[str]]:
        """Refused."""
        raise OperatorError("services are listed where the executive runs")
