"""Holds docs/fleets.md to what the code does."""

import re
from collections import defaultdict
from pathlib import Path

import jsonschema
import pytest
from ruamel.yaml import YAML

from m2pem.fleet.behaviors import ALTITUDE_FRAME, SHARED
from m2pem.fleet.fleet_schema import fleet_schema
from m2pem.mission.catalogue import ParameterKind
from m2pem.units import UNITS

DOCS = Path(__file__).parents[2] / "docs"
TEXT = (DOCS / "fleets.md").read_text(encoding="utf-8")
BOUNDS = (DOCS / "evidence.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("example", re.findall(r"```yaml\n(.*?)```", TEXT, re.DOTALL))
def test_the_examples_fit_the_schema(example: str) -> None:
    fleet = YAML(typ="safe", pure=True).load(example)
    validator = jsonschema.Draft202012Validator(fleet_schema())
    assert [error.message for error in validator.iter_errors(fleet)] == []


def test_every_key_and_unit_is_explained() -> None:
    schema = fleet_schema()
    keys = {key for model in (schema, *schema["$defs"].values()) for key in model["properties"]}
    units = {unit for of_dimension in UNITS.values() for unit in of_dimension}
    assert {name for name in keys | units if f"`{name}`" not in TEXT + BOUNDS} == set()


def test_the_table_of_behaviors_is_the_catalogue() -> None:
    types: dict[str, list[str]] = defaultdict(list)
    parameters: dict[str, str] = {}
    for (name, type_), spec in SHARED.items():
        types[name].append(type_.value)
        parameters[name] = ", ".join(
            f"**{p.name}: {_kind(p.kind)}**" if p.required else f"{p.name}: {_kind(p.kind)}"
            for p in spec.parameters
            if p is not ALTITUDE_FRAME
        )
    rows = re.findall(r"^\| `(\w+)` \| ([a-z, ]+) \| ([^|]*) \| [A-Z].*\. \|$", TEXT, re.MULTILINE)
    written = {name: (of, re.sub(r" \([\d.]+\)", "", listed)) for name, of, listed in rows}
    assert written == {name: (", ".join(types[name]), parameters[name]) for name in parameters}


def _kind(kind: ParameterKind) -> str:
    return kind.value.replace("_", " ")
