"""The wheel has what `m2pem init`, `m2pem examples` and `import m2pem` need."""

import re
from zipfile import ZipFile

import pytest

from tests.authoring.author import REPOSITORY, Author


@pytest.mark.long
@pytest.mark.timeout(300)
def test_folders_and_examples_are_made_from_the_wheel_alone(author: Author) -> None:
    author.do("python3 -m venv .venv")
    assert author.do("pip install m2pem").returncode == 0
    assert author.do("m2pem init made").returncode == 0
    checked = author.do("cd made && m2pem check mission.bpmn --fleet fleet.yaml --strict")
    assert checked.returncode == 0, checked.stdout
    listed = author.do("m2pem examples").stdout
    folders = sorted(each.name for each in (REPOSITORY / "examples").iterdir() if each.is_dir())
    assert sorted(re.findall(r"^(\w+) ", listed, re.M)) == folders
    copied = author.do("m2pem examples t01 && m2pem examples notebook nb")
    assert copied.returncode == 0, copied.stdout
    code = "import m2pem; print(m2pem.rehearse('nb/mission.bpmn', 'nb/fleet.yaml').outcome)"
    assert author.do(f'python -c "{code}"').stdout == "completed\n"
    for kind in ("mavlink", "ros"):
        assert author.do(f"m2pem init {kind} --for {kind}").returncode == 0
        assert (author.folder / kind / "mission.bpmn").exists()


@pytest.mark.long
def test_the_wheel_has_no_compiled_file(author: Author) -> None:
    with ZipFile(author.wheel) as wheel:
        assert [name for name in wheel.namelist() if "__pycache__" in name] == []
