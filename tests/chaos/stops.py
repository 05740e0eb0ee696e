"""Rounds in which an operator stops all at a random moment, while something is wrong.

Each vehicle that can be reached is commanded to stop, whatever is wrong, and operators read what
could not be done. What is wrong lasts until then.
"""

import asyncio
import random
import re
import signal
import sqlite3
import time
from collections.abc import AsyncIterator, Iterator, Mapping, Sequence
from contextlib import asynccontextmanager, contextmanager, nullcontext, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Event, Thread

from m2pem.api import MissionControl
from m2pem.api.authoring import MissionFiles
from m2pem.api.runs import Alert, RunId
from m2pem.control_socket.remote import RemoteControl
from m2pem.engine import records as r
from m2pem.errors import M2pemError, OperatorError
from m2pem.journal import open_journal
from m2pem.mission.catalogue import BehaviorState
from tests.chaos.judge import Verdict, judge
from tests.chaos.rounds import Evidence, Plan, Play
from tests.chaos.table import text_table
from tests.chaos.troubles import TROUBLES, Trouble, database_of, disk_of
from tests.chaos.worlds import BLOCK, TROUBLE, WORLDS, Sign, World
from tests.faults import Faults, with_faults
from tests.preloaded import Process

TOLD_WITHIN_S = 1.0
ALERTED_WITHIN_S = 10.0
"""After a stop: m2pem waits for an arbiter for one second, and a vehicle has some to answer."""

SPEEDS = (2.0, 4.0, 8.0)
"""So the vehicles do something for some seconds."""

LOOK_EVERY_S = 0.01
ENDED_WITHIN_S = 60.0
WAYS = ("stop_all", "stop", "signal")
"""How all is stopped: at once, each run, or by SIGTERM."""


@dataclass(frozen=True, slots=True)
class StopPlan:
    """`after_s`: when all missions have begun. `lead_s`: how long before the stop something goes
    wrong. `dies`: whether the executive is killed when all were commanded, before that is mended.
    `within_s`: how soon vehicles must be commanded; what is wrong lasts as long if they are not."""

    number: int
    world: str
    journal: str
    trouble: str
    way: str = WAYS[0]
    after_s: float = 0.5
    lead_s: float = 0.1
    dies: bool = False
    speed: float = SPEEDS[0]
    within_s: float = TOLD_WITHIN_S

    def __str__(self) -> str:
        dies = ", then the executive is killed" if self.dies else ""
        return (
            f"round {self.number}: {self.world}, {self.journal}: {self.trouble} for "
            f"{self.lead_s:.2f} s, {self.way} after {self.after_s:.2f} s at speed {self.speed:g}"
            f"{dies}"
        )


@dataclass
class Stop:
    """What came of a stop. `at_s`: when it was asked for, and `answered_s`, of `time.monotonic`.
    `runs`: those that had not ended. `said`: all that operators read of it and since."""

    at_s: float = 0.0
    answered_s: float = 0.0
    answer: str = ""
    runs: Sequence[RunId] = ()
    alerts: list[Alert] = field(default_factory=list)
    errors: str = ""

    def names(self, vehicle: str) -> bool:
        """Whether operators read that the vehicle may not have received the stop."""
        return any(
            vehicle in names
            for names, not_commanded, _ in (
                line.partition(" may not have received ") for line in self.said.splitlines()
            )
            if not_commanded
        )

    @property
    def said(self) -> str:
        return "\n".join([self.answer, self.errors, *(each.text for each in self.alerts)])


@dataclass
class StopRound:
    """A round that was played. `commanded_s`: how long the stop took to each vehicle that moved."""

    plan: StopPlan
    verdict: Verdict
    commanded_s: Mapping[str, float] = field(default_factory=dict)
    answered_after_s: float = 0.0
    said: str = ""


def plan_stop(seed: int, number: int, world: str, journal: str, trouble: str = "") -> StopPlan:
    """Draw a round. `trouble`: what is wrong; "": any that may be, each as often as the others."""
    chance = random.Random(f"stop {seed} {number}")
    names = [
        each.name for each in TROUBLES.values() if world in each.worlds and journal in each.journals
    ]
    name = trouble or names[number % len(names)]
    # A start that never returns has not said which run it is.
    way = chance.choice(WAYS if TROUBLES[name].mission is None else ("stop_all", "signal"))
    return StopPlan(
        number,
        world,
        journal,
        name,
        way,
        chance.uniform(0.0, 3.0),
        chance.choice([0.0, chance.uniform(0.0, 1.0)]),
        way != "signal" and chance.random() < 0.3,  # which is not answered
        min(chance.choice(SPEEDS), WORLDS[world].speed),
    )


