"""Conformance run: the engine executes a counterexample step by step.

    run = ConformanceRun(mission, fleet, process, data, steps=steps)
    for step in steps:                # steps of a report as data (m2pem.verify.report.run_steps)
        run.play(step)
    run.undone                        # sequence flows that the net took and the engine did not

Each step that comes from outside becomes an input of the engine. The internal steps are not played:
the run compares them with what the engine does by itself. Where the mission leaves open what
happens, the engine does what the run does: a gateway without conditions takes the flows of the run,
and `data_for` finds data for conditions on what nothing in the mission writes.
"""

from collections import Counter, deque
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from itertools import combinations, islice, product
from typing import Any

from m2pem.engine import inputs as i
from m2pem.engine import records as r
from m2pem.engine.arming import definition_of
from m2pem.engine.data import reader
from m2pem.engine.keeping import may_use
from m2pem.engine.run import MissionRun, Step
from m2pem.engine.state import (
    AllocationRequest,
    BehaviorPhase,
    RunState,
    RunStatus,
    Scope,
    Token,
    Wait,
)
from m2pem.engine.steps import Steps
from m2pem.engine.triggering import arm_event_subprocesses, take_kept_messages
from m2pem.errors import ExpressionError
from m2pem.fleet.fleet import Fleet
from m2pem.fleet.space import without_space
from m2pem.mission.catalogue import BehaviorState, ResourceId
from m2pem.mission.elements import ExclusiveGateway, FlowNode, InclusiveGateway, SequenceFlow
from m2pem.mission.expression import Expression
from m2pem.mission.losses import LINK_LOST, UNAVAILABLE
from m2pem.mission.mission import Mission
from m2pem.mission.values import ReadValue, Value
from m2pem.verify.net import choices
from m2pem.verify.net.petri_net import REASSIGNED, Action, Trigger
from m2pem.verify.translate.domains import constants, representatives
from m2pem.verify.translate.participants import untriggered
from m2pem.verify.translate.pools import candidates_of
from m2pem.verify.translate.sequence_flows import is_free_choice
from m2pem.verify.translate.space import SpacePlan, space_plan
from m2pem.verify.translate.ways import KnownWays

_SECOND_US = 1_000_000
_START_US = 1_767_225_600 * _SECOND_US  # 2026-01-01, as of rehearsals
_MOST_TIMERS = 1_000
"""Most other timers that may fire before the timer of a step."""
_BY = "counterexample"
_BATCH = 250
_MOST_BATCHES = 20
_MOST_TOKENS = 200
"""Batches of steps, and tokens then, after which a run counts as one that never waits."""


class NotPlayableError(Exception):
    """The engine is not in the state of the run, or something in the run cannot be
    brought about.
    """


class _StepsWithOpenConditions(Steps):
    """Steps of a run into which data of unknown origin may still be written.

    `choices`: by element, the sequence flows by which its next tokens leave, where neither the
    mission nor its data decides; `made`: names of the data that was written for that; `followed`:
    names of data that is never written for that. `together`: the processes that are still to begin,
    with the run.
    """

    __slots__ = ("choices", "followed", "made", "together")

    def __init__(
        self,
        state: RunState,
        fleet: Fleet | None,
        choices: Mapping[str, deque[tuple[str, ...]]],
        together: Sequence[str],
        followed: Collection[str],
    ) -> None:
        super().__init__(state, fleet, _BATCH)
        self.choices = choices
        self.followed = followed
        self.made: set[str] = set()
        self.together = [self.mission.process(each) for each in together]

    def finish(self) -> list[r.Record]:
        """Begin first what begins with the run."""
        while self.together and self.state.status is RunStatus.RUNNING:
            process, number = self.together.pop(0), self.state.last_scope + 1
            self.emit(r.ScopeOpened(number, process.id, process.id))
            scope = self.state.scopes[number]
            if arm_event_subprocesses(self, scope):
                for entry in untriggered(process):
                    self.spawn(entry, scope)
                take_kept_messages(self, scope)
        return super().finish()

    def emit(self, record: r.Record) -> None:
        super().emit(record)
        if isinstance(record, r.FlowTaken):
            flow = self.mission.elements[record.flow]
            assert isinstance(flow, SequenceFlow)
            if chosen := self.choices.get(flow.target.id):
                self._decide(flow.target, self.state.scopes[record.scope], chosen[0])

    def proceed(self, token: Token, flows: Iterable[SequenceFlow], reason: str = "") -> None:
        """Leave by the flows of the run, where the mission leaves that open."""
        node = token.node
        chosen = self.choices.get(node.id)
        if chosen:
            taken = chosen.popleft()
            if isinstance(node, ExclusiveGateway | InclusiveGateway) and is_free_choice(node):
                flows = [flow for flow in node.outgoing if flow.id in taken]
        super().proceed(token, flows, reason)

    def _decide(self, node: FlowNode, scope: Scope, taken: tuple[str, ...]) -> None:
        """Write data that nothing in the mission writes, so that a token leaves by these flows."""
        wanted: list[tuple[Expression, bool]] = []
        for flow in node.outgoing:
            if flow.condition is not None and flow is not getattr(node, "default", None):
                wanted.append((flow.condition, flow.id in taken))
                if flow.id in taken and isinstance(node, ExclusiveGateway):
                    break
        read = reader(scope)
        names = {name for condition, _ in wanted for name in condition.names}
        known = {
            name for name in names - self.made if name in self.followed or read(name) is not None
        }
        if data := data_for(wanted, read, known):
            self.made.update(data)
            self.write_in(scope, node, dict(data))

    def _fail_if_stuck(self) -> None:
        """A run that waits for a condition is not stuck: the condition may become true."""
        if not self.state.conditions:
            super()._fail_if_stuck()


