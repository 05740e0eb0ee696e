"""No name of the code contains a word that CONTRIBUTING.md retires."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[1]
PAGE = (REPOSITORY / "CONTRIBUTING.md").read_text(encoding="utf-8")
PRODUCT = [
    *sorted((REPOSITORY / "m2pem").rglob("*.py")),
    *sorted(REPOSITORY.glob("plugins/*/*/m2pem_plugin_*/**/*.py")),
]


def retired() -> set[str]:
    table = PAGE.partition("## Words that are not used")[2].partition("\n## ")[0]
    cells = re.findall(r"^\| ([^|]+) \| [^|]+ \|$", table, re.M)
    return {word for cell in cells if cell not in ("not", "---") for word in cell.split(", ")}


def words(name: str) -> set[str]:
    """The words of a name in snake case or camel case, in lower case."""
    return {word.lower() for word in re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", name)}


def names(file: Path) -> Iterator[str]:
    """Its path inside of its distribution, and the names that it defines or binds."""
    yield from file.relative_to(REPOSITORY).with_suffix("").parts[-4:]
    yield from bound_names(file.read_text(encoding="utf-8"))


def bound_names(source: str) -> Iterator[str]:
    """Names of classes, functions, parameters, variables, attributes and import aliases."""
    for node in ast.walk(ast.parse(source)):
        match node:
            case ast.ClassDef(name) | ast.FunctionDef(name) | ast.AsyncFunctionDef(name):
                yield name
            case ast.arg(name) | ast.alias(asname=str(name)) | ast.ExceptHandler(name=str(name)):
                yield name
            case ast.Name(name, ast.Store()) | ast.Attribute(_, name, ast.Store()):
                yield name
            case ast.MatchAs(name=str(name)) | ast.MatchStar(name=str(name)):
                yield name
            case _:
                pass


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


@pytest.mark.parametrize(
    "source",
    [
        "class Told: pass",
        "def told(): pass",
        "async def told(): pass",
        "def f(told): pass",
        "f = lambda *, told: 0",
        "told = 1",
        "told: int",
        "for told in range(2): pass",
        "self._told = 1",
        "import m2pem as told",
        "with f() as told: pass",
        "try: pass\nexcept ValueError as told: pass",
        "match f():\n    case {'a': told}: pass",
        "match f():\n    case [*told]: pass",
    ],
)
def test_a_retired_word_is_found_wherever_it_is_bound(source: str) -> None:
    assert any("told" in words(name) for name in bound_names(source))


def test_a_name_that_is_only_read_is_that_of_another_library() -> None:
    assert list(bound_names("message.heard")) == []


def test_no_name_of_the_code_contains_a_retired_word() -> None:
    assert {"helm", "wishes", "somebody"} <= retired()
    assert len(PRODUCT) > 300
    not_used = retired()
    found = {
        f"{file.relative_to(REPOSITORY)}: {name}"
        for file in PRODUCT
        for name in set(names(file))
        if words(name) & not_used
    }
    assert sorted(found) == []
