"""Rounds in which operators revise a mission and decide about its incidents while executives die.

    python -m tests.chaos.decisions --seeds 1-200

A mission and its decisions are drawn (`decision_missions`). `m2pem serve` executes it; it is killed
before, during and after decisions, and started again, or a standby takes over. An operator whose
decision was lost with the connection looks whether it was done, or decides again.
"""

import argparse
import asyncio
import os
import signal
import sys
import tempfile
from collections import Counter
from collections.abc import Awaitable, Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from random import Random

from m2pem.api import MissionControl
from m2pem.api.authoring import MissionFiles
from m2pem.api.runs import RunId
from m2pem.cli.replay import Verification
from m2pem.control_socket.paths import ControlSocketError, live_sockets
from m2pem.control_socket.remote import RemoteControl
from m2pem.engine import records as r
from m2pem.errors import M2pemError, NotDrivenError, OperatorError, StuckError
from m2pem.fleet.fleet_file import load_fleet
from m2pem.journal import open_journal
from m2pem.journal.lease import LEASE_VARIABLE
from m2pem.simulation.executions import EffectKind
from m2pem.simulation.state_file import recorded_effects
from tests.chaos import journals
from tests.chaos.decision_missions import Decision, Reader, Script, Seen, draw_script
from tests.chaos.kill_points import JOURNALS, RANDOM, points_of
from tests.chaos.worlds import SimulatedVehicles
from tests.command_line import CommandLine
from tests.preloaded import Process, preloaded

LOOK_EVERY_S = 0.03
STEP_WITHIN_S = 60.0
RUN = RunId("r1")
SPEED = 60.0

_FLEET = """version: 1
name: decisions
origin: {{lat: 38.1075, lon: -77.3192, alt: 60.0}}
vehicles:
  ugv1: {{domain: ground, arbiter: sim, connection: {{state: {state}, telemetry_hz: 0.2}}}}
  ugv2:
    domain: ground
    arbiter: sim
    connection: {{state: {state}, telemetry_hz: 0.2, faults: ["goto: fail at 1 s"]}}
"""
_STARTER = """
import runpy, sys
from pathlib import Path
from tests.chaos import kill_points
points = kill_points.points_of(kill_points.JOURNALS[{journal!r}], {arbiter!r})
kill_points.die_when({points!r}, points, Path({armed!r}))
sys.argv = ["m2pem", *{words!r}]
runpy.run_module("m2pem", run_name="__main__", alter_sys=True)
"""
POINTS = (
    "decided, not committed",
    "committed, not published",
    "group commit: begun",
    "group commit: before COMMIT",
    "group commit: before the mark",
    "group commit: after the mark",
    "group commit: not acknowledged yet",
)
"""Where an executive is killed while it takes a decision."""

OF_RESUME = ("resume: claimed", "resume: replayed", "resume: posted", "resume: taken up")


_GONE = (
    *("the executive has ended", "does not answer", "is gone", "no executive"),
    "was interrupted, and",
)
"""What the command line says of an executive that was killed."""


class After(StrEnum):
    """Who goes on when an executive was killed."""

    RESTART = "started again"
    STANDBY = "a standby"


@dataclass
class Round:
    """What came of a seed. `kills`: when an executive was killed."""

    seed: int
    faults: list[str] = field(default_factory=list)
    kills: list[str] = field(default_factory=list)
    said: list[str] = field(default_factory=list)


