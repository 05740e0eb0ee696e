"""XML from strangers: entities, DTDs, encodings, sizes, depths and lines."""

from pathlib import Path

import pytest
from bpmn_text import around, findings, load, process, summary

from m2pem.bpmn import NO_BPMN_RULES
from m2pem.bpmn.xml import XmlError, max_bytes, parse_xml
from m2pem.errors import M2pemError, MissionError

GOOD = around('<task id="T" name="Überfahrt"/>')


def refused(data: bytes) -> tuple[str, int]:
    with pytest.raises(MissionError) as caught:
        load(data)
    (finding,) = caught.value.findings
    assert finding.message
    assert finding.remedy
    assert finding.rule in NO_BPMN_RULES
    return finding.rule, finding.line


def test_external_entities_are_not_read(tmp_path: Path) -> None:
    secret = tmp_path / "secret"
    secret.write_text("the secret")
    data = f'<!DOCTYPE d [<!ENTITY x SYSTEM "{secret.as_uri()}">]>\n<d>&x;</d>'.encode()
    assert refused(data) == ("doctype", 1)


def test_entities_are_not_expanded() -> None:
    laughs = '<!ENTITY l0 "lol">' + "".join(
        f'<!ENTITY l{i} "{f"&l{i - 1};" * 10}">' for i in range(1, 12)
    )
    assert refused(f"<!DOCTYPE d [{laughs}]><d a='&l11;'>&l11;</d>".encode()) == ("doctype", 1)


def test_external_dtds_are_not_fetched() -> None:
    data = (
        b'<?xml version="1.0"?>\n<!-- <x> -->\n<!DOCTYPE d SYSTEM "http://127.0.0.1:1/d.dtd">\n<d/>'
    )
    assert refused(data) == ("doctype", 3)


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be", "utf-32", "utf-8-sig"])
def test_a_doctype_in_another_encoding_is_seen(encoding: str) -> None:
    text = '<!DOCTYPE d [<!ENTITY x "y">]><d>&x;</d>'
    data = text.encode(encoding)
    rule, _ = refused(data)
    assert rule in ("doctype", "not-xml", "encoding")  # never read, whatever the byte order


def test_a_doctype_behind_an_odd_encoding_is_seen() -> None:
    text = "<?xml version='1.0' encoding='cp037'?><!DOCTYPE d [<!ENTITY x 'y'>]><d>&x;</d>"
    assert refused(text.encode("cp037"))[0] in NO_BPMN_RULES


def test_comments_and_instructions_before_the_root_are_no_doctype() -> None:
    text = GOOD.decode()
    assert load(f"<!-- <!DOCTYPE x> -->\n<?pi <!DOCTYPE?>\n{text}".encode()).nodes


def test_an_undeclared_entity_is_not_well_formed() -> None:
    assert refused(b"<d>\n&x;</d>") == ("not-xml", 2)


@pytest.mark.parametrize(
    "encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "iso-8859-1", "cp1252"]
)
def test_a_file_is_read_in_its_encoding(encoding: str) -> None:
    name = encoding.removesuffix("-sig").removesuffix("-le").removesuffix("-be")
    text = f'<?xml version="1.0" encoding="{name}"?>\n' + GOOD.decode()
    mission = load(text.encode(encoding))
    assert mission.nodes[0].name == "Überfahrt"
    assert mission.nodes[0].line == 4


def test_a_declaration_of_utf_16_over_bytes_is_forgiven() -> None:
    data = b'<?xml version="1.0" encoding="UTF-16"?>' + GOOD
    assert load(data).nodes[0].name == "Überfahrt"


def test_bytes_that_are_no_text_are_found_on_their_line() -> None:
    assert refused(b"<a>\n\xff\n</a>") == ("encoding", 2)


@pytest.mark.parametrize("name", ["klingon", "hex", "unicode_escape", "utf-7", "idna", "undefined"])
def test_unknown_encodings_are_refused(name: str) -> None:
    assert refused(f'<?xml version="1.0" encoding="{name}"?><a/>'.encode()) == ("encoding", 1)


@pytest.mark.parametrize(
    ("data", "line"),
    [
        (b"", 1),
        (b"hello", 1),
        (b"<a>\n<b>\n</a>", 3),
        (b"<a>\n</a>\n<b/>", 3),
        (b"<a\x00/>", 1),
        (b"<a>\x01</a>", 1),
        (b'<a b="1" b="2"/>', 1),
        (b"<x:a/>", 1),
        (b"{}", 1),
    ],
)
def test_what_is_no_xml(data: bytes, line: int) -> None:
    assert refused(data) == ("not-xml", line)


@pytest.mark.parametrize(
    "data",
    [
        b"<html/>",
        b"<definitions/>",
        b'<definitions xmlns="http://schema.omg.org/spec/BPMN/2.0"/>',
        b'<process xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" id="P"/>',
    ],
)
def test_what_is_no_bpmn(data: bytes) -> None:
    assert refused(data) == ("not-bpmn", 1)


def test_files_over_the_limit_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    data = around("<!--" + " " * (1024 * 1024) + '--><task id="T"/>')
    monkeypatch.setenv("M2PEM_MAX_MISSION_MIB", "1")
    assert refused(data) == ("too-large", 1)
    (found,) = findings(data)
    assert "1,048,576" in found.message
    assert "M2PEM_MAX_MISSION_MIB" in found.remedy
    monkeypatch.setenv("M2PEM_MAX_MISSION_MIB", "2")
    assert findings(data) == ()


def test_a_mission_of_23_mb_is_within_the_limit() -> None:
    assert max_bytes() > 24_000_000


def test_a_limit_that_is_no_number_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("M2PEM_MAX_MISSION_MIB", "much")
    with pytest.raises(M2pemError, match="M2PEM_MAX_MISSION_MIB='much'"):
        max_bytes()


def test_deeply_nested_extensions_are_refused() -> None:
    deep = "<x>" * 3000 + "</x>" * 3000
    data = process(f"<extensionElements>\n{deep}</extensionElements>")
    assert summary(data) == [("too-deep", 4, "")]


def test_lines_beyond_16_bits_are_exact() -> None:
    count = 23_000
    tasks = "".join(f'<task id="n{i}"\n>\n</task>\n' for i in range(count))
    mission = load(process(tasks))
    assert [node.line for node in mission.nodes] == [3 + 3 * i for i in range(count)]


def test_lines_with_markup_inside_comments_and_cdata() -> None:
    mission = load(
        process(
            "<!-- <task\n id='no'/> --><documentation><![CDATA[<a\n>]]></documentation>\n"
            "<task\n  id='T'/>"
        )
    )
    (task,) = mission.nodes
    assert task.line == 6


def test_a_text_in_the_file_is_utf_8_whatever_it_declares() -> None:
    document = parse_xml('<?xml version="1.0" encoding="latin1"?><a>é</a>'.encode(), declared=False)
    assert document.root.text == "é"


def test_errors_name_what_is_wrong() -> None:
    with pytest.raises(XmlError) as caught:
        parse_xml(b"<a><b></a>")
    assert "mismatch" in caught.value.message
    assert "line" not in caught.value.message.split("mismatch")[1][-10:]
