"""Every conformance case opens in a BPMN editor, complete and tidy."""

from collections.abc import Iterator
from pathlib import Path

from lxml import etree

from tests.cases import DATA
from tests.editor import (
    BPMN,
    BPMNDI,
    content,
    edges,
    has_symbol,
    read_with_moddle,
    schema,
    symbols,
)

FILES = sorted(DATA.glob("[0-9]*/*.bpmn"))


def named() -> Iterator[tuple[str, etree._Element]]:
    for file in FILES:
        yield f"{file.parent.name}/{file.name}", etree.parse(file).getroot()


def known(root: etree._Element) -> object:
    """The content, but for what bpmn-moddle writes under another name than it has read."""
    for path in [*root.iter(f"{BPMN}messagePath"), *root.iter(f"{BPMN}dataPath")]:
        path.tag = f"{BPMN}formalExpression"
    names = {"condition": "formalExpression", "event": "implicitThrowEvent"}
    for behavior in root.iter(f"{BPMN}complexBehaviorDefinition"):
        for child in behavior:
            name = str(child.tag).removeprefix(BPMN)
            child.tag = BPMN + names.get(name, name)
    return content(root)


def test_an_editor_reads_every_case_without_warning_and_keeps_all_of_it() -> None:
    wrong = []
    for name, read in read_with_moddle(FILES).items():
        rewritten = etree.fromstring(str(read["rewritten"]).encode())
        kept = known(rewritten) == known(etree.parse(name).getroot())
        if read["warnings"] or not kept:
            wrong.append((Path(name).name, read["warnings"] or "loses something"))
    assert wrong == []


def test_every_case_is_valid_against_the_schema_of_bpmn() -> None:
    bpmn = schema()
    assert [f"{name}: {bpmn.error_log}" for name, root in named() if not bpmn.validate(root)] == []


def test_everything_of_a_case_that_has_a_symbol_is_drawn() -> None:
    wrong = []
    for name, root in named():
        drawn = {element.get("bpmnElement") for element in root.iter(f"{BPMNDI}*")}
        ids = {element.get("id") for element in root.iter() if has_symbol(element)}
        wrong += [f"{name}: {identifier}" for identifier in ids - drawn]
    assert wrong == []


def test_no_sequence_flow_of_a_case_is_drawn_across_a_symbol() -> None:
    wrong = []
    for name, root in named():
        boxes = symbols(root)
        flows = {element.get("id") for element in root.iter(f"{BPMN}sequenceFlow")}
        for edge, segments in edges(root).items():
            if edge in flows:
                crossed = [
                    id_ for id_, box in boxes.items() if any(box.meets(*s) for s in segments)
                ]
                wrong += [f"{name}: {edge} crosses {element}" for element in crossed]
    assert wrong == []
