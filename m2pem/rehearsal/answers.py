"""A scripted outside world: what operators, services and vehicles do in a rehearsal.

An answers file (docs/rehearsal.md) lists for each element what happens at the first visit, the
second, and so on. A visit is counted when its record is committed, and known by the id of its
prompt, service or behavior from then on: so two instances of one element take their entries first
come, first served, and a run that is taken up after a crash goes on with the next ones.
"""

import asyncio
import logging
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from m2pem.api.clock import Clock
from m2pem.api.control import MissionControl
from m2pem.api.runs import OpenPrompt, PromptClosed, RunId, StampedRecord
from m2pem.engine.inputs import MessageReceived, SignalReceived
from m2pem.engine.records import (
    BehaviorRequested,
    IncidentOpened,
    InputDeferred,
    MessageThrown,
    PromptOpened,
    Record,
    RunResumed,
    ServiceRequested,
    SignalThrown,
)
from m2pem.errors import OperatorError
from m2pem.findings import Finding
from m2pem.fleet.fleet import Fleet
from m2pem.fleet.yaml_source import YamlSource
from m2pem.mission.mission import Mission
from m2pem.rehearsal.answers_file import (
    AnswerEntry,
    AnswersModel,
    BehaviorEntry,
    IncidentEntry,
    ServiceEntry,
    TimedEntry,
    check,
    check_vehicles,
    read_answers,
)
from m2pem.units import US_PER_S

log = logging.getLogger("m2pem.answers")

BY_SCRIPT = "answers file"
"""Who the journal says has answered a prompt or sent a signal that is scripted."""

BY_DEFAULT = "default"
"""Who has taken the first decision of a prompt without a script, or has ended the run at an
incident without one."""