class _Run(MissionRun):
    """A run into which data can be written that nothing in the mission writes.

    The net lets a condition on such data become true at any time.
    """

    def __init__(
        self,
        mission: Mission,
        fleet: Fleet | None,
        choices: Mapping[str, deque[tuple[str, ...]]],
        together: Sequence[str],
        followed: Collection[str],
    ) -> None:
        super().__init__(mission, fleet, "r1")
        self._x = _StepsWithOpenConditions(self.state, fleet, choices, together, followed)

    def write(self, wait: Wait, data: dict[str, Value], now_us: int) -> Step:
        """Write data where an element waits for a condition that reads it."""
        x = self._x
        seq, t_us = self.state.seq + 1, self.state.mission_time_us(now_us)
        x.begin(now_us)
        x.write_in(wait.scope, wait.node, data)
        return Step(i.Continue(), now_us, t_us, seq, x.finish(), ())


class ConformanceRun:
    """A run of the engine that follows a run of the net. `steps` has all that it did."""

    def __init__(
        self,
        mission: Mission,
        fleet: Fleet | None,
        process: str,
        data: Mapping[str, Value] | None = None,
        ways: KnownWays | None = None,
        steps: Sequence[Mapping[str, Any]] = (),
        together: Sequence[str] = (),
        followed: Collection[str] = (),
    ) -> None:
        """`ways`: those with which the net was made. `steps`: those that are going to be played.
        `together`: processes that begin with the run, as other runs never do. `followed`: names
        whose values the net follows.
        """
        self._space: SpacePlan | None = None
        if fleet is not None and fleet.shared_space:
            candidates = candidates_of(mission, fleet, None)
            self._space = space_plan(mission, mission.process(process), fleet, candidates, ways)
        if fleet is not None:
            fleet = without_space(fleet) if self._space is None else self._space.fleet
        self.run = _Run(mission, fleet, _choices(mission, steps), together, followed)
        self.steps: list[Step] = []
        self._now_us = _START_US
        self._reports: Counter[str] = Counter()
        self._expected: Counter[str] = Counter()
        self._give(i.StartRun(process, dict(data or {}), _BY))

    def play(self, step: Mapping[str, Any]) -> Sequence[Step]:
        """Bring a step about, and return what the engine did then.

        Raises:
            NotPlayableError: the step cannot be brought about here.
        """
        before = len(self.steps)
        trigger = step["trigger"]
        if trigger is not None:
            self._now_us += _SECOND_US
            self._bring_about(Trigger(trigger), step)
        for action in step["actions"]:
            if action["action"] == Action.ALLOCATED:
                self._allocate(action["element"], action["detail"])
            if action["action"] == Action.REFUSED:
                self._refuse_space(action["element"], action["detail"])
            if action["action"] == "taken":
                self._expected[action["element"]] += 1
        return self.steps[before:]

    @property
    def undone(self) -> list[str]:
        """Sequence flows that the run takes more often than the engine did."""
        taken = Counter(
            record.flow
            for step in self.steps
            for record in step.records
            if isinstance(record, r.FlowTaken)
        )
        return sorted((self._expected - taken).keys())

    @property
    def completed(self) -> bool:
        """Whether the run of the engine has completed."""
        return self.run.state.outcome is r.RunOutcome.COMPLETED

    @property
    def where(self) -> list[str]:
        """Elements with a token now."""
        return sorted(token.node.id for token in self.run.state.tokens.values())

    # --- inputs ---------------------------------------------------------------------------------

    def _bring_about(self, trigger: Trigger, step: Mapping[str, Any]) -> None:
        element, detail = step["element"], step["detail"]
        match trigger:
            case Trigger.SUCCEEDS | Trigger.FAILS:
                self._end_work(
                    element, "" if trigger is Trigger.SUCCEEDS else detail, step["writes"]
                )
            case Trigger.ANSWER:
                token = self._token(element, "prompt")
                self._give(i.PromptAnswer(token.prompt, detail, _BY))
            case Trigger.SIGNAL:
                self._give(i.SignalReceived(detail, step["writes"], _BY))
            case Trigger.MESSAGE:
                self._give(i.MessageReceived(detail, step["writes"], _BY))
            case Trigger.TIMER:
                self._time_is_up(element)
            case Trigger.CONDITION:
                self._come_true(element, step["data"])

    def _allocate(self, element: str, detail: str) -> None:
        """Answer the request of a task for resources as the allocator does in the step."""
        request = self._request(element)
        if request is None:
            raise NotPlayableError(f"{element} asks for no resources in the engine now")
        if not detail:
            self._give(i.ResourcesNotFree(request.id, "too few are free", {}, UNAVAILABLE))
            return
        chosen: dict[str, tuple[str, ...]] = {}
        given: set[str] = set()
        token = request.token
        for role, places in choices.read(detail).items():
            for filling in places:
                unused = [each for each in filling.resources if each not in given]
                free = next((r for r in unused if self._is_free(token, r, filling.kept)), None)
                if free is None:
                    names = " and ".join(filling.resources)
                    raise NotPlayableError(f"{names} are not free in the engine now")
                given.add(free)
                chosen[role] = (*chosen.get(role, ()), free)
        self._give(i.ResourcesChosen(request.id, chosen, {"roles": {}, "together_with": []}))

    def _request(self, element: str) -> AllocationRequest | None:
        asked = self.run.state.allocations.values()
        return next((each for each in asked if each.token.node.id == element), None)

    def _refuse_space(self, element: str, space: str) -> None:
        """A shared space is full: a request ends; a behavior begins, and is rejected later."""
        request = self._request(element)
        if request is not None:
            self._give(i.ResourcesNotFree(request.id, f"{space} is full", {}, "REJECTED"))

    def _is_free(self, token: Token, resource: str, kept: str) -> bool:
        """Whether no task has a resource, and it is kept for a task until `kept` ends; "": is not
        kept."""
        state = self.run.state
        holders = [state.behaviors[each] for each in state.held.get(ResourceId(resource), ())]
        if any(each.phase is not BehaviorPhase.CANCELLING for each in holders):
            return False
        keeping = state.kept.get(resource)
        if keeping is None or not kept:
            return keeping is None and not kept
        owner = keeping.until.owner
        ends = {keeping.until.container.id, *(() if owner is None else (owner.node.id,))}
        return kept in ends and may_use(keeping, token)

    def _end_work(self, element: str, code: str, writes: Mapping[str, Any]) -> None:
        token = self._token(element, "behavior", "service", "prompt")
        if token.service and not code:
            self._give(i.ServiceCompleted(token.service, dict(writes)))
        elif token.service:
            self._give(i.ServiceFailed(token.service, code))
        elif token.behavior:
            state = BehaviorState.FAILED if code else BehaviorState.SUCCEEDED
            code_or_loss = LINK_LOST if code == REASSIGNED else code
            self._report(token.behavior, state, code_or_loss, {} if code else writes)
            if code != REASSIGNED and (found := self.run.state.tokens.get(token.id)) is not None:
                self._refuse_rest(found)
        else:
            self._time_is_up(element)  # a prompt fails only when its time is up

    def _refuse_rest(self, token: Token) -> None:
        """No other does what is left of a behavior that was lost: its error is thrown."""
        if token.allocation and token.lost_work is not None:
            self._give(i.ResourcesNotFree(token.allocation, "too few are free", {}, UNAVAILABLE))

    def _report(
        self,
        behavior: str,
        state: BehaviorState,
        code: str = "",
        outputs: Mapping[str, Value] | None = None,
    ) -> None:
        self._reports[behavior] += 1
        number, written = self._reports[behavior], dict(outputs or {})
        self._give(i.BehaviorReported(behavior, number, state, code, outputs=written))

    def _time_is_up(self, element: str) -> None:
        request = self._request(element)
        if request is not None and not request.deadline and self._space is not None:
            wait_s = self._space.wait_s()
            self._give(i.ResourcesNotFree(request.id, "no space", {}, wait_s=wait_s))
        for _ in range(_MOST_TIMERS):
            due = self.run.next_due_us
            if due is None:
                break
            self._now_us = max(self._now_us, due)
            if self._fires(self._give(i.Tick()), element):
                return
        raise NotPlayableError(f"no timer of {element} runs in the engine")

    def _come_true(self, element: str, data: Mapping[str, Value]) -> None:
        """Write data that makes the condition of an element true: nothing else does."""
        state = self.run.state
        for number, wait in list(state.waits.items()):
            if number not in state.conditions or wait.node.id != element:
                continue
            before = [] if state.conditions[number] else [False]  # it must be seen false first
            for truth in [*before, True]:
                read = reader(wait.token or wait.scope)
                known = {key for name in data for key in _endings(name)}
                values = data_for([(definition_of(wait).condition, truth)], read, known)
                if values is None:
                    raise NotPlayableError(f"no data was found for the condition of {element}")
                steps = self._after(self.run.write(wait, dict(values), self._now_us))
            if self._fires(steps, element):
                return
        where = ", ".join(self.where) or "nowhere"
        raise NotPlayableError(f"no condition of {element} is awaited now: tokens are {where}")

    def _fires(self, steps: Sequence[Step], element: str) -> bool:
        return any(
            getattr(record, "element", "") == element for step in steps for record in step.records
        )

    def _give(self, item: i.Input) -> Sequence[Step]:
        return self._after(self.run.receive(item, self._now_us))

    def _after(self, step: Step) -> Sequence[Step]:
        """Return the steps after an input."""
        item = step.input
        before = len(self.steps)
        self.steps.append(step)
        for _ in range(_MOST_BATCHES):
            if not self.run.wants_continue or len(self.run.state.tokens) > _MOST_TOKENS:
                break
            self.steps.append(self.run.receive(i.Continue(), self._now_us))
        if not isinstance(item, i.BehaviorReported) or item.state is not BehaviorState.CANCELLED:
            self._end_cancelled()
        return self.steps[before:]

    def _end_cancelled(self) -> None:
        """End cancelled behaviors: vehicles obey at once."""
        for behavior in [*self.run.state.behaviors.values()]:
            if behavior.phase is BehaviorPhase.CANCELLING:
                self._report(behavior.id, BehaviorState.CANCELLED)

    def _token(self, element: str, *works: str) -> Token:
        if self.run.state.status is RunStatus.ENDED:
            raise NotPlayableError(f"the engine's run is over before {element} goes on")
        for token in self.run.state.tokens.values():
            if token.node.id == element and any(getattr(token, work) for work in works):
                return token
        where = ", ".join(self.where) or "nowhere"
        raise NotPlayableError(f"{element} does not work in the engine now: its tokens are {where}")