class Watcher:
    """Notes which command came to a vehicle, and when. `signs`: so far."""

    def __init__(self, world: World) -> None:
        self.signs: list[Sign] = []
        self._world = world
        self._ended = Event()
        self._thread = Thread(target=self._watch, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Look no more."""
        assert self._thread.is_alive()
        self._ended.set()
        self._thread.join()

    def _watch(self) -> None:
        while not self._ended.wait(LOOK_EVERY_S):
            try:
                found = self._world.signs()
            except (sqlite3.OperationalError, FileNotFoundError):  # the file is just made
                continue
            new, now_s = found[len(self.signs) :], time.monotonic()
            self.signs += [each if each.at_s else replace(each, at_s=now_s) for each in new]

    def moving(self) -> dict[str, Sign]:
        """Return the last command of each vehicle that was commanded to move."""
        last = {each.vehicle: each for each in self.signs}
        return {vehicle: each for vehicle, each in last.items() if each.begun is not None}


class StopPlay(Play):
    """One round while it is played."""

    def __init__(self, plan: StopPlan, folder: Path) -> None:
        self._faults = Faults(folder)
        super().__init__(
            Plan(plan.number, plan.world, plan.journal, (), speed=plan.speed),
            folder,
            self._faults.variables,
            with_faults(),
        )
        self.stop_plan = plan
        self.trouble: Trouble = TROUBLES[plan.trouble]
        self.stop = Stop()
        self._flag = folder / TROUBLE
        self.watcher = Watcher(self._world)

    def close(self) -> None:
        """See `Play.close`."""
        self.watcher.close()
        super().close()

    async def _resume_paused(self, control: MissionControl) -> None:
        """Let them be paused."""

    def evidence(self) -> Evidence:
        """See `Play.evidence`."""
        return replace(super().evidence(), stopped=True)

    async def whole(self) -> None:
        """See `Play.whole`."""
        await self._stop_once()
        while await self._left():
            await self._life_until_ended()

    async def _left(self) -> bool:
        """Return whether a run that has begun has not ended."""
        journal = open_journal(str(self._file))
        try:
            return any(each.outcome is None and each.last_seq for each in await journal.runs())
        finally:
            await journal.close()

    # --- the executive that commands the stop ---------------------------------------------------

    async def _stop_once(self) -> None:
        arm = (
            "from tests.chaos import troubles\n"
            f"troubles.install({self.trouble.name!r}, {self._world.arbiter!r}, "
            f"Path({str(self._flag)!r}))"
        )
        process = self._start(arm, "")
        async with RemoteControl(await self._control(process)) as control:
            await self._connected(control)
            listening = asyncio.create_task(self._listen(control))
            operator = asyncio.create_task(self._operate(process))
            try:
                while not all(self._runs.values()):
                    await asyncio.sleep(LOOK_EVERY_S)
                    if operator.done():
                        await operator
                await asyncio.sleep(self.stop_plan.after_s)
                listed = await control.runs()
                self.stop.runs = [each.run for each in listed if each.ended_us is None]
                self._held, self._held_s = set(await control.holders()), time.monotonic()
                async with self._wrong(control):
                    await asyncio.sleep(self.stop_plan.lead_s)
                    await self._ask(control, process)
                    await self._look_at_vehicles(control, process)
                    if self.stop_plan.dies:
                        process.kill()
                    self.stop.errors = self._said()
            finally:
                for task in (operator, listening):
                    task.cancel()
                await asyncio.gather(operator, listening, return_exceptions=True)
        if self.stop_plan.way != "signal":
            process.terminate()
        await self._until_ended(process)
        self.stop.errors = self._said()

    async def _until_ended(self, process: Process) -> None:
        async with asyncio.timeout(ENDED_WITHIN_S):
            while process.poll() is None:  # noqa: ASYNC110  # a pipe tells, which blocks
                await asyncio.sleep(LOOK_EVERY_S)
        # Runs that were held, as nothing could be recorded, are another end than 0.
        if process.returncode not in (0, -signal.SIGKILL) and not self.trouble.mute:
            raise AssertionError(f"it ended with {process.returncode}: {self._said()}")

    async def _life_until_ended(self) -> None:
        """Run an executive that takes up what is left, until that has ended."""
        process = self._start("", "")
        async with asyncio.timeout(ENDED_WITHIN_S):
            async with RemoteControl(await self._control(process)) as control:
                await self._connected(control)
                while any(each.ended_us is None for each in await control.runs() if each.records):
                    for prompt in control.prompts():
                        with suppress(OperatorError):  # its run has just ended
                            await self._answer(control, prompt)
                    await asyncio.sleep(LOOK_EVERY_S)
        process.terminate()
        await self._until_ended(process)

    async def _listen(self, control: MissionControl) -> None:
        with suppress(M2pemError, OSError):
            async for event in control.subscribe():
                if isinstance(event, Alert):
                    self.stop.alerts.append(event)

    @asynccontextmanager
    async def _wrong(self, control: MissionControl) -> AsyncIterator[None]:
        """Have something go wrong within the block."""
        if self.trouble.name == "paused":
            for run in [run for some in self._runs.values() for run in some]:
                with suppress(OperatorError):  # it has ended
                    await control.pause(run, by="anna")
        if self.trouble.mission is not None:
            mission = self.trouble.mission
            self._world.missions = (*self._world.missions, mission)
            self._runs[mission.name] = []
            source = MissionFiles(mission.name, mission.source)
            run = asyncio.create_task(control.start(source, even_if_busy=True, by="anna"))
            await asyncio.wait({run}, timeout=1.0)
            if run.done():
                self._runs[mission.name].append(run.result())
                self.stop.runs = [*self.stop.runs, run.result()]
        with self._outside():
            self._flag.touch()
            try:
                yield
            finally:
                self._flag.unlink()

    @contextmanager
    def _outside(self) -> Iterator[None]:
        match self.trouble.name:
            case "the disk hangs":
                with disk_of(self._file, self._faults):
                    yield
            case "database gone" | "database silent":
                with database_of(self._file, silent="silent" in self.trouble.name):
                    yield
            case "vehicles silent":
                self._world.send_signal(signal.SIGSTOP)
                try:
                    yield
                finally:
                    self._world.send_signal(signal.SIGCONT)
            case "arbiter blocks":
                self._flag.touch()  # for as long as which it blocks
                self._world.send_signal(BLOCK)
                yield
            case _:
                with nullcontext():
                    yield

    async def _ask(self, control: MissionControl, process: Process) -> None:
        """Stop all."""
        stop = self.stop
        stop.alerts.clear()
        stop.at_s = time.monotonic()
        if self.stop_plan.way == "signal":
            process.terminate()
        elif self.stop_plan.way == "stop_all":
            stop.answer = await self._answer_to(control.stop_all(by="anna"))
        else:
            answers = (self._answer_to(control.stop(run, by="anna")) for run in stop.runs)
            stop.answer = "\n".join(await asyncio.gather(*answers))
        stop.answered_s = time.monotonic()

    async def _answer_to(self, asked: "asyncio.Future[object]") -> str:
        try:
            async with asyncio.timeout(ENDED_WITHIN_S):
                await asked
        except M2pemError as error:
            return str(error)
        return ""

    async def _look_at_vehicles(self, control: MissionControl, process: Process) -> None:
        """Wait until all that can be reached are commanded, and operators read of the others."""
        deaf = self.trouble.deaf is not None
        until_s = self.stop.at_s + max(
            ALERTED_WITHIN_S if deaf else 0.0, 2 * self.stop_plan.within_s
        )
        while time.monotonic() < until_s and process.poll() is None:
            with suppress(M2pemError, OSError):  # it has just ended
                if not self.trouble.mute and not await control.holders():
                    return  # all that it was to do has ended
            moving = self.watcher.moving()
            # An autopilot does not note that it has arrived.
            unreached = [
                vehicle
                for vehicle, sign in moving.items()
                if vehicle in self._held or sign.at_s > self._held_s
            ]
            if not any(not self.stop.names(each) for each in unreached) and not self.unsaid():
                return
            await asyncio.sleep(LOOK_EVERY_S)

    def unsaid(self) -> list[RunId]:
        """The runs of which operators have not read that their stop could not be recorded."""
        if not self.trouble.mute or self.stop_plan.way == "signal":
            return []
        return [run for run in self.stop.runs if not re.search(rf"\b{run}\b", self.stop.said)]


async def judge_stop(play: StopPlay) -> tuple[Verdict, dict[str, float]]:
    """Judge a round of which all executives have ended; also how long it took to tell vehicles."""
    evidence, stop = play.evidence(), play.stop
    verdict = await judge(evidence, None)
    journal = open_journal(str(evidence.journal))
    ends: dict[str, r.BehaviorEnded] = {}
    requested: dict[str, str] = {}
    try:
        for info in await journal.runs():
            outcome = info.outcome.value if info.outcome is not None else "none"
            mission, deaf = play.trouble.mission, play.trouble.deaf is not None
            # What fails by itself: the slow mission, and one that has lost a vehicle.
            may_fail = deaf or (mission is not None and info.header.mission_name == mission.name)
            ends_well = {"stopped", "completed", *(("failed",) if may_fail else ())}
            if info.run in stop.runs and outcome not in ends_well:
                verdict.faults.append(f"{info.run} was to stop, and is {outcome}")
            async for entry in journal.read(info.run):
                for record in entry.records:
                    if isinstance(record, r.BehaviorEnded):
                        ends[record.behavior] = record
                    elif isinstance(record, r.BehaviorRequested):
                        requested[record.element] = record.behavior
    finally:
        await journal.close()
    commanded_s: dict[str, float] = {}
    for vehicle in dict.fromkeys(each.vehicle for each in play.watcher.signs):
        fault = _unreached(vehicle, play, ends, requested, commanded_s)
        if fault:
            verdict.faults.append(fault)
    for run in play.unsaid():
        verdict.faults.append(f"nothing said that the stop of {run} was not recorded: {stop.said}")
    return verdict, commanded_s


def _unreached(
    vehicle: str,
    play: StopPlay,
    ends: Mapping[str, r.BehaviorEnded],
    requested: Mapping[str, str],
    commanded_s: dict[str, float],
) -> str:
    """Why a vehicle was not commanded as it must be; "" if it was."""
    stop = play.stop
    until_s = stop.at_s + play.stop_plan.within_s
    signs = [each for each in play.watcher.signs if each.vehicle == vehicle]
    before = [each for each in signs if each.at_s <= until_s]
    after = [each for each in signs if each.at_s > until_s]
    commanded = [each for each in signs if each.begun is None and not each.arrived]
    since = [each for each in commanded if each.at_s >= stop.at_s]
    last = before[-1] if before else None
    moved = [each for each in before if each.at_s < stop.at_s]
    if moved and moved[-1].begun is not None and since:
        commanded_s[vehicle] = since[0].at_s - stop.at_s
    late = next((each.at_s - stop.at_s for each in commanded if each.at_s > until_s), None)
    if last is not None and last.begun is not None:
        behavior = last.begun.behavior or requested.get(last.begun.element, "")
        end = ends.get(behavior)
        by_itself = (BehaviorState.SUCCEEDED, BehaviorState.FAILED)
        if not (end is not None and end.state in by_itself):
            deaf = play.trouble.deaf in ("", vehicle)
            if not deaf:
                when = "never" if late is None else f"after {late:.2f} s"
                return f"{vehicle}, which did {behavior}, was commanded {when}: {stop.said}"
            if not stop.names(vehicle):
                return (
                    f"{vehicle} did {behavior}, had no stop, and no operator read it: {stop.said}"
                )
    again = [each for each in after if each.begun is not None]
    if again and play.trouble.deaf not in ("", vehicle):
        return f"{vehicle} began {again[0].begun} {again[0].at_s - stop.at_s:.2f} s after the stop"
    return ""


def play_stop(plan: StopPlan, folder: Path | None = None) -> StopRound:
    """Play a round and judge it. `folder`: where it is played; None: one that is removed."""
    if folder is None:
        with TemporaryDirectory(prefix="m2pem-chaos-") as made:
            return play_stop(plan, Path(made))
    play = StopPlay(plan, folder)
    commanded_s: dict[str, float] = {}
    try:
        asyncio.run(play.whole())
        verdict, commanded_s = asyncio.run(judge_stop(play))
    except (AssertionError, M2pemError, TimeoutError, OSError) as error:
        verdict = Verdict(faults=[f"{type(error).__name__}: {error}; {play.stop.said}"])
    finally:
        play.close()
    return StopRound(
        plan, verdict, commanded_s, play.stop.answered_s - play.stop.at_s, play.stop.said
    )


COLUMNS = (
    "what was wrong",
    "vehicles",
    "journal",
    "rounds",
    "commanded",
    "median s",
    "longest s",
    "faults",
)


def as_table(played: Sequence[StopRound]) -> str:
    """Return the table of rounds by what was wrong. `commanded`: vehicles that moved until the stop
    came to them; `median s`, `longest s`: how long that took after the request."""
    found: dict[tuple[str, str, str], list[StopRound]] = {}
    for each in played:
        key = (each.plan.trouble, each.plan.world, each.plan.journal)
        found.setdefault(key, []).append(each)
    rows: list[Sequence[object]] = []
    for key, some in sorted(found.items()):
        commanded_s = sorted(s for each in some for s in each.commanded_s.values())
        middle, last = (
            f"{commanded_s[n]:.2f}" if commanded_s else "" for n in (len(commanded_s) // 2, -1)
        )
        faults = sum(bool(each.verdict.faults) for each in some)
        rows.append((*key, len(some), len(commanded_s), middle, last, faults))
    return text_table(COLUMNS, rows)
