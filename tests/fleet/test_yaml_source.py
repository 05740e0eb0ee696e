"""YAML that people wrote, and what is wrong in it."""

import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from m2pem.fleet import yaml_source
from m2pem.fleet.fleet_schema import FleetModel
from m2pem.fleet.yaml_source import YamlSource, dotted, note_shape_findings, parse_yaml, read_yaml


@pytest.fixture
def read(tmp_path: Path):
    def read(text: str | bytes) -> YamlSource:
        path = tmp_path / "a.yaml"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_yaml(path)

    return read


def rules(source: YamlSource) -> list[tuple[int, str]]:
    return [(finding.line, finding.rule) for finding in source.findings]


def test_values_come_out_as_json_and_know_their_lines(read) -> None:
    source = read("a:\n  b: [1, 2.5,\n   x]\n\nc: null\n")
    assert source.data == {"a": {"b": [1, 2.5, "x"]}, "c": None}
    assert source.line(("a", "b")) == 2
    assert source.line(("a", "b", 2)) == 3
    assert source.line(("c",)) == 5
    assert source.line(("a", "b", 7, "nowhere")) == 2
    assert source.findings == []


def test_scalars_are_those_of_yaml_1_2(read) -> None:
    source = read("[yes, no, on, off, y, true, 010, 12:30, 2026-01-01, ~]")
    expected = ["yes", "no", "on", "off", "y", True, 10, "12:30", "2026-01-01", None]
    assert source.data == expected


def test_a_key_that_stands_twice_is_found_at_its_second_line(read) -> None:
    source = read("a: 1\nb: {c: 1,\n c: 2}\na: 3\n")
    assert rules(source) == [(3, "duplicate-key"), (4, "duplicate-key")]
    assert "first in line 1" in source.findings[1].message
    assert source.findings[0].element == "b.c"


def test_tags_make_no_objects(read) -> None:
    source = read("a: !!python/object/apply:os.system [x]\nb: !foo 1\nc: !!binary aGk=\n")
    assert rules(source) == [(1, "yaml-tag"), (2, "yaml-tag"), (3, "yaml-tag")]
    assert source.data == {"a": None, "b": None, "c": None}


def test_a_core_tag_that_its_text_does_not_fit_is_found(read) -> None:
    assert rules(read("a: !!int abc\nb: !!bool maybe\nc: !!int\n")) == [
        (1, "yaml-tag"),
        (2, "yaml-tag"),
        (3, "yaml-tag"),
    ]


def test_keys_must_be_texts(read) -> None:
    assert rules(read("1: a\n[x]: b\nnull: c\n")) == [
        (1, "key-not-text"),
        (2, "key-not-text"),
        (3, "key-not-text"),
    ]


def test_numbers_must_be_finite_and_of_64_bits(read) -> None:
    assert rules(read("- .inf\n- .nan\n- 9223372036854775808\n- -9223372036854775808\n")) == [
        (1, "number"),
        (2, "number"),
        (3, "number"),
    ]


def test_merge_keys_are_refused_and_plain_aliases_read(read) -> None:
    source = read("a: &x {k: 1}\nb: *x\nc:\n  <<: *x\n")
    assert source.data == {"a": {"k": 1}, "b": {"k": 1}, "c": {}}
    assert rules(source) == [(4, "merge-key")]


def test_a_bomb_of_aliases_is_refused(read) -> None:
    text = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n"
    for level in range(1, 20):
        text += f"a{level}: &a{level} [{', '.join([f'*a{level - 1}'] * 10)}]\n"
    source = read(text)
    assert source.data is None
    assert rules(source) == [(0, "too-large")]


@pytest.mark.parametrize("text", ["&a [*a]", "&a {b: *a}"])
def test_an_alias_to_what_contains_it_is_refused(read, text: str) -> None:
    source = read(text)
    assert source.data is None
    assert [finding.rule for finding in source.findings] in (["too-large"], ["yaml-syntax"])


@pytest.mark.parametrize("depth", [100, 10_000])
def test_deep_nesting_is_refused(read, depth: int) -> None:
    source = read("[" * depth + "]" * depth)
    assert source.data is None
    assert rules(source) == [(0, "too-large")]


