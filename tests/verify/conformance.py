"""Playing a run of the net to the engine: which inputs make it happen, and whether they do.

played = play(mission, fleet, net, run)
played.inputs        # one for each transition that comes from outside
played.agrees        # whether the engine came along all the way
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from m2pem.engine import inputs as i
from m2pem.engine.run import MissionRun, Step
from m2pem.engine.state import BehaviorPhase, RunState, RunStatus
from m2pem.fleet.fleet import Fleet
from m2pem.mission.catalogue import BehaviorState
from m2pem.mission.mission import Mission
from m2pem.mission.values import Value
from m2pem.verify.net.petri_net import Action, Kind, PetriNet, Transition, Trigger
from tests.verify.trace_mapping import Follower

START_US = 1_767_225_600_000_000
"""When a run is played: 2026-01-01T00:00:00Z, in microseconds since the Unix epoch."""
_MOST_CONTINUES = 100
_MOST_TOKENS = 200
_MOST_TRIES = 50
"""With more, a run that does not wait is one that never will."""


@dataclass(frozen=True, slots=True)
class Played:
    """`inputs` with their times (microseconds since the Unix epoch), and what came of them.

    `stopped`: why the engine could not come along, "" when it did. A condition that the transitions
    cannot follow, and timers out of the order of their times, cannot be made to happen.
    """

    inputs: tuple[tuple[int, i.Input], ...]
    steps: tuple[Step, ...]
    stopped: str

    @property
    def agrees(self) -> bool:
        """Whether the engine went the whole way."""
        return not self.stopped


def play(
    mission: Mission,
    fleet: Fleet | None,
    net: PetriNet,
    run: Sequence[int],
    data: Mapping[str, Value] | None = None,
) -> Played:
    """Play the transitions of a run, one after the other, to a new run of the engine.

    Where a transition fits several inputs, such as one of two prompts of a task, each is tried.
    """
    first: Played | None = None
    waiting: list[list[int]] = [[]]  # which of the inputs that fit was given, each time
    for _ in range(_MOST_TRIES):
        chosen = waiting.pop()
        played, fitted = _play(mission, fleet, net, run, data, chosen)
        if played.agrees:
            return played
        first = first or played
        for place in range(len(chosen), len(fitted)):
            more = [*chosen, *[0] * (place - len(chosen))]
            waiting += [[*more, other] for other in range(fitted[place] - 1, 0, -1)]
        if not waiting:
            break
    assert first is not None
    return first


def _play(
    mission: Mission,
    fleet: Fleet | None,
    net: PetriNet,
    run: Sequence[int],
    data: Mapping[str, Value] | None,
    chosen: Sequence[int],
) -> tuple[Played, list[int]]:
    """What came of it, and how many inputs fitted each time."""
    fitted: list[int] = []
    engine = MissionRun(mission, fleet, "r1", 200)
    follower = Follower(net)
    inputs: list[tuple[int, i.Input]] = []
    steps: list[Step] = []
    now_us = START_US

    def give(item: i.Input) -> bool:
        inputs.append((now_us, item))
        steps.append(engine.receive(item, now_us))
        for _ in range(_MOST_CONTINUES):
            if not engine.wants_continue or len(engine.state.tokens) > _MOST_TOKENS:
                break
            steps.append(engine.receive(i.Continue(), now_us))
        return follower.step(engine.state)

    def stopped(why: str) -> tuple[Played, list[int]]:
        return Played(tuple(inputs), tuple(steps), why), fitted

    if not give(i.StartRun(net.process, dict(data or {}))):
        return stopped("the engine begins otherwise")
    for number in run:
        transition = net.transitions[number]
        if transition.kind is not Kind.EXTERNAL:
            continue
        if engine.state.status is RunStatus.ENDED:
            return stopped(f"the run is over before {transition.name}")
        now_us += 1  # no two timers are due at one moment
        if transition.trigger is Trigger.TIMER:
            due_us = _due_us(engine.state, transition)
            if due_us is None:
                return stopped(f"no timer of {transition.element} runs")
            now_us = max(now_us, due_us)
        items = [*_inputs(net, transition, engine.state)]
        if not items:
            return stopped(f"nothing makes {transition.name} happen")
        choice = chosen[len(fitted)] if len(fitted) < len(chosen) else 0
        fitted.append(len(items))
        if not give(items[choice]):
            return stopped(f"the engine goes another way at {transition.name}")
    return stopped("")


def _due_us(state: RunState, transition: Transition) -> int | None:
    elements = {step.element for step in transition.steps[:1]}
    elements |= {step.element for step in transition.steps if step.action is Action.TRIGGERED}
    offset_us = state.started_us + state.paused_total_us
    due = [
        wait.due_us if wait.calendar else wait.due_us + offset_us
        for wait in state.waits.values()
        if wait.trigger.value == "timer" and wait.node.id in elements
    ]
    return min(due, default=None)


def _inputs(net: PetriNet, transition: Transition, state: RunState) -> Iterator[i.Input]:
    element = transition.element
    match transition.trigger:
        case Trigger.ANSWER:
            for prompt in state.prompts.values():
                if prompt.token.node.id == element:
                    yield i.PromptAnswer(prompt.id, transition.detail, "verify")
        case Trigger.SUCCEEDS | Trigger.FAILS:
            yield from _reports(net, transition, state)
        case Trigger.TIMER:
            yield i.Tick()
        case Trigger.SIGNAL:
            yield i.SignalReceived(transition.detail, by="verify")
        case Trigger.MESSAGE:
            yield i.MessageReceived(transition.detail, by="verify")
        case _:
            pass


def _reports(net: PetriNet, transition: Transition, state: RunState) -> Iterator[i.Input]:
    well = transition.trigger is Trigger.SUCCEEDS
    for behavior in state.behaviors.values():
        if behavior.element == transition.element and behavior.phase is BehaviorPhase.ACTIVE:
            yield i.BehaviorReported(
                behavior.id,
                behavior.number + 1,
                BehaviorState.SUCCEEDED if well else BehaviorState.FAILED,
                "" if well else transition.detail,
                outputs=_written(net, transition) if well else {},
            )
    for service in state.services.values():
        if service.token.node.id == transition.element:
            if well:
                yield i.ServiceCompleted(service.id, _written(net, transition))
            else:
                yield i.ServiceFailed(service.id, transition.detail)


def _written(net: PetriNet, transition: Transition) -> dict[str, Value]:
    return {
        net.variables[variable].key: net.variables[variable].values[value]
        for variable, value in transition.assign
    }
