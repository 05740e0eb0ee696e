"""`m2pem init`: every command of the README that it writes does what it says."""

import os
from importlib.util import find_spec
from pathlib import Path

import pytest

from m2pem.demo.shipped_files import SHARED
from tests.cli.conftest import Invoke
from tests.console import Command, assert_does_what_is_shown, blocks, environment

KINDS = pytest.mark.parametrize("kind", SHARED)


def commands(folder: Path) -> list[Command]:
    return [command for _, block in blocks(folder / "README.md") for command in block]


@KINDS
def test_the_commands_of_the_readme_work(kind: str, invoke: Invoke, tmp_path: Path) -> None:
    """Those that need vehicles are run in the tests of the plugins."""
    folder = tmp_path / "first mission"
    status, out, _ = invoke("init", folder, "--for", kind)
    assert status == 0
    assert f"cd '{folder}'" in out
    shell = environment(tmp_path / "home")
    shell["PYTHONPATH"] = os.environ.get("PYTHONPATH", shell["PYTHONPATH"])
    done = []
    for command in commands(folder):
        needs_vehicles = kind != "sim" and command.text.startswith("m2pem run")
        text = command.text if command.interactive else f"{command.text} # interactive"
        assert_does_what_is_shown(Command(text) if needs_vehicles else command, folder, shell)
        done.append(command.text.split()[1])
    assert {"check", "verify", "simulate", "run"} <= set(done)
    assert (folder / "chart.svg").read_text(encoding="utf-8").startswith("<svg")


@KINDS
def test_the_readme_names_every_file(kind: str, invoke: Invoke, tmp_path: Path) -> None:
    out = invoke("init", tmp_path / "new" / "folder", "--for", kind)[1]
    folder = tmp_path / "new" / "folder"
    readme = (folder / "README.md").read_text(encoding="utf-8")
    names = {each.name for each in folder.iterdir()}
    assert names >= {"mission.bpmn", "fleet.yaml", "answers.yaml"}
    assert [each for each in names - {"README.md"} if f"`{each}`" not in readme] == []
    assert out.splitlines()[0] == f"{folder}: {', '.join(sorted(names))}"


@KINDS
def test_the_mission_is_without_a_finding_and_comes_home(
    kind: str, invoke: Invoke, tmp_path: Path
) -> None:
    invoke("init", tmp_path / "made", "--for", kind)
    given = [tmp_path / "made" / "mission.bpmn", "--fleet", tmp_path / "made" / "fleet.yaml"]
    assert invoke("check", *given, "--strict")[0] == 0
    assert "r1 completed" in invoke("simulate", *given)[1]
    fleet = (tmp_path / "made" / "fleet.yaml").read_text(encoding="utf-8")
    assert f"arbiter: {kind}" in fleet


def test_a_folder_with_something_in_it_is_refused_and_left_as_it_is(
    invoke: Invoke, tmp_path: Path
) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    status, _, err = invoke("init", tmp_path)
    assert status == 2
    assert f"{tmp_path} is not empty: name a new folder, or an empty one" in err
    assert [each.name for each in tmp_path.iterdir()] == ["mine.txt"]
    status, _, err = invoke("init", tmp_path / "mine.txt")
    assert status == 2
    assert "cannot be made" in err


@pytest.mark.parametrize(("kind", "plugin"), [("mavlink", True), ("ros", True), ("sim", False)])
def test_a_plugin_that_is_missing_is_named(
    kind: str, plugin: bool, invoke: Invoke, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    named = f"pip install m2pem-plugin-{kind}"
    present = find_spec(f"m2pem_plugin_{kind}") is not None
    assert (named in invoke("init", tmp_path / "a", "--for", kind)[1]) is (plugin and not present)
    monkeypatch.setattr("m2pem.cli.init.find_spec", lambda _: None)
    assert (named in invoke("init", tmp_path / "b", "--for", kind)[1]) is plugin
