"""Extension elements: m2pem's own are known or refused, those that look like them too."""

import json
import re
from pathlib import Path

import pytest
from bpmn_text import around, definitions, findings, load, summary

from m2pem.bpmn.extensions import ELEMENTS, EXTENSIONS, looks_like_own
from m2pem.bpmn.pages import descriptor, extensions_page
from m2pem.findings import Severity

REPOSITORY = Path(__file__).parents[2]
OWN = "https://m2pem.org/schema/1"
ASKS = (
    '<userTask id="T"><extensionElements><m2pem:prompt>Go?</m2pem:prompt>'
    '<m2pem:decision value="abort"/></extensionElements></userTask>'
)


def inside(content: str, place: str = "userTask", more: str = "") -> bytes:
    """A task whose extension elements stand on line 4."""
    return around(
        f'<{place} id="T"{more}><extensionElements>\n{content}</extensionElements></{place}>'
    )


# --- names that m2pem does not know -------------------------------------------------------------

UNKNOWN = {
    "user task": (inside('<m2pem:userTask tiemout="PT5M"/>'), "timeout"),
    "user task's role": (inside('<m2pem:userTask rol="commander"/>'), "role"),
    "prompt": (inside('<m2pem:prompt stoer="a">x</m2pem:prompt>'), "store"),
    "decision": (inside('<m2pem:decision value="a" lable="A"/>'), "label"),
    "element": (inside("<m2pem:promt>x</m2pem:promt>"), "prompt"),
    "in": (
        inside('<m2pem:in source="a" target="b" tagret="c"/>', "callActivity"),
        "target",
    ),
    "prefixed": (
        inside('<m2pem:in source="a" target="b" m2pem:source="c"/>', "callActivity"),
        "write source",
    ),
    "service": (inside('<m2pem:service class="X" calss="Y"/>', "serviceTask"), "class"),
    "requirement": (
        definitions(
            '<process id="P"><extensionElements><m2pem:requirement id="r" ltl="true" fiar="true"/>'
            '</extensionElements><startEvent id="S"/></process>'
        ),
        "fair",
    ),
}


@pytest.mark.parametrize(("data", "meant"), UNKNOWN.values(), ids=UNKNOWN.keys())
def test_a_name_that_m2pem_does_not_know_is_an_error(data: bytes, meant: str) -> None:
    (found,) = [each for each in findings(data) if each.rule == "unknown-extension"]
    assert found.severity is Severity.ERROR
    assert meant in found.remedy


def test_an_unknown_attribute_of_a_bpmn_element_is_an_error() -> None:
    assert ("unknown-extension", 3, "T") in summary(around('<task id="T" m2pem:stroe="x"/>'))


def test_a_known_attribute_without_effect_is_warned_of() -> None:
    (found,) = load(around('<task id="T" m2pem:store="x"/>')).warnings
    assert (found.rule, found.line) == ("misplaced-extension", 3)
    assert "user task" in found.remedy


def test_an_attribute_that_lacks_the_prefix_names_it() -> None:
    (found,) = load(around('<userTask id="T" timeout="PT5M"/>')).warnings
    assert (found.rule, found.remedy) == ("misspelled-attribute", "did you mean 'm2pem:timeout'?")


def test_what_other_programs_add_to_m2pems_elements_is_their_own() -> None:
    data = inside('<m2pem:prompt t:note="x" xmlns:t="urn:t"><t:more/>Go?</m2pem:prompt>')
    assert findings(data) == ()


# --- namespaces ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "namespace",
    [
        "https://m2pem.org/schema",
        "http://m2pem.org/schema/1",
        "https://m2pem.org/schema/1/",
        "https://M2PEM.org/schema/1",
        "https://m2pem.com/schema/1",
        "https://mp2em.org/schema/1",
        "urn:anything",
    ],
)
def test_a_wrong_namespace_of_the_prefix_is_an_error(namespace: str) -> None:
    data = around(ASKS).replace(OWN.encode(), namespace.encode())
    found = [each for each in findings(data) if each.rule == "wrong-namespace"]
    assert [(each.severity, each.line) for each in found] == [(Severity.ERROR, 1)]
    assert OWN in found[0].remedy


def test_a_wrong_namespace_under_another_prefix_is_an_error() -> None:
    data = inside('<z:prompt xmlns:z="http://m2pem.org/schema/1">Go?</z:prompt>')
    assert ("wrong-namespace", 4, "T") in summary(data)


def test_a_wrong_namespace_of_an_attribute_is_an_error() -> None:
    data = around('<userTask id="T" z:timeout="PT5M" xmlns:z="http://m2pem.org/schema/1"/>')
    assert ("wrong-namespace", 3, "T") in summary(data)


def test_an_element_of_m2pems_without_its_prefix_is_an_error() -> None:
    assert ("wrong-namespace", 4, "T") in summary(inside("<prompt>Go?</prompt>"))


@pytest.mark.parametrize(
    "namespace",
    [
        "http://camunda.org/schema/1.0/bpmn",
        "http://flowable.org/bpmn",
        "http://jbpm.org/schema/1",
        "https://example.org/m2pem/tools",
        OWN,
    ],
)
def test_other_namespaces_are_not_taken_for_m2pems(namespace: str) -> None:
    assert not looks_like_own("x", namespace)


def test_another_prefix_for_m2pems_namespace_is_right() -> None:
    assert findings(around(ASKS.replace("m2pem:", "mm:")).replace(b":m2pem=", b":mm=")) == ()


def test_what_another_program_says_is_one_warning_for_its_namespace() -> None:
    form = "<camunda:look/>" * 30 + "<camunda:feel/>"
    (found,) = load(inside(form)).warnings
    assert (found.rule, found.line) == ("foreign-extension", 4)
    assert "31 elements of the namespace http://camunda.org/schema/1.0/bpmn" in found.message
    assert "look, feel" in found.message


@pytest.mark.parametrize(
    "content",
    [
        '<s:signavioMetaData xmlns:s="http://www.signavio.com" metaKey="bgcolor"/>',
        '<c:color xmlns:c="http://www.omg.org/spec/BPMN/non-normative/color/1.0"/>',
        "<camunda:properties/>",
    ],
)
def test_what_editors_keep_in_a_file_is_not_warned_of(content: str) -> None:
    assert findings(inside(content)) == ()


# --- one table for all --------------------------------------------------------------------------


def test_the_docs_are_made_of_the_table() -> None:
    written = (REPOSITORY / "docs/extensions.md").read_text(encoding="utf-8")
    assert written == extensions_page(), (
        "python -m m2pem.bpmn.pages extensions > docs/extensions.md"
    )


def test_the_editor_is_held_to_the_table() -> None:
    file = REPOSITORY / "plugins/ocu/web/ui/src/editor/moddle/vocabulary.json"
    assert json.loads(file.read_text(encoding="utf-8")) == descriptor(), (
        f"python -m m2pem.bpmn.pages editor > {file.relative_to(REPOSITORY)}"
    )


def test_the_editors_descriptor_has_the_tables_names() -> None:
    """The names alone; the editor's own test compares types and attributes."""
    text = (REPOSITORY / "plugins/ocu/web/ui/src/editor/moddle/descriptor.ts").read_text()
    types = set(re.findall(r'name: "([A-Z]\w*)"', text))
    assert types == {name[0].upper() + name[1:] for name in ELEMENTS} | {
        each.name for each in EXTENSIONS
    }
