"""The plain operator control unit: prompts on standard output, lines from standard input."""

import asyncio
import sys
from collections.abc import Awaitable, Callable
from contextlib import suppress
from functools import partial
from pathlib import Path

from m2pem.api.allocation import blocked_by
from m2pem.api.control import MissionControl
from m2pem.api.description import printable
from m2pem.api.foreground import Lines
from m2pem.api.requirement_states import RequirementStates, worst_first
from m2pem.api.runs import OpenPrompt, PromptClosed, RunId, RunStatus, StampedRecord
from m2pem.api.schedule import When
from m2pem.cli.standard_streams import writer_for
from m2pem.engine.records import IncidentOpened, RunClaimed, RunEnded, RunStarted
from m2pem.errors import BusyError, M2pemError, OperatorError, StuckError
from m2pem.findings import lines
from m2pem.mission.behavior import Decision
from m2pem.mission.values import Value

NAME = "plain"
BACKLOG = 1_000_000
STOP_WAITS_S = 0.2

HELP = """\
  2, or abort        answer the open prompt, by number or by decision
  p3 2               answer prompt p3, when several are open (r2 p3 2: of run r2)
  incidents          list the errors about which you decide, and what can be chosen
  resolve i1 retry   decide: skip, end, set_data NAME=VALUE, move ID, retry_with ROLE=uav2
  resolve! i1 skip   the same, even if the mission cannot complete after it
  signal NAME        send a signal, by its name or its id
  pause, resume      hold the vehicles and the clock; go on
  stop               end the mission: its vehicles are sent the command to stop
  stop all           end every mission
  route NAME FILE    hand over a route, under the name that the mission uses
  area NAME FILE     hand over an area; point NAME FILE: a point
  missions           list the mission files that are found here
  check FILE         print what speaks against a start of it, and what its roles run on
  start FILE         start another mission
  start! FILE        the same, even if other runs or operators have its vehicles
  schedule           list the missions that start later
  schedule TIME FILE  start it at 08:00, or 2026-05-01T08:00; or free: when its vehicles are
  schedule start s1  start that entry now
  schedule cancel s1  start that entry no more
  schedule hold      hold all of it (hold s1: one entry)
  schedule release   release it
  takeover evsg1     take a vehicle or payload from the missions, to steer it by hand
  handback evsg1     give it back; what another operator has who is gone: handback evsg1 REASON
  requirements       list what a run is monitored for, with the verdicts (requirements r2)
  who                print the holder of each vehicle and payload, and which tasks wait
  runs               list the runs and their states
  quit               leave; missions go on without an operator here
With several runs, say which: stop r2."""


