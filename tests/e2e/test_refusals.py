"""A mission that does not fit its fleet is refused before anything moves."""

import shutil
from pathlib import Path

import pytest

from m2pem.simulation.state_file import recorded_effects
from tests.command_line import FLEET, MISSION, CommandLine, fleet_with_state


def assert_refused(m2pem: CommandLine, mission: Path, fleet: Path, *said: str) -> None:
    status, out, errors = m2pem.run("run", mission, "--fleet", fleet, "--ocu", "none")
    assert (status, out) == (2, "")
    assert "Traceback" not in errors
    for each in said:
        assert each in errors
    assert m2pem.run("runs")[1] == "no runs yet\n"


def test_a_fleet_without_the_vehicle(m2pem: CommandLine, tmp_path: Path) -> None:
    fleet, state = fleet_with_state(tmp_path)
    text = fleet.read_text(encoding="utf-8")
    text = text[: text.index("  evsg1:")] + text[text.index("  evsg2:") :]
    fleet.write_text(text.replace("[evsg1, evsg2, evsg3], lead: evsg1", "[evsg2, evsg3]"))
    assert_refused(m2pem, MISSION, fleet, "vignette1.bpmn:", "DriveRoute", "driver", str(fleet))
    assert not state.exists() or recorded_effects(state) == []


@pytest.mark.parametrize(
    ("wrong", "right", "said"),
    [
        pytest.param(
            'name="driver" vehicle="evsg1"', 'name="driver" payload="evsg1/ptz"', "evsg2/ptz",
            marks=pytest.mark.long, id="payload on another vehicle",
        ),
        pytest.param('value="reverse"', 'value="revers"', "'reverse'", id="unknown behavior"),
        pytest.param(
            'value="10 m"', 'value="10 kg"', "10 kg", marks=pytest.mark.long, id="mistyped unit"
        ),
    ],
)  # fmt: skip
def test_a_mission_that_asks_for_what_is_not_there(
    m2pem: CommandLine, tmp_path: Path, wrong: str, right: str, said: str
) -> None:
    mission = tmp_path / "mission.bpmn"
    shutil.copy(MISSION, mission)
    text = mission.read_text(encoding="utf-8")
    assert wrong in text
    mission.write_text(text.replace(wrong, right))
    assert_refused(m2pem, mission, FLEET, f"{mission}:", said)


def test_real_vehicles_keep_real_time(m2pem: CommandLine, tmp_path: Path) -> None:
    fleet, _ = fleet_with_state(tmp_path)
    fleet.write_text(fleet.read_text(encoding="utf-8").replace("arbiter: sim", "arbiter: boat"))
    assert_refused(m2pem, MISSION, fleet, "arbiter 'boat'")
    status, _, errors = m2pem.run("run", MISSION, "--fleet", fleet, "--speed", "2")
    assert status == 2
    assert "--speed 2: evsg1, evsg2" in errors
