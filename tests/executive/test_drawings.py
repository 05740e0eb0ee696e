"""Geometries that operators hand over for all runs: versions, deletion, restarts."""

import asyncio
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from m2pem.errors import JournalError, OperatorError
from m2pem.executive.drawings import MOST_VERSIONS, Drawings
from m2pem.fleet.fleet import simulated_fleet
from m2pem.journal import MemoryJournal, open_journal
from m2pem.mission.geometry import Area
from m2pem.testing import scenarios
from tests.executive.conftest import World, mission, question, sequence

POINT = {"type": "Point", "coordinates": [7.0, 50.0]}
OTHER = {"type": "Point", "coordinates": [7.1, 50.1]}
ASK = mission(sequence(("Ask", question("Ask"))).replace("<userTask", "<!-- gate --><userTask"))


def test_versions_are_kept_and_a_deleted_drawing_is_gone(play: Any) -> None:
    async def story(world: World) -> Any:
        control = world.executive.control
        await control.set_geometry("gate", POINT, by="anna")
        await control.set_geometry("gate", OTHER, by="ben")
        await control.delete_geometry("gate", by="anna")
        assert control.geometries() == {}
        assert "gate" not in control.fleet().geometries
        with pytest.raises(OperatorError, match="no operator has handed over a geometry 'gate'"):
            await control.delete_geometry("gate", by="anna")
        return await control.geometry_versions("gate")

    versions = play(story)
    assert [(each.geometry, each.by) for each in versions] == [
        (POINT, "anna"),
        (OTHER, "ben"),
        (None, "anna"),
    ]
    assert [each.number for each in versions] == [1, 2, 3]


def test_an_area_is_mended_once_and_operators_read_of_it(play: Any) -> None:
    ring = [
        [7.0, 50.0],
        [7.1, 50.0],
        [7.1, 50.1],
        [7.1, 50.2],
        [7.1, 50.1],
        [7.0, 50.1],
        [7.0, 50.0],
    ]
    spike = {"type": "Polygon", "coordinates": [ring]}

    async def story(world: World) -> Any:
        control = world.executive.control
        await control.set_geometry("field", spike, by="anna")
        return control.geometries()["field"].geometry, await control.alerts()

    kept, alerts = play(story)
    assert kept["geometry"]["coordinates"] == [
        [[7.0, 50.0], [7.1, 50.0], [7.1, 50.1], [7.0, 50.1], [7.0, 50.0]]
    ]
    (alert,) = alerts
    assert "geometry 'field': its edge from [50.1, 7.1] to [50.2, 7.1]" in alert.text


def test_what_leaves_the_fence_is_said_with_the_place_and_the_distance(play: Any) -> None:
    ring = ((50.0, 7.0, None), (50.0, 7.1, None), (50.1, 7.1, None), (50.1, 7.0, None))

    async def story(world: World) -> Any:
        fleet = world.executive.supervisor.fleet
        fleet.geometries["yard"] = Area(((*ring, ring[0]),))
        object.__setattr__(fleet, "fence", "yard")
        control = world.executive.control
        inside = {"type": "LineString", "coordinates": [[7.05, 50.05], [7.06, 50.05]]}
        await control.set_geometry("inside", inside, by="anna")
        outside = {"type": "LineString", "coordinates": [[7.05, 50.05], [7.05, 50.2]]}
        await control.set_geometry("outside", outside, by="anna")
        await control.set_geometry("gate", {"type": "Point", "coordinates": [7.05, 50.2]}, by="ben")
        field = [[[7.05, 50.05], [7.06, 50.05], [7.06, 50.2], [7.05, 50.05]]]
        await control.set_geometry("field", {"type": "Polygon", "coordinates": field}, by="ben")
        return await control.alerts()

    alerts = play(story)
    for alert, place in zip(
        alerts,
        (
            "geometry 'outside': waypoint 2, [50.200000, 7.050000], is 11",
            "geometry 'gate': point 1, [50.200000, 7.050000], is 11",
            "geometry 'field': corner 3, [50.200000, 7.060000], is 11",
        ),
        strict=True,
    ):
        assert place in alert.text
        assert "outside the fleet's fence" in alert.text


