"""The documentation builds without a warning, and its reference has all that plugins import."""

import ast
import importlib
import os
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

import m2pem.api
import m2pem.testing

REPOSITORY = Path(__file__).parents[1]
FIXTURES = ("virtual", "executive")


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet"]
    built = subprocess.run(
        [*command, "--site-dir", str(folder)],
        cwd=REPOSITORY,
        env={**os.environ, "NO_MKDOCS_2_WARNING": "1"},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    assert built.returncode == 0, built.stdout
    return folder


PACKAGES = ("m2pem", "m2pem.api", "m2pem.testing")
INCLUDED = re.compile(r"^::: ([\w.]+)\n(?: +options:\n +members: \[([^]]*)\])?", re.M)
"""A module that a page includes, and those of its names that it shows, if not all."""


@pytest.mark.parametrize("package", PACKAGES)
def test_pages_of_the_reference_include_every_public_name(package: str) -> None:
    pages = sorted((REPOSITORY / "docs" / "reference").glob("*.md"))
    included = [each for page in pages for each in INCLUDED.findall(page.read_text())]
    shown = {module for module, members in included if not members}
    shown |= {f"{module}.{name}" for module, names in included for name in names.split(", ")}
    places = importlib.import_module(package)._LAZY
    modules = {
        name: module if module.startswith("m2pem") else f"{package}.{module}"
        for name, module in places.items()
    }
    assert len(modules) > 10
    left = {name for name, module in modules.items() if not {module, f"{module}.{name}"} & shown}
    assert sorted(left) == []


@pytest.mark.long
@pytest.mark.parametrize("package", PACKAGES)
def test_every_public_name_is_in_the_reference(package: str, site: Path) -> None:
    page = "".join(page.read_text() for page in (site / "reference").glob("*.html"))
    documented = {anchor.rpartition(".")[2] for anchor in re.findall(r'id="(m2pem\.[\w.]+)"', page)}
    names = set(importlib.import_module(package).__all__) - {"__version__", "hookimpl"}
    assert sorted(names - documented) == []


@pytest.mark.long
def test_hooks_and_fixtures_are_in_the_reference(site: Path) -> None:
    hooks = (site / "reference" / "hooks.html").read_text(encoding="utf-8")
    names = [name for name in vars(importlib.import_module("m2pem.hookspecs")) if "m2pem_" in name]
    assert [name for name in names if f'id="m2pem.hookspecs.{name}"' not in hooks] == []
    fixtures = (site / "reference" / "testing.html").read_text(encoding="utf-8")
    assert all(f'id="m2pem.testing.plugin.{name}"' in fixtures for name in FIXTURES)


@pytest.mark.long
def test_pages_load_nothing_from_other_hosts(site: Path) -> None:
    loads = re.compile(
        r"""<(?:script|img|iframe)[^>]+src="https?:|<link[^>]+stylesheet[^>]+https?:"""
    )
    assert [page.name for page in site.rglob("*.html") if loads.search(page.read_text())] == []


def test_names_that_are_loaded_when_asked_for_are_all_there() -> None:
    for package in (m2pem, m2pem.api, m2pem.testing):
        at_once = {"__version__", "hookimpl"} if package is m2pem else set()
        assert set(package._LAZY) | at_once == set(package.__all__)
        for name in package.__all__:
            assert getattr(package, name) is not None
        with pytest.raises(AttributeError, match="no attribute 'nothing'"):
            _ = package.nothing


@pytest.mark.parametrize("package", [m2pem, m2pem.api, m2pem.testing])
def test_every_name_that_type_checkers_find_is_loaded_from_there(package: ModuleType) -> None:
    source = Path(str(package.__file__)).read_text(encoding="utf-8")
    imports = next(each for each in ast.parse(source).body if isinstance(each, ast.If))
    found = {
        name.asname: each.module
        for each in imports.body
        if isinstance(each, ast.ImportFrom)
        for name in each.names
    }
    assert found == package._LAZY


@pytest.mark.long
def test_links_to_files_of_the_repository_lead_to_them(site: Path) -> None:
    written = re.compile(r"\]\(\.\./(?!\.\.)([^)#]+)(?:#([^)]+))?\)")
    count = 0
    for page in (REPOSITORY / "docs").glob("*.md"):
        built = site / page.relative_to(REPOSITORY / "docs").with_suffix(".html")
        text = built.read_text(encoding="utf-8").partition("<article")[2]
        links = re.findall(r'href="(repository/[^"#]+)', text)
        targets = written.findall(page.read_text(encoding="utf-8"))
        assert len(links) == len(targets), page
        for link, (target, anchor) in zip(links, targets, strict=True):
            if target.endswith(".md"):
                there = (site / link).read_text(encoding="utf-8")
                assert "<article" in there
                assert not anchor or f'id="{anchor}"' in there
            else:
                assert (site / link).read_bytes() == (REPOSITORY / target).read_bytes()
            count += 1
    assert count > 20


@pytest.mark.long
def test_readmes_are_pages_whose_links_lead_somewhere(site: Path) -> None:
    readmes = [REPOSITORY / "README.md", *(REPOSITORY / "examples").rglob("README.md")]
    assert len(readmes) > 20
    for readme in readmes:
        page = site / "repository" / readme.relative_to(REPOSITORY).with_name("index.html")
        article = (
            page.read_text(encoding="utf-8").partition("<article")[2].partition("</article")[0]
        )
        links = re.findall(r'(?:href|src)="(?!\w+:|#)([^"#]+)', article)
        assert [link for link in links if not (page.parent / link).exists()] == []
