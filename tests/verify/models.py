"""Missions for the tests of verification, and engine runs that random numbers drive."""

from random import Random

from m2pem.bpmn import parse_mission
from m2pem.engine import inputs as i
from m2pem.engine.elements.behaviors import BRINGS_DOWN
from m2pem.engine.run import MissionRun
from m2pem.engine.state import BehaviorPhase, RunStatus
from m2pem.fleet.fleet import Fleet
from m2pem.mission.catalogue import BehaviorState
from m2pem.mission.mission import Mission
from m2pem.verify.net.petri_net import PetriNet
from tests.verify.allocator import Allocator
from tests.verify.conformance import START_US
from tests.verify.trace_mapping import Follower, look_of_run

CODES = ("FAILED", "LINK_LOST", "ROUTE_BLOCKED")


def branches(
    count: int, tasks: int = 3, *, interruptible: bool = False, error: bool = False
) -> Mission:
    """Parallel branches of user tasks, perhaps in a subprocess that a timer interrupts.

    `error`: another branch in there, of as many tasks, ends with an error that interrupts it.
    """
    body = [
        '<startEvent id="s"/><parallelGateway id="f"/><parallelGateway id="j"/><endEvent id="e"/>',
        '<sequenceFlow id="a0" sourceRef="s" targetRef="f"/>',
        '<sequenceFlow id="a1" sourceRef="j" targetRef="e"/>',
    ]
    for branch in range(count + error):
        before = "f"
        for task in range(tasks):
            name = f"t{branch}_{task}"
            body.append(
                f'<userTask id="{name}"><extensionElements><m2pem:prompt>?</m2pem:prompt>'
                f'<m2pem:decision value="ok" label="ok"/></extensionElements></userTask>'
                f'<sequenceFlow id="q{branch}_{task}" sourceRef="{before}" targetRef="{name}"/>'
            )
            before = name
        after = "j" if branch < count else "wrong"
        body.append(f'<sequenceFlow id="q{branch}_e" sourceRef="{before}" targetRef="{after}"/>')
    if error:
        body.append('<endEvent id="wrong"><errorEventDefinition/></endEvent>')
    inside = "".join(body)
    if interruptible or error:
        event = (
            "<errorEventDefinition/>"
            if error
            else "<timerEventDefinition><timeDuration>PT5M</timeDuration></timerEventDefinition>"
        )
        inside = (
            f'<startEvent id="S"/><subProcess id="SUB">{inside}</subProcess>'
            f'<boundaryEvent id="B" attachedToRef="SUB">{event}</boundaryEvent>'
            '<endEvent id="E"/><endEvent id="EB"/>'
            '<sequenceFlow id="w0" sourceRef="S" targetRef="SUB"/>'
            '<sequenceFlow id="w1" sourceRef="SUB" targetRef="E"/>'
            '<sequenceFlow id="w2" sourceRef="B" targetRef="EB"/>'
        )
    text = (
        '<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"'
        ' xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="x">'
        f'<process id="P" isExecutable="true">{inside}</process></definitions>'
    )
    return parse_mission(text.encode(), "branches.bpmn")


def unsafe(count: int) -> Mission:
    """Parallel branches of tasks, and one more in which tokens meet again unjoined and go round."""
    loop = (
        '<exclusiveGateway id="In"/><parallelGateway id="Out"/><exclusiveGateway id="Back"/>'
        '<sequenceFlow id="u0" sourceRef="f" targetRef="In"/>'
        '<sequenceFlow id="u1" sourceRef="In" targetRef="Again"/>'
        '<sequenceFlow id="u2" sourceRef="Again" targetRef="Out"/>'
        '<sequenceFlow id="u3" sourceRef="Out" targetRef="In"/>'
        '<sequenceFlow id="u4" sourceRef="Out" targetRef="Back"/>'
        '<sequenceFlow id="u5" sourceRef="Back" targetRef="In"/>'
        '<sequenceFlow id="u6" sourceRef="Back" targetRef="j"/>'
        '<userTask id="Again"><extensionElements><m2pem:prompt>?</m2pem:prompt>'
        '<m2pem:decision value="ok"/></extensionElements></userTask></process>'
    )
    text = branches(count).source.decode().replace("</process>", loop)
    return parse_mission(text.encode(), "unsafe.bpmn")


class Walk:
    """A run of the engine in which numbers choose what happens, followed by the net."""

    def __init__(
        self,
        mission: Mission,
        fleet: Fleet,
        net: PetriNet,
        seed: int,
        allocator: Allocator | None = None,
    ) -> None:
        """`allocator`: answers the requests of tasks for resources."""
        self.fleet = fleet
        self.run = MissionRun(mission, fleet, "r1")
        self.follower = Follower(net)
        self.process = net.process
        self.now_us = START_US
        self.dice = Random(seed)
        self.given: list[i.Input] = []
        self.allocator = allocator

    def give(self, item: i.Input) -> bool:
        """Whether the net can do what the engine has done."""
        self._receive(item)
        for _ in range(50):
            if self.allocator is None or self.run.wants_continue:
                break
            answer = self.allocator.answer(self.run)
            if answer is None:
                break
            self._receive(answer)
        return self.run.wants_continue or self.follower.step(self.run.state)

    def _receive(self, item: i.Input) -> None:
        self.given.append(item)
        self.run.receive(item, self.now_us)
        for _ in range(50):
            if not self.run.wants_continue:
                break
            self.run.receive(i.Continue(), self.now_us)

    def go(self, length: int = 25) -> str:
        """Where the net could not follow; "" if they always could."""
        agrees = self.give(i.StartRun(self.process))
        while agrees and len(self.given) < length and not self.run.wants_continue:
            things = self.things()
            if not things or self.run.state.status is RunStatus.ENDED:
                return ""
            item = self.dice.choice(things)
            if isinstance(item, i.Tick):
                assert self.run.next_due_us is not None
                self.now_us = max(self.now_us, self.run.next_due_us)
            agrees = self.give(item)
        if agrees:
            return ""
        state = self.run.state
        return f"{self.given}: {state.status} {state.detail} {dict(look_of_run(state))}"

    def things(self) -> list[i.Input]:
        """What could happen now."""
        state, dice = self.run.state, self.dice
        found: list[i.Input] = []
        for prompt in state.prompts.values():
            found += [i.PromptAnswer(prompt.id, d["value"]) for d in prompt.decisions]
        for behavior in state.behaviors.values():
            number = behavior.number + 1
            if behavior.phase is BehaviorPhase.CANCELLING:
                found.append(i.BehaviorReported(behavior.id, number, BehaviorState.CANCELLED))
                continue
            found.append(i.BehaviorReported(behavior.id, number, BehaviorState.SUCCEEDED))
            code = dice.choice(CODES)
            found.append(i.BehaviorReported(behavior.id, number, BehaviorState.FAILED, code))
            if self.fleet.preemption and behavior.name not in BRINGS_DOWN:
                taken = behavior.resources[-1]
                found.append(i.BehaviorPreempted(behavior.id, taken, "r2.a1", "another run"))
        for service in state.services.values():
            data = {"detection.type": dice.choice(["gpr", "other"])}
            found.append(i.ServiceCompleted(service.id, data if "Det" in service.name else {}))
            found.append(i.ServiceFailed(service.id, "FAILED"))
        for wait in state.waits.values():
            if wait.trigger.value == "signal":
                found.append(i.SignalReceived(wait.ref))
            elif wait.trigger.value == "message":
                found.append(i.MessageReceived(wait.ref))
        if self.run.next_due_us is not None:
            found.append(i.Tick())
        return found
