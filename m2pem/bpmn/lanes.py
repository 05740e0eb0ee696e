"""Lanes, nested to any depth: kept for display, without an effect on execution."""

from lxml import etree

from m2pem.bpmn.names import BPMN
from m2pem.bpmn.reading import Reading, text_of
from m2pem.bpmn.scan import scan
from m2pem.mission.elements import Process
from m2pem.mission.mission import Lane


def read_lanes(reading: Reading, lane_set: etree._Element, process: Process) -> None:
    """All lanes of a lane set, outer ones first."""
    stack = [lane_set]
    while stack:
        outer = stack.pop()
        reading.optional_id(outer)
        for element in outer.iterchildren(BPMN + "lane"):
            identifier = reading.optional_id(element)
            found = scan(reading, element, identifier)
            reading.lanes.append(
                Lane(
                    identifier,
                    element.get("name", ""),
                    reading.report.line(element),
                    process.id,
                    tuple(text_of(each) for each in found.of("flowNodeRef")),
                )
            )
            stack += found.of("childLaneSet")
