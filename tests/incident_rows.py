"""Rows of the table of incidents: every error code, provoked on a real vehicle, and every choice.

An arbiter's tests say how each error comes about (`Provocation`). Its rows are played one after
another on one executive; the choices are made over the control socket.
"""

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Iterable, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from m2pem.api import Clock, MissionControl, OpenIncident, OpenPrompt, ResourceId, RunId, RunStatus
from m2pem.api.authoring import MissionFiles
from m2pem.cli.replay import Verification
from m2pem.control_socket.client import ask
from m2pem.control_socket.paths import live_sockets
from m2pem.control_socket.remote import RemoteControl
from m2pem.control_socket.server import ControlSocket
from m2pem.engine import records as r
from m2pem.executive.executive import Executive
from m2pem.journal import Journal
from m2pem.journal.sqlite import SqliteJournal
from m2pem.mission.catalogue import BehaviorState
from tests.executive.conftest import mission, question, sequence, task

CHOICES = ("retry", "retry_with", "skip", "set_data", "move", "end")
SPARE = "spare1"
"""The vehicle that `retry_with` names."""

LOOK_EVERY_S = 0.05
"""Of the event loop's clock, whatever the speed."""

WITHIN_S = 600.0
"""Of the executive's clock."""


class Killed(Protocol):
    """A running program."""

    def kill(self) -> None:
        """Kill it as a power failure would."""
        ...


@dataclass
class Row:
    """One incident, and the choice that is made about it. `data`: with which the run begins."""

    code: str
    choice: str
    data: dict[str, Any]
    run: str = ""


@dataclass(frozen=True)
class Provocation:
    """How an error comes about, and how its cause is removed before the choice.

    `code`: of the incident. `data`: with which the run begins, over that of every run. `during`:
    what is done to the vehicle when its behavior is under way; None: it does not begin. `before`:
    what is done before the run begins. `mend`: removes the cause; it takes the run.
    """

    code: str
    data: Mapping[str, Any] = field(default_factory=dict)
    before: Callable[[], Awaitable[None]] | None = None
    during: Callable[[], Awaitable[None]] | None = None
    mend: Callable[[str], Awaitable[None]] | None = None


def go(resource: str, data: Iterable[str], attributes: str = "", behavior: str = "goto") -> bytes:
    """A mission: `Go` (a behavior of a vehicle or payload, with the values of `data`), then `Home`,
    a question. `attributes`: of the role."""
    parameters = "".join(f'<m2pem:property name="{name}" value="${{{name}}}"/>' for name in data)
    kind = "payload" if "/" in resource else "vehicle"
    doing = task("Go", f'{kind}="{resource}" {attributes}', behavior, parameters)
    body = sequence(
        ("Go", doing.replace('type="vehicle"', f'type="{kind}"')), ("Home", question("Home"))
    )
    executable = 'isExecutable="true"'
    return mission(body.replace(executable, f'{executable} m2pem:onError="incident"'))


class Desk:
    """An operator who decides over the control socket of an executive, and looks on there."""

    def __init__(self, control: MissionControl, clock: Clock) -> None:
        self.control, self._clock = control, clock

    async def until(self, true: Callable[[], Awaitable[Any]], run: str, what: str) -> Any:
        """Wait until something is so of a run."""
        until_us = self._clock.now_us() + round(WITHIN_S * 1e6)
        while not (value := await true()):
            if self._clock.now_us() > until_us:
                last = "\n".join(map(str, (await self.records(run))[-8:])) if run else ""
                raise AssertionError(f"not within {WITHIN_S:g} s: {run} {what}\n{last}")
            await asyncio.sleep(LOOK_EVERY_S)
        return value

    async def start(self, mission: bytes, data: Mapping[str, Any]) -> str:
        """Start the mission `go`."""
        source = MissionFiles("go.bpmn", mission)
        return await self.control.start(source, data=data, even_if_busy=True, by="anna")

    async def records(self, run: str) -> list[r.Record]:
        """All records of a run."""
        return [each.record for each in await self.control.records(run)]

    async def incident(self, run: str) -> OpenIncident:
        """Wait for the incident of a run."""

        async def found() -> OpenIncident | None:
            listed = await self.control.incidents()
            return next((each for each in listed if each.run == run), None)

        known: OpenIncident = await self.until(found, run, "has an incident")
        return known

    async def under_way(self, run: str) -> None:
        """Wait until the behavior of a run is under way."""

        async def so() -> bool:
            seen = [e for e in await self.records(run) if isinstance(e, r.BehaviorProgressed)]
            return any(each.state is BehaviorState.RUNNING for each in seen)

        await self.until(so, run, "is under way")

    async def resolve(self, incident: OpenIncident, choice: str, **needs: Any) -> None:
        """Make a choice about an incident; what follows it is not explored, which takes long."""
        about = (incident.run, incident.incident, choice)
        await self.control.resolve_incident(*about, by="anna", even_if_stuck=True, **needs)

    async def go_home(self, run: str) -> None:
        """Answer the question of a run, which completes then."""

        async def asked() -> OpenPrompt | None:
            return next((each for each in self.control.prompts() if each.run == run), None)

        prompt = await self.until(asked, run, "is at Home")
        assert prompt.element == "Home"
        await self.control.answer(run, prompt.prompt, "yes", by="anna")
        assert (await self.control.wait(run)).status is RunStatus.COMPLETED


