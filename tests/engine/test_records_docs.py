"""docs/records.md says what the records are: names, fields, types and values, no more, no less."""

import re
from enum import EnumMeta
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Union, get_args, get_origin

import msgspec
import pytest

from m2pem.engine.inputs import IncidentChoice, Input
from m2pem.engine.records import Record, RunOutcome, TokenOutcome, Trigger
from m2pem.mission.catalogue import BehaviorState

PAGE = (Path(__file__).parents[2] / "docs" / "records.md").read_text(encoding="utf-8")
RECORDS = {kind.__name__: kind for kind in get_args(Record)}
PLAIN = {str: "text", int: "integer", bool: "boolean", NoneType: "null"}


def rows(heading):
    """The cells of the table under a heading, row by row."""
    section = PAGE.split(f"\n{heading}\n", 1)[1].split("\n#", 1)[0]
    table = [line for line in section.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in table[2:]]


def documented_records():
    sections = re.findall(r"^## .*", PAGE, re.M)
    return [row for section in sections if section != "## Fields" for row in rows(section)]


def quoted(cell):
    return re.findall(r"`([^`]+)`", cell)


def json_type(kind):
    origin, arguments = get_origin(kind), get_args(kind)
    if kind is Any or float in arguments:
        return "any"
    if kind in PLAIN:
        return PLAIN[kind]
    if isinstance(kind, EnumMeta):
        return "text"
    if origin is tuple and arguments[0] is Any:
        return "list"
    if origin is tuple:
        return f"list of {json_type(arguments[0])}s"
    if origin is dict or kind == Input:
        return "object"
    assert origin in (Union, UnionType), kind
    return " or ".join(map(json_type, arguments))


def json_types():
    """Each field's type: the same in all records, but that some may be null as well."""
    types = {}
    for kind in RECORDS.values():
        for field in msgspec.structs.fields(kind):
            found = json_type(field.type)
            before = types.get(field.name, found)
            assert found.removesuffix(" or null") == before.removesuffix(" or null"), field.name
            types[field.name] = max(before, found, key=len)
    return types


def test_every_record_is_documented_in_the_order_of_the_code():
    assert [quoted(row[0]) for row in documented_records()] == [[name] for name in RECORDS]


@pytest.mark.parametrize("row", documented_records(), ids=lambda row: row[0].strip("`"))
def test_a_records_fields_are_those_of_the_code(row):
    name, fields, meaning = row
    kind = RECORDS[quoted(name)[0]]
    expected = [
        field.name + ("" if field.required else "?") for field in msgspec.structs.fields(kind)
    ]
    assert quoted(fields) == expected
    assert meaning


@pytest.mark.parametrize("kind", RECORDS.values(), ids=lambda kind: kind.__name__)
def test_only_fields_with_nothing_to_say_are_left_out(kind):
    for field in msgspec.structs.fields(kind):
        if not field.required:
            empty = field.default if field.default is not msgspec.NODEFAULT else {}
            assert empty in ("", 0, False, None, {}, ())


def test_every_field_is_explained_with_its_type():
    documented = {quoted(name)[0]: kind for name, kind, _ in rows("## Fields")}
    assert documented == json_types()
    assert list(documented) == sorted(documented)


def test_every_value_of_a_field_with_few_is_listed():
    assert {name: quoted(values) for name, values in rows("### Values")} == {
        "`choice`": list(IncidentChoice),
        "`outcome` of a token or scope": list(TokenOutcome),
        "`outcome` of a run": list(RunOutcome),
        "`state`": list(BehaviorState),
        "`trigger`": list(Trigger),
    }
