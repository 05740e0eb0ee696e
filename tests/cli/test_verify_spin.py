"""`m2pem verify --engine spin` and `--emit`."""

import json
from pathlib import Path

import pytest

from tests.cli.conftest import Invoke
from tests.command_line import FLEET, MISSION


def test_spin_says_what_the_built_in_engine_says(invoke: Invoke) -> None:
    words = ("verify", MISSION, "--fleet", FLEET, "--format", "json")
    status, out, _ = invoke(*words, "--engine", "spin")
    spins, ours = json.loads(out), json.loads(invoke(*words)[1])
    assert status == 0
    assert (spins["engine"], ours["engine"]) == ("spin", "builtin")
    assert spins["coverage"]["states"] == ours["coverage"]["states"] > 20
    told = [[(p["property"], p["verdict"]) for p in each["properties"]] for each in (spins, ours)]
    assert told[0] == told[1]
    assert "can-complete" in spins["coverage"]["notes"][0]
    assert invoke(*words, "--engine", "spin", "--strict")[0] == 1


def test_a_table_of_bits_leaves_it_undecided(invoke: Invoke) -> None:
    status, out, _ = invoke("verify", MISSION, "--engine", "spin", "--storage", "bitstate")
    assert status == 3
    assert "may take a new state for a known one" in out
    status, _, err = invoke("verify", MISSION, "--storage", "bitstate")
    assert (status, "add --engine spin" in err) == (2, True)


def test_the_model_can_be_written(invoke: Invoke, tmp_path: Path) -> None:
    status, out, _ = invoke("verify", MISSION, "--emit", "promela")
    assert status == 0
    assert "active proctype mission()" in out
    file = tmp_path / "mission.pml"
    assert invoke("verify", MISSION, "--emit", f"promela={file}") == (0, "", "")
    assert file.read_text(encoding="utf-8") == out
    status, _, err = invoke("verify", MISSION, "--emit", "tla")
    assert (status, "'promela' or 'promela=FILE'" in err) == (2, True)
    status, _, err = invoke("verify", MISSION, "--emit", f"promela={tmp_path}")
    assert (status, "cannot be written" in err) == (2, True)


def test_without_spin_it_says_what_to_install(
    invoke: Invoke, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    status, _, err = invoke("verify", MISSION, "--engine", "spin")
    assert (status, "apt-get install spin tcc" in err) == (2, True)
