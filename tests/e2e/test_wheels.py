"""Wheels of m2pem in an environment that has nothing else: they have all that the docs show.

The environment is made on every supported Python of this machine.
"""

import os
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from email.parser import Parser
from pathlib import Path

import pytest

from tests.console import environment as shell_of
from tests.console import follow, make_workspace

pytestmark = pytest.mark.long

REPOSITORY = Path(__file__).parents[2]
PLUGINS = sorted(path.parent for path in REPOSITORY.glob("plugins/*/*/pyproject.toml"))
THIS = f"3.{sys.version_info.minor}"
VERSIONS = ["3.11", "3.12", "3.13"]
BUILDING = """
import os, sys
from hatchling.build import build_wheel

into, *projects = sys.argv[1:]
for project in projects:
    os.chdir(project)
    build_wheel(into)
"""
"""What pip has the backend of each project do; pip itself takes longer than that."""


def run(*words: str | Path, cwd: Path = REPOSITORY) -> str:
    """What a program prints.

    Raises:
        AssertionError: it failed; its output is the message.
    """
    inherited = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    constraints = str(REPOSITORY / "constraints.txt")
    done = subprocess.run(
        [str(word) for word in words],
        cwd=cwd,
        env={
            **inherited,
            "HOME": str(cwd),
            "PIP_CONSTRAINT": constraints,
            "PIP_DISABLE_PIP_VERSION_CHECK": "1",
        },
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, f"{words}: {done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.fixture(scope="module")
def wheels(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the wheels that `make dist` builds, of a copy without what git ignores."""
    clone = tmp_path_factory.mktemp("clone") / "m2pem"
    files = run("git", "ls-files", "-z", "--cached", "--others", "--exclude-standard")
    page = REPOSITORY / "plugins/ocu/web/m2pem_plugin_web/static"
    for name in filter(None, files.split("\0")):
        if (REPOSITORY / name).exists():
            (clone / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(REPOSITORY / name, clone / name, follow_symlinks=False)
    # Building the page takes npm and a minute; `make setup` has built it.
    shutil.copytree(page, clone / page.relative_to(REPOSITORY))
    made = clone / "dist"
    projects = [clone, *(clone / plugin.relative_to(REPOSITORY) for plugin in PLUGINS)]
    run(sys.executable, "-c", BUILDING, made, *projects, cwd=clone)
    return made


def interpreter(version: str) -> str | None:
    """A Python of that version: of the PATH, or of pyenv."""
    found = [
        f"python{version}",
        *map(str, Path.home().glob(f".pyenv/versions/{version}.*/bin/python")),
    ]
    for python in [sys.executable] if version == THIS else found:
        path = shutil.which(python)
        if (
            path
            and subprocess.run([path, "-c", ""], capture_output=True, check=False).returncode == 0
        ):
            return path
    return None


def cases() -> Iterator[str]:
    for version in VERSIONS:
        if version == THIS or interpreter(version):
            yield version


@pytest.mark.parametrize("version", list(cases()))
def test_wheels_alone_do_what_the_first_pages_show(
    version: str, wheels: Path, tmp_path: Path
) -> None:
    python = interpreter(version)
    assert python
    environment = tmp_path / "environment"
    run(python, "-m", "venv", environment)
    pip = (environment / "bin/pip", "install", "--quiet", "--find-links", wheels)
    run(*pip, "m2pem", "m2pem-plugin-terminal")
    m2pem = environment / "bin/m2pem"
    home = tmp_path / "home"
    home.mkdir()
    assert run(m2pem, "--version", cwd=home) == "m2pem, version 0.2.0\n"
    listed = run(m2pem, "plugins", cwd=home)
    assert "terminal" in listed
    assert "broken" not in listed
    shown = run(m2pem, "demo", cwd=home)
    assert "The second way" in shown
    assert "terminated by mission ended" in shown
    shell = shell_of(tmp_path / "reader")
    shell.update(PATH=f"{environment / 'bin'}:{os.environ['PATH']}")
    del shell["PYTHONPATH"]
    follow(REPOSITORY / "docs" / "start.md", make_workspace(tmp_path / "clone"), shell)


@pytest.mark.parametrize("name", ["m2pem", *(plugin.name for plugin in PLUGINS)])
def test_a_wheel_has_its_license_its_types_and_a_description(name: str, wheels: Path) -> None:
    [wheel] = wheels.glob("m2pem-*.whl" if name == "m2pem" else f"m2pem_plugin_{name}-*.whl")
    with zipfile.ZipFile(wheel) as opened:
        names = opened.namelist()
        [metadata] = [each for each in names if each.endswith(".dist-info/METADATA")]
        [license_] = [each for each in names if each.endswith("/licenses/LICENSE")]
        said = Parser().parsestr(opened.read(metadata).decode())
        assert opened.read(license_) == (REPOSITORY / "LICENSE").read_bytes()
    assert any(each.endswith("/py.typed") for each in names)
    assert said["License-Expression"] == "Apache-2.0"
    assert said["Project-URL"]
    assert said["Description-Content-Type"] == "text/markdown"
    assert len(str(said.get_payload())) > 100


def test_the_wheel_of_the_web_page_has_the_page(wheels: Path) -> None:
    [wheel] = wheels.glob("m2pem_plugin_web-*.whl")
    with zipfile.ZipFile(wheel) as opened:
        assert "m2pem_plugin_web/static/index.html" in opened.namelist()