class Play:
    """One round while it is played."""

    def __init__(self, seed: int, after: After, journal: str, folder: Path) -> None:
        self.seed, self._after, self._folder = seed, after, folder
        self._chance = Random(f"kills {seed}")
        self._ways = Random(f"ways {seed}")
        self._kind = JOURNALS[journal]
        self._file = journals.make(self._kind, folder)
        self._fleet, self._state = folder / "fleet.yaml", folder / "vehicles.state"
        self._fleet.write_text(_FLEET.format(state=self._state), encoding="utf-8")
        self._armed = folder / "armed"
        self._m2pem = CommandLine(folder, {LEASE_VARIABLE: "2"} if self._kind.lease_s else {})
        self._lives: list[Process] = []
        self._owner: Process | None = None
        self._standby: Process | None = None
        self.script: Script = draw_script(seed, load_fleet(self._fleet))
        self.round = Round(seed)
        self._done: dict[int, list[tuple[str, str]]] = {}
        """By decision: each attempt, and what came of it: done, refused or lost."""
        for number, text in enumerate(self.script.versions):
            (folder / f"v{number}.bpmn").write_text(text, encoding="utf-8")

    # --- executives -----------------------------------------------------------------------------

    def _start(self, *words: str) -> Process:
        life = len(self._lives)
        said, errors = self._folder / f"output{life}.jsonl", self._folder / f"errors{life}.txt"
        words = (
            *("serve", "--fleet", str(self._fleet), "--journal", str(self._file)),
            *("--speed", f"{SPEED:g}", "--ocu", "none", "--format", "json"),
            *words,
        )
        code = _STARTER.format(
            journal=self._kind.name,
            arbiter=SimulatedVehicles.arbiter,
            points=self._points(POINTS) + (OF_RESUME if words[-1] != "--standby" else ()),
            armed=str(self._armed),
            words=words,
        )
        streams = [
            os.open(path, os.O_RDWR | os.O_CREAT, 0o600) for path in (os.devnull, said, errors)
        ]
        try:
            process = preloaded().start(
                ["-c", code], self._folder, self._m2pem.environment, tuple(streams)
            )
        finally:
            for each in streams:
                os.close(each)
        self._lives.append(process)
        return process

    def _points(self, names: tuple[str, ...]) -> tuple[str, ...]:
        known = points_of(self._kind, SimulatedVehicles.arbiter)
        return tuple(each for each in names if each in known)

    def _arm(self, point: str, passage: int) -> None:
        self._armed.write_text(f"{point}\n{passage}\n", encoding="utf-8")

    def _serve(self) -> None:
        """Have an executive serve, and one stand by for it if that is to take over."""
        if self._standby is not None:
            self._owner, self._standby = self._standby, None
        else:
            self._owner = self._start()

    async def _ready(self) -> None:
        """Wait until the executive serves, and drives the run. One that dies meanwhile is
        replaced."""
        while True:
            path = await self._socket()
            if path is None:
                self._armed.unlink(missing_ok=True)
                self.round.kills.append("while it took the run up")
                self._serve()
                continue
            with suppress(ControlSocketError, OSError):
                async with RemoteControl(path) as control:
                    if await self._drives(control):
                        break
            await asyncio.sleep(LOOK_EVERY_S)
        if self._after is After.STANDBY and self._standby is None:
            self._standby = self._start("--standby")
            errors = self._folder / f"errors{len(self._lives) - 1}.txt"
            while "standing by" not in errors.read_text():
                assert self._standby.poll() is None, errors.read_text()
                await asyncio.sleep(LOOK_EVERY_S)

    async def _drives(self, control: MissionControl) -> bool:
        if {each.name: each.status for each in await control.health()}["arbiters"] != "ok":
            return False
        if not await control.runs():
            return True
        with suppress(OperatorError):
            await control.mission_time_s(RUN)
            return True
        return any(each.ended_us is not None for each in await control.runs())

    async def _socket(self) -> Path | None:
        """The socket of the executive that is to serve; None: it has died."""
        assert self._owner is not None
        while self._owner.poll() is None:
            for path in live_sockets(self._file):
                if path.stem == str(self._owner.pid):
                    return path
            await asyncio.sleep(LOOK_EVERY_S)
        return None

    async def _die(self, when: str) -> None:
        """Kill the executive, if it has not died by itself, and have the next one serve."""
        assert self._owner is not None
        await self._kill()
        assert self._owner.returncode == -signal.SIGKILL, self.said()
        self._armed.unlink(missing_ok=True)
        self.round.kills.append(when)
        if self._chance.random() < 0.2:
            if self._standby is None and self._chance.random() < 0.5:
                self._arm(self._chance.choice(OF_RESUME), 1)
            self._serve()
            if not self._armed.exists():
                await asyncio.sleep(self._chance.uniform(0.0, 0.5))
                await self._kill()
        else:
            self._serve()
        await self._ready()
        self._armed.unlink(missing_ok=True)

    async def _kill(self) -> None:
        assert self._owner is not None
        self._owner.kill()
        while self._owner.poll() is None:  # noqa: ASYNC110  # a pipe tells, which blocks
            await asyncio.sleep(LOOK_EVERY_S)

    def said(self) -> str:
        """The last words of all executives."""
        texts = [each.read_text()[-1500:] for each in sorted(self._folder.glob("errors*.txt"))]
        return "\n".join(texts)

    # --- the operator ---------------------------------------------------------------------------

    async def whole(self) -> None:
        """Play the round to its end."""
        self._serve()
        await self._ready()
        async with asyncio.timeout(STEP_WITHIN_S), self._control() as control:
            source = MissionFiles("v0.bpmn", self.script.versions[0].encode())
            assert await control.start(source, process="MAIN", by="anna") == RUN
        for number, decision in enumerate(self.script.decisions):
            await self._until(decision.before, f"before {decision}")
            await self._decide(number, decision)
        await self._until(Reader(self.script.records).seen, "at the end")
        assert self._owner is not None
        both = [each for each in (self._owner, self._standby) if each is not None]
        for each in both:
            each.terminate()
        while any(each.poll() is None for each in both):  # noqa: ASYNC110  # a pipe tells
            await asyncio.sleep(LOOK_EVERY_S)
        assert all(each.returncode == 0 for each in both), self.said()

    def _control(self) -> RemoteControl:
        assert self._owner is not None
        (path,) = [each for each in live_sockets(self._file) if each.stem == str(self._owner.pid)]
        return RemoteControl(path)

    async def _records(self) -> list[r.Record]:
        async with self._control() as control:
            return await _read(control, [])

    async def _until(self, wanted: Seen | None, when: str) -> None:
        """Wait until the run has come to where it is without kills."""
        assert wanted is not None
        try:
            async with asyncio.timeout(STEP_WITHIN_S), self._control() as control:
                records: list[r.Record] = []
                while True:
                    reader = Reader(await _read(control, records))
                    if reader.seen == wanted:
                        return
                    await self._go_on(control, reader)
                    await asyncio.sleep(LOOK_EVERY_S)
        except TimeoutError:
            raise AssertionError(f"{when}: {reader.seen}, not {wanted}") from None

    async def _go_on(self, control: MissionControl, reader: Reader) -> None:
        """Answer what an executive asks about behaviors after it was started."""
        for prompt, opened in reader.prompts.items():
            if opened.behavior:
                self.round.said.append(f"asked after a restart: {opened.text}")
                await control.answer(RUN, prompt, "resume", by="anna")

    async def _decide(self, number: int, decision: Decision) -> None:
        """Have a decision done, by as many attempts as it needs."""
        if decision.kind == "arrive":
            if self._chance.random() < 0.4:
                await asyncio.sleep(self._chance.uniform(0.0, 0.3))
                await self._die("while a vehicle is on its way")
            return
        attempts = self._done.setdefault(number, [])
        reader = Reader(await self._records())
        make = self._request(decision, reader)
        if self._chance.random() < 0.06:
            await self._die(f"before {decision}")
        while True:
            by = f"d{number}a{len(attempts)}"
            confirmed = any(each == "not confirmed" for _, each in attempts)
            outcome = await self._attempt(make, by, decision, confirmed=confirmed)
            attempts.append((by, outcome))
            if outcome == "done":
                return
            if outcome == "lost" and self._looks(decision) and await self._was_done(attempts):
                return
            if outcome.startswith("refused"):
                if await self._was_done(attempts):
                    return
                assert len(attempts) < 6, f"{decision}: {attempts}"
                if decision.kind == "revise" and "another one since" in outcome:
                    make = self._request(decision, reader)  # by a new plan
                    continue
                raise AssertionError(f"{decision}: {outcome}")

    def _looks(self, decision: Decision) -> bool:
        """Whether the operator looks first if a lost decision was done. Signals, messages and data
        may be sent again, and come again then."""
        again = decision.kind in ("signal", "message") or decision.value == "set_data"
        return again or self._chance.random() < 0.4

    async def _was_done(self, attempts: list[tuple[str, str]]) -> bool:
        names = {by for by, _ in attempts}
        return any(getattr(each, "by", "") in names for each in await self._records())

    async def _attempt(
        self,
        make: Callable[[str, bool], Awaitable[None]],
        by: str,
        decision: Decision,
        *,
        confirmed: bool,
    ) -> str:
        """Decide once; the executive may be killed meanwhile. Returns what came of it."""
        chance, quick = self._chance, confirmed or self._chance.random() < 0.7
        kill = chance.random()
        killer: asyncio.Task[None] | None = None
        when = f"during {decision}"
        if kill < 0.15:
            point = chance.choice(self._points(POINTS))
            self._arm(point, chance.choice((1, 1, 2)))
            when += f": {point}"
        elif kill < 0.3:
            killer = asyncio.create_task(self._kill_in(chance.uniform(0.0, 0.05 if quick else 1.5)))
            when += f": {RANDOM}"
        try:
            await make(by, quick)
            outcome = "done"
        except (ControlSocketError, NotDrivenError, OSError) as error:
            outcome = "lost"
            self.round.said.append(f"lost: {error}")
        except StuckError as error:
            outcome = "not confirmed"
            self.round.said.append(f"{decision}: {error}")
        except OperatorError as error:
            outcome = f"refused: {error}"
            self.round.said.append(f"{decision}: {outcome}")
        if killer is not None:
            await killer
        if kill < 0.3 or chance.random() < 0.06:
            await self._die(when if outcome == "lost" or kill < 0.3 else f"right after {decision}")
        elif outcome == "lost":
            raise AssertionError(f"{decision} was lost, and no executive was killed: {self.said()}")
        return outcome

    async def _kill_in(self, seconds: float) -> None:
        await asyncio.sleep(seconds)
        await self._kill()

    def _request(
        self, decision: Decision, reader: Reader
    ) -> Callable[[str, bool], Awaitable[None]]:
        """How a decision is asked for, by whom, and whether what follows is confirmed at once."""
        words = self._command(decision, reader)
        if words and self._ways.random() < 0.3:
            return lambda by, quick: self._typed(words, by, quick=quick)
        match decision.kind:
            case "answer":
                prompt = self._prompt(decision, reader)
                return lambda by, _: self._call("answer", prompt, decision.value, by=by)
            case "resolve":
                incident = self._incident(decision, reader)
                return lambda by, quick: self._call(
                    "resolve_incident",
                    incident,
                    decision.value,
                    by=by,
                    even_if_stuck=quick,
                    **decision.more,
                )
            case "revise":
                return self._revision(int(decision.about), dict(decision.more))
        return lambda by, _: self._send(decision.kind, decision.about, by)

    async def _typed(self, words: list[str], by: str, *, quick: bool) -> None:
        """Decide by a command of the command line.

        Raises:
            ControlSocketError, StuckError, OperatorError: as the operations themselves.
        """
        confirmed = ["--even-if-stuck"] if quick and words[0] in ("revise", "resolve") else []
        words = [*words, *confirmed, "--by", by, "--journal", str(self._file)]
        status, _, said = await asyncio.to_thread(self._m2pem.run, *words)
        if status == 0:
            return
        if any(each in said for each in _GONE):
            raise ControlSocketError(said)
        raise StuckError(said) if "--even-if-stuck does it" in said else OperatorError(said)

    def _command(self, decision: Decision, reader: Reader) -> list[str]:
        """The command of a decision; []: there is none."""
        more = dict(decision.more)
        match decision.kind:
            case "answer":
                return ["answer", RUN, self._prompt(decision, reader), decision.value]
            case "resolve":
                words = ["resolve", RUN, self._incident(decision, reader), decision.value]
                words += [f"--data={key}={value}" for key, value in more.get("data", {}).items()]
                return words + ([f"--to={more['to']}"] if "to" in more else [])
            case "revise":
                moves = [f"--move={element}={target}" for element, target in more.items()]
                return ["revise", RUN, f"v{decision.about}.bpmn", "--yes", *moves]
            case "signal":
                return ["signal", RUN, decision.about]
        return []

    @staticmethod
    def _prompt(decision: Decision, reader: Reader) -> str:
        prompts = reader.prompts
        named = [key for key in prompts if prompts[key].element == decision.about]
        return min(named, key=lambda each: int(each.rpartition("p")[2]))

    @staticmethod
    def _incident(decision: Decision, reader: Reader) -> str:
        incidents = reader.incidents
        (incident,) = (key for key in incidents if incidents[key].element == decision.about)
        return incident

    async def _call(self, method: str, *words: str, **more: object) -> None:
        async with self._control() as control:
            await getattr(control, method)(RUN, *words, **more)

    async def _send(self, method: str, about: str, by: str) -> None:
        async with self._control() as control:
            await getattr(control, method)(about, run=RUN, by=by)

    def _revision(
        self, version: int, moves: dict[str, str]
    ) -> Callable[[str, bool], Awaitable[None]]:
        name = f"v{version}.bpmn"
        source = MissionFiles(name, self.script.versions[version].encode())
        plan = ""

        async def revise(by: str, quick: bool) -> None:
            nonlocal plan
            async with self._control() as control:
                if not plan:
                    preview = await control.plan_revision(RUN, source, moves=moves)
                    if not preview.is_possible:
                        raise OperatorError("; ".join(each.text for each in preview.refusals))
                    plan = preview.plan
                await control.revise(RUN, source, plan, moves=moves, by=by, even_if_stuck=quick)

        return revise

    # --- the judge ------------------------------------------------------------------------------

    async def judge(self) -> None:
        """Compare the journal with what was acknowledged, and with the run without kills."""
        faults, records = self.round.faults, list[r.Record]()
        journal = open_journal(str(self._file))
        try:
            (info,) = await journal.runs()
            verification = Verification(info)
            async for entry in journal.read(RUN):
                if not verification.agrees(entry):
                    faults.append(verification.as_text())
                    break
                records += entry.records
        finally:
            await journal.close()
        reader = Reader(records)
        faults += reader.faults
        for number, attempts in self._done.items():
            faults += faults_of(self.script.decisions[number], attempts, records)
        faults += differences(records, self.script.records)
        starts = Counter(
            each.behavior
            for each in (recorded_effects(self._state) if self._state.exists() else ())
            if each.kind is EffectKind.START
        )
        again = Counter(each.behavior for each in records if isinstance(each, r.BehaviorRestarted))
        asked = {each.behavior for each in records if isinstance(each, r.BehaviorRequested)}
        for behavior, count in starts.items():
            if behavior not in asked or count > 1 + again[behavior]:
                faults.append(f"{behavior} began {count} times, restarted {again[behavior]}")
        if "Traceback" in self.said():
            faults.append(self.said())

    def close(self) -> None:
        """Leave nothing running."""
        for process in self._lives:
            process.kill()
            process.wait()
        self._m2pem.end()


