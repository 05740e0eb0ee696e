"""The JSON Schema of variations files says of files what their reader does, as far as it can."""

import json
import re
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from ruamel.yaml import YAML

from bench.campaigns import VARIATIONS
from m2pem.campaign.variations import read_variations
from m2pem.campaign.variations_file import variations_schema
from m2pem.errors import AnswersError
from tests.campaign.conftest import TWO

REPOSITORY = Path(__file__).parents[2]
FOLDER = REPOSITORY / "missions" / "variations"
PAGE = (REPOSITORY / "docs" / "campaigns.md").read_text(encoding="utf-8")
ON_PAGE = re.findall(r"```yaml\n(.*?)```", PAGE, re.DOTALL)
EXAMPLES = {
    **{f"page, example {number}": text for number, text in enumerate(ON_PAGE, 1)},
    "bench": VARIATIONS.decode(),
    "tests": TWO,
    **{file.name: file.read_text(encoding="utf-8") for file in FOLDER.glob("*.yaml")},
}


def errors(text: str) -> list[str]:
    """What is wrong with a variations file by the schema."""
    validator = jsonschema.Draft202012Validator(variations_schema())
    content = YAML(typ="safe", pure=True).load(text)
    return [error.message for error in validator.iter_errors(content)]


def is_read(text: str) -> bool:
    try:
        read_variations(text.encode())
    except AnswersError:
        return False
    return True


def test_the_committed_schema_is_the_one_of_the_reader() -> None:
    committed = json.loads((FOLDER / "variations.schema.json").read_text(encoding="utf-8"))
    assert committed == variations_schema(), "write the output of `m2pem campaign --schema` there"


def test_the_schema_is_a_schema() -> None:
    jsonschema.Draft202012Validator.check_schema(variations_schema())


@pytest.mark.parametrize("name", EXAMPLES)
def test_every_example_fits_the_schema_and_is_read(name: str) -> None:
    assert errors(EXAMPLES[name]) == []
    assert is_read(EXAMPLES[name])


def test_the_page_shows_the_example() -> None:
    assert ON_PAGE[0] == EXAMPLES["vignette1.yaml"]


@pytest.mark.parametrize(
    "text",
    [
        "behaviours: {}",
        "behaviors: []",
        "behaviors: {'': {duration: 5 s}}",
        "behaviors: {A: {fails: {probability: 2}}}",
        "behaviors: {A: {fails: {probability: '0.5'}}}",
        "behaviors: {A: {fails: {probability: true}}}",
        "behaviors: {A: {fails: {after: 2 s}}}",
        "behaviors: {A: {fails: {probability: 0.5, error: ''}}}",
        "behaviors: {A: {after: 5 s}}",
        "behaviors: {A: {duration: 5 s, duration_factor: 2}}",
        "services: {A: {write: {a: 1}}}",
        "services: {A: {write: [{weight: -1, data: {a: 1}}]}}",
        "services: {A: {write: [{weight: 1}]}}",
        "answers: {Ask: [yes]}",
        "answers: {Ask: {yes: much}}",
        "signals: [{id: stop}]",
        "signals: [{at: 5 s}]",
        "links: [{vehicle: uav1}]",
        "links: [{vehicle: uav1, at: 5 s, until: 8 s}]",
        "vehicles: {uav1: {batery: 5 %}}",
        "vehicles: {uav1: 5}",
        "wind: 5",
        "wind: {from: 5 deg}",
        "links: [{vehicle: uav1, at: 5 s, sampled: 1}]",
        "signals: [{id: stop, at: 5 s, sampled: 0}]",
        "visits: 0",
        "visits: 1001",
        "visits: 1.5",
    ],
)
def test_the_schema_refuses_what_the_reader_refuses(text: str) -> None:
    assert errors(text)
    assert not is_read(text)


def drawn(file: str, value: Any) -> str:
    return file.replace("VALUE", json.dumps(value))


FILES = {
    "duration": "behaviors: {A: {duration: VALUE}}",
    "factor": "behaviors: {A: {duration_factor: VALUE}}",
    "speed": "wind: {speed: VALUE}",
    "angle": "wind: {speed: 5, from: VALUE}",
    "battery": "vehicles: {uav1: {battery: VALUE}}",
}
VALUES = [
    *(0, 0.5, 1, 5, -1, True, [], {}, "", "x", "0.5", "1", "5", "-5", " 5 ", "5.", ".5", "1e-2"),
    *("5 s", "5s", "+5 min", "5 m", "-5 s", "5 kn", "7 m/s", "-7 m/s", "45 deg", "-0.5 rad"),
    *("5 %", "100 %", "100.0%", "101 %", "-5 %", ".5 %", "1.5"),
    *("1..2", "1..2 s", "1 s..2 min", "1 s..2", "0.1..0.2", "5..6 m/s", "1..2..3", "1..", "..2"),
    *("0..90 deg", "-90 deg..1 rad", "0 deg..90", "60..100 %", "60%..100%", "0.6..100 %"),
    *({"uniform": [0.1, 0.2]}, {"uniform": [0.1]}, {"uniform": "1..2"}, {"gauss": [1, 2]}),
    *({"uniform": ["10 deg", "20 deg"]}, {"triangular": ["1 s", "2 s", "5 s"]}),
    *({"triangular": [0.1, 0.2, 0.3]}, {"triangular": [0.1, 0.2]}),
    {"normal": {"mean": 0.5, "sd": 0.1, "low": 0.2, "high": 0.9}},
    {"normal": {"mean": "5 deg", "sd": "2 deg"}},
    {"normal": {"mean": 0.5}},
    {"normal": {"mean": 0.5, "sd": 0.1, "mode": 1}},
    {"lognormal": {"median": "3 min", "sigma": 0.2}},
    {"lognormal": {"median": "3 m/s", "sigma": "0.2"}},
    {"lognormal": {"median": "3 m/s", "sigma": 0}},
    {"weibull": {"scale": "5 m/s", "shape": 2}},
    *({"exponential": "40 s"}, {"exponential": "4 m/s"}, {"exponential": [1]}),
    *({"lognormal": {"median": 1, "sigma": 0.2}}, {"uniform": [0, 2]}, "0..2", "0.0", "0.01"),
    *({"exponential": 0.4}, {"weibull": {"scale": 0.5, "shape": 1}}),
    {"uniform": [0.1, 0.2], "exponential": 1},
]


@pytest.mark.parametrize("quantity", FILES)
def test_schema_and_reader_agree_on_distributions(quantity: str) -> None:
    for value in VALUES:
        text = drawn(FILES[quantity], value)
        assert (errors(text) == []) is is_read(text), text


@pytest.mark.parametrize(
    "text",
    [
        "behaviors: {A: {duration: 5..2 s}}",
        "behaviors: {A: {duration: {normal: {mean: 5 s, sd: 0 s}}}}",
        "answer_times: {Ask: 5 s}",
    ],
)
def test_what_compares_values_is_left_to_the_reader(text: str) -> None:
    assert errors(text) == []
    assert not is_read(text)
