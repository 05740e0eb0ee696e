"""A file for an editor: the same mission, complete, and nothing that an editor would lose."""

import os
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from lxml import etree

from m2pem.api.authoring import Editable
from m2pem.bpmn import parse_mission
from m2pem.bpmn.search_path import SearchPath
from m2pem.editing.editable import editable
from m2pem.errors import MissionError
from m2pem.mission.mission import Mission
from tests.each_case import every_file
from tests.editing.same_model import model_of, new_names
from tests.editor import BPMN, BPMNDI, has_symbol, read_with_moddle

REPOSITORY = Path(__file__).parents[2]
CORPORA = os.environ.get("M2PEM_CORPORA", "")
FILES = sorted(
    [
        *(REPOSITORY / "missions").glob("*.bpmn"),
        *(REPOSITORY / "examples").glob("*/*.bpmn"),
        *(REPOSITORY / "docs").glob("**/*.bpmn"),
        *(REPOSITORY / "tests" / "data").glob("**/*.bpmn"),
    ]
)
FOREIGN = sorted(Path(CORPORA).rglob("*.bpmn")) if CORPORA else []
for_every_file = every_file(FILES, FOREIGN)

HEAD = (
    '<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" '
    'xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="test" id="Test">'
)
FIGURE_3 = """
<behavior>
  <property name="type" value="vehicle"/>
  <property name="name">single_vehicle_routing</property>
  <properties><property name="route">alpha</property></properties>
  <resources><role name="driver" vehicle="evsg1"/></resources>
</behavior>"""


def process(inside: str) -> bytes:
    return f'{HEAD}<process id="P" isExecutable="true">{inside}</process></definitions>'.encode()


def drive(script: str) -> bytes:
    return process(
        '<startEvent id="S"/><sequenceFlow id="f" sourceRef="S" targetRef="Drive"/>'
        f'<scriptTask id="Drive" scriptFormat="application/xml">{script}</scriptTask>'
        '<sequenceFlow id="g" sourceRef="Drive" targetRef="E"/><endEvent id="E"/>'
    )


def tree(source: bytes) -> etree._Element:
    return etree.fromstring(source)


def loaded(path: Path, source: bytes) -> Mission:
    return parse_mission(source, str(path), SearchPath(path))


@cache
def edited(file: Path, *, anew: bool = False) -> Editable:
    return editable(file.read_bytes(), anew=anew)


@cache
def moddle(foreign: bool) -> dict[Path, tuple[list[str], str]]:
    """What an editor says to each file of the repository or of others, and how it writes it."""
    found: dict[Path, tuple[list[str], str]] = {}
    with TemporaryDirectory() as folder:
        made = {
            Path(folder, f"{number}.bpmn"): file
            for number, file in enumerate(FOREIGN if foreign else FILES)
        }
        for copy, file in made.items():
            copy.write_bytes(edited(file).source)
        read = read_with_moddle(made)
        for copy, file in made.items():
            said: Any = read[str(copy)]
            found[file] = (said["warnings"], said["rewritten"])
    return found


# --- every mission there is ---------------------------------------------------------------------


@for_every_file
def test_the_model_stays_the_same(file: Path) -> None:
    source = file.read_bytes()
    try:
        before = loaded(file, source)
    except MissionError:
        edited(file)
        return
    result = edited(file)
    after = loaded(file, result.source)
    if any("editors refuse such an id" in note for note in result.notes):
        assert len(after.nodes) == len(before.nodes)
        return
    assert model_of(after) == model_of(before, new_names(before, after))


@for_every_file
def test_what_an_editor_saves_is_the_same_model(file: Path) -> None:
    warnings, saved = moddle(file in FOREIGN)[file]
    assert warnings == []
    try:
        before = loaded(file, edited(file).source)
    except MissionError:
        return
    assert model_of(loaded(file, saved.encode())) == model_of(before)


@for_every_file
def test_everything_is_drawn(file: Path) -> None:
    assert_everything_is_drawn(file, anew=False)


@for_every_file
def test_everything_is_drawn_where_all_is_laid_out(file: Path) -> None:
    assert_everything_is_drawn(file, anew=True)