class PlainOcu:
    """Reads one command from each line, until its operator quits.

    At the end of the input no operator answers here any more; the unit still shows the prompts.
    """

    def __init__(self, control: MissionControl) -> None:
        self._control = control
        self._out = writer_for(sys.stdout)
        self._notices = control.subscribe(size=BACKLOG)
        self._prompts: dict[tuple[RunId, str], OpenPrompt] = {}
        self._active: dict[RunId, None] = {}
        """Runs that have not ended, in the order of their first events."""
        self._ended: set[RunId] = set()
        self._lines: asyncio.Queue[str] = asyncio.Queue()
        self._listening = True
        self._end_noted = False
        self._commands: dict[str, Callable[[list[str]], Awaitable[None]]] = {
            "stop": self._stop,
            "pause": self._pause,
            "resume": self._resume,
            "incidents": self._incidents,
            "resolve": self._resolve,
            "resolve!": partial(self._resolve, even_if_stuck=True),
            "signal": self._signal,
            "route": partial(self._hand_over, "route"),
            "area": partial(self._hand_over, "area"),
            "point": partial(self._hand_over, "point"),
            "missions": self._missions,
            "check": self._check,
            "start": self._start,
            "start!": partial(self._start, even_if_busy=True),
            "schedule": self._schedule,
            "takeover": self._take,
            "handback": self._give,
            "requirements": self._requirements,
            "who": self._who,
            "runs": self._runs,
            "help": self._help,
        }

    async def serve(self) -> None:
        """Show prompts and carry out commands until the operator quits."""
        watching = asyncio.create_task(self._watch())
        obeying = asyncio.create_task(self._obey_in_turn())
        try:
            async for line in Lines():
                if line.strip() == "quit":
                    await self._lines.join()
                    return
                if line.split()[:1] == ["stop"]:
                    # It keeps its order, too, unless an earlier command hangs.
                    with suppress(TimeoutError):
                        await asyncio.wait_for(self._lines.join(), STOP_WAITS_S)
                    await self._obey(line)
                else:
                    self._lines.put_nowait(line)
            await self._lines.join()
            self._listening = False
            self._note_the_end()
            await watching
        finally:
            watching.cancel()
            obeying.cancel()

    # --- showing --------------------------------------------------------------------------------

    async def _watch(self) -> None:
        async for notice in self._notices:
            match notice:
                case StampedRecord(run=run, record=record):
                    self._note(run, record)
                    if isinstance(record, IncidentOpened):
                        self._show_incident(record)
                case OpenPrompt():
                    self._open(notice)
                case PromptClosed():
                    self._close(notice)

    def _show_incident(self, record: IncidentOpened) -> None:
        """Say what can be chosen; the line of the record has said what failed."""
        choices = ", ".join(record.choices)
        self._say(f"[{record.incident}] {record.element}: {record.code}; decide: {choices}")
        self._say(f"for instance: resolve {record.incident} {record.choices[0]}", indent=4)

    def _note(self, run: RunId, record: object) -> None:
        match record:
            case RunStarted() | RunClaimed():
                self._active[run] = None
            case RunEnded():
                self._active.pop(run, None)
                self._ended.add(run)

    def _open(self, prompt: OpenPrompt) -> None:
        key = (prompt.run, prompt.prompt)
        if key in self._prompts:
            return
        self._active[prompt.run] = None
        self._prompts[key] = prompt
        self._say(f"[{self._name(key)}] {prompt.element}: {prompt.text}")
        for number, decision in enumerate(prompt.decisions, 1):
            value = "" if _same(decision.label, decision.value) else f" ({decision.value})"
            self._say(f"{number}  {decision.label or decision.value}{value}", indent=4)
        self._note_the_end()

    def _close(self, closed: PromptClosed) -> None:
        key = (closed.run, closed.prompt)
        name = self._name(key)
        if self._prompts.pop(key, None) is None or closed.by == NAME:
            return
        if closed.decision:
            self._say(f"[{name}] answered by {closed.by or 'another'}: {closed.decision}")
        else:
            self._say(f"[{name}] is not asked any more")

    def _say(self, text: str, indent: int = 0) -> None:
        self._out.put(" " * indent + printable(text))

    def _note_the_end(self) -> None:
        """Print, once, that a prompt is open which cannot be answered here."""
        if not self._listening and self._prompts and not self._end_noted:
            self._end_noted = True
            self._say("the input has ended: no operator answers here any more")

    def _name(self, key: tuple[RunId, str]) -> str:
        """p1; with more than one run, r2 p1."""
        run, prompt = key
        return prompt if len(self._active) <= 1 else f"{run} {prompt}"

    # --- obeying --------------------------------------------------------------------------------

    async def _obey_in_turn(self) -> None:
        while True:
            line = await self._lines.get()
            try:
                await self._obey(line)
            finally:
                self._lines.task_done()

    async def _obey(self, line: str) -> None:
        words = line.split()
        if not words:
            return
        try:
            command = self._commands.get(words[0])
            if command is not None:
                await command(words[1:])
            else:
                await self._answer(words)
        except M2pemError as error:
            self._say(str(error))

    async def _answer(self, words: list[str]) -> None:
        prompt, rest = self._addressed(words)
        decision = _decision(prompt, rest)
        await self._control.answer(prompt.run, prompt.prompt, decision.value, by=NAME)

    def _addressed(self, words: list[str]) -> tuple[OpenPrompt, str]:
        """Return the prompt that a line answers, and the rest of the line."""
        for (run, name), prompt in self._prompts.items():
            if words[:2] == [run, name]:
                return prompt, " ".join(words[2:])
        named = [prompt for (_, name), prompt in self._prompts.items() if name == words[0]]
        if len(named) == 1:
            return named[0], " ".join(words[1:])
        if len(self._prompts) == 1:
            return next(iter(self._prompts.values())), " ".join(words)
        if not self._prompts:
            raise OperatorError(f"{words[0]!r} is no command, and no prompt is open; try: help")
        names = ", ".join(map(self._name, self._prompts))
        raise OperatorError(f"several prompts are open: {names}; begin with the one you answer")

    async def _which(self, words: list[str]) -> RunId:
        """The run that is named, else the only one that this unit has seen go on. Where it has seen
        none, as it came later, the executive is asked."""
        if words:
            return words[0]
        going_on = list(self._active) or [
            each.run
            for each in await self._control.runs()
            if each.status in (RunStatus.RUNNING, RunStatus.PAUSED) and each.run not in self._ended
        ]
        if len(going_on) != 1:
            raise OperatorError(
                f"which run: {', '.join(going_on)}?" if going_on else "no mission runs"
            )
        return going_on[0]

    async def _stop(self, words: list[str]) -> None:
        if words == ["all"]:
            await self._control.stop_all(by=NAME)
        else:
            await self._control.stop(await self._which(words), by=NAME)

    async def _pause(self, words: list[str]) -> None:
        await self._control.pause(await self._which(words), by=NAME)

    async def _resume(self, words: list[str]) -> None:
        """Resume a paused run; while none is paused, it may answer a prompt after a restart."""
        asked = any(
            decision.value == "resume"
            for prompt in self._prompts.values()
            for decision in prompt.decisions
        )
        if asked and not words and not await self._is_any_paused():
            await self._answer(["resume"])
        else:
            await self._control.resume(await self._which(words), by=NAME)

    async def _is_any_paused(self) -> bool:
        runs = await self._control.runs()
        return any(run.status is RunStatus.PAUSED and run.run in self._active for run in runs)

    async def _incidents(self, _: list[str]) -> None:
        found = await self._control.incidents()
        waiting = await self._control.waiting() if found else ()
        for incident in found:
            self._say(str(incident))
            self._say(f"choices: {', '.join(incident.choices)}", indent=4)
            if blocked := blocked_by(incident.incident, waiting):
                tasks = "; ".join(each.in_short() for each in blocked)
                self._say(f"blocked: {tasks}", indent=4)
        if not found:
            self._say("no incident is open")

    async def _requirements(self, words: list[str]) -> None:
        """List the requirements of a run, what is violated first."""
        run, last = await self._which(words), 0
        known = RequirementStates()
        while page := await self._control.records(run, last):
            for stamped in page:
                known.take(stamped.record, stamped.t_s)
            last = page[-1].seq
        for each in worst_first(known.values()):
            self._say(str(each))
        if not known:
            self._say(f"{run} is monitored for no requirement")

    async def _resolve(self, words: list[str], *, even_if_stuck: bool = False) -> None:
        """Decide about an incident, "i1" of the only run that has one of that name, or "r2.i1"."""
        if len(words) < 2:
            raise OperatorError("say which, and what: resolve INCIDENT CHOICE")
        name, choice, rest = words[0], words[1], words[2:]
        known = {each.incident: each for each in await self._control.incidents()}
        named = [id_ for id_ in known if name in (id_, id_.partition(".")[2])]
        if len(named) != 1:
            listed = ", ".join(known) or "none"
            raise OperatorError(f"{name!r} is no open incident, or several; open are: {listed}")
        data: dict[str, Value] = {}
        roles: dict[str, list[str]] = {}
        for word in rest if choice in ("set_data", "retry_with") else ():
            key, equals, value = word.partition("=")
            if not (key and equals):
                raise OperatorError(f"{word!r} is not of the form NAME=VALUE")
            if choice == "set_data":
                from m2pem.api.data_text import value_of

                data[key] = value_of(value, key)
            else:
                roles[key] = value.split(",")
        try:
            await self._control.resolve_incident(
                known[named[0]].run,
                named[0],
                choice,
                data=data,
                to=" ".join(rest) if choice == "move" else "",
                roles=roles,
                by=NAME,
                even_if_stuck=even_if_stuck,
            )
        except StuckError as error:
            again = " ".join(words)
            raise OperatorError(f"{error}. resolve! {again} does it all the same") from error

    async def _signal(self, words: list[str]) -> None:
        if not words:
            raise OperatorError("say which: signal NAME")
        run = words.pop(0) if len(words) > 1 and words[0] in self._active else None
        await self._control.signal(" ".join(words), run=run, by=NAME)

    async def _hand_over(self, kind: str, words: list[str]) -> None:
        """To every run, now and later (paper, section 4.3)."""
        from m2pem.geo.files import read_geometry
        from m2pem.geo.geojson import as_geojson
        from m2pem.geo.geometry_files import FileProblem

        if len(words) < 2:
            raise OperatorError(f"say which, and from where: {kind} NAME FILE")
        name, file = words[0], " ".join(words[1:])
        left_out: list[FileProblem] = []
        geometry = await asyncio.to_thread(read_geometry, Path(file), kind, left_out.append)
        for problem in left_out:
            self._say(f"{file}: {problem}")
        await self._control.set_geometry(name, as_geojson(geometry), by=NAME)
        self._say(f"{name} is handed over")

    async def _missions(self, _: list[str]) -> None:
        files = await self._control.missions()
        for file in files:
            self._say(file)
        if not files:
            self._say("no mission files are found here; start FILE takes any path")

    async def _check(self, words: list[str]) -> None:
        if not words:
            raise OperatorError("say which: check FILE")
        preview = await self._control.preview_start(" ".join(words))
        for line in lines(preview.findings) or [f"{preview.file}: nothing found"]:
            self._say(line)
        for role in preview.roles:
            self._say(str(role))
        if preview.busy:
            self._say(preview.busy)

    async def _start(self, words: list[str], *, even_if_busy: bool = False) -> None:
        if not words:
            raise OperatorError("say which: start FILE")
        file = " ".join(words)
        try:
            await self._control.start(file, by=NAME, even_if_busy=even_if_busy)
        except BusyError as error:
            raise OperatorError(f"{error}. start! {file} starts it all the same") from error

    async def _schedule(self, words: list[str]) -> None:
        match words:
            case []:
                for line in (await self._control.scheduled()).lines() or ["nothing is scheduled"]:
                    self._say(line)
            case ["cancel", entry]:
                await self._control.unschedule(entry, by=NAME)
            case ["start", entry]:
                await self._control.start_scheduled(entry, by=NAME)
            case ["hold", *entry] if len(entry) <= 1:
                await self._control.hold_schedule(entry[0] if entry else None, by=NAME)
            case ["release", *entry] if len(entry) <= 1:
                await self._control.release_schedule(entry[0] if entry else None, by=NAME)
            case [time, *file] if file and time not in ("cancel", "start"):
                when = When(at="" if time == "free" else time)
                entry_id = await self._control.schedule(" ".join(file), when=when, by=NAME)
                self._say(f"{entry_id} is scheduled; schedule cancel {entry_id} takes it back")
            case _:
                raise OperatorError(
                    "say what: schedule 08:00 FILE, schedule free FILE, schedule start s1, "
                    "schedule cancel s1, schedule hold, or schedule release"
                )

    async def _take(self, words: list[str]) -> None:
        if len(words) != 1:
            raise OperatorError("say which: takeover RESOURCE")
        for effect in await self._control.preview_take(words[0]):
            self._say(str(effect))
        await self._control.take(words[0], by=NAME)
        self._say(f"{words[0]} is yours; handback {words[0]} gives it back")

    async def _give(self, words: list[str]) -> None:
        if not words:
            raise OperatorError("say which: handback RESOURCE, or handback RESOURCE REASON")
        await self._control.give_back(words[0], reason=" ".join(words[1:]), by=NAME)
        self._say(f"{words[0]} is the missions' again")

    async def _who(self, _: list[str]) -> None:
        unavailable = await self._control.unavailable()
        labels = await self._control.holder_labels()
        for resource, holder in (await self._control.holders()).items():
            if label := labels.get(holder):
                holder = f"{label} ({holder})"  # noqa: PLW2901
            self._say(f"{resource}: {holder or unavailable.get(resource) or 'free'}")
        for space in await self._control.shared_space():
            self._say(str(space))
        for task in await self._control.waiting():
            self._say(str(task))

    async def _runs(self, _: list[str]) -> None:
        for run in await self._control.runs():
            detail = f": {run.detail}" if run.detail else ""
            self._say(f"{run.run} {run.status.value} {run.mission} ({run.process}){detail}")

    async def _help(self, _: list[str]) -> None:
        self._out.put(HELP)


def _decision(prompt: OpenPrompt, text: str) -> Decision:
    if text.isdecimal() and 1 <= int(text) <= len(prompt.decisions):
        return prompt.decisions[int(text) - 1]
    for decision in prompt.decisions:
        if text == decision.value:
            return decision
    alike = [
        each for each in prompt.decisions if _same(text, each.value) or _same(text, each.label)
    ]
    if len(alike) == 1:
        return alike[0]
    choices = ", ".join(
        f"{number} {decision.value}" for number, decision in enumerate(prompt.decisions, 1)
    )
    raise OperatorError(f"{text!r} does not answer {prompt.prompt}; its decisions: {choices}")


def _same(one: str, other: str) -> bool:
    return one.casefold() == other.casefold()
