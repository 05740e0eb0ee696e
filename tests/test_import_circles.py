"""No modules import each other in a circle, not even for their types."""

import ast
from pathlib import Path

import pytest
import rustworkx

REPOSITORY = Path(__file__).parents[1]
PACKAGES = [REPOSITORY / "m2pem", *sorted(REPOSITORY.glob("plugins/*/*/m2pem_plugin_*"))]


def modules(package: Path) -> dict[str, Path]:
    found = {}
    for file in sorted(package.rglob("*.py")):
        parts = file.relative_to(package.parent).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = file
    return found


def imports(text: str, known: set[str]) -> set[str]:
    """The modules among `known` that a module imports, anywhere in it."""
    found = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names} & known
        elif isinstance(node, ast.ImportFrom) and node.module:
            for alias in node.names:
                full = f"{node.module}.{alias.name}"
                found |= {full if full in known else node.module} & known
    return found


def circles(sources: dict[str, str]) -> list[list[str]]:
    names = list(sources)
    graph = rustworkx.PyDiGraph()
    number = dict(zip(names, graph.add_nodes_from(names), strict=True))
    for name, text in sources.items():
        for other in imports(text, set(names)) - {name}:
            graph.add_edge(number[name], number[other], None)
    components = rustworkx.strongly_connected_components(graph)
    return [sorted(graph[each] for each in found) for found in components if len(found) > 1]


def test_a_circle_is_found_where_a_type_alone_closes_it() -> None:
    types = "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from p.a import A\n"
    assert circles({"p.a": "from p.b import B", "p.b": types}) == [["p.a", "p.b"]]
    assert circles({"p": "from p import a", "p.a": "import os", "p.b": "from p.a import A"}) == []


@pytest.mark.parametrize("package", PACKAGES, ids=lambda package: package.name)
def test_no_modules_import_each_other_in_a_circle(package: Path) -> None:
    sources = {name: file.read_text(encoding="utf-8") for name, file in modules(package).items()}
    assert sources
    assert circles(sources) == []
