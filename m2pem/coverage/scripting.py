"""The answers file that makes a rehearsal go as a run of the checker went.

The engine plays the run (`m2pem.verify.conformance_run`), and what came from outside is written
down: who answered what after how long, which behaviors and services ended how and when, which
signals and messages came. What was under way when the run ended goes on a little longer.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from m2pem.coverage.reach import as_step
from m2pem.engine import inputs as i
from m2pem.engine import records as r
from m2pem.engine.run import Step
from m2pem.mission.catalogue import BehaviorState
from m2pem.units import US_PER_S
from m2pem.verify.conformance_run import ConformanceRun, NotPlayableError
from m2pem.verify.net.petri_net import Trigger
from m2pem.verify.report.run_steps import RunStep

_LONGER_S = 1.0
"""How long what was under way at the end of the run goes on."""

Content = dict[str, Any]
"""The content of an answers file (docs/rehearsal.md)."""


class NotScriptableError(Exception):
    """No answers file can bring the run about; the text says why."""


def answers_for(player: ConformanceRun, steps: Iterable[RunStep]) -> list[Content]:
    """Return the content of answers files that may bring a run about, the shortest one first.

    `player` has only begun. Whether one of them does it, a rehearsal shows: vehicles move there,
    and the short ones leave all to them but what fails.

    Raises:
        NotScriptableError: none can.
    """
    for step in steps:
        if step.trigger == Trigger.CONDITION:
            data = ", ".join(step.data) or "data"
            raise NotScriptableError(f"nothing in the mission writes {data}")
        try:
            player.play(as_step(step))
        except NotPlayableError as error:
            raise NotScriptableError(f"the engine does not follow: {error}") from error
    script = _Script()
    for each in player.steps:
        script.add(each)
    script.finish()
    found = [script.short(), script.whole()]
    return found if found[0] != found[1] else found[1:]


@dataclass(slots=True)
class _Visit:
    """What happens at one visit of an element, and how long after its begin, in seconds."""

    began_us: int
    entry: Content = field(default_factory=dict)
    after_s: float | None = None

    def end(self, now_us: int, **entry: Any) -> None:
        if self.after_s is None:
            self.entry = entry
            self.after_s = (now_us - self.began_us) / US_PER_S


class _Script:
    def __init__(self) -> None:
        self._now_us = 0
        self._started_us: int | None = None
        self._prompts: dict[str, dict[str, _Visit]] = {}
        self._behaviors: dict[str, dict[str, _Visit]] = {}
        self._services: dict[str, dict[str, _Visit]] = {}
        self._first: dict[str, str] = {}
        self._sent: dict[str, list[Content]] = {"signals": [], "messages": []}

    def add(self, step: Step) -> None:
        """Note what came from outside with an input, and what began and ended because of it."""
        self._now_us = step.at_us
        if self._started_us is None:
            self._started_us = step.at_us
        match step.input:
            case i.SignalReceived(signal=signal, data=data):
                self._send("signals", signal, data)
            case i.MessageReceived(message=message, data=data):
                self._send("messages", message, data)
            case i.ServiceCompleted(service=service, data=data):
                self._end(self._services, service, **({"write": dict(data)} if data else {}))
            case _:
                pass
        for record in step.records:
            self._note(record)

    def _send(self, kind: str, name: str, data: Any) -> None:
        assert self._started_us is not None
        at_s = (self._now_us - self._started_us) / US_PER_S
        self._sent[kind].append({"at": at_s, "id": name, **({"data": dict(data)} if data else {})})

    def _note(self, record: r.Record) -> None:
        match record:
            case r.PromptOpened(element=element, prompt=prompt, decisions=decisions):
                self._begin(self._prompts, element, prompt)
                self._first[element] = str(decisions[0]["value"]) if decisions else ""
            case r.PromptAnswered(prompt=prompt, decision=decision):
                self._end(self._prompts, prompt, decision=decision)
            case r.BehaviorRequested(element=element, behavior=behavior):
                self._begin(self._behaviors, element, behavior)
            case r.BehaviorCancelRequested(behavior=behavior):
                self._end(self._behaviors, behavior, end="stalled")
            case r.BehaviorEnded(behavior=behavior, state=BehaviorState.SUCCEEDED):
                self._end(self._behaviors, behavior, end="succeeded")
            case r.BehaviorEnded(behavior=behavior, code=code):
                self._end(self._behaviors, behavior, end="failed", error=code)
            case r.ServiceRequested(element=element, service=service):
                self._begin(self._services, element, service)
            case r.ServiceEnded(service=service, code=code) if code:
                self._end(self._services, service, error=code)
            case _:
                pass

    def _begin(self, of: dict[str, dict[str, _Visit]], element: str, visit: str) -> None:
        of.setdefault(element, {}).setdefault(visit, _Visit(self._now_us))

    def _end(self, of: dict[str, dict[str, _Visit]], visit: str, **entry: Any) -> None:
        for visits in of.values():
            if visit in visits:
                visits[visit].end(self._now_us, **entry)

    def finish(self) -> None:
        """Let what is under way go on a little longer."""
        later_us = self._now_us + round(_LONGER_S * US_PER_S)
        for element, visits in self._prompts.items():
            for visit in visits.values():
                visit.end(later_us, decision=self._first[element])
        for visits in self._behaviors.values():
            for visit in visits.values():
                visit.end(later_us, end="succeeded")
        for visits in self._services.values():
            for visit in visits.values():
                visit.end(later_us)

    def whole(self) -> Content:
        """Return the answers with the times of the run."""

        def timed(of: dict[str, dict[str, _Visit]]) -> Content:
            return {
                element: [
                    {"after": _number(each.after_s), **each.entry} for each in visits.values()
                ]
                for element, visits in of.items()
            }

        return _without_empty(
            {
                "answers": timed(self._prompts),
                "services": timed(self._services),
                "behaviors": timed(self._behaviors),
                **self._sent,
            }
        )

    def short(self) -> Content:
        """Return the answers without times, and without what happens by itself."""
        answers = {
            element: _rest(
                [visit.entry["decision"] for visit in visits.values()], self._first[element]
            )
            for element, visits in self._prompts.items()
        }
        behaviors = {
            element: _rest(
                [
                    {"after": 0, **visit.entry}
                    if visit.entry["end"] == "failed"
                    else {"end": "simulated"}
                    for visit in visits.values()
                ],
                {"end": "simulated"},
            )
            for element, visits in self._behaviors.items()
        }
        services = {
            element: [visit.entry or {"after": 0} for visit in visits.values()]
            for element, visits in self._services.items()
        }
        found = {"answers": answers, "services": services, "behaviors": behaviors}
        visits = {key: _without_empty(each) for key, each in found.items()}
        return _without_empty({**visits, **self._sent})


def _rest(entries: Sequence[Any], default: Any) -> list[Any]:
    """The entries up to the last one that is not the default."""
    kept = list(entries)
    while kept and kept[-1] == default:
        kept.pop()
    return kept


def _number(seconds: float | None) -> float | int:
    assert seconds is not None
    return int(seconds) if seconds == int(seconds) else seconds


def _without_empty(content: Mapping[str, Any]) -> Content:
    return {key: each for key, each in content.items() if each}
