"""The template yields plugins that can be installed, and whose tests pass."""

import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from tests.authoring.author import REPOSITORY, Author

KINDS = {
    "arbiter": ("arbiter sea-boat", r"ArbiterContract of .*: 37 kept, 1 not supported$"),
    "ocu": ("ocu sea-boat", r"OcuContract of .*: 17 kept$"),
    "service": ("service SeaBoat", r"ServiceContract of .*: 4 kept$"),
}


def render(template: Path, folder: Path, **answers: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "copier", "copy", "--quiet", "--defaults"]
    for name, value in answers.items():
        command += ["--data", f"{name}={value}"]
    command += [str(template), str(folder)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_an_arbiter_of_the_template_passes_its_tests(tmp_path: Path) -> None:
    """Found where it was rendered, without pip."""
    boat = tmp_path / "boat"
    assert render(REPOSITORY / "templates" / "plugin", boat, name="sea-boat").returncode == 0
    project = tomllib.loads((boat / "pyproject.toml").read_text())["project"]
    info = boat / f"{project['name'].replace('-', '_')}-0.1.0.dist-info"
    info.mkdir()
    said = f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: 0.1.0\n"
    (info / "METADATA").write_text(said)
    ((name, module),) = project["entry-points"]["m2pem"].items()
    (info / "entry_points.txt").write_text(f"[m2pem]\n{name} = {module}\n")
    tested = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:schemathesis"],
        cwd=boat,
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(boat), str(REPOSITORY)])},
        capture_output=True,
        text=True,
        check=False,
    )
    assert tested.returncode == 0, tested.stdout
    assert re.search(KINDS["arbiter"][1], tested.stdout, re.M), tested.stdout


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.timeout(300)
def test_a_plugin_of_the_template_is_installed_and_passes_its_tests(
    kind: str, author: Author
) -> None:
    """The template is the one in the wheel."""
    author.do("python3 -m venv .venv")
    assert author.do("pip install m2pem pytest").returncode == 0
    template = author.do("python -m m2pem.testing.template").stdout.strip()
    assert str(author.folder / ".venv") in template
    rendered = render(Path(template), author.folder / "boat", name="sea-boat", kind=kind)
    assert rendered.returncode == 0, rendered.stderr
    left = [file for file in (author.folder / "boat").rglob("*") if "jinja" in file.name]
    assert left == []
    provides, summary = KINDS[kind]
    installed = author.do("pip install --editable './boat[test]'")
    assert installed.returncode == 0, installed.stdout
    assert f"    {provides}\n" in author.do("m2pem plugins").stdout
    tested = author.do("cd boat && python -m pytest -q")
    assert tested.returncode == 0, tested.stdout
    assert re.search(summary, tested.stdout, re.M), tested.stdout


def test_a_name_that_no_distribution_may_have_is_refused(tmp_path: Path) -> None:
    template = REPOSITORY / "templates" / "plugin"
    refused = render(template, tmp_path / "boat", name="Sea Boat")
    assert refused.returncode != 0
    assert "Lower-case letters" in refused.stderr
    assert not (tmp_path / "boat").exists()
