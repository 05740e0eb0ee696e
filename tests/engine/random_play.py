"""Plays a mission by numbers: each chooses something that could happen outside now.

`Outside` keeps book of the commands and asserts that they make sense to whoever carries them out.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace

from m2pem.engine import commands as c
from m2pem.engine import inputs as i
from m2pem.engine import records as r
from m2pem.engine.run import Step
from m2pem.engine.state import BehaviorPhase, Incident, RunStatus
from m2pem.mission.catalogue import BehaviorState, ResumePolicy
from m2pem.mission.elements import ErrorPolicy
from m2pem.mission.mission import Mission
from tests.engine.invariants import check_state
from tests.engine.kit import SECOND_US, Play

MAX_CONTINUES = 30


@dataclass
class Outside:
    """What arbiters, OCUs and services have been told."""

    active: dict[str, tuple[str, ...]] = field(default_factory=dict)
    cancelled: set[str] = field(default_factory=set)
    prompts: set[str] = field(default_factory=set)
    services: set[str] = field(default_factory=set)

    def take(self, step: Step) -> None:
        """Carry out the commands of a step."""
        restarted = {x.behavior for x in step.records if isinstance(x, r.BehaviorRestarted)}
        requested = {x.behavior for x in step.records if isinstance(x, r.BehaviorRequested)}
        for record in step.records:
            if isinstance(record, r.BehaviorEnded):
                self.active.pop(record.behavior, None)
            elif isinstance(record, r.ServiceEnded):
                self.services.discard(record.service)
        for command in step.commands:
            match command:
                case c.StartBehavior(behavior=behavior, resources=resources):
                    assert behavior not in self.active or behavior in restarted
                    for other, held in self.active.items():
                        if other != behavior and not set(held).isdisjoint(resources):
                            assert other in command.preempts
                            assert other in self.cancelled
                    self.active[behavior] = resources
                case c.CancelBehavior(behavior=behavior, resources=resources):
                    assert behavior in self.active or behavior in requested
                    self.active[behavior] = resources  # one that never started can be cancelled
                    assert behavior not in self.cancelled
                    self.cancelled.add(behavior)
                case c.OpenPrompt(prompt=prompt):
                    assert prompt not in self.prompts
                    self.prompts.add(prompt)
                case c.ClosePrompt(prompt=prompt):
                    self.prompts.remove(prompt)
                case c.RunService(service=service):
                    assert service not in self.services
                    self.services.add(service)
                case c.CancelService(service=service):
                    self.services.remove(service)
                case _:
                    pass

    def check(self, play: Play) -> None:
        """What the outside is busy with is what the state says."""
        state = play.run.state
        assert set(self.active) == set(state.behaviors)
        assert self.prompts == set(state.prompts)
        assert self.services == set(state.services)
        for behavior in state.behaviors.values():
            cancelling = behavior.phase is BehaviorPhase.CANCELLING
            assert cancelling == (behavior.id in self.cancelled)


class RandomPlay:
    """A play that never waits: what happens is chosen by numbers."""

    def __init__(
        self, text: str | Mission, batch: int, on_error: ErrorPolicy = ErrorPolicy.END
    ) -> None:
        self.play = Play(text, batch=batch)
        fleet = replace(self.play.fleet, on_error=on_error)
        self.play = Play(self.play.mission, fleet=fleet, batch=batch)
        self.play.goes_on = False
        self.outside = Outside()
        self.spare = MAX_CONTINUES

    def give(self, item: i.Input) -> None:
        """Hand in an input; check everything."""
        play = self.play
        play.give(item)
        self._check()
        while play.run.wants_continue and self.spare:
            self.spare -= 1
            play.give(i.Continue())
            self._check()

    def _check(self) -> None:
        self.outside.take(self.play.steps[-1])
        self.outside.check(self.play)
        check_state(self.play.run.state)

    def go(self, choices: Sequence[int]) -> None:
        """Start, and let the chosen things happen."""
        self.give(i.StartRun(self.play.mission.process().id, {"a": 1, "b": 1}))
        self.go_on(choices)

    def go_on(self, choices: Sequence[int]) -> None:
        """Let the chosen things happen."""
        for choice in choices:
            things = self._things()
            things[choice % len(things)]()

    def finish(self) -> None:
        """Let all that is awaited come well, in order, until the run ends or waits for an event."""
        state = self.play.run.state
        self.give(i.SetBreakpoints())
        for _ in range(60):
            if state.status is RunStatus.ENDED or self.play.run.wants_continue:
                return
            if state.status is RunStatus.PAUSED:
                self.give(i.ResumeRun())
            elif state.prompts:
                prompt = next(iter(state.prompts.values()))
                self.give(i.PromptAnswer(prompt.id, prompt.decisions[0]["value"]))
            elif state.incidents:
                self._get_over(next(iter(state.incidents.values())))
            elif state.services:
                self.give(i.ServiceCompleted(next(iter(state.services))))
            elif active := [b for b in state.behaviors.values() if b.phase is BehaviorPhase.ACTIVE]:
                self._report(active[0].id, BehaviorState.SUCCEEDED)
            elif self.play.run.next_due_us is not None:
                self._to_next_timer()
            else:
                return

    def end(self) -> None:
        """Give the run up if it still goes on, and let all that is being cancelled end."""
        state = self.play.run.state
        if state.status is not RunStatus.ENDED:
            self.give(i.GiveUp("the test is over"))
        for behavior in list(state.behaviors):
            self._report(behavior, BehaviorState.CANCELLED)
        assert not state.held
        assert not self.outside.active

    # --- what can happen ------------------------------------------------------------------------

    def _things(self) -> list[Callable[[], None]]:
        state = self.play.run.state
        things: list[Callable[[], None]] = [self._to_next_timer, lambda: self._wait(1.5)]

        def add(item: i.Input) -> None:
            things.append(lambda: self.give(item))

        for prompt in state.prompts.values():
            for decision in prompt.decisions:
                add(i.PromptAnswer(prompt.id, decision["value"], "ann"))
        for behavior in state.behaviors.values():
            number = behavior.number + 1
            for reported in (*BehaviorState, BehaviorState.SUCCEEDED, BehaviorState.CANCELLED):
                add(i.BehaviorReported(behavior.id, number, reported))
            for policy in ResumePolicy:
                add(i.BehaviorMissing(behavior.id, policy))
            add(i.BehaviorMissing(behavior.id, ResumePolicy.HOLD, BehaviorState.RUNNING))
            for reachable in (True, False):
                add(i.ResourceFault(behavior.resources[-1], "LINK_LOST", "", reachable))
        for service in state.services:
            add(i.ServiceCompleted(service, {"a": 2}))
            add(i.ServiceFailed(service, "E1"))
        mission = state.mission
        for signal in mission.signals:
            add(i.SignalReceived(signal, {"b": 2}))
            add(i.SignalReceived(signal, id="once"))
        for message in mission.messages:
            add(i.MessageReceived(message, {"a": 0}))
        for incident in state.incidents.values():
            for choice in self._choices_about(incident):
                add(choice)
        add(i.PauseRun())
        add(i.ResumeRun())
        add(i.ResumeRun())
        elements = [node.id for node in self.play.mission.nodes]
        add(i.SetBreakpoints(tuple(elements[len(self.play.steps) % len(elements) :: 3])))
        add(i.SetBreakpoints((), ("a == 2", "b > 1")))
        add(i.SetBreakpoints())
        add(i.StepRun())
        add(i.StepRun())
        add(i.SetData({"a": 2, "b": 0}))
        add(i.SetData({"a": 1}, max(state.scopes, default=0)))
        add(i.ClaimRun(state.epoch + 1))
        add(i.Tick())
        add(i.GeometrySet("alpha", {"type": "Point", "coordinates": [1.0, 2.0]}))
        add(i.Continue())
        for step in self.play.steps[-3:]:
            if not isinstance(step.input, i.Continue):
                add(step.input)
        if len(self.play.steps) > 10:
            add(i.StopRun())
        return things

    def _choices_about(self, incident: Incident) -> Iterator[i.ResolveIncident]:
        """Yield every choice about an incident, wrong ones too."""
        for choice in i.IncidentChoice:
            yield i.ResolveIncident(incident.id, choice, "ann")
        yield i.ResolveIncident(incident.id, i.IncidentChoice.SET_DATA, data={"a": 3, "b": 0})
        for target in self.play.run.state.mission.elements:
            yield i.ResolveIncident(incident.id, i.IncidentChoice.MOVE, to=target)
        for role in incident.roles:
            for resource in self.play.fleet.vehicles:
                roles = {role: (resource,)}
                yield i.ResolveIncident(incident.id, i.IncidentChoice.RETRY_WITH, roles=roles)

    def _get_over(self, incident: Incident) -> None:
        """Go on after an incident, or fail."""
        can_skip = i.IncidentChoice.SKIP in incident.choices
        opened = self.play.run.state.last_incident
        choice = i.IncidentChoice.SKIP if can_skip and opened < 30 else i.IncidentChoice.END
        self.give(i.ResolveIncident(incident.id, choice))

    def _report(self, behavior: str, state: BehaviorState) -> None:
        number = self.play.run.state.behaviors[behavior].number + 1
        self.give(i.BehaviorReported(behavior, number, state))

    def _wait(self, seconds: float) -> None:
        until_us = self.play.now_us + round(seconds * SECOND_US)
        while (due_us := self.play.run.next_due_us) is not None and due_us <= until_us:
            if self.play.run.wants_continue:
                return
            self.play.now_us = max(self.play.now_us, due_us)
            self.give(i.Tick())
        self.play.now_us = until_us

    def _to_next_timer(self) -> None:
        due_us = self.play.run.next_due_us
        if due_us is not None:
            self.play.now_us = max(self.play.now_us, due_us)
            self.give(i.Tick())
