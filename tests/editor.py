"""A BPMN file as an editor sees it.

bpmn-moddle is what bpmn-js and Camunda Modeler read and write BPMN with; it also carries the
OMG's XML schemas. `make setup` installs it under tests/js.
"""

import json
import shutil
import subprocess
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import pytest
from lxml import etree

JS = Path(__file__).parent / "js"
SCHEMA = JS / "node_modules" / "bpmn-moddle" / "resources" / "bpmn" / "xsd" / "BPMN20.xsd"

BPMN = "{http://www.omg.org/spec/BPMN/20100524/MODEL}"
BPMNDI = "{http://www.omg.org/spec/BPMN/20100524/DI}"
DC = "{http://www.omg.org/spec/DD/20100524/DC}"
DI = "{http://www.omg.org/spec/DD/20100524/DI}"


def read_with_moddle(files: Iterable[Path]) -> Mapping[str, Mapping[str, object]]:
    node = shutil.which("node")
    if node is None or not SCHEMA.exists():
        pytest.fail("needs Node.js 18 or newer and the packages of tests/js: run `make setup`")
    done = subprocess.run(
        [node, "read_bpmn.mjs", *map(str, files)],
        cwd=JS,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    results: Mapping[str, Mapping[str, object]] = json.loads(done.stdout)
    return results


def draw_from_templates(
    modeler: str, templates: Path, steps: Sequence[Mapping[str, object]]
) -> tuple[str, list[str]]:
    """Draw a mission of element templates by filling in their forms in a headless Chromium.

    `modeler`: "cloud" (Camunda 8) or "platform" (Camunda 7). A step has the `template`'s name, its
    `category`, and the `values` of fields by label. Returns the saved file, and what the validator
    of templates, the forms, or reading it with bpmn-moddle found wrong.
    """
    node = shutil.which("node")
    if node is None or not (JS / "node_modules" / "camunda-bpmn-js").exists():
        pytest.fail("needs Node.js 18 or newer and the packages of tests/js: run `make setup`")
    done = subprocess.run(
        [node, "apply_templates.mjs", modeler, str(templates)],
        cwd=JS,
        input=json.dumps(steps),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    return result["xml"], result["errors"]


def schema() -> etree.XMLSchema:
    """The OMG's schema of BPMN 2.0."""
    if not SCHEMA.exists():
        pytest.fail("needs the packages of tests/js: run `make setup`")
    return etree.XMLSchema(etree.parse(SCHEMA))


def content(root: etree._Element) -> list[tuple[str, str, tuple[tuple[str, str], ...]]]:
    """All elements with their text and attributes, whatever their order and their spacing."""
    return sorted(
        (
            str(element.tag),
            " ".join((element.text or "").split()),
            tuple(sorted((str(k), str(v)) for k, v in element.attrib.items())),
        )
        for element in root.iter(etree.Element)
    )


def has_symbol(element: etree._Element) -> bool:
    """Whether BPMN has a symbol or a line for the element."""
    tag = str(element.tag).removeprefix(BPMN)
    return tag in {
        *("participant", "lane", "sequenceFlow", "messageFlow", "dataObjectReference"),
        *("dataStoreReference", "dataInputAssociation", "dataOutputAssociation"),
        *("textAnnotation", "association", "callActivity", "subProcess", "boundaryEvent"),
        *("transaction", "adHocSubProcess"),
    } or tag.endswith(("Task", "task", "Gateway", "Event"))


class Box(NamedTuple):
    """Where a symbol is drawn, in the diagram's units; y grows downwards."""

    left: float
    top: float
    right: float
    bottom: float

    def meets(self, x1: float, y1: float, x2: float, y2: float) -> bool:
        """Whether a line goes through the inside, not just to the rim; a slanting line counts as
        the box around it."""
        return (
            min(x1, x2) < self.right
            and max(x1, x2) > self.left
            and min(y1, y2) < self.bottom
            and max(y1, y2) > self.top
        )


def symbols(root: etree._Element) -> dict[str, Box]:
    """The symbols that no line may cross: not pools and lanes, nor subprocesses drawn open."""
    surfaces = {
        element.get("id")
        for tag in ("participant", "lane", "subProcess", "transaction", "adHocSubProcess")
        for element in root.iter(f"{BPMN}{tag}")
    }
    boxes = {}
    for shape in root.iter(f"{BPMNDI}BPMNShape"):
        bounds = shape.find(f"{DC}Bounds")
        if bounds is not None and shape.get("bpmnElement") not in surfaces:
            x, y, width, height = (float(bounds.get(k, "")) for k in ("x", "y", "width", "height"))
            boxes[shape.get("bpmnElement", "")] = Box(x, y, x + width, y + height)
    return boxes


def edges(root: etree._Element) -> dict[str, list[tuple[float, float, float, float]]]:
    """The straight pieces of every line, by the element that the line draws."""
    lines = {}
    for edge in root.iter(f"{BPMNDI}BPMNEdge"):
        points = [
            (float(point.get("x", "")), float(point.get("y", "")))
            for point in edge.iter(f"{DI}waypoint")
        ]
        lines[edge.get("bpmnElement", "")] = [(*a, *b) for a, b in pairwise(points)]
    return lines
