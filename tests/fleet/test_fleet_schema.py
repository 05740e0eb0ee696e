import json
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from ruamel.yaml import YAML

from m2pem.fleet.fleet_schema import fleet_schema

FLEETS = Path(__file__).parents[2] / "fleet_configs"


def errors(value: object, schema: Any = None) -> list[str]:
    """What is wrong with a value by a schema, by default that of fleets."""
    validator = jsonschema.Draft202012Validator(schema or fleet_schema())
    return [error.message for error in validator.iter_errors(value)]


def test_the_committed_schema_is_the_one_that_fleets_are_checked_by() -> None:
    committed = json.loads((FLEETS / "fleet.schema.json").read_text(encoding="utf-8"))
    assert committed == fleet_schema(), "write the output of `m2pem fleet --schema` there"


def test_the_schema_is_a_schema() -> None:
    assert errors(fleet_schema(), jsonschema.Draft202012Validator.META_SCHEMA) == []


@pytest.mark.parametrize("path", sorted(FLEETS.glob("*.yaml")), ids=lambda path: path.name)
def test_every_example_fits_the_schema(path: Path) -> None:
    assert errors(YAML(typ="safe", pure=True).load(path.read_text(encoding="utf-8"))) == []


@pytest.mark.parametrize("duration", ["30 s", "2min", "1.5 h", 30, 0.5])
def test_the_schema_takes_quantities_as_texts_and_numbers(duration: object) -> None:
    assert errors({"version": 1, "max_outage": duration}) == []


@pytest.mark.parametrize(
    "fleet",
    [
        {"version": 2},
        {"version": 1, "vehicle": {}},
        {"version": 1, "max_outage": "30 m"},
        {"version": 1, "max_outage": 0},
        {"version": 1, "max_outage": "-3 s"},
        {"version": 1, "vehicles": {"a/b": {"domain": "air", "arbiter": "sim"}}},
        {"version": 1, "vehicles": {"a": {"domain": "space", "arbiter": "sim"}}},
        {"version": 1, "teams": {"t": {"members": []}}},
    ],
)
def test_the_schema_refuses_what_the_loader_refuses(fleet: object) -> None:
    assert errors(fleet)