def test_the_next_executive_knows_them(play: Any) -> None:
    journal = MemoryJournal()

    async def before(world: World) -> None:
        control = world.executive.control
        await control.set_geometry("gate", POINT, by="anna")
        await control.set_geometry("gate", OTHER, by="ben")
        await control.set_geometry("gone", POINT, by="anna")
        await control.delete_geometry("gone", by="anna")

    async def after(world: World) -> Any:
        control = world.executive.control
        given = dict(control.geometries())
        await control.set_geometry("gate", POINT, by="carl")
        return given, await control.geometry_versions("gate")

    play(before, journal=journal)
    given, versions = play(after, journal=journal)
    assert {name: (each.geometry, each.by) for name, each in given.items()} == {
        "gate": (OTHER, "ben")
    }
    assert [each.by for each in versions] == ["anna", "ben", "carl"]
    assert versions[-1].number > 4, "numbers are not used again"


def test_the_oldest_versions_are_removed(play: Any) -> None:
    async def story(world: World) -> Any:
        control = world.executive.control
        for number in range(MOST_VERSIONS + 5):
            await control.set_geometry("gate", POINT, by=str(number))
        kept = await world.journal.drawings(world.executive.control.fleet().kept_as)
        return await control.geometry_versions("gate"), kept

    versions, kept = play(story)
    assert [each.by for each in versions] == [str(n) for n in range(5, MOST_VERSIONS + 5)]
    assert list(kept) == [each.number for each in versions]


def test_runs_under_way_that_name_it_are_its_users(play: Any) -> None:
    async def story(world: World) -> Any:
        control = world.executive.control
        await control.set_geometry("gate", POINT, by="anna")
        run = await control.start(ASK)
        during = await control.geometry_users("gate"), await control.geometry_users("hangar")
        await control.delete_geometry("gate", by="anna")
        has = dict(world.executive.runner(run).run.state.geometries)
        await control.stop(run, by="anna")
        await control.wait(run)
        return during, has, await control.geometry_users("gate")

    during, has, after = play(story)
    assert during == (["r1"], [])
    assert has == {"gate": POINT}, "a run under way keeps what it has"
    assert after == []


class BrokenJournal(MemoryJournal):
    """A journal that cannot be read, or whose writing is waited for in vain."""

    unreadable = False
    stuck = False
    written_all_the_same = False

    async def drawings(self, fleet: str) -> Mapping[int, str]:
        if self.unreadable:
            raise JournalError("it cannot be read")
        return await super().drawings(fleet)

    async def write_drawings(
        self, fleet: str, drawings: Mapping[int, str | None], *, last: int | None = None
    ) -> None:
        if self.written_all_the_same:
            await super().write_drawings(fleet, drawings, last=last)
        if self.stuck:
            await asyncio.Event().wait()
        await super().write_drawings(fleet, drawings, last=last)


def names_of(kept: Mapping[str, Any]) -> list[str]:
    return sorted(kept)


async def test_what_could_not_be_read_at_first_is_not_written_over() -> None:
    journal = BrokenJournal()
    before = Drawings(scenarios.fleet("sim", {"ugv1": {}}), journal, lambda: 1)
    before.change("gate", POINT, "anna")
    await before.write("done")
    journal.unreadable = True
    after = Drawings(scenarios.fleet("sim", {"ugv1": {}}), journal, lambda: 2)
    with pytest.raises(JournalError):
        await after.load()
    after.change("hangar", OTHER, "ben")
    with pytest.raises(OperatorError, match="it cannot be read"):
        await after.write("hangar is handed over")
    journal.unreadable = False
    await after.write("done")
    assert names_of(after.handed_over) == ["gate", "hangar"]
    assert names_of(after.given_here) == ["hangar"]
    again = Drawings(scenarios.fleet("sim", {"ugv1": {}}), journal, lambda: 3)
    await again.load()
    assert again.handed_over == after.handed_over


@pytest.mark.parametrize("written", [False, True])
async def test_who_hands_over_and_is_gone_at_once_leaves_it_to_be_written(written: bool) -> None:
    """As a browser that was closed while the journal was slow."""
    journal = BrokenJournal()
    drawings = Drawings(scenarios.fleet("sim", {"ugv1": {}}), journal, lambda: 1)
    await drawings.load()
    journal.stuck, journal.written_all_the_same = True, written
    drawings.change("gate", POINT, "anna")
    writing = asyncio.create_task(drawings.write("done"))
    await asyncio.sleep(0)
    writing.cancel()
    await asyncio.wait([writing])
    journal.stuck = journal.written_all_the_same = False
    drawings.change("hangar", OTHER, "ben")
    await drawings.write("done")
    again = Drawings(scenarios.fleet("sim", {"ugv1": {}}), journal, lambda: 2)
    await again.load()
    assert names_of(again.handed_over) == ["gate", "hangar"]
    assert [each.by for each in again.versions("gate")] == ["anna"], "it is written once"