def assert_everything_is_drawn(file: Path, *, anew: bool) -> None:
    source = file.read_bytes()
    result = edited(file, anew=anew)
    root = tree(result.source)
    drawn = {
        each.get("bpmnElement", "").rpartition(":")[2]: plane
        for plane, diagram in enumerate(root.iter(f"{BPMNDI}BPMNPlane"))
        for each in diagram
    }
    symbols = {
        each.get("id", "")
        for owner in root.iter(f"{BPMN}process", f"{BPMN}collaboration")
        for each in owner.iter(f"{BPMN}*")
        if has_symbol(each) and not is_line_to_what_is_not_drawn(each, drawn)
    }
    lost = symbols - drawn.keys()
    if not anew and b"BPMNShape" in source:
        nodes = {each.get("id") for each in root.iter(f"{BPMN}*") if not has_line(each)}
        told = " ".join(result.notes)
        lost = {each for each in lost & nodes if "does not show" not in told}
    assert lost == set()


def has_line(element: etree._Element) -> bool:
    """An author may have left lines out."""
    return element.tag.endswith(("Association", "association", "Flow"))


def is_line_to_what_is_not_drawn(element: etree._Element, drawn: Mapping[str, int]) -> bool:
    """Data may come from a property, or go to an input, which have no symbol; a message may go to
    a process that is in no pool, and has a diagram of its own."""
    ends = {element.get("sourceRef"), element.get("targetRef")}
    if "Association" in element.tag:
        ends |= {each.text for each in element.iter(f"{BPMN}sourceRef", f"{BPMN}targetRef")}
        owner = element.getparent()
        ends -= set() if owner is None else {each.get("id") for each in owner.iter(f"{BPMN}*")}
        return not (ends - {None}) or not (ends - {None} <= drawn.keys())
    return "messageFlow" in element.tag and len({drawn.get(str(each), -1) for each in ends}) > 1


def test_the_same_file_gives_the_same_bytes() -> None:
    for file in FILES[:20]:
        source = file.read_bytes()
        assert editable(source) == editable(source)


@for_every_file
def test_once_is_enough(file: Path) -> None:
    once = edited(file).source
    assert editable(once).source == once


# --- behaviors ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "script",
    [
        FIGURE_3,
        f"<script><![CDATA[{FIGURE_3}]]></script>",
        FIGURE_3.replace("<", "&lt;"),
        FIGURE_3.replace("<behavior>", '<behavior xmlns="">'),
        FIGURE_3.replace("<behavior>", '<behavior type="vehicle">'),
    ],
    ids=["nested", "CDATA", "escaped", "no namespace", "head as attribute"],
)
def test_a_behavior_becomes_an_extension_element_in_one_form(script: str) -> None:
    if not script.startswith("<script>"):
        script = f"<script>{script}</script>"
    task = tree(editable(drive(script)).source).find(f".//{BPMN}scriptTask")
    assert task is not None
    assert task.find(f"{BPMN}script") is None and "scriptFormat" not in task.attrib
    behavior = task.find(f"{BPMN}extensionElements/{{https://m2pem.org/schema/1}}behavior")
    assert behavior is not None
    assert dict(behavior.attrib) == {"type": "vehicle", "name": "single_vehicle_routing"}
    said = [(str(each.tag).rpartition("}")[2], dict(each.attrib)) for each in behavior.iter()][1:]
    assert said == [
        ("properties", {}),
        ("property", {"name": "route", "value": "alpha"}),
        ("resources", {}),
        ("role", {"name": "driver", "vehicle": "evsg1"}),
    ]


def test_statements_stay_a_script() -> None:
    source = drive("<script>a.b = 1</script>").replace(b"application/xml", b"m2pem")
    task = tree(editable(source).source).find(f".//{BPMN}scriptTask")
    assert task is not None and task.findtext(f"{BPMN}script") == "a.b = 1"


def test_xml_that_is_no_behavior_is_kept_as_text_and_said() -> None:
    result = editable(drive("<script><other a='1'>x</other></script>"))
    task = tree(result.source).find(f".//{BPMN}scriptTask")
    assert task is not None and "<other" in (task.findtext(f"{BPMN}script") or "")
    assert any("Drive" in note for note in result.notes)


def test_a_documentation_with_markup_keeps_its_words() -> None:
    source = process('<documentation><p xmlns="x">Go <b>on</b></p></documentation>')
    assert tree(editable(source).source).findtext(f".//{BPMN}documentation") == "Go on"


# --- what an editor needs -----------------------------------------------------------------------


