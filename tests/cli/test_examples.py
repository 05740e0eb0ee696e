"""`m2pem examples`: the list, and copies whose README still does what it shows."""

from pathlib import Path

import pytest

from tests.cli.conftest import Invoke
from tests.console import REPOSITORY, assert_does_what_is_shown, blocks, environment

EXAMPLES = REPOSITORY / "examples"


def test_the_list_has_every_example_with_a_line(invoke: Invoke) -> None:
    status, out, _ = invoke("examples")
    assert status == 0
    listed = dict(line.split(None, 1) for line in out.splitlines() if line.startswith(("t", "n")))
    assert listed.keys() == {each.name for each in EXAMPLES.iterdir() if each.is_dir()}
    assert listed["t05_signal"] == "the operator interrupts a patrol: signal"


@pytest.mark.parametrize(
    ("words", "target"),
    [
        (("t05",), "examples/t05_signal"),
        (("t05_signal", "my examples/signal"), "my examples/signal"),
        (("t03", "two"), "two"),
    ],
)
def test_a_copy_does_what_its_readme_shows(
    words: tuple[str, ...],
    target: str,
    invoke: Invoke,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    here = tmp_path / "here"
    here.mkdir()
    monkeypatch.chdir(here)
    status, out, _ = invoke("examples", *words)
    assert status == 0
    assert f"Read {target}/README.md" in out
    shell = environment(tmp_path / "home")
    shown = [each for _, block in blocks(here / target / "README.md") for each in block]
    assert shown
    for command in shown:
        assert_does_what_is_shown(command, here, shell)
    assert "](../" not in (here / target / "README.md").read_text(encoding="utf-8")


def test_every_example_can_be_copied_whole(
    invoke: Invoke, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for example in sorted(each for each in EXAMPLES.iterdir() if each.is_dir()):
        assert invoke("examples", example.name)[0] == 0
        there = {
            each.relative_to(example)
            for each in example.rglob("*")
            if "__pycache__" not in each.parts
        }
        copied = tmp_path / "examples" / example.name
        assert {each.relative_to(copied) for each in copied.rglob("*")} == there


def test_an_unknown_example_and_a_folder_in_use_are_refused(invoke: Invoke, tmp_path: Path) -> None:
    status, _, err = invoke("examples", "t5")
    assert status == 2
    assert "there is no example 't5'; did you mean" in err
    (tmp_path / "mine.txt").write_text("mine")
    status, _, err = invoke("examples", "t05", tmp_path)
    assert status == 2
    assert "is not empty" in err
