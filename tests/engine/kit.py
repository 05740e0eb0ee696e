"""Playing a mission by hand: inputs in, records out, with a clock that the test moves."""

from collections.abc import Iterator
from typing import Any, ClassVar, Self

from m2pem.engine import inputs as i
from m2pem.engine import records as r
from m2pem.engine.commands import Command
from m2pem.engine.revision import RevisionPlan, plan_revision
from m2pem.engine.run import MissionRun, Step
from m2pem.engine.state import Behavior, BehaviorPhase, RunStatus
from m2pem.fleet.default_fleet import fleet_for
from m2pem.fleet.fleet import Fleet
from m2pem.journal.base import Entry
from m2pem.journal.codec import decode_body, encode_body
from m2pem.mission.catalogue import BehaviorState
from m2pem.mission.mission import Mission
from m2pem.mission.values import Value
from tests.engine.invariants import check_state
from tests.engine.notation import mission
from tests.engine.snapshot import snapshot
from tests.engine.trace import line

START_US = 1_767_225_600_000_000  # 2026-01-01T00:00:00Z
SECOND_US = 1_000_000

SUCCEEDED = BehaviorState.SUCCEEDED
FAILED = BehaviorState.FAILED
CANCELLED = BehaviorState.CANCELLED
RUNNING = BehaviorState.RUNNING
ACCEPTED = BehaviorState.ACCEPTED