def test_incoming_and_outgoing_are_what_the_flows_say() -> None:
    source = drive("<script>a = 1</script>").replace(
        b'<endEvent id="E"/>', b'<endEvent id="E"><incoming>old</incoming></endEvent>'
    )
    root = tree(editable(source).source)
    said = {
        node.get("id"): [
            (str(each.tag).removeprefix(BPMN), each.text)
            for each in node.iter(f"{BPMN}incoming", f"{BPMN}outgoing")
        ]
        for node in root.iter(f"{BPMN}startEvent", f"{BPMN}scriptTask", f"{BPMN}endEvent")
    }
    assert said == {
        "S": [("outgoing", "f")],
        "Drive": [("incoming", "f"), ("outgoing", "g")],
        "E": [("incoming", "g")],
    }


def test_a_uuid_that_begins_with_a_digit_is_another_id_and_still_a_name() -> None:
    source = (
        f'{HEAD}<signal id="6b7e52aa-9d5f"/><process id="P"><startEvent id="S"/>'
        '<sequenceFlow id="f" sourceRef="S" targetRef="T"/><endEvent id="T">'
        '<signalEventDefinition signalRef="6b7e52aa-9d5f"/></endEvent></process></definitions>'
    ).encode()
    result = editable(source)
    signals = parse_mission(result.source, "x").signals
    assert {key: each.name for key, each in signals.items()} == {"_6b7e52aa-9d5f": "6b7e52aa-9d5f"}
    assert any("6b7e52aa-9d5f is _6b7e52aa-9d5f" in note for note in result.notes)


def test_comments_are_said_to_be_lost() -> None:
    source = drive("<script><![CDATA[a = 1 // <!-- no comment -->]]></script>")
    assert editable(source).notes == ("Laid out, as the file drew it nowhere: P.",)
    source = source.replace(b"<startEvent", b"<!-- one --><startEvent")
    assert editable(source).notes[0].startswith("The file has 1 XML comment:")


def test_every_process_without_a_diagram_gets_one_and_drawn_ones_stay() -> None:
    first = editable(process('<startEvent id="S"/>')).source
    more = first.replace(
        b"<bpmndi:BPMNDiagram", b'<process id="Q"><startEvent id="T"/></process><bpmndi:BPMNDiagram'
    ).replace(b'<dc:Bounds x="', b'<dc:Bounds x="777')
    root = tree(editable(more).source)
    planes = [each.get("bpmnElement") for each in root.iter(f"{BPMNDI}BPMNPlane")]
    assert planes == ["P", "Q"]
    assert b'x="777' in editable(more).source
    assert b'x="777' not in editable(more, anew=True).source


def test_a_collapsed_subprocess_that_is_drawn_nowhere_gets_a_plane() -> None:
    inside = '<subProcess id="Sub"><startEvent id="Inner"/></subProcess>'
    root = tree(editable(process(inside)).source)
    for shape in [*root.iter(f"{BPMNDI}BPMNShape")]:
        if shape.get("bpmnElement") == "Inner":
            shape.getparent().remove(shape)  # type: ignore[union-attr]
    result = editable(etree.tostring(root))
    again = tree(result.source)
    planes = [each.get("bpmnElement") for each in again.iter(f"{BPMNDI}BPMNPlane")]
    assert planes == ["P", "Sub"]
    expanded = {
        each.get("bpmnElement"): each.get("isExpanded") for each in again.iter(f"{BPMNDI}BPMNShape")
    }
    assert expanded["Sub"] == "false" and "Inner" in expanded


def test_an_unfinished_drawing_is_laid_out_too() -> None:
    source = process(
        '<startEvent id="S"/><sequenceFlow id="f" sourceRef="S" targetRef="Nowhere"/>'
        '<sequenceFlow id="g" targetRef="T"/><task id="T"/>'
        '<boundaryEvent id="B" attachedToRef="Gone"/>'
    )
    root = tree(editable(source).source)
    drawn = {each.get("bpmnElement") for each in root.iter(f"{BPMNDI}BPMNShape")}
    assert drawn == {"S", "T"}


def test_what_is_no_bpmn_is_refused() -> None:
    with pytest.raises(MissionError, match="DOCTYPE"):
        editable(b'<!DOCTYPE a [<!ENTITY x SYSTEM "file:///etc/passwd">]><a>&x;</a>')
    with pytest.raises(MissionError, match="definitions"):
        editable(b"<html/>")
