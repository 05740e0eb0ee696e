"""What holds for the repository as a whole."""

import re
import subprocess
import tomllib
from functools import cache
from pathlib import Path

import pytest

import m2pem

REPOSITORY = Path(__file__).parents[1]
REGISTRIES = re.compile(
    rb"\b(?:pypi|pythonhosted|npmjs|debian|unpkg|jsdelivr)\.(?:org|com|io|net)\b"
)
PLUGIN_MODULES = re.compile(r"^\s*(?:from|import) (m2pem_plugin_\w+)\.([\w.]+)", re.MULTILINE)
HOME_PATHS = re.compile(rb"(?<![\w.])/(?:home|Users)/\w+|(?<![\w./])/root[/]")


@cache
def files() -> tuple[Path, ...]:
    """Every file of the repository that is not ignored."""
    listed = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        cwd=REPOSITORY,
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    ).stdout
    paths = (REPOSITORY / name for name in listed.split("\0") if name)
    return tuple(path for path in paths if path.is_file())


def found_in_files(pattern: re.Pattern[bytes]) -> list[str]:
    return [
        f"{path.relative_to(REPOSITORY)}: {found[0].decode()}"
        for path in files()
        if (found := pattern.search(path.read_bytes()))
    ]


def test_no_file_names_a_package_registry() -> None:
    assert found_in_files(REGISTRIES) == []


def test_no_file_names_somebodys_home() -> None:
    assert found_in_files(HOME_PATHS) == []


@pytest.mark.parametrize(
    ("pattern", "text"),
    [
        (REGISTRIES, b"https://files.%s.org/a.whl" % b"pythonhosted"),
        (REGISTRIES, b"registry.%s.org" % b"npmjs"),
        (HOME_PATHS, b"see /%s/ann/m2pem" % b"home"),
        (HOME_PATHS, b"'/%s/.cache'" % b"root"),
    ],
)
def test_what_no_file_may_name_is_recognised(pattern: re.Pattern[bytes], text: bytes) -> None:
    assert pattern.search(text)


def test_the_licence_is_apache_2() -> None:
    first_lines = (REPOSITORY / "LICENSE").read_text(encoding="utf-8")[:200]
    assert "Apache License" in first_lines
    assert "Version 2.0" in first_lines


def test_the_package_and_its_metadata_say_the_same_version() -> None:
    pyproject = tomllib.loads((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))
    assert pyproject["project"]["version"] == m2pem.__version__


def test_the_changelog_leads_to_this_version() -> None:
    changelog = (REPOSITORY / "CHANGELOG.md").read_text(encoding="utf-8")
    headings = re.findall(r"^## \[(.+?)\]", changelog, re.M)
    assert headings[:1] == ["Unreleased"] or headings[0] == m2pem.__version__


def test_every_version_is_pinned() -> None:
    lines = (REPOSITORY / "constraints.txt").read_text(encoding="utf-8").splitlines()
    pins = [line for line in lines if line and not line.startswith("#")]
    assert [pin for pin in pins if not re.fullmatch(r"[\w.-]+==[\w.]+", pin)] == []
    assert pins


def test_no_pattern_repeats_a_group_possessively() -> None:
    """Before Python 3.11.5 what a failed repetition took is lost, and Debian 12 has 3.11.2."""
    possessive = re.compile(r"\)(?:[*+?]|\{\d*,?\d*\})\+")
    product = [path for path in files() if path.suffix == ".py" and "tests" not in path.parts]
    assert len(product) > 300
    found = [str(path) for path in product if possessive.search(path.read_text(encoding="utf-8"))]
    assert found == []


def test_plugins_import_no_submodule_of_another_plugin() -> None:
    """What a plugin offers to others is in its `__init__`."""
    found = []
    for path in files():
        own = next((part for part in path.parts if part.startswith("m2pem_plugin_")), "")
        if own and path.suffix == ".py":
            for plugin, module in PLUGIN_MODULES.findall(path.read_text(encoding="utf-8")):
                if plugin != own:
                    found.append(f"{path.relative_to(REPOSITORY)}: {plugin}.{module}")
    assert found == []