class Play:
    """A run in a test. Methods that hand in an input return the play, for chains.

    Without a fleet, one is made up from the mission's roles. Every play is `verify`d after its
    test.
    """

    made: ClassVar[list["Play"]] = []

    def __init__(
        self, text: str | Mission, *, fleet: Fleet | None = None, batch: int = 10_000
    ) -> None:
        self.mission = mission(text) if isinstance(text, str) else text
        self.fleet = fleet or fleet_for(self.mission)
        self.run = MissionRun(self.mission, self.fleet, "r1", batch)
        self.now_us = START_US
        self.steps: list[Step] = []
        self.goes_on = True  # whether a yield is followed by `Continue` at once
        self._batch = batch
        self._traced = 0
        self._commanded = 0
        Play.made.append(self)

    # --- inputs ---------------------------------------------------------------------------------

    def give(self, item: i.Input) -> Self:
        """Hand in any input."""
        self.steps.append(self.run.receive(item, self.now_us))
        while self.goes_on and self.run.wants_continue:
            self.steps.append(self.run.receive(i.Continue(), self.now_us))
        return self

    def start(self, data: dict[str, Value] | None = None, *, process: str | None = None) -> Self:
        return self.give(i.StartRun(self.mission.process(process).id, data or {}))

    def answer(self, decision: str = "done", *, prompt: str = "", by: str = "ops") -> Self:
        """Answer the prompt of that id or task, or the one that was opened first."""
        prompts = self.run.state.prompts
        named = [p.id for p in prompts.values() if prompt in ("", p.id, p.token.node.id)]
        return self.give(i.PromptAnswer(named[0] if named else prompt, decision, by))

    def report(
        self, element: str, state: BehaviorState = SUCCEEDED, code: str = "", number: int = 0
    ) -> Self:
        """The arbiter's word on a behavior, by its number ("b1") or the task that commands it."""
        behavior = self.behavior(element)
        number = number or behavior.number + 1
        return self.give(i.BehaviorReported(behavior.id, number, state, code))

    def resolve(self, choice: str, incident: str = "", **options: Any) -> Self:
        """Choose what is done about the incident of that element, or the one that opened first."""
        incidents = self.run.state.incidents
        named = [each.id for each in incidents.values() if incident in ("", each.token.node.id)]
        number = named[0] if named else incident
        return self.give(i.ResolveIncident(number, i.IncidentChoice(choice), "ops", **options))

    def complete(self, element: str, **data: Value) -> Self:
        return self.give(i.ServiceCompleted(self.service(element), data))

    def fail(self, element: str, code: str) -> Self:
        return self.give(i.ServiceFailed(self.service(element), code))

    def signal(self, name: str, data: dict[str, Value] | None = None) -> Self:
        return self.give(i.SignalReceived(name, data or {}))

    def message(self, name: str, data: dict[str, Value] | None = None) -> Self:
        return self.give(i.MessageReceived(name, data or {}))

    def fault(self, resource: str, code: str = "LINK_LOST", *, reachable: bool = True) -> Self:
        return self.give(i.ResourceFault(resource, code, reachable=reachable))

    def pause(self) -> Self:
        return self.give(i.PauseRun("ops"))

    def resume(self) -> Self:
        return self.give(i.ResumeRun("ops"))

    def stop(self) -> Self:
        return self.give(i.StopRun("ops"))

    def plan(self, text: str, *adjustable: str, **moves: str) -> RevisionPlan:
        """The plan of a revision to the mission that `text` says; `adjustable`: behaviors whose
        arbiters can change their speed."""
        return plan_revision(self.run.state, mission(text), moves, self.now_us, adjustable)

    def revise(self, text: str, *adjustable: str, **moves: str) -> Self:
        """Revise the run to the mission that `text` says, by the plan of this moment."""
        new = mission(text)
        plan = self.plan(text, *adjustable, **moves)
        assert not plan.refusals, plan.refusals
        item = i.Revise(
            plan.version,
            "new.bpmn",
            new.source,
            plan.digest,
            moves=moves,
            by="ops",
            adjustable=adjustable,
        )
        return self.give(item)

    def advance(self, seconds: float) -> Self:
        """Let time pass; every timer fires when it is due."""
        until_us = self.now_us + round(seconds * SECOND_US)
        while (due_us := self.run.next_due_us) is not None and due_us <= until_us:
            self.now_us = max(self.now_us, due_us)
            self.give(i.Tick())
        self.now_us = until_us
        return self

    # --- what became of it ----------------------------------------------------------------------

    def records(self) -> Iterator[r.Record]:
        for step in self.steps:
            yield from step.records

    def commands(self) -> Iterator[Command]:
        for step in self.steps:
            yield from step.commands

    def trace(self, *words: str) -> list[str]:
        """Lines of the records since the last call; only those that begin with one of `words`."""
        lines = [line(record) for record in self.records()]
        new, self._traced = lines[self._traced :], len(lines)
        return [each for each in new if not words or each.split()[0] in words]

    def entered(self) -> str:
        """The elements that tokens have entered since the last look."""
        return " ".join(each.removeprefix("enter ") for each in self.trace("enter"))

    def orders(self) -> list[str]:
        """Lines of the commands since the last call."""
        lines = [line(command) for command in self.commands()]
        new, self._commanded = lines[self._commanded :], len(lines)
        return new

    @property
    def at(self) -> str:
        """Where tokens are, innermost only, in the order of their last moves."""
        tokens = self.run.state.tokens.values()
        return " ".join(token.node.id for token in tokens if token.inner is None)

    @property
    def data(self) -> dict[str, Value]:
        """The data of the process that the run began with."""
        root = self.run.state.root
        assert root is not None
        return root.data

    @property
    def ended(self) -> str:
        """How the run has ended; "" while it has not."""
        outcome = self.run.state.outcome
        return outcome.value if outcome is not None else ""

    @property
    def detail(self) -> str:
        return self.run.state.detail

    def behavior(self, element: str) -> Behavior:
        """The behavior of that number, or of a task: one that runs before one being cancelled."""
        found = [
            behavior
            for behavior in self.run.state.behaviors.values()
            if element in (behavior.element, behavior.id.rpartition(".")[2])
        ]
        found.sort(key=lambda behavior: behavior.phase is BehaviorPhase.CANCELLING)
        assert found, f"{element} commands nothing: {list(self.run.state.behaviors)}"
        return found[0]

    def service(self, element: str) -> str:
        for service in self.run.state.services.values():
            if service.token.node.id == element:
                return service.id
        raise AssertionError(f"{element} runs no service")

    def ignored(self) -> str:
        """Why the last input changed nothing; asserts that it did not."""
        record = self.steps[-1].records
        assert [type(each) for each in record] == [r.InputIgnored], record
        assert isinstance(record[0], r.InputIgnored)
        return record[0].reason

    # --- what holds for every play ----------------------------------------------------------------

    def verify(self) -> None:
        """The journal alone rebuilds the state; the same inputs lead to the same records."""
        state = self.run.state
        check_state(state)
        replayed = MissionRun(self.mission, self.fleet, "r1", self._batch)
        decided = MissionRun(self.mission, self.fleet, "r1", self._batch)
        for step in self.steps:
            entry = Entry("r1", 1, step.seq, step.at_us, step.t_us, step.input, tuple(step.records))
            item, records = decode_body(encode_body(entry))
            replayed.replay(records, item)
            again = decided.receive(item, step.at_us)
            assert list(again.records) == list(step.records)
            assert list(again.commands) == list(step.commands)
        assert snapshot(replayed.state) == snapshot(state)
        assert replayed.outstanding() == self.run.outstanding()
        assert replayed.next_due_us == self.run.next_due_us
        kinds = [type(record) for record in self.records()]
        after_end = kinds[kinds.index(r.RunEnded) + 1 :] if r.RunEnded in kinds else []
        allowed = {r.BehaviorProgressed, r.BehaviorEnded, r.InputIgnored, r.RunClaimed}
        allowed |= {r.RequirementDecided, r.RequirementLeftOpen}
        assert set(after_end) <= allowed
        if state.status is RunStatus.RUNNING and not self.run.wants_continue:
            assert self.awaits(), "the run goes on and waits for nothing"

    def awaits(self) -> bool:
        """Whether anything from outside can still move a token."""
        state = self.run.state
        return bool(
            len(state.waits) > len(state.conditions)
            or state.allocations
            or state.prompts
            or state.services
            or state.incidents
            or any(token.behavior for token in state.tokens.values())
        )
