"""Missions of several files: what is called where, whose ids are what, where findings are."""

from collections.abc import Sequence

import pytest

from m2pem.bpmn import parse_mission
from m2pem.bpmn.lint import lint
from m2pem.errors import MissionError
from m2pem.findings import Severity
from m2pem.mission.elements import CallActivity
from m2pem.mission.library import KeptLibrary, LibraryError, Source
from m2pem.mission.mission import Mission
from tests.bpmn.bpmn_text import around, definitions, line_of

MODEL = "http://www.omg.org/spec/BPMN/20100524/MODEL"
HEAD = f'<definitions xmlns="{MODEL}" xmlns:lib="urn:lib" targetNamespace="urn:lib">'


class Shelf:
    """A library of files that a test writes: by the id that is called, and by location."""

    def __init__(self, **files: bytes) -> None:
        self.files = {f"lib/{name}.bpmn": data for name, data in files.items()}
        self.asked: list[tuple[str, str]] = []

    @property
    def places(self) -> Sequence[str]:
        return ["lib"]

    def called(self, element: str, namespace: str) -> Source | None:
        self.asked.append((element, namespace))
        found = [
            Source(name, data)
            for name, data in self.files.items()
            if f'id="{element}"'.encode() in data
            and (not namespace or f'targetNamespace="{namespace}"'.encode() in data)
        ]
        if len(found) > 1:
            raise LibraryError(f"'{element}' is in several files", "rename one")
        return found[0] if found else None

    def imported(self, location: str, importer: str) -> Source:
        name = f"lib/{location}"
        if name not in self.files:
            raise LibraryError(f"{name} cannot be read: no such file", "check the path")
        return Source(name, self.files[name])


def call(target: str, *, roots: str = "") -> bytes:
    """A mission P whose call activity T (line 3) calls `target`."""
    return around(f'<callActivity id="T" calledElement="{target}"/>', roots)


def process(name: str, inside: str = '<task id="T"/>', more: str = "") -> bytes:
    """A file of urn:lib with one process; what is `inside` it begins on line 3."""
    body = f'<process id="{name}">\n{inside}\n{line_of("T")}</process>{more}'
    return f"{HEAD}\n{body}\n</definitions>".encode()


def imports(location: str, namespace: str = "urn:lib") -> bytes:
    return f'<import importType="{MODEL}" location="{location}" namespace="{namespace}"/>'.encode()


def importing(data: bytes, *locations: str) -> bytes:
    head, _, rest = data.partition(b"\n")
    return head + b"".join(imports(each) for each in locations) + b"\n" + rest


def called(mission: Mission, call_id: str = "T") -> str:
    node = mission.elements[call_id]
    assert isinstance(node, CallActivity)
    assert node.called_id == node.called.id
    return node.called.id


def refused(data: bytes, library: object) -> list[tuple[str, str, int, str]]:
    with pytest.raises(MissionError) as caught:
        parse_mission(data, "m.bpmn", library)  # type: ignore[arg-type]
    return [
        (each.rule, each.file, each.line, each.element)
        for each in caught.value.findings
        if each.severity is Severity.ERROR
    ]


# --- ids --------------------------------------------------------------------------------------


def test_elements_of_another_file_have_its_name_in_front() -> None:
    mission = parse_mission(call("SEARCH"), "m.bpmn", Shelf(survey=process("SEARCH")))
    assert called(mission) == "survey:SEARCH"
    assert [each.id for each in mission.processes] == ["P", "survey:SEARCH"]
    assert {each for each in mission.elements if ":" in each} == {
        *(f"survey:{each}" for each in ("SEARCH", "S", "T", "E", "S-T", "T-E"))
    }
    for identifier, element in mission.elements.items():
        assert element.id == identifier
        assert element.local_id == identifier.removeprefix("survey:")
    assert [each.index for each in mission.nodes] == list(range(len(mission.nodes)))
    assert [each.index for each in mission.flows] == list(range(len(mission.flows)))


def test_files_of_one_name_get_numbers() -> None:
    files = {
        "a/x.bpmn": process("A", '<callActivity id="T" calledElement="B"/>'),
        "b/x.bpmn20.xml": process("B", '<callActivity id="T" calledElement="C"/>'),
        "c/x y.bpmn": process("C", '<callActivity id="T" calledElement="D"/>'),
        "d/x_y.bpmn": process("D"),
    }
    shelf = Shelf()
    shelf.files = files
    mission = parse_mission(call("A"), "m.bpmn", shelf)
    assert [each.id for each in mission.processes] == ["P", "x:A", "x-2:B", "x_y:C", "x_y-2:D"]


def test_an_id_with_a_colon_of_the_missions_own_is_kept_apart() -> None:
    data = call("SEARCH").replace(b'"S-T"', b'"survey:S-T"')
    mission = parse_mission(data, "m.bpmn", Shelf(survey=process("SEARCH")))
    assert called(mission) == "survey-2:SEARCH"


