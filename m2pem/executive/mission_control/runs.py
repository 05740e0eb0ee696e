"""Operations on runs: begin them, steer them, answer them, end them."""

import asyncio
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from m2pem.api.allocation import StartPreview
from m2pem.api.authoring import MissionSource
from m2pem.api.people import MAX_NOTE_CHARACTERS
from m2pem.api.runs import RunId
from m2pem.bpmn.search_path import mission_files_in
from m2pem.engine import inputs as i
from m2pem.engine.state import RunStatus as EngineStatus
from m2pem.errors import OperatorError
from m2pem.executive.ended_runs import refuse_ended
from m2pem.executive.handover import UNNAMED_OPERATOR
from m2pem.executive.journal_loss import PROMPT as LOSS_PROMPT
from m2pem.executive.journal_loss import unknown_decision
from m2pem.executive.mission_control.parts import ControlParts, bounded
from m2pem.mission.events import Signal
from m2pem.mission.mission import Mission
from m2pem.mission.values import Value


class RunOperations(ControlParts):
    """See `m2pem.api.mission_control.runs.RunControl`."""

    async def start(
        self,
        mission: MissionSource | Mission,
        *,
        process: str | None = None,
        data: Mapping[str, Value] | None = None,
        by: str = "",
        even_if_busy: bool = False,
    ) -> RunId:
        return await self._starter.start(
            mission, process, bounded(data), by, even_if_busy=even_if_busy
        )

    async def execute_behavior(
        self,
        resource: str,
        behavior: str,
        parameters: Mapping[str, Value] | None = None,
        *,
        by: str = "",
    ) -> RunId:
        self._supervisor.seen(by)
        return await self._direct.execute(resource, behavior, bounded(parameters) or {}, by)

    async def missions(self) -> Sequence[str]:
        here = Path.cwd()
        folders = (*self._supervisor.settings.search_path, here, here / "missions")
        return [str(path) for path in await asyncio.to_thread(mission_files_in, folders)]

    async def preview_start(
        self, mission: MissionSource, *, process: str | None = None, data: Iterable[str] = ()
    ) -> StartPreview:
        return await self._starter.preview(mission, process, tuple(data))

    async def pause(self, run: RunId, *, by: str = "") -> None:
        emergency = self._supervisor.emergency
        async with self._explain_end("pause", run):
            asked = emergency.pause(self._supervisor.runner(run), by)
            await emergency.written("pause", {run: asked})

    async def resume(self, run: RunId, *, by: str = "") -> None:
        await self._ask("resume", run, i.ResumeRun(by))

    async def signal(
        self,
        signal: str,
        *,
        run: RunId | None = None,
        data: Mapping[str, Value] | None = None,
        by: str = "",
    ) -> None:
        given = bounded(data)
        if run is not None:
            async with self._explain_end("signal", run):
                refuse_ended(self._supervisor.runner(run))
        runners = (
            [self._supervisor.runner(run)]
            if run is not None
            else [
                runner
                for runner in self._supervisor.runners.values()
                if runner.run.state.status is not EngineStatus.ENDED
            ]
        )
        known = [(runner, runner.run.state.mission.signals) for runner in runners]
        meant = [(runner, _named(signal, signals)) for runner, signals in known]
        if not any(ids for _, ids in meant):
            there = {each.id: each.name for _, signals in known for each in signals.values()}
            listed = (
                ", ".join(f"{name} ({key})" if name else key for key, name in there.items())
                or "none"
            )
            raise OperatorError(
                f"{run or 'no run'} has {'no' if run else 'a'} signal {signal!r}; known: {listed}"
            )
        for runner, ids in meant:
            if len(ids) > 1:
                raise OperatorError(
                    f"{runner.id} has several signals named {signal!r}; say which: {', '.join(ids)}"
                )
        for runner, ids in meant:
            for key in ids:
                await self._ask("signal", runner.id, i.SignalReceived(key, given, by))

    async def message(
        self, message: str, *, run: RunId, data: Mapping[str, Value] | None = None, by: str = ""
    ) -> None:
        await self._ask("message", run, i.MessageReceived(message, bounded(data), by))

    async def answer(self, run: RunId, prompt: str, decision: str, *, by: str = "") -> None:
        if prompt == LOSS_PROMPT and self._supervisor.losses.is_open(run):
            match decision:
                case "go_on":
                    await self.resume(run, by=by)
                case "stop":
                    await self.stop(run, by=by, reason="the journal has lost records")
                case _:
                    raise unknown_decision(decision)
            return
        runner = self._supervisor.runners.get(run)
        asked = runner.prompts.get(prompt) if runner is not None else None
        if asked is not None:
            self._refuse_others(f"{run}: {prompt}", asked.role, by)
        await self._ask("answer", run, i.PromptAnswer(prompt, decision, by))

    async def add_note(self, run: RunId, text: str, *, by: str = "") -> None:
        note = text.strip()
        if not note or len(note) > MAX_NOTE_CHARACTERS:
            raise OperatorError(
                f"a note has 1 to {MAX_NOTE_CHARACTERS} characters, and this one {len(note)}"
            )
        await self._ask("note", run, i.OperatorNoted(note, by or UNNAMED_OPERATOR))

    async def stop(self, run: RunId, *, by: str = "", reason: str = "") -> None:
        emergency, interrupted = self._supervisor.emergency, self._supervisor.interrupted
        is_taken_up_later = interrupted.stop(run, by, reason)
        if is_taken_up_later and run not in self._supervisor.runners:
            self._schedule.run_stopping(run, by)
            return
        async with self._explain_end("stop", run):
            asked = emergency.stop(self._supervisor.runner(run), by, reason)
            self._schedule.run_stopping(run, by)
            if not is_taken_up_later:
                await emergency.written("stop", {run: asked})

    async def stop_all(self, *, by: str = "", reason: str = "") -> Sequence[RunId]:
        emergency, schedule = self._supervisor.emergency, self._schedule
        asked = emergency.stop_all(self._supervisor.runners.values(), by, reason)
        interrupted = self._supervisor.interrupted.stop_all(by, reason)
        hold = schedule.hold_at_once(by, f"STOP of all{f': {reason}' if reason else ''}")
        # A run that is just taken up decides its stop only then.
        driven = {run: each for run, each in asked.items() if run not in interrupted}
        written = emergency.written("stop", driven), schedule.written(hold)
        done = await asyncio.gather(*written, return_exceptions=True)
        if failed := [each for each in done if isinstance(each, BaseException)]:
            raise OperatorError("; ".join(map(str, failed))) from failed[0]
        return list(dict.fromkeys((*asked, *interrupted)))


def _named(name: str, signals: Mapping[str, Signal]) -> list[str]:
    """The ids of the signals that a name, or an id, may mean."""
    if name in signals:
        return [name]
    return [key for key, signal in signals.items() if name and signal.name == name]
