"""Names of the code use the words of docs/glossary.md, and none of those that it retires."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[1]
PAGE = (REPOSITORY / "docs" / "glossary.md").read_text(encoding="utf-8")
PRODUCT = [
    *sorted((REPOSITORY / "m2pem").rglob("*.py")),
    *sorted(REPOSITORY.glob("plugins/*/*/m2pem_plugin_*/**/*.py")),
]


def retired() -> set[str]:
    _, _, table = PAGE.partition("## Words that are not used")
    cells = re.findall(r"^\| ([^|]+) \| [^|]+ \|$", table, re.M)
    return {word for cell in cells if cell not in ("not", "---") for word in cell.split(", ")}


def words(name: str) -> set[str]:
    """The words of a name in snake case or camel case, in lower case."""
    return {word.lower() for word in re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", name)}


def names(file: Path) -> Iterator[str]:
    """Its path inside of its distribution, and what it defines."""
    yield from file.relative_to(REPOSITORY).with_suffix("").parts[-4:]
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            yield node.name


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("VehicleController", {"vehicle", "controller"}),
        ("was_heard", {"was", "heard"}),
        ("MAVLink_message", {"mav", "link", "message"}),
        ("_told", {"told"}),
    ],
)
def test_a_name_is_split_into_words(name: str, expected: set[str]) -> None:
    assert words(name) == expected


def test_no_name_of_the_code_contains_a_retired_word() -> None:
    assert {"helm", "wishes", "somebody"} <= retired()
    assert len(PRODUCT) > 300
    found = {
        f"{file.relative_to(REPOSITORY)}: {name}"
        for file in PRODUCT
        for name in names(file)
        if words(name) & retired()
    }
    assert sorted(found) == []
