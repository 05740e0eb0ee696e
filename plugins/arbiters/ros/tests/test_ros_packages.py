"""The packages of ros/ are complete, and say the same as the Python packages that they install."""

import configparser
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import pytest

REPOSITORY = Path(__file__).parents[4]
PACKAGES = [REPOSITORY / "ros" / name for name in ("m2pem", "m2pem_interfaces")]
PYTHON = {
    "m2pem": REPOSITORY,
    "m2pem_plugin_ros": REPOSITORY / "plugins" / "arbiters" / "ros",
    "m2pem_plugin_mocu": REPOSITORY / "plugins" / "ocu" / "mocu",
}
"""Python packages that ros/m2pem installs, and the folders of their projects."""

IMPORT = re.compile(r"^\s*(?:from|import) (rclpy|\w+_msgs|\w+_interfaces)\b", re.MULTILINE)
ONLY_FOR_NAV2 = {"nav2_msgs"}


def text_of(package: Path, tag: str) -> str:
    found = ElementTree.parse(package / "package.xml").getroot().find(tag)
    assert found is not None, tag
    return (found.text or "").strip()


def project(folder: Path) -> dict[str, object]:
    read = tomllib.loads((folder / "pyproject.toml").read_text(encoding="utf-8"))
    told: dict[str, object] = read["project"]
    return told


@pytest.mark.parametrize("package", PACKAGES, ids=lambda path: path.name)
def test_a_package_has_what_ros_expects(package: Path) -> None:
    root = ElementTree.parse(package / "package.xml").getroot()
    assert root.get("format") == "3"
    assert text_of(package, "name") == package.name
    assert text_of(package, "license") == "Apache-2.0"
    assert text_of(package, "url").startswith("https://")
    assert text_of(package, "author")
    maintainer = root.find("maintainer")
    assert maintainer is not None
    assert "@" in (maintainer.get("email") or "")
    title = f"Changelog for package {package.name}"
    lines = (package / "CHANGELOG.rst").read_text(encoding="utf-8").splitlines()
    assert lines[:3] == ["^" * len(title), title, "^" * len(title)]
    assert lines[4:6] == ["Forthcoming", "-" * len("Forthcoming")]
    declared = (package / "QUALITY_DECLARATION.md").read_text(encoding="utf-8")
    assert f"# Quality declaration of `{package.name}`" in declared
    assert "Quality Level 4" in declared


def test_versions_are_those_of_the_python_packages() -> None:
    ours, interfaces = PACKAGES
    assert {project(folder)["version"] for folder in PYTHON.values()} == {text_of(ours, "version")}
    assert project(interfaces)["version"] == text_of(interfaces, "version")


@pytest.mark.parametrize("name", PYTHON)
def test_plugins_have_their_entry_points(name: str) -> None:
    points = project(PYTHON[name]).get("entry-points", {})
    assert isinstance(points, dict)
    expected = points.get("m2pem", {})
    file = PACKAGES[0] / "setup" / f"{name}.cfg"
    read = configparser.ConfigParser()
    read.read(file)
    told = read.get("options.entry_points", "m2pem", fallback="")
    given = dict(line.split(" = ") for line in told.split("\n") if line)
    assert given == expected


def imported() -> Iterator[str]:
    for name, folder in PYTHON.items():
        if name != "m2pem":
            for source in (folder / name).rglob("*.py"):
                yield from IMPORT.findall(source.read_text(encoding="utf-8"))


def test_what_the_plugins_import_of_ros_is_a_dependency() -> None:
    root = ElementTree.parse(PACKAGES[0] / "package.xml").getroot()
    depends = {(each.text or "") for each in root.findall("exec_depend")}
    assert set(imported()) - ONLY_FOR_NAV2 <= depends


def test_workspaces_do_not_build_the_double_of_nav2() -> None:
    """It has the name of the real package, and would hide it."""
    double = Path(__file__).parent / "nav2_testdouble"
    assert (double / "package.xml").is_file()
    assert (double / "COLCON_IGNORE").is_file()