def test_what_an_event_makes_up_for_itself_is_its_own_in_each_file() -> None:
    events = '<intermediateThrowEvent id="T"><signalEventDefinition/></intermediateThrowEvent>'
    main = around(events, "").replace(
        b"</process>", b'<callActivity id="C" calledElement="SEARCH"/></process>'
    )
    mission = parse_mission(main, "m.bpmn", Shelf(survey=process("SEARCH", events)))
    assert set(mission.signals) == {"T", "survey:T"}


# --- what is called ---------------------------------------------------------------------------


def test_the_library_is_asked_only_for_what_the_file_does_not_have() -> None:
    shelf = Shelf(other=process("P2"))
    own = call("P2", roots='<process id="P2"><task id="X"/></process>')
    assert called(parse_mission(own, "m.bpmn", shelf)) == "P2"
    assert shelf.asked == []


def test_only_the_processes_that_are_called_take_part() -> None:
    more = '<process id="NIGHTLY"><callActivity id="N" calledElement="NOWHERE"/></process>'
    shelf = Shelf(survey=process("SEARCH", more=more))
    mission = parse_mission(call("SEARCH"), "m.bpmn", shelf)
    assert [each.id for each in mission.processes] == ["P", "survey:SEARCH"]
    assert shelf.asked == [("SEARCH", "")]


def test_files_may_call_each_other_and_the_mission() -> None:
    shelf = Shelf(
        a=process("A", '<callActivity id="T" calledElement="B"/>'),
        b=process("B", '<callActivity id="T" calledElement="P"/>'),
    )
    mission = parse_mission(call("A"), "m.bpmn", shelf)
    assert (called(mission), called(mission, "a:T"), called(mission, "b:T")) == ("a:A", "b:B", "P")
    assert mission.process().id == "P"
    recursive = [each for each in lint(mission) if each.rule == "call-recursion"]
    assert [(each.file, each.element) for each in recursive] == [
        ("m.bpmn", "T"),
        ("lib/a.bpmn", "a:T"),
        ("lib/b.bpmn", "b:T"),
    ]


@pytest.mark.parametrize("target", ["tns:P2", "nobody:P2", "bpmn:P2"])
def test_a_prefix_that_names_no_other_file_changes_nothing(target: str) -> None:
    own = call(target, roots='<process id="P2"><task id="X"/></process>')
    own = own.replace(b"<definitions", f'<definitions xmlns:bpmn="{MODEL}"'.encode())
    assert called(parse_mission(own, "m.bpmn", Shelf())) == "P2"


def test_a_prefix_of_another_file_goes_past_the_own_process_of_that_id() -> None:
    own = call("lib:P2", roots='<process id="P2"><task id="X"/></process>')
    own = own.replace(b"<definitions", b'<definitions xmlns:lib="urn:lib"')
    shelf = Shelf(survey=process("P2"))
    assert called(parse_mission(own, "m.bpmn", shelf)) == "survey:P2"
    assert shelf.asked == [("P2", "urn:lib")]
    assert called(parse_mission(own, "m.bpmn", Shelf())) == "P2"


def test_an_imported_file_is_looked_into_before_the_search_path() -> None:
    shelf = Shelf(meant=process("SEARCH"), other=process("SEARCH"))
    mission = parse_mission(importing(call("SEARCH"), "meant.bpmn"), "m.bpmn", shelf)
    assert called(mission) == "meant:SEARCH"
    assert shelf.asked == []


def test_two_imported_files_with_one_process_are_told_apart_by_their_namespaces() -> None:
    files = Shelf(
        one=process("SEARCH"), two=process("SEARCH").replace(b'"urn:lib"', b'"urn:two"', 2)
    )
    both = importing(call("SEARCH"), "one.bpmn", "two.bpmn")
    assert refused(both, files) == [("ambiguous-call", "m.bpmn", 3, "T")]
    prefixed = importing(call("l:SEARCH"), "one.bpmn", "two.bpmn")
    prefixed = prefixed.replace(b"<definitions", b'<definitions xmlns:l="urn:two"')
    mission = parse_mission(prefixed, "m.bpmn", files)
    assert called(mission) == "two:SEARCH"


def test_signals_of_an_imported_file_may_be_referred_to() -> None:
    shelf = Shelf(roots=definitions('<signal id="go" name="Go"/><error id="e" errorCode="X"/>'))
    throw = '<intermediateThrowEvent id="T"><signalEventDefinition signalRef="lib:go"/>'
    data = importing(around(throw + "</intermediateThrowEvent>"), "roots.bpmn")
    data = data.replace(b"<definitions", b'<definitions xmlns:lib="urn:t"')
    mission = parse_mission(data, "m.bpmn", shelf)
    assert mission.signals["go"].name == "Go"
    assert mission.file_of(mission.signals["go"]) == "lib/roots.bpmn"


