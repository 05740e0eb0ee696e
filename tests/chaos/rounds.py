"""A round: missions are run by `m2pem serve`, which is killed and started again until they end.

All of a round follows from its number and the seed, but for what the computer's load changes.
"""

import asyncio
import json
import os
import random
import signal
from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from m2pem.api import MissionControl
from m2pem.api.authoring import MissionFiles
from m2pem.api.runs import OpenPrompt, RunId, RunStatus
from m2pem.control_socket.paths import ControlSocketError, live_sockets
from m2pem.control_socket.remote import RemoteControl
from m2pem.errors import M2pemError, OperatorError
from m2pem.journal.lease import LEASE_VARIABLE
from tests.chaos import journals
from tests.chaos.judge import Verdict, judge
from tests.chaos.kill_points import JOURNALS, RANDOM, REPLACED, points_of
from tests.chaos.missions import ChaosMission
from tests.chaos.worlds import WORLDS, World
from tests.command_line import CommandLine
from tests.preloaded import Preloaded, Process, preloaded

LOOK_EVERY_S = 0.01
ROUND_WITHIN_S = 120.0
MOST_KILLS = 3
STATEMENTS_OF_AN_UPGRADE = 4
"""At least so many has the migration of a journal that was made an older one."""

_STARTER = """
import runpy, sys
from pathlib import Path
from tests.chaos import kill_points
{arm}
{spoil}
sys.argv = ["m2pem", *{words!r}]
runpy.run_module("m2pem", run_name="__main__", alter_sys=True)
"""


@dataclass(frozen=True, slots=True)
class Kill:
    """A kill of one executive. `passage`: of the point, from 1. `after_s`: of a random moment, of
    the wall clock, from when it serves."""

    point: str
    passage: int = 1
    after_s: float = 0.0

    def __str__(self) -> str:
        if self.point in (RANDOM, REPLACED):
            return f"{self.point}, after {self.after_s:.2f} s"
        return f"{self.point}, passage {self.passage}"


@dataclass(frozen=True, slots=True)
class Plan:
    """What happens in a round: executives are killed, one after the other; the next one is not.

    `pauses`: whether an operator pauses all runs in each life, and resumes them. `spoil`: Python
    code that makes the executives that are killed worse, to see that the judge finds it. `speed`:
    0: that of its vehicles.
    """

    number: int
    world: str
    journal: str
    kills: tuple[Kill, ...]
    pauses: bool = False
    spoil: str = ""
    speed: float = 0.0

    def __str__(self) -> str:
        kills = "; ".join(map(str, self.kills)) or "no kill"
        pauses = "; an operator pauses and resumes" if self.pauses else ""
        return f"round {self.number}: {self.world}, {self.journal}: {kills}{pauses}"


@dataclass
class Round:
    """A round that was played. `reached`: how many of its kills happened."""

    plan: Plan
    verdict: Verdict
    reached: int = 0


def plan_round(seed: int, number: int, world: str, journal: str, point: str = "") -> Plan:
    """Draw a round. `point`: of its first kill; "": any, each as often as the others."""
    chance = random.Random(f"{seed} {number}")
    kind = JOURNALS[journal]
    passages = undisturbed(world, journal).passages
    points = points_of(kind, WORLDS[world].arbiter)
    names = [RANDOM, *points, *([REPLACED] if kind.lease_s else [])]
    first = point or names[number % len(names)]
    kills: list[Kill] = []
    older = first in points and points[first].opening
    if first in points and (points[first].resuming or (older and chance.random() < 0.7)):
        early = [RANDOM, *(each for each in points if passages.get(each, 0) > 1)]
        kills.append(_kill(chance, chance.choice(early), passages))
    upgrades = kills and older
    kills.append(_kill(chance, first, {first: STATEMENTS_OF_AN_UPGRADE} if upgrades else passages))
    while len(kills) < MOST_KILLS and chance.random() < 0.3:
        kills.append(_kill(chance, chance.choice(names), passages))
    pauses = WORLDS[world].pauses and chance.random() < 0.15
    return Plan(number, world, journal, tuple(kills), pauses)


