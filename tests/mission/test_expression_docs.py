"""docs/conditions.md says what the language does."""

import json
import re
from pathlib import Path

import pytest

from m2pem.errors import ExpressionError, ExpressionSyntaxError
from m2pem.mission.behavior import Assignment, ThrowError
from m2pem.mission.expression import parse, template
from m2pem.mission.expression.calls import FLOWABLE, METHODS, XPATH_DATA, XPATH_NAMES
from m2pem.mission.expression.feel_functions import FEEL_FUNCTIONS
from m2pem.mission.expression.functions import FUNCTIONS
from m2pem.mission.script import parse_script
from m2pem.mission.timers import cycle, date_us, duration_us

DOCS = (Path(__file__).parents[2] / "docs" / "conditions.md").read_text(encoding="utf-8")
DATA = json.loads(re.search(r"```json\n(.*?)```", DOCS, re.DOTALL)[1])
EXAMPLES = [
    tuple(re.split(r"\s+-> ", line))
    for block in re.findall(r"```text\n(.*?)```", DOCS, re.DOTALL)
    for line in block.splitlines()
]
FUNCTION_ROWS = re.findall(r"^\| `(\w+\([^`]*\))` \| (.+) \| `(.+)` is `(.+)` \|$", DOCS, re.M)


@pytest.mark.parametrize(("text", "outcome"), EXAMPLES)
def test_every_example_does_what_the_docs_say(text, outcome):
    if outcome == "refused":
        with pytest.raises(ExpressionSyntaxError):
            parse(text)
    elif outcome == "error":
        with pytest.raises(ExpressionError):
            parse(text).evaluate(DATA.get)
    else:
        assert repr(parse(text).evaluate(DATA.get)) == repr(json.loads(outcome))


def test_the_docs_have_examples():
    assert len(EXAMPLES) > 30


def test_the_docs_list_every_function_and_no_other():
    assert [row[0] for row in FUNCTION_ROWS] == [each.signature for each in FUNCTIONS.values()]


@pytest.mark.parametrize(
    ("name", "example", "value"), [(s.partition("(")[0], e, v) for s, _, e, v in FUNCTION_ROWS]
)
def test_the_example_of_every_function_is_true(name, example, value):
    assert f"{name}(" in example
    assert repr(parse(example).evaluate(DATA.get)) == repr(json.loads(value))


STANDARD = """
date, date and time, time, duration, years and months duration, number, string, range, not
substring, string length, upper case, lower case, substring before, substring after, contains
starts with, ends with, matches, replace, split, string join, decimal, floor, ceiling, round up
round down, round half up, round half down, abs, modulo, sqrt, log, exp, odd, even, list contains
count, min, max, sum, product, mean, median, stddev, mode, all, any, sublist, append, concatenate
insert before, remove, list replace, reverse, index of, union, distinct values, flatten, sort
get value, get entries, context, context put, context merge, day of week, day of year, week of year
month of year, is, before, after, meets, met by, overlaps, overlaps before, overlaps after, finishes
finished by, includes, during, starts, started by, coincides, now, today
"""
"""The built-in functions of DMN 1.5, 10.3.4."""


def test_the_docs_list_every_name_of_feel_beside_those_of_the_standard():
    standard = set(re.split(", |\n", STANDARD.strip()))
    assert standard <= {*FEEL_FUNCTIONS, "not", "now", "today"}
    assert [name for name in {*FEEL_FUNCTIONS} - standard - {"@"} if f"`{name}`" not in DOCS] == []


@pytest.mark.parametrize("name", sorted({*METHODS, *FLOWABLE, *XPATH_DATA, *XPATH_NAMES}))
def test_the_docs_list_what_is_read_of_other_dialects(name):
    assert f"`{name}`" in DOCS


def test_parameters_are_as_the_docs_say():
    assert template("5 m/s").evaluate(DATA.get) == "5 m/s"
    assert template("${mission.speed}").evaluate(DATA.get) == 2.5
    assert template("= mission.speed").evaluate(DATA.get) == 2.5
    assert template("area_${mission.lap}").evaluate(DATA.get) == "area_3"
    assert template(r"\${x}").evaluate(DATA.get) == "${x}"


def test_the_script_of_the_docs_is_well():
    script, problems = parse_script(re.search(r"```python\n(.*?)```", DOCS, re.DOTALL)[1])
    assert not problems
    assert [type(each) for each in script.statements] == [Assignment, Assignment, ThrowError]


def test_every_time_of_the_docs_is_read():
    readers = {"duration": lambda text: duration_us(text, 0), "date": date_us, "cycle": cycle}
    section = DOCS.partition("## Times")[2]
    for name, read in readers.items():
        cells = re.findall(rf"^\| {name} \| (.+?) \|", section, re.M)
        assert cells
        for text in re.findall(r"`([^`]+)`", " ".join(cells)):
            read(text)
