"""What a wheel has in it, and that it can be built anywhere."""

import gzip
import json
import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import m2pem_plugin_web
import pytest

PLUGIN = Path(__file__).parents[1]
REPOSITORY = PLUGIN.parents[2]
STATIC = Path(m2pem_plugin_web.__file__).parent / "static"
UI = PLUGIN / "ui"
MOST_BYTES = 553_000
"""Of what a browser loads for any page, compressed, from an empty cache."""

ON_DEMAND = (
    "readAnswers-*.js",
    "PlotsPane-*.*",
    "CamerasPane-*.*",
    "SettingsDialog-*.*",
    "hls.light-*.js",
    "de-*.js",
    "CodeEditor-*.*",
    "CompareDialog-*.*",
    "Comparison-*.*",
    "ReviseDialog-*.*",
    "RevisionDiagrams-*.*",
    "RunVersions-*.*",
    "revise-*.css",
    "RouteMap-*.*",
    "MapPanel-*.*",
    "VersionsPanel-*.*",
    "CameraList-*.*",
    "DetectionsPane-*.*",
    "DetectionCard-*.*",
    "RequirementsPane-*.*",
    "DebugPane-*.*",
    "ElementMenu-*.*",
    "StopBanner-*.*",
    "debug-*.css",
    "Outcome-*.*",
    "Verdict-*.*",
)
"""Loaded by no page, but by a button of one, or for those who chose a language."""

NO_PROGRAMS = ("sh", "bash", "env")
"""What a machine without Node.js has still."""


def bundled() -> set[str]:
    """The packages that stand in the page."""
    lock = json.loads((UI / "package-lock.json").read_text(encoding="utf-8"))
    return set(lock["packages"][""]["dependencies"])


def test_the_page_is_there() -> None:
    page = (STATIC / "index.html").read_text(encoding="utf-8")
    named = re.findall(r'(?:src|href)="/([^"]+)"', page)
    assert named
    assert [name for name in named if not (STATIC / name).is_file()] == []


def test_licences_of_all_that_is_bundled_are_shipped() -> None:
    told = (STATIC / "licenses.md").read_text(encoding="utf-8")
    assert {
        name for name in bundled() if not re.search(rf"^#+ {re.escape(name)}\b", told, re.M)
    } == set()


def test_all_that_any_page_loads_is_small() -> None:
    kinds = (".js", ".css", ".html", ".svg", ".json")
    found = [list(STATIC.rglob(each)) for each in ON_DEMAND]
    assert all(found)
    later = {path for paths in found for path in paths}
    loaded = [path for path in STATIC.rglob("*") if path.suffix in kinds and path not in later]
    size = sum(len(gzip.compress(path.read_bytes(), 6)) for path in loaded)
    size += sum(path.stat().st_size for path in STATIC.rglob("*.woff2"))
    assert 0 < size < MOST_BYTES


def test_there_is_one_preact() -> None:
    """With two of them, menus of the modeler open without entries."""
    lock = json.loads((UI / "package-lock.json").read_text(encoding="utf-8"))
    found = [name for name in lock["packages"] if name.endswith("node_modules/preact")]
    assert found == ["node_modules/preact"]


def checkout(folder: Path) -> Path:
    """The plugin as it would be committed: without what was built."""
    listed = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard", "."],
        cwd=PLUGIN,
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    ).stdout
    for name in filter(None, listed.split("\0")):
        if (PLUGIN / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(PLUGIN / name, folder / name)
    return folder


def pip(words: list[str], path: str) -> None:
    environment = {
        **os.environ,
        "PATH": path,
        "PIP_CONSTRAINT": str(REPOSITORY / "constraints.txt"),
    }
    command = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check", *words]
    done = subprocess.run(
        command, env=environment, capture_output=True, text=True, timeout=600, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr


def in_wheel(folder: Path) -> set[str]:
    (wheel,) = folder.glob("*.whl")
    with zipfile.ZipFile(wheel) as opened:
        return set(opened.namelist())


def path_without_node(folder: Path) -> str:
    folder.mkdir()
    for program in NO_PROGRAMS:
        found = shutil.which(program)
        assert found
        (folder / program).symlink_to(found)
    return str(folder)


@pytest.mark.long
@pytest.mark.timeout(900)
def test_a_wheel_is_built_where_node_is_missing(tmp_path: Path) -> None:
    source = checkout(tmp_path / "source")
    bare = path_without_node(tmp_path / "bin")
    pip(["wheel", "--no-deps", "--wheel-dir", str(tmp_path / "wheels"), str(source)], bare)
    names = in_wheel(tmp_path / "wheels")
    shipped = {str(path.relative_to(STATIC.parent)) for path in STATIC.rglob("*") if path.is_file()}
    kinds = {Path(name).name.split("-")[0] for name in shipped}
    there = {Path(name).name.split("-")[0] for name in names if "/static/" in name}
    assert there == kinds
    assert not [name for name in names if "node_modules" in name or name.endswith(".map")]


@pytest.mark.long
@pytest.mark.timeout(900)
def test_a_source_distribution_has_the_page_and_needs_no_node(tmp_path: Path) -> None:
    from hatchling.builders.sdist import SdistBuilder

    source = checkout(tmp_path / "source")
    (archive,) = SdistBuilder(str(source)).build(directory=str(tmp_path / "sdist"))
    bare = path_without_node(tmp_path / "bin")
    words = ["wheel", "--no-deps", "--no-index", "--no-build-isolation"]
    pip([*words, "--wheel-dir", str(tmp_path / "wheels"), archive], bare)
    names = in_wheel(tmp_path / "wheels")
    assert "m2pem_plugin_web/static/index.html" in names
    assert "m2pem_plugin_web/static/licenses.md" in names
