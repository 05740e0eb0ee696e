"""A small mission with a question, a time limit and a task that may fail."""

from pathlib import Path

import pytest

MISSION = b"""<?xml version="1.0" encoding="UTF-8"?>
<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"
    xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="https://m2pem.org/scenarios">
  <error id="Blocked" errorCode="BLOCKED"/>
  <process id="MAIN" isExecutable="true">
    <startEvent id="Start"/>
    <userTask id="Ask"><extensionElements><m2pem:userTask store="decision.Ask">
      <m2pem:prompt>Go?</m2pem:prompt>
      <m2pem:decision value="go" label="go"/><m2pem:decision value="stay" label="stay"/>
    </m2pem:userTask></extensionElements></userTask>
    <boundaryEvent id="TooLate" attachedToRef="Ask"><timerEventDefinition>
      <timeDuration>PT60S</timeDuration></timerEventDefinition></boundaryEvent>
    <exclusiveGateway id="Which" default="ToStayed"/>
    <scriptTask id="Drive"><extensionElements>
      <m2pem:behavior type="vehicle" name="drive_stop"><m2pem:resources>
        <m2pem:role name="driver" vehicle="rover"/></m2pem:resources></m2pem:behavior>
    </extensionElements></scriptTask>
    <boundaryEvent id="OnBlocked" attachedToRef="Drive"><errorEventDefinition errorRef="Blocked"/>
    </boundaryEvent>
    <endEvent id="Driven"/><endEvent id="Stayed"/><endEvent id="NoAnswer"/>
    <endEvent id="GivenUp"/>
    <sequenceFlow id="ToAsk" sourceRef="Start" targetRef="Ask"/>
    <sequenceFlow id="ToWhich" sourceRef="Ask" targetRef="Which"/>
    <sequenceFlow id="ToDrive" sourceRef="Which" targetRef="Drive">
      <conditionExpression>decision.Ask == "go"</conditionExpression></sequenceFlow>
    <sequenceFlow id="ToStayed" sourceRef="Which" targetRef="Stayed"/>
    <sequenceFlow id="ToDriven" sourceRef="Drive" targetRef="Driven"/>
    <sequenceFlow id="ToNoAnswer" sourceRef="TooLate" targetRef="NoAnswer"/>
    <sequenceFlow id="ToGivenUp" sourceRef="OnBlocked" targetRef="GivenUp"/>
  </process>
</definitions>
"""

GOOD = """\
scenarios:
  - scenario: the rover drives
    then: completed
  - scenario: it stays
    when: {answers: {Ask: [stay]}}
    then:
      ended: completed
      entered: Start Ask Which Stayed
      not_entered: Drive
      data: {decision.Ask: stay}
      commanded: {rover: []}
"""


@pytest.fixture
def mission(tmp_path: Path) -> Path:
    """A mission without scenarios."""
    file = tmp_path / "drive.bpmn"
    file.write_bytes(MISSION)
    return file


def write_scenarios(mission: Path, text: str) -> Path:
    """Write the scenarios of a mission."""
    file = mission.with_suffix(".test.yaml")
    file.write_text(text, encoding="utf-8")
    return file