async def _read(control: MissionControl, known: list[r.Record]) -> list[r.Record]:
    """Read the records of the run that are not among those that are known, too."""
    while page := await control.records(RUN, after_seq=len(known)):
        known += [each.record for each in page]
    return known


def faults_of(
    decision: Decision, attempts: list[tuple[str, str]], records: list[r.Record]
) -> list[str]:
    """Compare what came of each attempt at a decision, by whom it was made, with the records."""
    faults, total = [], 0
    for by, outcome in attempts:
        those = [each for each in records if getattr(each, "by", "") == by]
        total += len(those)
        if len(those) not in {"done": (1,), "lost": (0, 1)}.get(outcome, (0,)):
            faults.append(f"{decision}, {by}: {outcome}, and {len(those)} records: {those}")
    if total != 1:
        faults.append(f"{decision}: {attempts}, and {total} records")
    return faults


def differences(records: Iterable[r.Record], wanted: Iterable[r.Record]) -> list[str]:
    """Compare the records of a run with those of the run without kills."""
    found, without = (Counter(filter(None, map(_plain, each))) for each in (records, wanted))
    more = [f"{n} times more than without kills: {each}" for each, n in (found - without).items()]
    less = [f"{n} times less than without kills: {each}" for each, n in (without - found).items()]
    return more + less