def _choices(
    mission: Mission, steps: Sequence[Mapping[str, Any]]
) -> dict[str, deque[tuple[str, ...]]]:
    """Return by which flows the tokens of each element leave, one after the other; by none, where
    it has none that is true."""
    found: dict[str, deque[tuple[str, ...]]] = {}
    for step in steps:
        before = ""
        for action in step["actions"]:
            element = mission.elements.get(action["element"])
            if action["action"] == Action.TAKEN and isinstance(element, SequenceFlow):
                source, taken = element.source.id, found.setdefault(element.source.id, deque())
                rest = taken.pop() if before == source else ()
                taken.append((*rest, element.id))
                before = source
                continue
            before = ""
            if action["action"] == Action.THROWN and action["detail"] == "NO_FLOW":
                found.setdefault(action["element"], deque()).append(())
    return found


def _endings(name: str) -> set[str]:
    """A name with the calls that it is in before it, and without each of them."""
    parts = name.split(".")
    return {".".join(parts[at:]) for at in range(len(parts))}


_MOST_TRIES = 20_000
_ORDINARY: tuple[Value, ...] = (True, False, 1, 0, -1, 2, None, "something", [])
"""Values that are tried besides those that a condition compares with."""


def data_for(
    wanted: Sequence[tuple[Expression, bool]], read: ReadValue, known: Collection[str] = ()
) -> Mapping[str, Value] | None:
    """The fewest values to write for conditions to have their truths; None: none were found.

    `read`: the data that there is. `known`: names that keep their values.
    """
    names = {name for condition, _ in wanted for name in condition.names}
    compared: dict[str, set[tuple[str, Value]]] = {}
    for condition, _ in wanted:
        for name, values in constants(condition).items():
            compared.setdefault(name, set()).update(values)
    for data in islice(_changes(compared, sorted(names - set(known))), _MOST_TRIES):

        def with_changes(name: str, data: Mapping[str, Value] = data) -> Value:
            return data[name] if name in data else read(name)

        try:
            if all(condition.holds(with_changes) is truth for condition, truth in wanted):
                return data
        except ExpressionError:
            continue
    return None


def _changes(
    compared: Mapping[str, Collection[tuple[str, Value]]], names: list[str]
) -> Iterator[dict[str, Value]]:
    """Every choice of values, those that change the fewest names first."""
    tried: dict[str, list[Value]] = {}
    for name in names:
        alike = representatives(compared[name]) if name in compared else []
        tried[name] = [*(value for value, _ in alike), *_ORDINARY]
    for count in range(len(names) + 1):
        for changed in combinations(names, count):
            for values in product(*(tried[name] for name in changed)):
                yield dict(zip(changed, values, strict=True))
