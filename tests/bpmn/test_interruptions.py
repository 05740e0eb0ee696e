"""What can interrupt the tokens of a container."""

from bpmn_text import definitions, load

from m2pem.bpmn.interruptions import Surroundings
from m2pem.mission.mission import Mission

TIMER = "<timerEventDefinition><timeDuration>PT1M</timeDuration></timerEventDefinition>"
TEXT = """
    <process id="OUTER" isExecutable="true"> <startEvent id="a"/>
      <callActivity id="call" calledElement="CALLED"/>
      <boundaryEvent id="late" attachedToRef="call">{timer}</boundaryEvent>
      <boundaryEvent id="reminder" attachedToRef="call" cancelActivity="false">{timer}
      </boundaryEvent>
      <sequenceFlow id="f" sourceRef="a" targetRef="call"/>
    </process>
    <process id="CALLED"> <startEvent id="b"/>
      <subProcess id="inner"> <task id="work"/> </subProcess>
      <boundaryEvent id="failed" attachedToRef="inner"><errorEventDefinition/></boundaryEvent>
      <subProcess id="stop" triggeredByEvent="true">
        <startEvent id="c">{timer}</startEvent> <task id="tidy"/>
        <sequenceFlow id="g" sourceRef="c" targetRef="tidy"/>
      </subProcess>
      <subProcess id="beside" triggeredByEvent="true">
        <startEvent id="d" isInterrupting="false">{timer}</startEvent>
      </subProcess>
      <sequenceFlow id="h" sourceRef="b" targetRef="inner"/>
    </process>
"""


def mission() -> Mission:
    return load(definitions(TEXT.format(timer=TIMER)))


def around(node: str) -> list[tuple[str, list[str]]]:
    read = mission()
    (found,) = (each for each in read.nodes if each.id == node)
    return [
        (container.id, [event.id for event in events])
        for container, events in Surroundings(read).of(found.container)
    ]


def test_events_of_a_subprocess_of_the_process_and_of_its_caller_interrupt() -> None:
    assert around("work") == [("inner", ["failed"]), ("CALLED", ["stop", "late"]), ("OUTER", [])]


def test_an_event_subprocess_does_not_interrupt_itself() -> None:
    assert around("tidy") == [("stop", []), ("CALLED", ["late"]), ("OUTER", [])]
