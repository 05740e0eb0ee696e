"""The table of commands, by pymavlink's list of them and by the page that shows it."""

import re
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import ardupilotmega

from m2pem.fleet.behaviors import SHARED
from m2pem.geo.geometry_files.mission_commands import COMMANDS, Treatment, command_of

NOTHING = (None,) * 7
PAGE = Path(__file__).parents[3] / "docs/geometry-files.md"


@pytest.mark.parametrize("number", COMMANDS)
def test_names_are_those_of_mavlink(number: int) -> None:
    assert ardupilotmega.enums["MAV_CMD"][number].name == COMMANDS[number].title


def test_whatever_moves_a_vehicle_and_is_not_known_is_refused() -> None:
    for number in range(16, 96):
        known = command_of(number, NOTHING)
        assert known.treatment is not Treatment.LEFT_OUT or number in (80, 93), known
    assert command_of(95, NOTHING).treatment is Treatment.REFUSED
    assert command_of(31003, NOTHING).treatment is Treatment.REFUSED
    assert command_of(40000, NOTHING).treatment is Treatment.LEFT_OUT


def test_a_jump_that_is_never_made_is_left_out() -> None:
    assert command_of(177, (3, 0, *NOTHING[2:])).treatment is Treatment.LEFT_OUT
    assert command_of(177, (3, -1, *NOTHING[2:])).treatment is Treatment.REFUSED


def test_tasks_of_the_remedies_are_behaviors() -> None:
    tasks = {
        name for command in COMMANDS.values() for name in re.findall("`(.*?)`", command.remedy)
    }
    known = {name for name, _ in SHARED} | {"deploy", "run_onboard_mission"}
    assert tasks - known == {"loop", "heading", "fence"}


def test_the_page_lists_what_changes_the_way() -> None:
    rows = re.findall(r"^\| (.*?) \| (.*?) \|$", PAGE.read_text(), re.MULTILINE)
    shown = {name: row for row, names in rows for name in re.findall(r"[A-Z][A-Z_]{5,}", names)}
    treatments = (Treatment.WAIT, Treatment.STAY, Treatment.BEGIN, Treatment.END, Treatment.REFUSED)
    wanted = {each.name: each for each in COMMANDS.values() if each.treatment in treatments}
    assert wanted.keys() <= shown.keys()
    assert all(
        (each.treatment is Treatment.REFUSED) == ("anywhere" in shown[name])
        for name, each in wanted.items()
    )