class Answers:
    """What an answers file says of each visit; made by `load_answers`.

    Each run counts its own visits. Asked again for the same visit, such as after a restart, it says
    the same again.
    """

    def __init__(self, model: AnswersModel | None = None, source: YamlSource | None = None) -> None:
        self.model = model or AnswersModel()
        self.source = source or YamlSource("")
        self._visits: dict[tuple[str, str, str], dict[str, int]] = {}
        self._sent: Counter[tuple[str, str, str]] = Counter()
        self._deferred: Counter[tuple[str, str, str]] = Counter()
        self._resolving = 0
        self._to_send = len(self.model.signals) + len(self.model.messages)

    def script_next(self, run: str, change: AnswersModel) -> None:
        """Let the next visits of elements in a run go as `change` says; then comes what the file
        says of visits that were to be next. Signals and messages are left out."""
        for section in ("answers", "services", "behaviors", "incidents"):
            for key, entries in getattr(change, section).items():
                place = len(self._visits.get((run, section, key), {}))
                getattr(self.model, section).setdefault(key, [])[place:place] = entries

    # --- visits ---------------------------------------------------------------------------------

    def seen(self, run: str, records: Sequence[Record]) -> None:
        """Count visits and what was sent, in the order of the journal."""
        for record in records:
            match record:
                case PromptOpened():
                    self._visit(run, "answers", record.element, record.prompt)
                case IncidentOpened():
                    self._visit(run, "incidents", record.element, record.incident)
                case ServiceRequested():
                    key = self._service(record.element, record.name)
                    self._visit(run, "services", key, record.service)
                case BehaviorRequested():
                    self._visit(run, "behaviors", record.element, record.behavior)
                case SignalThrown(by=by, signal=signal) if by == BY_SCRIPT:
                    self._sent[run, "signals", signal] += 1
                case MessageThrown(by=by, message=message) if by == BY_SCRIPT:
                    self._sent[run, "messages", message] += 1
                case InputDeferred(input=SignalReceived(by=by, signal=signal)) if by == BY_SCRIPT:
                    self._deferred[run, "signals", signal] += 1
                case InputDeferred(input=MessageReceived(by=by, message=name)) if by == BY_SCRIPT:
                    self._deferred[run, "messages", name] += 1
                case RunResumed():
                    # They are thrown now, with records of their own.
                    for late in [late for late in self._deferred if late[0] == run]:
                        del self._deferred[late]
                case _:
                    pass

    def service(self, run: str, element: str, name: str, service: str) -> ServiceEntry | None:
        """Return the scripted result of a service task on this visit; None: none is left."""
        key = self._service(element, name)
        place = self._visit(run, "services", key, service)
        return None if place is None else self.model.services[key][place]

    def behavior(self, run: str, behavior: str) -> tuple[str, BehaviorEntry] | None:
        """Return the element of a behavior and its scripted end; None: none is left."""
        for element, entries in self.model.behaviors.items():
            place = self._visits.get((run, "behaviors", element), {}).get(behavior)
            if place is not None:
                return element, entries[place]
        return None

    def answer(self, run: str, element: str, prompt: str) -> AnswerEntry | None:
        """The answer to a prompt of an element; None: nothing is scripted (any more)."""
        place = self._visit(run, "answers", element, prompt)
        return None if place is None else self.model.answers[element][place]

    def incident(self, run: str, element: str, incident: str) -> IncidentEntry | None:
        """The choice about an incident of an element; None: nothing is scripted (any more)."""
        place = self._visit(run, "incidents", element, incident)
        return None if place is None else self.model.incidents[element][place]

    def _service(self, element: str, name: str) -> str:
        """A service is scripted by its element, else by its class."""
        return element if element in self.model.services else name

    def _visit(self, run: str, section: str, key: str, visit: str) -> int | None:
        """The place in its list of a visit, old or new; None when the list is used up."""
        entries: dict[str, list[object]] = getattr(self.model, section)
        if key not in entries:
            return None
        places = self._visits.setdefault((run, section, key), {})
        # No more visits are remembered than there are entries: the run may last for months.
        if visit not in places and len(places) < len(entries[key]):
            places[visit] = len(places)
        return places.get(visit)

    # --- the operator and the world outside -----------------------------------------------------

    @property
    def to_send(self) -> int:
        """The number of signals and messages that are still to be sent."""
        return self._to_send

    @property
    def resolving(self) -> int:
        """The number of incidents and prompts that will be answered by script after a while."""
        return self._resolving

    async def act(
        self,
        control: MissionControl,
        run: RunId,
        clock: Clock,
        *,
        default_first_decision: bool,
    ) -> None:
        """Answer prompts and send what is to be sent, until cancelled or the executive ends.

        `default_first_decision`: a prompt without a script takes its first decision, and an
        incident without one ends the run; else they are left to an operator.
        """
        async with asyncio.TaskGroup() as group:
            group.create_task(self._send(control, run, clock), name="scripted signals")
            group.create_task(
                self._answer_prompts(control, run, clock, group, default_first_decision),
                name="scripted answers",
            )

    async def _answer_prompts(
        self,
        control: MissionControl,
        run: RunId,
        clock: Clock,
        group: asyncio.TaskGroup,
        default_first_decision: bool,
    ) -> None:
        asked: set[str] = set()
        late: dict[str, asyncio.Task[None]] = {}

        def take(incident: str, element: str) -> None:
            if incident not in asked:
                asked.add(incident)
                choosing = self._choose(
                    control, clock, run, incident, element, default_first_decision
                )
                group.create_task(choosing, name="scripted choice")

        while True:
            notices = control.subscribe(run)
            for each in await control.incidents():
                if each.run == run:
                    take(each.incident, each.element)
            try:
                async for notice in notices:
                    if isinstance(notice, StampedRecord):
                        if isinstance(notice.record, IncidentOpened):
                            take(notice.record.incident, notice.record.element)
                        continue
                    if isinstance(notice, OpenPrompt) and notice.prompt not in asked:
                        asked.add(notice.prompt)
                        entry = self.answer(notice.run, notice.element, notice.prompt)
                        if entry is None or not entry.after:
                            await self._answer(control, notice, entry, default_first_decision)
                            continue
                        answering = self._answer_later(control, clock, notice, entry)
                        late[notice.prompt] = group.create_task(answering, name="scripted answer")
                    elif isinstance(notice, PromptClosed):
                        asked.discard(notice.prompt)
                        if notice.prompt in late:  # what closes it may be this answer itself
                            late.pop(notice.prompt).cancel()
            except OperatorError:  # we were too slow; standing prompts come first in the next one
                continue
            return

    async def _answer_later(
        self, control: MissionControl, clock: Clock, prompt: OpenPrompt, entry: AnswerEntry
    ) -> None:
        self._resolving += 1
        try:
            await clock.sleep(entry.after)
        finally:
            self._resolving -= 1
        await self._answer(control, prompt, entry, default_first_decision=False)

    async def _answer(
        self,
        control: MissionControl,
        prompt: OpenPrompt,
        entry: AnswerEntry | None,
        default_first_decision: bool,
    ) -> None:
        by = BY_SCRIPT
        if entry is not None:
            decision = entry.decision
        elif default_first_decision:
            by = BY_DEFAULT
            decision = prompt.decisions[0].value
        else:
            return
        # First, tasks that began with the prompt get the vehicles that they need.
        await asyncio.sleep(0)
        try:
            await control.answer(prompt.run, prompt.prompt, decision, by=by)
        except OperatorError as error:
            # The default decision is too late when another answer has ended the task.
            level = logging.DEBUG if by == BY_DEFAULT else logging.WARNING
            log.log(level, "%s: the answer %r: %s", prompt.element, decision, error)

    async def _choose(
        self,
        control: MissionControl,
        clock: Clock,
        run: RunId,
        incident: str,
        element: str,
        default_end: bool,
    ) -> None:
        """Resolve an incident as it is scripted; else, with `default_end`, end the run."""
        entry = self.incident(run, element, incident)
        by = BY_SCRIPT if entry is not None else BY_DEFAULT
        if entry is None and default_end:
            entry = IncidentEntry(choice="end")
        if entry is None:
            return
        self._resolving += 1
        try:
            await clock.sleep(entry.after)
            if entry.data:
                await control.resolve_incident(run, incident, "set_data", data=entry.data, by=by)
            await control.resolve_incident(
                run,
                incident,
                entry.choice,
                to=entry.to or "",
                roles=entry.roles,
                by=by,
                even_if_stuck=True,
            )
        except OperatorError as error:
            level = logging.DEBUG if by == BY_DEFAULT else logging.WARNING
            log.log(level, "%s: %s about %s: %s", element, entry.choice, incident, error)
        finally:
            self._resolving -= 1

    async def _send(self, control: MissionControl, run: RunId, clock: Clock) -> None:
        summary = next(each for each in await control.runs() if each.run == run)
        skip = self._sent + self._deferred
        for kind, entry in self._timed():
            if skip[run, kind, entry.id] > 0:
                skip[run, kind, entry.id] -= 1
            else:
                await clock.sleep_until(summary.started_us + round(entry.at * US_PER_S))
                await self._send_one(control, run, kind, entry)
            self._to_send -= 1

    def _timed(self) -> list[tuple[str, TimedEntry]]:
        """Signals and messages by time; at the same time, in the order of the file."""
        events = [("signals", entry) for entry in self.model.signals]
        events += [("messages", entry) for entry in self.model.messages]
        return sorted(events, key=lambda event: event[1].at)

    async def _send_one(
        self, control: MissionControl, run: RunId, kind: str, entry: TimedEntry
    ) -> None:
        send = control.signal if kind == "signals" else control.message
        try:
            await send(entry.id, run=run, data=entry.data, by=BY_SCRIPT)
        except OperatorError as error:
            log.warning("scripted %s %s at %g s: %s", kind[:-1], entry.id, entry.at, error)


def load_answers(answers: str | Path | bytes) -> Answers:
    """Read an answers file, or its text.

    Raises:
        AnswersError: with every finding.
    """
    return Answers(*read_answers(answers if isinstance(answers, bytes) else Path(answers)))


def check_answers(answers: Answers, mission: Mission, fleet: Fleet | None = None) -> list[Finding]:
    """What in the answers does not fit the mission: elements, decisions, signals, messages; nor
    the fleet: vehicles and their settings."""
    findings = check(answers.model, answers.source, mission)
    if fleet is not None:
        findings += check_vehicles(answers.model, answers.source, fleet)
    return findings