def test_files_may_import_each_other() -> None:
    main = importing(call("A"), "a.bpmn")
    shelf = Shelf(a=importing(process("A", '<callActivity id="T" calledElement="P"/>'), "m.bpmn"))
    shelf.files["lib/m.bpmn"] = main
    mission = parse_mission(main, "lib/m.bpmn", shelf)
    assert [each.id for each in mission.processes] == ["P", "a:A"]
    again = parse_mission(main, "lib/m.bpmn", KeptLibrary(mission.library))
    assert list(again.elements) == list(mission.elements)


# --- findings ---------------------------------------------------------------------------------


def test_an_error_in_a_called_file_says_which_file_and_line() -> None:
    bad = '<scriptTask id="T" scriptFormat="python"><script>x</script></scriptTask>'
    found = refused(call("SEARCH"), Shelf(survey=process("SEARCH", bad)))
    assert found == [("script-language", "lib/survey.bpmn", 3, "survey:T")]


def test_a_warning_about_the_whole_mission_says_which_file_and_line() -> None:
    wait = '<intermediateCatchEvent id="T"><signalEventDefinition signalRef="go"/>'
    wait += "</intermediateCatchEvent>"
    data = process("SEARCH", wait, more='\n<signal id="go"/>')
    mission = parse_mission(call("SEARCH"), "m.bpmn", Shelf(survey=data))
    assert [(each.rule, each.file, each.line) for each in lint(mission)] == [
        ("outside-only", "lib/survey.bpmn", 5)
    ]


def test_operators_send_what_any_file_says_they_send() -> None:
    wait = '<intermediateCatchEvent id="T"><signalEventDefinition signalRef="go"/>'
    data = process("SEARCH", wait + "</intermediateCatchEvent>", more='<signal id="go"/>')
    main = call("SEARCH", roots='<signal id="go" m2pem:from="operator"/>')
    mission = parse_mission(main, "m.bpmn", Shelf(survey=data))
    assert mission.signals["go"].from_operator
    assert lint(mission) == []


def test_what_is_nowhere_is_refused_with_where_was_looked() -> None:
    with pytest.raises(MissionError) as caught:
        parse_mission(call("SEARHC"), "m.bpmn", Shelf(survey=process("SEARCH")))
    [finding] = caught.value.findings
    assert "no process or global task of this file, nor of a BPMN file in lib" in finding.message
    assert "--path" in finding.remedy


def test_an_expression_is_no_called_element() -> None:
    for target in ("${which}", "= which"):
        assert refused(call(target), Shelf()) == [("not-executed", "m.bpmn", 3, "T")]


def test_several_files_with_the_process_are_refused() -> None:
    shelf = Shelf(one=process("SEARCH"), two=process("SEARCH"))
    assert refused(call("SEARCH"), shelf) == [("ambiguous-call", "m.bpmn", 3, "T")]


@pytest.mark.parametrize("data", [b"<definitions>", b"<html/>", b"\xff"])
def test_an_imported_file_that_is_no_bpmn_is_refused(data: bytes) -> None:
    [found] = refused(importing(call("P"), "broken.bpmn"), Shelf(broken=data))
    assert found[:2] == ("unusable-file", "lib/broken.bpmn")


def test_an_import_that_cannot_be_read_is_a_warning_until_something_of_it_is_called() -> None:
    mission = parse_mission(importing(call("P"), "gone.bpmn"), "m.bpmn", Shelf())
    assert [(each.rule, each.line) for each in mission.warnings] == [("import-unreadable", 1)]
    assert refused(importing(call("X"), "gone.bpmn"), Shelf()) == [
        ("dangling-reference", "m.bpmn", 3, "T")
    ]


def test_imports_of_other_kinds_are_nothing_to_m2pem() -> None:
    schema = importing(call("P"), "types.xsd").replace(
        MODEL.encode() + b'" location', b'http://www.w3.org/2001/XMLSchema" location'
    )
    assert parse_mission(schema, "m.bpmn", Shelf()).warnings == ()


def test_the_same_mission_is_read_from_what_was_kept() -> None:
    shelf = Shelf(
        a=process("A", '<callActivity id="T" calledElement="B"/>'),
        b=importing(process("B"), "c.bpmn"),
        c=process("C"),
    )
    mission = parse_mission(call("A"), "m.bpmn", shelf)
    assert [each.name for each in mission.library] == ["lib/a.bpmn", "lib/b.bpmn", "lib/c.bpmn"]
    again = parse_mission(mission.source, mission.file, KeptLibrary(mission.library))
    assert list(again.elements) == list(mission.elements)
    assert again.library == mission.library
    with pytest.raises(MissionError):
        parse_mission(mission.source, mission.file, KeptLibrary(mission.library[:1]))