def _plain(record: r.Record) -> str:
    """What a record says, without what differs between two executions of one mission; "" for a
    record that only executives cause."""
    kind = type(record).__name__
    if kind in _OF_EXECUTIVES:
        return ""
    said = {
        name: getattr(record, name)
        for name in _COMPARED
        if hasattr(record, name) and not (kind == "PromptAnswered" and name == "behavior")
    }
    return f"{kind} {said}"


_OF_EXECUTIVES = {
    *("RunClaimed", "InputIgnored", "InputSeen", "RunYielded", "BehaviorProgressed"),
    *("BehaviorUnsettled", "BehaviorContinued", "BehaviorRestarted", "BehaviorCancelRequested"),
    *("ResourceReturned", "RunStarted"),
}
_COMPARED = (
    *("element", "outcome", "flow", "instance", "decision", "choice", "to", "key", "value"),
    *("kept", "message", "signal", "code", "name", "trigger", "ref", "activity", "previous"),
)


def play_round(seed: int, after: After, journal: str) -> Round:
    """Play a round and judge it."""
    with tempfile.TemporaryDirectory(prefix="m2pem-decisions-") as folder:
        play = Play(seed, after, journal, Path(folder))
        try:
            asyncio.run(play.whole())
            asyncio.run(play.judge())
        except (AssertionError, M2pemError, TimeoutError, OSError) as error:
            play.round.faults.append(f"{type(error).__name__}: {error}\n{play.said()}")
        finally:
            play.close()
        return play.round