def _kill(chance: random.Random, point: str, passages: Mapping[str, int]) -> Kill:
    # A point that is passed only in a resume is passed once for each run or behavior.
    most = passages.get(point) or 2
    # A computer with other work has fewer commits, each of more calls.
    passage = chance.randint(1, -(-most * 2 // 3))
    # The missions take a second on a quiet computer. Where another executive is to take over, all
    # have begun, and must not have ended.
    return Kill(point, passage, chance.uniform(0.0, 0.5 if point == REPLACED else 0.8))


@dataclass(frozen=True, slots=True)
class Undisturbed:
    """What missions do when nothing goes wrong. `passages`: of each kill point."""

    passages: Mapping[str, int]
    ends: Mapping[str, tuple[str, Counter[str]]]


@cache
def undisturbed(world: str, journal: str) -> Undisturbed:
    """Run the missions once with no kill."""
    with TemporaryDirectory(prefix="m2pem-chaos-") as folder:
        passages = Path(folder) / "passages.json"
        play = Play(Plan(0, world, journal, ()), Path(folder))
        try:
            asyncio.run(play.to_the_end(count_into=passages))
            verdict = asyncio.run(judge(play.evidence(), None))
        finally:
            play.close()
        if verdict.faults:
            raise AssertionError("with no kill: " + "; ".join(verdict.faults))
        return Undisturbed(json.loads(passages.read_text()), verdict.ends)


@dataclass
class Evidence:
    """What is known of a round from outside: see `m2pem`'s judge."""

    world: World
    journal: Path
    printed: Sequence[str] = ()
    acknowledged: Mapping[str, Sequence[RunId]] = field(default_factory=dict)
    answered: Sequence[tuple[RunId, str]] = ()
    errors: str = ""
    stopped: bool = False
    """An operator stopped all runs: not each mission has begun, and none needs have come far."""


_GONE = (ControlSocketError, OSError)
"""What an operator sees of an executive that is killed."""


class Play:
    """One round while it is played."""

    def __init__(
        self,
        plan: Plan,
        folder: Path,
        environment: Mapping[str, str] | None = None,
        forked_from: Preloaded | None = None,
    ) -> None:
        self.plan = plan
        self.reached = 0
        kind = WORLDS[plan.world]
        self._world: World = kind(folder, plan.speed or kind.speed)
        self._folder = folder
        self._kind = JOURNALS[plan.journal]
        self._file = journals.make(self._kind, folder)
        lease = {LEASE_VARIABLE: self._kind.lease_s} if self._kind.lease_s else {}
        variables = {**self._world.environment, **lease, **(environment or {})}
        self._environment = CommandLine(folder, variables).environment
        self._forked_from = forked_from or preloaded()
        self._processes: list[Process] = []
        self._chance = random.Random(f"{plan.number}")
        self._lives = 0
        self._runs: dict[str, list[RunId]] = {each.name: [] for each in self._world.missions}
        self._answered: list[tuple[RunId, str]] = []

    def close(self) -> None:
        """Leave nothing running."""
        for process in self._processes:
            process.kill()
            process.wait()
        self._world.close()

    def evidence(self) -> Evidence:
        """Return what the judge looks at."""
        lives = range(1, self._lives + 1)
        printed = [self._output(life).read_text().splitlines(keepends=True) for life in lives]
        # What a killed process had not printed whole, no operator has read.
        lines = [line.rstrip("\n") for life in printed for line in life if line.endswith("\n")]
        errors = "\n".join(self._errors(life).read_text() for life in lives)
        return Evidence(self._world, self._file, lines, self._runs, self._answered, errors)

    async def whole(self) -> None:
        """Play the plan."""
        for kill in self.plan.kills:
            if kill.point == "migration" and self._lives:
                journals.downgrade(self._kind, self._file)
            life = self._replaced if kill.point == REPLACED else self._life
            if await life(kill):
                self.reached += 1
            elif self._over:
                break
        await self.to_the_end()

    async def to_the_end(self, count_into: Path | None = None) -> None:
        """Run an executive that is not killed until all missions have ended."""
        await self._life(None, count_into)

    # --- one executive --------------------------------------------------------------------------

    async def _life(self, kill: Kill | None, count_into: Path | None = None) -> bool:
        """Run one executive. Returns whether it was killed."""
        self._over = False
        process = self._start(self._arm(kill, count_into), self.plan.spoil if kill else "")
        operator = asyncio.create_task(self._operate(process))
        killer = asyncio.create_task(self._kill_later(kill, process))
        try:
            async with asyncio.timeout(ROUND_WITHIN_S):
                while process.poll() is None and not operator.done():  # noqa: ASYNC110
                    await asyncio.sleep(LOOK_EVERY_S)
        except TimeoutError as error:
            last = self._output(self._lives).read_text()[-2000:]
            raise AssertionError(f"no end within {ROUND_WITHIN_S:g} s: {last}") from error
        finally:
            killer.cancel()
        if process.poll() is None and operator.exception() is None:
            self._over = True
            process.terminate()
        elif process.poll() is None and not isinstance(operator.exception(), _GONE):
            await operator  # raises what went wrong
        operator.cancel()
        await asyncio.gather(operator, return_exceptions=True)
        async with asyncio.timeout(ROUND_WITHIN_S):
            while process.poll() is None:  # noqa: ASYNC110  # a pipe tells, which blocks
                await asyncio.sleep(LOOK_EVERY_S)
        killed = process.returncode == -signal.SIGKILL and kill is not None
        if not killed and not (self._over and process.returncode == 0):
            raise AssertionError(f"it ended by itself ({process.returncode}): {self._said()}")
        return killed

    async def _replaced(self, kill: Kill) -> bool:
        """Run an executive that is stopped until a standby has taken over, and goes on then.

        Returns whether that happened; all missions have ended in any case.
        """
        owner = self._start("", self.plan.spoil)
        operator = asyncio.create_task(self._operate(owner))
        try:
            async with asyncio.timeout(ROUND_WITHIN_S):
                await self._control(owner)
                # Another computer's: on this one the owner's vehicles would stay locked.
                elsewhere = {"M2PEM_RUNTIME_DIR": str(self._folder / "elsewhere")}
                standby = self._start("", "", ("--standby",), elsewhere)
                while not (operator.done() or all(self._runs.values())):  # noqa: ASYNC110
                    await asyncio.sleep(LOOK_EVERY_S)
                await asyncio.sleep(kill.after_s)
                reached = not operator.done()
                if reached:
                    owner.send_signal(signal.SIGSTOP)
                    operator.cancel()
                    await asyncio.gather(operator, return_exceptions=True)
                    operator = asyncio.create_task(self._operate(standby))
                    await self._control(standby)
                    await asyncio.sleep(self._chance.uniform(0.0, 1.0))
                    owner.send_signal(signal.SIGCONT)
                await operator
                self._over = True
                for process in (standby, owner):
                    process.terminate()
                while None in (owner.poll(), standby.poll()):  # noqa: ASYNC110  # a pipe tells
                    await asyncio.sleep(LOOK_EVERY_S)
        except TimeoutError as error:
            said = [self._errors(life).read_text()[-2000:] for life in (1, 2)]
            raise AssertionError(f"no end within {ROUND_WITHIN_S:g} s: {said}") from error
        finally:
            operator.cancel()
        # It ends when it sees the standby serve, or serves again when that has ended before.
        ends = (0, 1) if reached else (0,)
        if owner.returncode not in ends or standby.returncode != 0:
            both = f"{owner.returncode} and {standby.returncode}"
            raise AssertionError(f"the owner and the standby ended with {both}: {self._said()}")
        return reached

    def _start(
        self,
        arm: str,
        spoil: str,
        more: Sequence[str] = (),
        environment: Mapping[str, str] | None = None,
    ) -> Process:
        self._lives += 1
        words = [
            *("serve", "--fleet", str(self._world.fleet), "--journal", str(self._file)),
            *("--speed", f"{self._world.speed:g}", "--ocu", "none", "--format", "json"),
            *more,
        ]
        code = _STARTER.format(arm=arm, spoil=spoil, words=words)
        nothing = os.open(os.devnull, os.O_RDONLY)
        output, errors = (
            os.open(path, os.O_WRONLY | os.O_CREAT, 0o600)
            for path in (self._output(self._lives), self._errors(self._lives))
        )
        try:
            process = self._forked_from.start(
                ["-c", code],
                self._folder,
                {**self._environment, **(environment or {})},
                (nothing, output, errors),
            )
        finally:
            for each in (nothing, output, errors):
                os.close(each)
        self._processes.append(process)
        return process

    def _arm(self, kill: Kill | None, count_into: Path | None) -> str:
        names = f"kill_points.points_of(kill_points.JOURNALS[{self._kind.name!r}], "
        points = f"{names}{self._world.arbiter!r})"
        if count_into is not None:
            return f"kill_points.count({points}.values(), Path({str(count_into)!r}))"
        if kill is None or kill.point == RANDOM:
            return ""
        return f"kill_points.die_at({points}[{kill.point!r}], {kill.passage})"

    async def _kill_later(self, kill: Kill | None, process: Process) -> None:
        if kill is not None and kill.point == RANDOM:
            await self._control(process)
            await asyncio.sleep(kill.after_s)
            process.kill()

    def _output(self, life: int) -> Path:
        return self._folder / f"output{life}.jsonl"

    def _errors(self, life: int) -> Path:
        return self._folder / f"errors{life}.txt"

    def _said(self) -> str:
        return self._errors(self._lives).read_text()[-3000:]

    # --- the operator ---------------------------------------------------------------------------

    async def _control(self, process: Process) -> Path:
        """Wait until the executive can be asked."""
        while True:
            for path in live_sockets(self._file):
                if path.stem == str(process.pid):
                    return path
            await asyncio.sleep(LOOK_EVERY_S)

    async def _operate(self, process: Process) -> None:
        """Start what has not started, answer what is asked, until all missions have ended."""
        async with RemoteControl(await self._control(process)) as control:
            await self._connected(control)
            begun = await self._begun(control)
            for mission in self._world.missions:
                if mission.name not in begun:
                    self._runs[mission.name].append(await self._begin(control, mission))
            pausing = asyncio.create_task(self._pause(control))
            try:
                while not await self._all_ended(control):
                    for prompt in control.prompts():
                        await self._answer(control, prompt)
                    if pausing.done():
                        await self._resume_paused(control)
                    await asyncio.sleep(LOOK_EVERY_S)
                await pausing
            finally:
                pausing.cancel()

    async def _begin(self, control: MissionControl, mission: ChaosMission) -> RunId:
        source = MissionFiles(mission.name, mission.source)
        while True:
            try:
                return await control.start(source, even_if_busy=True, by="anna")
            except OperatorError as error:
                if "is just taken up" not in str(error):
                    raise
            await asyncio.sleep(LOOK_EVERY_S)

    async def _all_ended(self, control: MissionControl) -> bool:
        ended = {each.mission for each in await control.runs() if each.ended_us is not None}
        return ended.issuperset(self._runs)

    async def _connected(self, control: MissionControl) -> None:
        while True:
            found = {each.name: each.status for each in await control.health()}
            if found["arbiters"] == "ok":
                return
            await asyncio.sleep(LOOK_EVERY_S)

    async def _begun(self, control: MissionControl) -> set[str]:
        """Look which missions have begun: the answer to a start may have been lost."""
        begun = [each for each in await control.runs() if each.records]
        for each in begun:
            known = self._runs[each.mission]
            if each.run not in known:
                known.append(each.run)
        return {each.mission for each in begun}

    async def _answer(self, control: MissionControl, prompt: OpenPrompt) -> None:
        decisions = [each.value for each in prompt.decisions]
        decision = "yes" if "yes" in decisions else "resume"
        try:
            await control.answer(prompt.run, prompt.prompt, decision, by="anna")
        except M2pemError as error:
            if "gone" in str(error) or "answered" not in str(error):
                raise
        else:
            self._answered.append((prompt.run, prompt.prompt))

    async def _pause(self, control: MissionControl) -> None:
        """Pause what runs, and resume it."""
        if not self.plan.pauses:
            return
        await asyncio.sleep(self._chance.uniform(0.0, 0.6))
        for run in [run for some in self._runs.values() for run in some]:
            # It may have ended, or not be taken up yet; or the journal is late, and it pauses.
            for act in (control.pause, control.resume):
                with suppress(OperatorError):
                    await act(run, by="anna")

    async def _resume_paused(self, control: MissionControl) -> None:
        """Resume what was paused by an operator of an executive that was killed."""
        for each in await control.runs():
            if each.status is RunStatus.PAUSED:
                with suppress(OperatorError):  # it is not taken up yet
                    await control.resume(each.run, by="anna")


def play_round(plan: Plan, folder: Path | None = None) -> Round:
    """Play a round and judge it. `folder`: where it is played; None: one that is removed."""
    expected = undisturbed(plan.world, plan.journal)
    if folder is None:
        with TemporaryDirectory(prefix="m2pem-chaos-") as made:
            return play_round(plan, Path(made))
    play = Play(plan, folder)
    try:
        asyncio.run(play.whole())
        verdict = asyncio.run(judge(play.evidence(), expected.ends))
    except (AssertionError, M2pemError, TimeoutError, OSError) as error:
        verdict = Verdict(faults=[f"{type(error).__name__}: {error}"])
    finally:
        play.close()
    return Round(plan, verdict, play.reached)
