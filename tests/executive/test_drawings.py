"""Geometries that operators hand over for all runs: versions, deletion, restarts."""

from typing import Any

import pytest

from m2pem.errors import OperatorError
from m2pem.executive.drawings import MOST_VERSIONS
from m2pem.journal import MemoryJournal
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
        kept = await world.journal.drawings(world.executive.control.fleet().name)
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