def way_of(seed: int) -> tuple[After, str]:
    """Who goes on in the round of a seed, and with which kind of journal."""
    after = After.RESTART if seed % 2 else After.STANDBY
    return after, "postgres" if seed % 6 in (4, 5) else "sqlite"


def _moment(kill: str) -> str:
    """When an executive was killed, without the decision."""
    points = [each for each in (*POINTS, RANDOM) if kill.endswith(each)]
    return points[0] if points else kill.partition(" answer ")[0].partition(" re")[0]


def main() -> int:
    """Play rounds; 1 if one went wrong."""
    parser = argparse.ArgumentParser(prog="python -m tests.chaos.decisions", description=__doc__)
    parser.add_argument("--seeds", default="1-200")
    arguments = parser.parse_args()
    first, _, last = arguments.seeds.partition("-")
    wrong, kills, said = 0, Counter[str](), Counter[str]()
    for seed in range(int(first), int(last or first) + 1):
        after, journal = way_of(seed)
        played = play_round(seed, after, journal)
        kills.update(map(_moment, played.kills))
        said.update(each[:110] for each in played.said)
        if played.faults:
            wrong += 1
            print(f"seed {seed}, {after}, {journal}: {played.kills}", flush=True)
            print("\n".join(f"    {each}" for each in played.faults), flush=True)
        else:
            print(f"seed {seed}, {after}, {journal}: {len(played.kills)} kills", flush=True)
    for each, count in (*kills.most_common(), *said.most_common()):
        print(f"{count:5} {each}")
    print(f"wrong: {wrong}; kills: {kills.total()}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