async def until_incident(control: MissionControl, clock: Clock, code: str) -> None:
    """Wait until an incident with an error code is open."""
    while code not in {each.code for each in await control.incidents()}:
        await clock.sleep(LOOK_EVERY_S)


@asynccontextmanager
async def over_socket(executive: Executive, folder: Path) -> AsyncIterator[MissionControl]:
    """What operators have of an executive over its control socket."""
    async with ControlSocket(executive.control, folder / "j.db") as server:
        assert server.path is not None
        async with RemoteControl(server.path) as control:
            yield control


class Table:
    """The rows of one executive, whose `desk` is open while they are played. `vehicle`: the one to
    which all happens, or a payload; `spare`: with which `retry_with` does it; `behavior`: what they
    are to do."""

    vehicle: str
    desk: Desk
    spare = SPARE
    behavior = "goto"

    def data(self) -> dict[str, Any]:
        """Return the parameters with which a run begins, so that the vehicle has to move."""
        raise NotImplementedError

    def far(self) -> dict[str, Any]:
        """Return parameters, over those of `data`, with which a behavior takes so long that
        something can be done to its vehicle meanwhile; {}: it takes long enough."""
        return {}

    async def start(self, data: Mapping[str, Any], attributes: str = "") -> str:
        """Start a run; `attributes`: of its role."""
        mission = go(self.vehicle, data, attributes, self.behavior)
        return await self.desk.start(mission, data)

    def provocations(self) -> dict[str, Provocation]:
        """Return how each error of this arbiter's vehicles comes about, by a name."""
        raise NotImplementedError

    async def play(self, rows: Iterable[tuple[str, str]], journal: Journal) -> None:
        """Play rows, each the name of a provocation and a choice; then replay all their runs."""
        provocations, runs = self.provocations(), []
        for name, choice in rows:
            row = Row(provocations[name].code, choice, self.data())
            incident = await provoke(self, provocations[name], row)
            await decide(self, row, incident)
            runs.append(row.run)
        await verify_replays(journal, runs)

    def common(self) -> dict[str, Provocation]:
        """Return the errors that come about without the vehicle."""
        return {
            "a wrong parameter": Provocation("REJECTED", {"speed": "fast"}, mend=self.set_right),
            "an operator takes over": Provocation(
                "TAKEN_OVER", during=self._take, mend=self._give_back
            ),
            "an operator has it": Provocation(
                "RESOURCE_UNAVAILABLE", before=self._take, mend=self._give_back
            ),
            "a task takes it": Provocation(
                "PREEMPTED", during=self._preempt, mend=self._end_preemption
            ),
        }

    async def set_right(self, run: str) -> None:
        """Write data with which the task can be done, and soon."""
        if not (data := self.data()):
            return
        await self.desk.resolve(await self.desk.incident(run), "set_data", data=data)

    async def available(self) -> None:
        """Wait until the vehicle is back, and held."""

        async def is_back() -> bool:
            why = (await self.desk.control.unavailable()).get(ResourceId(self.vehicle), "")
            return why in ("", "returned: held")

        await self.desk.until(is_back, "", f"{self.vehicle} is back")

    async def _take(self) -> None:
        await self.desk.control.take(self.vehicle, by="ben")

    async def _give_back(self, _: str) -> None:
        await self.desk.control.give_back(self.vehicle, by="ben")

    async def _preempt(self) -> None:
        self._taker = await self.start(self.data(), 'priority="5"')

    async def _end_preemption(self, _: str) -> None:
        await self.desk.go_home(self._taker)


def act(do: Callable[[], object]) -> Callable[..., Awaitable[None]]:
    """Make a step of a provocation."""

    async def step(*_: str) -> None:
        do()

    return step