def test_a_file_that_is_too_large_is_not_parsed(read, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(yaml_source, "MAX_BYTES", 10)
    assert rules(read("a: 12345678")) == [(0, "too-large")]
    assert rules(read("a: 1234567")) == []


@pytest.mark.parametrize(
    ("text", "line"), [("a: 1\nb: [\n", 3), ("a: 1\n b: 2\n", 2), ("a: 1\n---\nb: 2\n", 2)]
)
def test_a_syntax_error_names_its_line(read, text: str, line: int) -> None:
    assert rules(read(text)) == [(line, "yaml-syntax")]


def test_a_byte_that_is_no_utf_8_is_found_at_its_line(read) -> None:
    assert rules(read(b"a: 1\nb: \xff\n")) == [(2, "not-utf-8")]


def test_a_missing_file_is_a_finding(tmp_path: Path) -> None:
    source = read_yaml(tmp_path / "none.yaml")
    assert rules(source) == [(0, "unreadable")]
    assert "No such file" in source.findings[0].message


def test_an_empty_file_is_null(read) -> None:
    source = read("# nothing\n")
    assert source.data is None
    assert source.findings == []


def test_a_place_is_named_by_keys_and_indices() -> None:
    assert dotted(("teams", "section", "members", 2)) == "teams.section.members[2]"


yamlish = st.text(alphabet="ab:[]{}&*!?|>-#%@'\"\n\t 01.,<~\\x\u2028\ufeff", max_size=60)


@given(yamlish.map(str.encode) | st.binary(max_size=60))
def test_any_bytes_come_out_as_plain_json_or_are_refused(
    tmp_path_factory: pytest.TempPathFactory, data
) -> None:
    path = tmp_path_factory.getbasetemp() / "any.yaml"
    path.write_bytes(data)
    read = read_yaml(path).data
    assert json.loads(json.dumps(read, allow_nan=False)) == read


def test_a_decimal_comma_in_a_flow_map_is_recognised() -> None:
    source = parse_yaml(b"home: {lat: 53,5400, lon: -9,5400}", "fleet.yaml")
    for finding, whole in zip(source.findings, ("53,5400", "-9,5400"), strict=True):
        assert finding.message == f"the comma splits the number {whole} in two"
        assert finding.remedy == f"write a decimal point: {whole.replace(',', '.')}"
    [other] = parse_yaml(b"home: {5400: 1}", "fleet.yaml").findings
    assert other.remedy == "keys are texts: quote it"


def findings(folder: Path, text: str) -> list[tuple[int, str, str, str, str]]:
    path = folder / "fleet.yaml"
    path.write_text(text)
    source = read_yaml(path)
    with pytest.raises(ValidationError) as refused:
        FleetModel.model_validate(source.data)
    note_shape_findings(source, refused.value, FleetModel)
    return [(f.line, f.element, f.rule, f.message, f.remedy) for f in source.findings]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (
            "version: 1\nvehicels: {}\n",
            (2, "vehicels", "unknown-key", "unknown key 'vehicels'", "did you mean 'vehicles'?"),
        ),
        (
            "version: 1\nvehicles:\n  a: {domain: air, arbiter: s, payloads: {p: {\n  xyz: 1}}}\n",
            (
                4,
                "vehicles.a.payloads.p.xyz",
                "unknown-key",
                "unknown key 'xyz'",
                "known keys: arbiter, connection, behaviors, detector, video, tags",
            ),
        ),
        (
            "version: 1\norigin: {lat: 1, lon: 2, height: 3}\n",
            (
                2,
                "origin.height",
                "unknown-key",
                "unknown key 'height'",
                "known keys: lat, lon, alt",
            ),
        ),
        (
            "version: 1\nvehicles:\n  a:\n    domain: air\n",
            (3, "vehicles.a.arbiter", "missing-key", "'arbiter' is missing", ""),
        ),
        (
            "version: 1\nvehicles:\n  a:\n    arbiter: sim\n    domain: grond\n",
            (
                5,
                "vehicles.a.domain",
                "bad-value",
                "'grond' is not one of 'ground', 'air', 'surface' or 'subsurface'",
                "did you mean 'ground'?",
            ),
        ),
        ("version: 2\n", (1, "version", "bad-value", "2 is not one of 1", "")),
        (
            "version: 1\nvehicles: [a]\n",
            (
                2,
                "vehicles",
                "bad-value",
                "['a'] is not a map",
                "write 'key: value' lines below it",
            ),
        ),
        (
            "version: 1\nvehicles:\n  a: {domain: air, arbiter: sim, manned: yes}\n",
            (
                3,
                "vehicles.a.manned",
                "bad-value",
                "'yes' is neither true nor false",
                "YAML 1.2 reads only true and false as such",
            ),
        ),
        (
            "version: 1\nvehicles:\n  a b: {domain: air, arbiter: sim}\n",
            (
                3,
                "vehicles.a b",
                "bad-name",
                "'a b' is no name: it has white space or '/' in it, or is empty",
                "",
            ),
        ),
        (
            "version: 1\nmax_outage: 30 m\n",
            (
                2,
                "max_outage",
                "bad-value",
                "'30 m' is a distance, not a duration; a duration is written with s, ms, min, h",
                "",
            ),
        ),
        ("version: 1\nmax_outage: 0\n", (2, "max_outage", "bad-value", "0 is not above 0", "")),
        (
            "version: 1\norigin: {lat: 98, lon: 0}\n",
            (2, "origin.lat", "bad-value", "98 should be less than or equal to 90", ""),
        ),
        (
            "version: 1\nteams: {t: {members: []}}\n",
            (2, "teams.t.members", "bad-value", "[] is too short", "at least one is needed"),
        ),
    ],
)
def test_each_mistake_is_told_in_a_persons_words(
    tmp_path: Path, text: str, expected: tuple[int, str, str, str, str]
) -> None:
    assert findings(tmp_path, text) == [expected]


def test_a_long_value_is_cut_in_the_message(tmp_path: Path) -> None:
    ((_, _, _, message, _),) = findings(tmp_path, f"version: 1\nvehicles: {'x' * 500}\n")
    assert len(message) < 100