async def test_a_simulated_fleet_knows_the_drawings_of_the_real_one_and_changes_none() -> None:
    journal = MemoryJournal()
    fleet = scenarios.fleet("mavlink", {"ugv1": {}})
    real = Drawings(fleet, journal, lambda: 1)
    real.change("gate", POINT, "anna")
    real.change("gone", POINT, "anna")
    await real.write("done")
    simulated = Drawings(simulated_fleet(fleet), journal, lambda: 2)
    await simulated.load()
    assert names_of(simulated.handed_over) == ["gate", "gone"]
    simulated.change("gate", OTHER, "ben")
    simulated.change("gone", None, "ben")
    await simulated.write("done")
    again = Drawings(fleet, journal, lambda: 3)
    await again.load()
    assert {name: each.by for name, each in again.handed_over.items()} == {
        "gate": "anna",
        "gone": "anna",
    }
    resumed = Drawings(simulated_fleet(fleet), journal, lambda: 4)
    await resumed.load()
    assert {name: each.by for name, each in resumed.handed_over.items()} == {"gate": "ben"}
    again.change("gate", POINT, "carla")
    await again.write("done")
    resumed = Drawings(simulated_fleet(fleet), journal, lambda: 5)
    await resumed.load()
    assert resumed.handed_over["gate"].by == "carla", "the newest counts"


async def test_two_executives_of_a_fleet_write_over_nothing_of_each_other() -> None:
    journal = MemoryJournal()
    fleet = scenarios.fleet("sim", {"ugv1": {}})
    one, two = (Drawings(fleet, journal, lambda: 1) for _ in range(2))
    await one.load()
    await two.load()
    one.change("gate", POINT, "anna")
    await one.write("done")
    two.change("hangar", POINT, "ben")
    await two.write("done")
    one.change("gate", OTHER, "anna")
    await one.write("done")
    assert names_of(two.given_here) == ["hangar"]
    again = Drawings(fleet, journal, lambda: 2)
    await again.load()
    assert names_of(again.handed_over) == ["gate", "hangar"]
    assert again.handed_over["gate"].geometry == OTHER
    assert [each.number for each in again.versions("gate")] == [1, 3]


_WRITER = """
import asyncio, sys
from m2pem.executive.drawings import Drawings
from m2pem.journal import open_journal
from m2pem.mission.geometry import Area
from m2pem.testing import scenarios

async def write(url, who, times):
    journal = open_journal(url)
    drawings = Drawings(scenarios.fleet("sim", {"ugv1": {}}), journal, lambda: 1)
    await drawings.load()
    print("ready", flush=True)
    sys.stdin.readline()
    for number in range(int(times)):
        place = {"type": "Point", "coordinates": [7.0, 50.0]}
        drawings.change(f"{who}{number}", place, who)
        await drawings.write("done")
    await journal.close()

asyncio.run(write(*sys.argv[1:]))
"""


def test_two_processes_that_write_at_the_same_time_lose_nothing(tmp_path: Path) -> None:
    times = 40
    url = str(tmp_path / "journal.db")
    people = ("anna", "ben")
    writers = [
        subprocess.Popen(
            [sys.executable, "-c", _WRITER, url, who, str(times)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        for who in people
    ]
    for writer in writers:
        assert writer.stdout and writer.stdout.readline() == "ready\n"
    for writer in writers:
        assert writer.stdin
        writer.stdin.write("go\n")
        writer.stdin.flush()
    for writer in writers:
        writer.communicate(timeout=60)
        assert writer.returncode == 0

    async def read() -> Drawings:
        journal = open_journal(url)
        drawings = Drawings(scenarios.fleet("sim", {"ugv1": {}}), journal, lambda: 2)
        await drawings.load()
        await journal.close()
        return drawings

    drawings = asyncio.run(read())
    expected = {f"{who}{number}": who for who in people for number in range(times)}
    assert dict(drawings.drawn_by) == expected
    numbers = [each.number for name in expected for each in drawings.versions(name)]
    assert sorted(numbers) == list(range(1, 2 * times + 1))
