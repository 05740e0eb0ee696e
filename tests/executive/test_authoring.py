"""What an executive tells those who draw missions."""

from typing import Any

import pytest

from m2pem.errors import MissionError
from tests.executive.conftest import World, mission, question, sequence

POINT = {"type": "Point", "coordinates": [7.0, 50.0]}


def test_a_mission_is_made_editable_and_its_parts_are_listed(play: Any) -> None:
    source = mission(sequence(("Ask", question("Ask"))) + '<signal id="go" name="Go"/>')

    async def story(world: World) -> Any:
        control = world.executive.control
        with pytest.raises(MissionError):
            control.outline(b"<nothing")
        return control.editable(source), control.outline(source)

    editable, outline = play(story)
    assert b"BPMNPlane" in editable.source and editable.notes
    assert [(each.id, each.starts) for each in outline.processes] == [("P", True)]
    assert ("Ask", "userTask", "P") in [(e.id, e.type, e.parent) for e in outline.elements]
    assert [(each.name, each.source) for each in outline.names] == [("user.decision", "Ask")]
    assert [(each.id, each.name, each.operators) for each in outline.signals] == [
        ("go", "Go", False)
    ]


def test_services_tell_what_they_write(play: Any) -> None:
    source = mission(
        sequence(("Look", '<serviceTask id="Look" xmlns:c="http://camunda.org/schema/1.0/bpmn" '
                  'c:class="Detector"/>'))
    )  # fmt: skip

    async def story(world: World) -> Any:
        control = world.executive.control
        return control.services(), control.outline(source)

    services, outline = play(story)
    assert "detection.type" in services["Detector"]
    assert ("detection.type", "Look") in [(each.name, each.source) for each in outline.names]


def test_names_that_only_timers_and_conditional_events_read_are_listed(play: Any) -> None:
    wait = (
        '<intermediateCatchEvent id="Wait"><timerEventDefinition><timeDuration>${pause.length}'
        "</timeDuration></timerEventDefinition></intermediateCatchEvent>"
    )
    until = (
        '<intermediateCatchEvent id="Until"><conditionalEventDefinition><condition>weather.calm'
        "</condition></conditionalEventDefinition></intermediateCatchEvent>"
    )
    source = mission(sequence(("Wait", wait), ("Until", until)))

    async def story(world: World) -> Any:
        return world.executive.control.outline(source)

    names = [(each.name, each.source) for each in play(story).names]
    assert names == [("pause.length", ""), ("weather.calm", "")]


def test_geometries_tell_who_handed_them_over_and_when(play: Any) -> None:
    async def story(world: World) -> Any:
        control = world.executive.control
        assert control.geometries() == {}
        await control.set_geometry("gate", POINT, by="anna")
        return control.geometries()["gate"], world.executive.clock.now_us()

    given, now_us = play(story)
    assert (given.geometry, given.by, given.at_us) == (POINT, "anna", now_us)


def test_a_file_with_errors_is_listed_as_far_as_it_can_be_read(play: Any) -> None:
    source = mission(
        '<process id="P"><userTask id="Ask"/><scriptTask id="Set"><script>a.b = 1\nno</script>'
        '</scriptTask><sequenceFlow id="f" targetRef="Gone"/><exclusiveGateway id="G" default="x"/>'
        '<subProcess id="Sub"><callActivity id="Call"/></subProcess></process>'
    )

    async def story(world: World) -> Any:
        return world.executive.control.outline(source)

    outline = play(story)
    assert ("Call", "Sub", "P") in [(e.id, e.parent, e.process) for e in outline.elements]
    assert {(each.name, each.source) for each in outline.names} == {
        ("a.b", "Set"),
        ("user.decision", "Ask"),
    }
