"""Tests see of the product what its users see: no test touches a private attribute of it.

A class of the tests may have private attributes; only it uses them (`self._x`).
"""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[1]
FILES = [
    file
    for folder in (REPOSITORY / "tests", *sorted(REPOSITORY.glob("plugins/*/*/tests")))
    for file in sorted(folder.rglob("*.py"))
    if "node_modules" not in file.parts
]
PRODUCT = re.compile(r"(m2pem|bench|tools)\b|m2pem_plugin_\w+")
PRIVATE = re.compile(r"_(?!_)\w+")
PUBLIC = {
    *("_asdict", "_fields", "_replace", "_exit", "_current_frames", "_Element"),
    *("_repr_html_", "_repr_svg_"),
    *("_shutdown", "_run_exitfuncs"),
}
"""Of named tuples, `os`, `sys`, `lxml.etree`, IPython and the end of Python: not of the product."""

EXCEPTIONS = {
    ("tests/verify/test_interrupted_search.py", "_Search"): "Ctrl-C comes at each line of the "
    "loop of the search, which only its frame tells",
    ("tests/verify/test_interrupted_search.py", "_loop"): "as above",
    ("tests/test_site.py", "_LAZY"): "a name that can be loaded and is missing in `__all__` is "
    "in this table only",
    ("plugins/arbiters/mavlink/tests/test_mavlink_sitl_planes.py", "_units"): "a landing is "
    "stored on a real plane by the driver under test, as MAVSDK shares its port with no other link",
}
"""By file and name: why nothing public reaches the same."""


def touched(text: str) -> Iterator[tuple[int, str]]:
    """The lines of a test where it touches private names that are not its own."""
    for node in ast.walk(ast.parse(text)):
        names: list[str] = []
        if isinstance(node, ast.Attribute) and not _is_own(node.value):
            names = [node.attr]
        elif isinstance(node, ast.ImportFrom) and PRODUCT.match(node.module or ""):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.Call) and _called(node).endswith("attr"):
            # getattr(it, "_x"), monkeypatch.setattr(it, "_x", ...), setattr("m2pem.it._x", ...)
            texts = [each.value for each in node.args[:2] if isinstance(each, ast.Constant)]
            names = [str(each).rpartition(".")[2] for each in texts]
        for name in names:
            if PRIVATE.fullmatch(name) and name not in PUBLIC:
                yield node.lineno, name


def _is_own(owner: ast.expr) -> bool:
    if isinstance(owner, ast.Call):
        return _called(owner) == "super"
    return isinstance(owner, ast.Name) and owner.id in ("self", "cls")


def _called(call: ast.Call) -> str:
    function = call.func
    if isinstance(function, ast.Attribute):
        return function.attr
    return function.id if isinstance(function, ast.Name) else ""


@pytest.mark.parametrize(
    "text",
    [
        "bench.arbiter._context.bus",
        "class It:\n    def go(self):\n        self.journal._writing.execute()",
        "monkeypatch.setattr(it, '_now', 1)",
        "monkeypatch.setattr('m2pem.journal.sqlite._now', 1)",
        "getattr(it, '_now')",
        "from m2pem_plugin_ros.arbiter import _now",
    ],
)
def test_a_private_attribute_of_the_product_is_found(text: str) -> None:
    assert len(list(touched(text))) == 1


@pytest.mark.parametrize(
    "text",
    [
        "class It:\n    def go(self):\n        self._x = super()._go()",
        "message._replace(x=1)",
        "it.__class__",
        "getattr(it, 'x')",
        "from collections.abc import _x",
    ],
)
def test_what_is_public_or_of_the_test_itself_is_not(text: str) -> None:
    assert list(touched(text)) == []


def test_no_test_touches_a_private_attribute_of_the_product() -> None:
    assert len(FILES) > 500
    found = {
        (file.relative_to(REPOSITORY).as_posix(), name): line
        for file in FILES
        for line, name in touched(file.read_text(encoding="utf-8"))
    }
    wrong = [f"{at[0]}:{line} {at[1]}" for at, line in found.items() if at not in EXCEPTIONS]
    assert wrong == []
    assert EXCEPTIONS.keys() - found.keys() == set(), "these are exceptions no more"
