"""What signals and messages bring is written where the engine writes it."""

import pytest

from m2pem.engine.inputs import Input
from m2pem.fleet.default_fleet import fleet_for
from m2pem.mission.mission import Mission
from m2pem.verify.net.petri_net import PetriNet
from m2pem.verify.search.explore import Limits, explore
from m2pem.verify.translate import Options, translate
from tests.engine.notation import mission
from tests.engine.test_data_flow import into, out_of
from tests.verify.models import Walk
from tests.verify.test_spin_agreement import same

OUTPUT = f'<dataOutput id="o" name="v"/>{out_of("o", "answer")}'
CONSTANT = "<transformation>2</transformation>"


def sends(name: str, inside: str = "") -> str:
    return f'<dataInput id="i" name="{name}"/>{into("speed", "i", inside)}'


SIGNAL = """
<dataObject id="speed"/><dataObject id="answer"/>
<startEvent id="s"/><scriptTask id="set">answer = 1; speed = 2</scriptTask>
<parallelGateway id="fork"/><userTask id="wait">ask on</userTask>
<intermediateThrowEvent id="throw">{}<signalEventDefinition signalRef="S"/></intermediateThrowEvent>
<intermediateCatchEvent id="catch">{}<signalEventDefinition signalRef="S"/></intermediateCatchEvent>
<exclusiveGateway id="which" default="no"/><endEvent id="e"/>
<endEvent id="two"/><endEvent id="other"/>
s -> set -> fork -> wait -> throw -> e
fork -> catch -> which -> two if answer == 2
no: which -> other
"""
BOUNDARY = """
<dataObject id="speed"/><dataObject id="answer"/>
<startEvent id="s"/><scriptTask id="set">answer = 1; speed = 2</scriptTask>
<parallelGateway id="fork"/><userTask id="wait">ask on</userTask>
<intermediateThrowEvent id="throw">{}<signalEventDefinition signalRef="S"/></intermediateThrowEvent>
<userTask id="ask">ask on</userTask><endEvent id="e"/><endEvent id="e2"/>
<boundaryEvent id="catch" attachedToRef="ask">{}<signalEventDefinition signalRef="S"/>
</boundaryEvent>
<exclusiveGateway id="which" default="no"/><endEvent id="two"/><endEvent id="other"/>
s -> set -> fork -> wait -> throw -> e
fork -> ask -> e2
catch -> which -> two if answer == 2
no: which -> other
"""
HANDLER = """
<dataObject id="speed"/><dataObject id="answer"/>
<startEvent id="s"/><scriptTask id="set">answer = 1; speed = 2</scriptTask>
<userTask id="wait">ask on</userTask>
<intermediateThrowEvent id="throw">{}<signalEventDefinition signalRef="S"/></intermediateThrowEvent>
<endEvent id="e"/>
<subProcess id="handler" triggeredByEvent="true">
  <startEvent id="catch">{}<signalEventDefinition signalRef="S"/></startEvent>
  <exclusiveGateway id="which" default="no"/><endEvent id="two"/><endEvent id="other"/>
  catch -> which -> two if answer == 2
  no: which -> other
</subProcess>
s -> set -> wait -> throw -> e
"""
PROCESS = """
<process id="MAIN"><dataObject id="speed"/>
<startEvent id="s"/><scriptTask id="set">speed = 2</scriptTask>
<intermediateThrowEvent id="throw">{}<messageEventDefinition messageRef="M"/>
</intermediateThrowEvent><endEvent id="e"/>
s -> set -> throw -> e
</process>
<process id="OTHER"><dataObject id="answer"/>
<startEvent id="catch">{}<messageEventDefinition messageRef="M"/></startEvent>
<exclusiveGateway id="which" default="no"/><endEvent id="two"/><endEvent id="other"/>
catch -> which -> two if answer == 2
no: which -> other
</process>
"""
RECEIVED = """
<dataObject id="speed"/><dataObject id="answer"/>
<startEvent id="s"/><scriptTask id="set">answer = 1; speed = 2</scriptTask>
<parallelGateway id="fork"/><userTask id="wait">ask on</userTask>
<sendTask id="throw" messageRef="M"><ioSpecification>{}</ioSpecification>{}</sendTask>
<receiveTask id="catch" messageRef="M"/>
<exclusiveGateway id="which" default="no"/><endEvent id="e"/>
<endEvent id="two"/><endEvent id="other"/>
s -> set -> fork -> wait -> throw -> e
fork -> catch -> which -> two if answer == 2
no: which -> other
""".format('<dataInput id="i" name="answer"/>', into("speed", "i"))
EVENTS = {"catch": SIGNAL, "boundary": BOUNDARY, "handler": HANDLER, "process": PROCESS}


def ends(net: PetriNet) -> set[str]:
    found = explore(net, Limits(tokens=3))
    steps = {
        step.element for transition in found.fired for step in net.transitions[transition].steps
    }
    return steps & {"two", "other"}


def followed(read: Mission) -> PetriNet:
    """Its transitions, which can do what the engine does."""
    net = translate(read)
    for seed in range(6):
        assert WithoutSignals(read, fleet_for(read), net, seed).go() == ""
    return net


class WithoutSignals(Walk):
    """Nothing is received but what the mission sends itself."""

    def things(self) -> list[Input]:
        return [each for each in super().things() if not type(each).__name__.endswith("Received")]


@pytest.mark.parametrize("text", EVENTS.values(), ids=EVENTS)
@pytest.mark.parametrize(
    ("sent", "caught"), [(sends("v"), OUTPUT), (sends("answer"), "")], ids=["outputs", "names"]
)
def test_what_is_sent_changes_what_the_catcher_reads(text: str, sent: str, caught: str) -> None:
    assert "two" in ends(followed(mission(text.format(sent, caught))))


@pytest.mark.parametrize("text", EVENTS.values(), ids=EVENTS)
@pytest.mark.parametrize(
    ("sent", "caught"),
    [(sends("v", CONSTANT), OUTPUT), (sends("answer", CONSTANT), "")],
    ids=["outputs", "names"],
)
def test_a_constant_that_is_sent_is_followed(text: str, sent: str, caught: str) -> None:
    read = mission(text.format(sent, caught))
    net = followed(read)
    assert ends(net) == {"two"}
    assert not [a for a in net.approximations if "values" in a.what]
    same(net)


def test_what_brings_nothing_changes_nothing() -> None:
    assert ends(followed(mission(SIGNAL.format("", "")))) == {"other"}


def test_a_receive_task_gets_what_a_send_task_sends() -> None:
    assert "two" in ends(followed(mission(RECEIVED)))


def test_what_comes_from_outside_may_bring_anything_that_is_named() -> None:
    constant = mission(SIGNAL.format(sends("v", CONSTANT), OUTPUT))
    assert ends(translate(constant, options=Options(open_world=True))) == {"two", "other"}
