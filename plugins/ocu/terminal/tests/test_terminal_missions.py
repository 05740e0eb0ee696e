"""Starting a mission that is chosen from the files there are."""

from pathlib import Path

import pytest
from m2pem_plugin_terminal.missions import preview_text
from m2pem_plugin_terminal.schedule import when_of
from terminal_world import MISSION, World

from m2pem.api import When
from m2pem.api.allocation import RoleAssignment, StartPreview
from m2pem.findings import Finding, Severity

BROKEN = MISSION.read_text("utf-8").replace('vehicle="scout"', 'vehicle="scuot"')


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with two missions: one fits the fleet, one names an unknown vehicle."""
    (tmp_path / "missions").mkdir()
    (tmp_path / "missions" / "patrol.bpmn").write_bytes(MISSION.read_bytes())
    (tmp_path / "missions" / "wrong.bpmn").write_text(BROKEN, "utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


async def test_a_mission_is_chosen_previewed_and_started_after_y(world: World, here: Path) -> None:
    async with world.terminal() as terminal:
        await terminal.press("m")
        await terminal.until_shown(
            "1 patrol.bpmn  missions", "2 wrong.bpmn", "[outside-only M308]", "driver: scout"
        )
        await terminal.press("enter")
        await terminal.until_shown("Start patrol.bpmn?", "y: yes")
        assert await world.control.runs() == []
        await terminal.press("enter", "1")
        await terminal.press("y")
        await terminal.until_shown("RUNNING", "● DRIVE")
    assert [run.mission for run in await world.control.runs()] == [
        str(here / "missions" / "patrol.bpmn")
    ]


async def test_a_mission_with_errors_is_shown_with_them_and_not_started(world: World) -> None:
    async with world.terminal() as terminal:
        await terminal.press("m")
        await terminal.until_shown("driver: scout")
        await terminal.press("down")
        await terminal.until_shown("wrong.bpmn:", "[unknown-vehicle]", "driver: scuot, which")
        await terminal.press("2")
        await terminal.until_shown("wrong.bpmn cannot start", "test.yaml has no vehicle", "scout")
        await terminal.press("y")
        await terminal.until_shown("wrong.bpmn cannot start")
    assert await world.control.runs() == []


async def test_a_start_with_busy_vehicles_says_who_has_them(world: World) -> None:
    await world.control.take("scout", by="bob@gcs2")
    async with world.terminal() as terminal:
        await terminal.press("m")
        await terminal.until_shown("bob@gcs2 has scout")
        await terminal.press("1")
        await terminal.until_shown("Start patrol.bpmn all the same?", "have bob@gcs2 give back")
        await terminal.press("y")
        await terminal.until_shown("DRIVE: error RESOURCE_UNAVAILABLE")


async def test_a_vehicle_that_becomes_busy_before_the_y_is_asked_about(world: World) -> None:
    async with world.terminal() as terminal:
        await terminal.press("m")
        await terminal.until_shown("driver: scout")
        await terminal.press("1")
        await terminal.until_shown("Start patrol.bpmn?")
        await world.control.take("scout", by="bob@gcs2")
        await terminal.press("y")
        await terminal.until_shown("Start patrol.bpmn all the same?", "bob@gcs2 has scout")
        await terminal.press("escape")
    assert await world.control.runs() == []


async def test_what_has_changed_since_it_was_read_is_refused_in_full(
    world: World, here: Path
) -> None:
    async with world.terminal() as terminal:
        await terminal.press("m")
        await terminal.until_shown("driver: scout")
        await terminal.press("1")
        await terminal.until_shown("Start patrol.bpmn?")
        (here / "missions" / "patrol.bpmn").write_text(BROKEN, "utf-8")
        await terminal.press("y")
        await terminal.until_shown("patrol.bpmn was not started", "[unknown-vehicle]")


async def test_where_no_mission_is_found_the_folders_are_named(world: World, here: Path) -> None:
    for file in (here / "missions").iterdir():
        file.unlink()
    async with world.terminal() as terminal:
        await terminal.press("m")
        await terminal.until_shown("No mission files were found", "M2PEM_PATH")
        await terminal.press("escape")
        await terminal.until_gone("No mission files were found")


async def test_a_long_text_can_be_moved(world: World, here: Path) -> None:
    roles = "".join(f'<m2pem:role name="r{n}" vehicle="v{n}"/>' for n in range(15))
    many = BROKEN.replace("</m2pem:resources>", f"{roles}</m2pem:resources>")
    (here / "missions" / "wrong.bpmn").write_text(many, "utf-8")
    async with world.terminal() as terminal:
        await terminal.press("m")
        await terminal.until_shown("driver: scout")
        await terminal.press("2")
        await terminal.until_shown("wrong.bpmn cannot start")
        assert not terminal.shows("r14: v14, which the fleet lacks")
        for _ in range(20):
            await terminal.press("pagedown")
        await terminal.until_shown("r14: v14, which the fleet lacks")


def test_a_preview_names_the_members_of_a_team_and_the_files_without_their_folders() -> None:
    warning = Finding(Severity.WARNING, "/a/b/c.bpmn", 3, "x", "rule", "is doubtful", "mend it")
    team = RoleAssignment("sweepers", "team", ("a", "b"))  # type: ignore[arg-type]
    text = preview_text(StartPreview("/a/b/c.bpmn", "SWEEP", "P", (warning,), (team,)))
    assert text.plain.splitlines() == [
        "SWEEP",
        "c.bpmn:3: x: warning: is doubtful; mend it [rule]",
        "sweepers: team: a, b",
    ]


async def test_a_mission_waits_until_its_vehicles_are_free_or_starts_later(world: World) -> None:
    await world.executive.load_schedule()
    world.executive.serve_schedule()
    async with world.terminal() as terminal:
        await terminal.press("m")
        await terminal.until_shown(
            "1 patrol.bpmn  missions  1 warning", "2 wrong.bpmn  missions  1"
        )
        await terminal.press("1")
        await terminal.until_shown("Start patrol.bpmn?", "w: when all is free   l: later")
        await terminal.press("l")
        await terminal.until_shown("Start patrol.bpmn later", "after r3")
        await terminal.press(*"2031-03-01", "space", *["0", "8", "colon", "0", "0"], "enter")
        await terminal.until_shown("s1 is scheduled by anna@gcs1")
        await terminal.press("m", "1")
        await terminal.until_shown("w: when all is free")
        await terminal.press("w")
        await terminal.until_shown("s2 is scheduled by anna@gcs1")
        first, second = (await world.control.scheduled()).entries
        assert {first.by, second.by} == {"anna@gcs1"}
        assert {each.when.at[:16] for each in (first, second)} == {"2031-03-01T08:00", ""}


def test_when_is_read_as_operators_type_it() -> None:
    assert when_of("08:00") == When(at="08:00")
    assert when_of("after r3") == When(after="r3")
    assert when_of("0 8 * * *") == When(cron="0 8 * * *")
