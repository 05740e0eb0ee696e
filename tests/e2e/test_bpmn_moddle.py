"""Every mission of the repository opens in a BPMN editor, complete and tidy."""

from collections.abc import Mapping
from pathlib import Path

import pytest
from lxml import etree

from tests.editor import BPMNDI, content, edges, has_symbol, read_with_moddle, schema, symbols

REPOSITORY = Path(__file__).parents[2]
MISSIONS = sorted(
    [
        *(REPOSITORY / "missions").glob("*.bpmn"),
        *(REPOSITORY / "examples").glob("*/*.bpmn"),
    ]
)

every_mission = pytest.mark.parametrize(
    "mission", MISSIONS, ids=lambda path: f"{path.parent.name}-{path.stem}"
)


@pytest.fixture(scope="module")
def moddle() -> Mapping[str, Mapping[str, object]]:
    return read_with_moddle(MISSIONS)


def test_there_are_missions_to_read() -> None:
    assert "vignette1.bpmn" in [mission.name for mission in MISSIONS]


def test_moddle_warns_of_a_flow_that_leads_nowhere(tmp_path: Path) -> None:
    broken = tmp_path / "broken.bpmn"
    text = (REPOSITORY / "missions" / "vignette1.bpmn").read_text(encoding="utf-8")
    broken.write_text(text.replace('targetRef="EndMission"', 'targetRef="Nowhere"'))
    assert "Nowhere" in str(read_with_moddle([broken])[str(broken)]["warnings"])


@every_mission
def test_an_editor_reads_the_mission_without_warning(
    mission: Path, moddle: Mapping[str, Mapping[str, object]]
) -> None:
    assert moddle[str(mission)]["warnings"] == []


@every_mission
@pytest.mark.tried_with(
    "bpmn-moddle",
    "reads and writes every mission of the repository, as bpmn-js and Camunda Modeler do",
    kind="BPMN editors",
    result="no warning, nothing lost",
)
def test_an_editor_that_saves_the_mission_keeps_all_of_it(
    mission: Path, moddle: Mapping[str, Mapping[str, object]]
) -> None:
    rewritten = str(moddle[str(mission)]["rewritten"]).encode()
    assert content(etree.fromstring(rewritten)) == content(etree.parse(mission).getroot())


@every_mission
@pytest.mark.tried_with(
    "XML schema of BPMN 2.0 (OMG)",
    "validates every mission of the repository",
    kind="BPMN editors",
    result="valid",
    package="bpmn-moddle",
    note="the package carries the schema",
)
def test_the_mission_is_valid_against_the_schema_of_bpmn(mission: Path) -> None:
    bpmn = schema()
    assert bpmn.validate(etree.parse(mission)), bpmn.error_log


@every_mission
def test_everything_that_has_a_symbol_is_drawn(mission: Path) -> None:
    root = etree.parse(mission).getroot()
    drawn = {element.get("bpmnElement") for element in root.iter(f"{BPMNDI}*")}
    assert {element.get("id") for element in root.iter() if has_symbol(element)} - drawn == set()


@every_mission
def test_no_flow_is_drawn_across_a_symbol(mission: Path) -> None:
    root = etree.parse(mission).getroot()
    boxes = symbols(root)
    crossings = [
        f"{edge} crosses {element}"
        for edge, segments in edges(root).items()
        for element, box in boxes.items()
        if any(box.meets(*segment) for segment in segments)
    ]
    assert crossings == []
