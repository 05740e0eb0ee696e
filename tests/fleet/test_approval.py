"""What is approved: the content of a mission's files, and of the drawings that they name."""

import pytest

from m2pem.fleet.approval import MISSION_PART, content_of, file_digest, person_of
from m2pem.mission.geometry import Geometry, Point, Route
from m2pem.mission.library import Source

MISSION = b'<definitions><property value="gate"/></definitions>'
GATE, HOME = Point((38.0, -77.0, None)), Point((38.1, -77.0, None))


def source(name: str, data: bytes, *answers: tuple[str, str, str]) -> Source:
    return Source(name, data, answers)


def test_the_content_has_the_files_and_the_drawings_that_they_name() -> None:
    called = source("/a/called.bpmn", b"<x/>", ("call", "P", ""))
    content = content_of(MISSION, [called], {"gate": GATE, "home": HOME})
    assert content.parts.keys() == {MISSION_PART, "called.bpmn", "drawing gate"}
    assert content.files == (file_digest(MISSION), file_digest(b"<x/>"))
    assert content.drawings == ("gate",)


@pytest.mark.parametrize(
    ("mission", "library", "geometries"),
    [
        (MISSION + b" ", [source("c.bpmn", b"1", ("call", "P", ""))], {"gate": GATE}),
        (MISSION, [source("c.bpmn", b"2", ("call", "P", ""))], {"gate": GATE}),
        (MISSION, [source("c.bpmn", b"1", ("call", "Q", ""))], {"gate": GATE}),
        (MISSION, [source("c.bpmn", b"1", ("call", "P", ""))], {"gate": HOME}),
        (MISSION, [source("c.bpmn", b"1", ("call", "P", ""))], {}),
        (MISSION, [], {"gate": GATE}),
    ],
)
def test_any_change_makes_another_content(
    mission: bytes, library: list[Source], geometries: dict[str, Geometry]
) -> None:
    first = content_of(MISSION, [source("c.bpmn", b"1", ("call", "P", ""))], {"gate": GATE})
    assert content_of(mission, library, geometries).digest != first.digest


def test_where_the_files_are_and_other_drawings_do_not_matter() -> None:
    here = [source("/a/b.bpmn", b"1", ("import", "b.bpmn", "/a/m.bpmn")), source("/a/c.bpmn", b"2")]
    there = [source("/x/c.bpmn", b"2"), source("b.bpmn", b"1", ("import", "b.bpmn", "m.bpmn"))]
    first = content_of(MISSION, here, {"gate": GATE, "home": HOME})
    assert content_of(MISSION, there, {"gate": GATE}).digest == first.digest


@pytest.mark.parametrize(
    "text",
    [
        b'<a value="g&#97;te"/>',
        '<?xml version="1.0" encoding="UTF-16"?><a value="gate"/>'.encode("utf-16"),
        b'<?xml version="1.0" encoding="ISO-8859-1"?><a/>',
    ],
)
def test_a_name_that_bytes_may_hide_counts_as_named(text: bytes) -> None:
    assert content_of(text, (), {"gate": GATE}).drawings == ("gate",)


def test_what_has_changed_since_is_named() -> None:
    before = content_of(MISSION, [source("c.bpmn", b"1")], {"gate": GATE})
    route = Route(((38.0, -77.0, None), (38.1, -77.0, None)))
    after = content_of(MISSION, [source("d.bpmn", b"1")], {"gate": route})
    assert after.changed_since(before.parts) == ("c.bpmn", "drawing gate", "d.bpmn")


def test_files_of_one_name_are_told_apart() -> None:
    library = [source("/a/c.bpmn", b"1"), source("/b/c.bpmn", b"2")]
    assert list(content_of(MISSION, library, {}).parts) == [MISSION_PART, "c.bpmn", "c.bpmn (2)"]


def test_a_person_is_the_same_on_every_host() -> None:
    assert person_of("Anna@gcs1") == person_of("anna") == "anna"
    assert person_of("@gcs1") == ""


def test_a_name_is_the_same_however_it_is_written() -> None:
    assert person_of("Jose\u0301") == person_of("Jos\u00e9"), "an accent of its own"
    assert person_of("\uff21nna\uff20gcs1") == "anna", "letters of full width"
