"""Undoing loops and multi-instance activities (BPMN 2.0.2, clause 13.5.5)."""

import pytest

from tests.engine.kit import Play

UNDOABLE = """
    <startEvent id="s"/> <userTask id="u"/> <endEvent id="e"/>
    <subProcess id="sub">{marker}
      <startEvent id="in"/> <task id="do"/> <endEvent id="out"/>
      <scriptTask id="undo" isForCompensation="true">undone = undone * 10 + loopCounter + 1
      </scriptTask>
      <boundaryEvent id="b" attachedToRef="do">compensate</boundaryEvent>
      b ~> undo
      in -> do -> out
    </subProcess>
    <intermediateThrowEvent id="back">compensate{named}</intermediateThrowEvent>
    s -> sub -> back -> u
"""


@pytest.mark.parametrize("named", ["", " sub"])
@pytest.mark.parametrize(
    "marker",
    ["<each>3</each>", '<each isSequential="true">3</each>', '<loop loopMaximum="3"> </loop>'],
)
def test_instances_are_undone_latest_first(marker: str, named: str) -> None:
    play = Play(UNDOABLE.format(marker=marker, named=named)).start({"undone": 0})
    assert play.at == "u"
    assert play.data["undone"] == 321


def test_instances_that_were_cancelled_are_not_undone() -> None:
    marker = "<each>3 until loopCounter == 1</each>"
    play = Play(UNDOABLE.format(marker=marker, named="")).start({"undone": 0})
    assert play.data["undone"] == 21
