"""Outside programs, as the tests say that they try them: docs/tried-with.md.

A test (or a class of tests, or a module by `pytestmark`) that runs an outside program has the mark
`pytest.mark.tried_with`, with the arguments of `_row`. Tests are read, not imported: no plugin and
no ROS is needed. `python -m tools.tried_with > docs/tried-with.md` writes the page.
"""

import ast
import json
import re
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

REPOSITORY = Path(__file__).parents[1]
PAGE = REPOSITORY / "docs" / "tried-with.md"
KINDS = (
    "Autopilots",
    "MAVLink clients",
    "BPMN editors",
    "BPMN engines",
    "Model checkers",
    "ROS 2",
    "Automated guided vehicles",
    "TAK",
    "Cameras",
    "Maps and geodesy",
    "Recordings and analysis",
    "Databases and brokers",
    "Observability",
    "Browsers and the web",
    "Platforms",
)
_PINS = (
    "constraints.txt",
    "ros/constraints.txt",
    "ros/colcon.txt",
    "tools/conformance/spiffworkflow.txt",
)
_LOCKS = ("tests/js/package-lock.json", "plugins/ocu/web/ui/package-lock.json")
_PINNED = re.compile(r"^([\w.-]+)==(\S+)", re.M)
_HEAD = """# Tried with

Programs, formats and devices of others that m2pem is tried with. Each row is a test that runs what
it names; `.venv/bin/python -m pytest FILE -k NAME` repeats it. Where a month is given, the test
needs what `make setup` does not install, such as
[real autopilots](mavlink.md#real-autopilots-in-the-loop); the others run each time. A version with
a package in brackets is the one that the tests are pinned to.

Written from the tests: mark one with `tried_with`, then `python -m tools.tried_with >
docs/tried-with.md`.
"""
_COLUMNS = ("program", "version", "what was done", "result", "what to know", "when", "test")


@dataclass(frozen=True, slots=True)
class Row:
    """An outside program and what a test does with it. `test`: file::name, as of pytest."""

    kind: str
    program: str
    version: str
    did: str
    result: str
    note: str
    when: str
    test: str


class MarkError(Exception):
    """A mark says too little, too much or what cannot be; the message names the test."""


def rows() -> list[Row]:
    """Return a row for each mark, by kind and program.

    Raises:
        MarkError: a mark cannot be used.
    """
    folders = (REPOSITORY / "tests", *sorted(REPOSITORY.glob("plugins/*/*/tests")))
    found = [
        row
        for folder in folders
        for file in sorted(folder.rglob("test_*.py"))
        for row in rows_of(str(file.relative_to(REPOSITORY)), file.read_text(encoding="utf-8"))
    ]
    return sorted(found, key=lambda row: (KINDS.index(row.kind), row.program.lower(), row.test))


def rows_of(file: str, text: str) -> list[Row]:
    """Return the rows of the marks in a file with that text.

    Raises:
        MarkError: a mark cannot be used.
    """
    if "mark.tried_with(" not in text:
        return []
    marked = [_marks(node) for node in ast.parse(text).body]
    of_module = [mark for name, marks in marked if not name for mark in marks]
    found = []
    for name, marks in marked:
        for mark in marks:
            if _name(mark) == "tried_with":
                test = f"{file}::{name}".removesuffix("::")
                literals = [ast.literal_eval(each) for each in mark.args]
                named = {str(each.arg): ast.literal_eval(each.value) for each in mark.keywords}
                try:
                    found.append(_row(test, [*marks, *of_module], *literals, **named))
                except (TypeError, MarkError) as error:
                    raise MarkError(f"{test}: tried_with: {error}") from None
    return found


def _marks(node: ast.stmt) -> tuple[str, Sequence[ast.Call]]:
    """Return the name of a test or class, "" for a module's `pytestmark`, and its marks."""
    if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
        return node.name, _calls(node.decorator_list)
    if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "pytestmark":
        value = node.value
        return "", _calls(value.elts if isinstance(value, ast.List | ast.Tuple) else [value])
    return "", ()


def _calls(marks: Sequence[ast.expr]) -> Sequence[ast.Call]:
    return [mark if isinstance(mark, ast.Call) else ast.Call(mark, [], []) for mark in marks]


def _name(mark: ast.Call) -> str:
    return mark.func.attr if isinstance(mark.func, ast.Attribute) else ""


def _row(
    test: str,
    marks: Sequence[ast.Call],
    program: str,
    did: str,
    *,
    kind: str,
    result: str,
    package: str = "",
    version: str = "",
    note: str = "",
    needs: str = "",
    on: str = "",
) -> Row:
    """Return the row of a mark.

    `package`: the pinned one that is or has the program, if its name is another; `version`: of what
    is pinned nowhere; `on`: the month in which that was done which needs more than `make setup`;
    `needs`: what it needs, if that is not in a `sitl` mark.
    """
    if kind not in KINDS:
        raise MarkError(f"there is no kind {kind!r}; one of {', '.join(KINDS)}")
    programs = [ast.literal_eval(arg) for m in marks if _name(m) == "sitl" for arg in m.args]
    needs = needs or " and ".join(f"`{each}`" for each in programs)
    if bool(on) != bool(needs):
        raise MarkError("'on' is given where more than `make setup` is needed, and only there")
    long = any(_name(each) == "long" for each in marks)
    when = f"{on}, with {needs}" if on else f"each `make {'test-long' if long else 'test'}`"
    return Row(kind, program, _version(program, package, version), did, result, note, when, test)


def _version(program: str, package: str, said: str) -> str:
    pinned = pins().get((package or program).lower())
    if package and pinned is None:
        raise MarkError(f"the package {package} is pinned nowhere")
    if pinned is not None and said:
        raise MarkError(f"the version of {package or program} is pinned: leave it out")
    if pinned is None and not said:
        raise MarkError(f"{program} is pinned nowhere: give its 'version', or its 'package'")
    return said or f"{pinned} (`{package or program}`)"


@cache
def pins() -> dict[str, str]:
    """Return the versions that the tests run with, by the package's name in small letters."""
    found: dict[str, str] = {}
    for lock in reversed(_LOCKS):
        packages = json.loads((REPOSITORY / lock).read_text(encoding="utf-8"))["packages"]
        direct = packages[""].get("dependencies", {}) | packages[""]["devDependencies"]
        found |= {name.lower(): packages[f"node_modules/{name}"]["version"] for name in direct}
    for file in _PINS:
        text = (REPOSITORY / file).read_text(encoding="utf-8")
        found |= {name.lower(): version for name, version in _PINNED.findall(text)}
    return found


def page() -> str:
    """Return docs/tried-with.md."""
    found = rows()
    parts = [_HEAD]
    for kind in KINDS:
        parts.append(f"\n## {kind}\n\n| {' | '.join(_COLUMNS)} |\n{'|---' * len(_COLUMNS)}|\n")
        for row in found:
            if row.kind == kind:
                file, _, name = row.test.partition("::")
                test = f"[{name or Path(file).name}](../{file})"
                cells = (row.program, row.version, row.did, row.result, row.note, row.when, test)
                parts.append(f"| {' | '.join(cells)} |\n")
    return "".join(parts)


if __name__ == "__main__":
    sys.stdout.write(page())
