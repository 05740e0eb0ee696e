"""What the terminal knows of a run, from its records alone."""

import pytest
from m2pem_plugin_terminal.board import Board

from m2pem.api.control import RunId, StampedRecord
from m2pem.bpmn import parse_mission
from m2pem.engine.inputs import PromptAnswer, SignalReceived, StartRun
from m2pem.engine.run import MissionRun

MISSION = """
<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" targetNamespace="urn:t">
  <signal id="go"/>
  <process id="P" isExecutable="true">
    <startEvent id="start"/> <userTask id="work"/>
    <sequenceFlow id="f" sourceRef="start" targetRef="work"/>
    <subProcess id="handler" triggeredByEvent="true">
      <startEvent id="on" isInterrupting="{interrupting}">
        <signalEventDefinition signalRef="go"/>
      </startEvent>
      <userTask id="handle"/>
      <sequenceFlow id="g" sourceRef="on" targetRef="handle"/>
    </subProcess>
  </process>
</definitions>"""

TWICE = """<userTask id="work" startQuantity="2"/>
<sequenceFlow id="again" sourceRef="start" targetRef="work"/>"""


class Watched:
    """A run, and the board that its records are shown on."""

    def __init__(self, interrupting: str, text: str = MISSION) -> None:
        mission = parse_mission(text.format(interrupting=interrupting).strip().encode(), "m.bpmn")
        self.run = MissionRun(mission, None, "r1")
        self.board = Board(RunId("r1"), mission)
        self.give(StartRun("P"))

    def give(self, item: StartRun | SignalReceived | PromptAnswer) -> None:
        step = self.run.receive(item, 0)
        for seq, record in enumerate(step.records, step.seq):
            self.board.apply(StampedRecord(RunId("r1"), seq, 0.0, record), 0.0)

    @property
    def awaited(self) -> bool:
        return self.board.signals()["go"][1]


@pytest.mark.parametrize(("interrupting", "after"), [("true", False), ("false", True)])
def test_a_signal_that_an_event_subprocess_waits_for_is_awaited(
    interrupting: str, after: bool
) -> None:
    watched = Watched(interrupting)
    assert watched.awaited
    watched.give(SignalReceived("go", {}))
    assert watched.awaited is after


def test_it_is_awaited_no_more_when_its_scope_has_ended() -> None:
    watched = Watched("false")
    watched.give(PromptAnswer("p1", "done", "ops"))
    assert not watched.awaited


def test_tokens_that_begin_an_activity_with_another_are_not_shown_as_done() -> None:
    watched = Watched("false", MISSION.replace('<userTask id="work"/>', TWICE))
    watched.give(PromptAnswer("p1", "done", "ops"))
    assert [done.element for done in watched.board.done] == ["work"]
