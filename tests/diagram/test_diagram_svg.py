"""What drawings show: every kind of symbol, names, marks; and files of strangers."""

import os
from pathlib import Path

import pytest
from lxml import etree

from m2pem.bpmn import parse_mission
from m2pem.diagram import Overlays, draw
from m2pem.diagram.style import FAINT, PATH, STUCK, WAITING, width_of, wrapped
from m2pem.errors import MissionError
from tests.each_case import every_file

REPOSITORY = Path(__file__).parents[2]
SVG = "{http://www.w3.org/2000/svg}"
DI = "{http://www.omg.org/spec/BPMN/20100524/DI}"
DATA = sorted((REPOSITORY / "tests" / "data").rglob("*.bpmn"))
FOREIGN = sorted(Path(os.environ.get("M2PEM_CORPORA") or os.devnull).rglob("*.bpmn"))


def fork() -> bytes:
    """A file without a diagram."""
    return FORK_XML.encode()


FORK_XML = """<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" targetNamespace="t">
<process id="P"><startEvent id="S"/><parallelGateway id="Fork"/>
<task id="A" name="Look &lt;here&gt;"/>
<subProcess id="B" name="Inside"><task id="Inner"/></subProcess>
<parallelGateway id="Join"/><endEvent id="E"/>
<sequenceFlow id="f1" sourceRef="S" targetRef="Fork"/>
<sequenceFlow id="f2" sourceRef="Fork" targetRef="A"/>
<sequenceFlow id="f3" sourceRef="Fork" targetRef="B"/>
<sequenceFlow id="f4" sourceRef="A" targetRef="Join" name="done"/>
<sequenceFlow id="f5" sourceRef="B" targetRef="Join"/>
<sequenceFlow id="f6" sourceRef="Join" targetRef="E"/></process></definitions>"""


def groups(svg: str) -> dict[str, etree._Element]:
    root = etree.fromstring(svg.encode())
    return {str(g.get("data-element-id")): g for g in root.iter(f"{SVG}g") if len(g.attrib)}


def texts(svg: str) -> list[str]:
    return [each.text or "" for each in etree.fromstring(svg.encode()).iter(f"{SVG}tspan")]


def strokes(group: etree._Element) -> set[str]:
    return {str(each.get("stroke")) for each in group.iter() if each.get("stroke")}


def test_a_file_without_a_diagram_is_laid_out() -> None:
    assert {"S", "Fork", "A", "B", "Inner", "Join", "E", "f1", "f6"} <= groups(draw(fork())).keys()


def test_names_are_shown_as_they_are() -> None:
    assert {"Look <here>", "Inside", "done"} <= {*texts(draw(fork()))}


def test_the_steps_of_a_run_are_coloured_and_numbered() -> None:
    svg = draw(fork(), Overlays(steps=[["f1", "S", "Fork"], ["f2", "A"], ["f4"], ["f2"]]))
    shown = groups(svg)
    for name in ("f1", "S", "Fork", "f2", "A", "f4"):
        assert PATH in strokes(shown[name]), name
    assert PATH not in strokes(shown["B"])
    assert {"1", "2, 4", "3"} <= {*texts(svg)}


def test_what_is_stuck_is_red_and_says_why() -> None:
    overlays = Overlays(stuck={"Join": "waits for B"}, missing=frozenset({"f5"}))
    shown = groups(draw(fork(), overlays))
    assert STUCK in strokes(shown["Join"])
    assert STUCK in strokes(shown["f5"])
    assert shown["Join"].findtext(f"{SVG}title") == "waits for B"


def test_other_tokens_and_what_is_never_reached_look_different() -> None:
    shown = groups(
        draw(
            fork(),
            Overlays(
                waiting={"A": "works"}, tokens=frozenset({"A"}), unreached=frozenset({"E", "f6"})
            ),
        )
    )
    assert WAITING in strokes(shown["A"])
    assert FAINT in strokes(shown["E"])
    assert FAINT in strokes(shown["f6"])


def test_an_element_that_is_not_drawn_is_marked_at_what_contains_it() -> None:
    diagram = """<bpmndi:BPMNDiagram xmlns:bpmndi="http://www.omg.org/spec/BPMN/20100524/DI"
     xmlns:dc="http://www.omg.org/spec/DD/20100524/DC"><bpmndi:BPMNPlane bpmnElement="P">
    <bpmndi:BPMNShape bpmnElement="B" isExpanded="false"><dc:Bounds x="5" y="5" width="100"
     height="80"/></bpmndi:BPMNShape></bpmndi:BPMNPlane></bpmndi:BPMNDiagram></definitions>"""
    svg = draw(
        FORK_XML.replace("</definitions>", diagram).encode(), Overlays(stuck={"Inner": "hangs"})
    )
    assert groups(svg)["B"].findtext(f"{SVG}title") == "hangs"
    assert STUCK in strokes(groups(svg)["B"])


def test_a_legend_explains_only_the_marks_that_there_are() -> None:
    assert "never reached" not in texts(draw(fork(), Overlays(stuck={"Join": ""})))
    assert "never reached" in texts(draw(fork(), Overlays(unreached=frozenset({"E"}))))
    assert not {"never reached", "not in this run"} & {*texts(draw(fork()))}


def test_text_above_is_broken_into_lines_that_fit() -> None:
    note = "a token waits at the join for what can no longer come " * 6
    svg = draw(fork(), title="Fork", note=note)
    width = float(str(etree.fromstring(svg.encode()).get("width")))
    assert all(width_of(line, 12) <= width for line in texts(svg))


@pytest.mark.parametrize("word", ["UserSendRouteAndWaitForDecision", "x" * 60, "\u822a\u8def" * 20])
def test_long_words_are_broken(word: str) -> None:
    lines = wrapped(word, 80, 12)
    assert "".join(lines) == word
    assert all(width_of(line, 12) <= 80 for line in lines)


def test_nothing_is_asked_of_any_host() -> None:
    assert "href" not in draw(fork())


@every_file(DATA, FOREIGN)
def test_files_of_all_sorts_are_drawn_with_all_that_their_diagrams_show(path: Path) -> None:
    try:
        parse_mission(path.read_bytes(), str(path))
        svg = draw(path.read_bytes())
    except MissionError:
        try:  # what is refused is drawn if it can be, and never ends in anything but a reason
            svg = draw(path.read_bytes())
        except ValueError:
            return
    known = {each.get("id") for each in etree.fromstring(path.read_bytes()).iter(etree.Element)}
    planned = {
        str(each.get("bpmnElement")).rpartition(":")[2]
        for each in etree.fromstring(path.read_bytes()).iter(f"{DI}BPMNShape")
    }
    missing = (planned & known) - groups(svg).keys()
    assert not missing or 'isExpanded="false"' in path.read_text(encoding="utf-8")