async def provoke(table: Table, provocation: Provocation, row: Row) -> OpenIncident:
    """Begin the run of a row, and have its task stopped by the error; its cause is removed."""
    desk, vehicle = table.desk, table.vehicle
    if provocation.before is not None:
        await provocation.before()
    far = {} if provocation.during is None else table.far()
    row.run = await table.start({**row.data, **far, **provocation.data})
    if provocation.during is not None:
        await desk.under_way(row.run)
        await provocation.during()
    incident = await desk.incident(row.run)
    assert incident.code == provocation.code, incident
    if provocation.mend is not None:
        await provocation.mend(row.run)
    if far:
        await table.set_right(row.run)
    begun = bool(requested(await desk.records(row.run)))
    keeps = begun and provocation.code != "PREEMPTED"
    assert incident.resources == ((vehicle,) if keeps else ())
    return incident


async def decide(table: Table, row: Row, incident: OpenIncident) -> None:
    """Make the choice of a row, and finish its run."""
    desk, run, choice = table.desk, row.run, row.choice
    before = len(requested(await desk.records(run)))
    needs: dict[str, Any] = {
        "retry_with": {"roles": {"driver": [table.spare]}},
        "set_data": {"data": {"seen": choice}},
        "move": {"to": "Home"},
    }.get(choice, {})
    await desk.resolve(incident, choice, **needs)
    if choice == "end":
        summary = await desk.control.wait(run)
        assert summary.status is RunStatus.FAILED
        assert f"error {row.code} from Go" in summary.detail
        return
    if choice == "set_data":
        assert (await desk.incident(run)).incident == incident.incident
        written = [each for each in await desk.records(run) if isinstance(each, r.DataWritten)]
        assert written[-1].value == choice
        await desk.resolve(incident, "skip")
    await desk.go_home(run)
    records = await desk.records(run)
    again = requested(records)[before:]
    anew = {"retry": [(table.vehicle,)], "retry_with": [(table.spare,)]}
    assert again == anew.get(choice, [])
    resolved = [each for each in records if isinstance(each, r.IncidentResolved)]
    assert {each.by for each in resolved} == {"anna"}


def requested(records: Iterable[r.Record]) -> list[tuple[str, ...]]:
    """The resources of each behavior that was requested."""
    return [each.resources for each in records if isinstance(each, r.BehaviorRequested)]


async def verify_replays(journal: Journal, runs: Iterable[str]) -> None:
    """See that each run is replayed to the same records, as `m2pem replay --verify` does."""
    lines = {each.run: each for each in await journal.runs()}
    for run in runs:
        verification = Verification(lines[RunId(run)])
        async for entry in journal.read(RunId(run)):
            assert verification.agrees(entry), verification.as_text()


# --- kill -9 while the incidents are open ---------------------------------------------------------


@asynccontextmanager
async def served(journal: Path) -> AsyncIterator[MissionControl]:
    """What operators have of the executive that writes to a journal, when it has connected."""
    while not (sockets := list(live_sockets(journal))):  # noqa: ASYNC110  # no event tells of it
        await asyncio.sleep(0.02)
    while not await asyncio.to_thread(_connected, sockets[0]):  # noqa: ASYNC110  # nor of that
        await asyncio.sleep(0.02)
    async with RemoteControl(sockets[0]) as control:
        yield control


def _connected(path: Path) -> bool:
    found = {each["name"]: each["status"] for each in ask(path, "health")}
    return found["arbiters"] == "ok"


async def decide_after_kill(
    serve: Callable[[], Killed],
    journal: Path,
    clock: Clock,
    rows: Iterable[tuple[Table, str, str]],
) -> None:
    """Let all rows come to their incidents, kill the executive, start it again, and decide.

    `serve`: starts an executive that serves; a row has a table of its own, with its vehicle, the
    name of a provocation, and a choice.
    """
    program, opened = serve(), []
    async with served(journal) as control:
        desk = Desk(control, clock)
        for table, name, choice in rows:
            table.desk = desk
            provocation = table.provocations()[name]
            row = Row(provocation.code, choice, table.data())
            incident = await provoke(table, provocation, row)
            opened.append((table, row, incident))
        program.kill()
    program = serve()
    async with served(journal) as control:
        desk = Desk(control, clock)
        for table, row, incident in opened:
            table.desk = desk
            assert await desk.incident(row.run) == incident
            await decide(table, row, incident)
    program.kill()
    read = SqliteJournal.open(journal)
    try:
        await verify_replays(read, [row.run for _, row, _ in opened])
    finally:
        await read.close()
