"""Kill points are there, and are passed where they say."""

import os
import signal
import sqlite3
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import psycopg
import pytest

from tests.chaos import kill_points
from tests.chaos.journals import make
from tests.chaos.kill_points import (
    JOURNALS,
    POSTGRES,
    KillPoint,
    When,
    die_at,
    install,
    place_of,
    points_of,
)
from tests.chaos.worlds import OF_ROS, WORLDS

POINTS = {
    point.target
    for world in WORLDS.values()
    for journal in JOURNALS.values()
    for point in points_of(journal, world.arbiter).values()
    if world.name not in OF_ROS  # test_ros_chaos.py looks for theirs
}


@pytest.mark.parametrize("target", sorted(POINTS))
def test_the_function_of_a_kill_point_is_there(target: str) -> None:
    assert callable(place_of(target).function)


@pytest.mark.parametrize("target", ["m2pem.journal.sqlite:SqliteJournal.gone", "m2pem.gone:open"])
def test_a_function_that_was_renamed_is_an_error(target: str) -> None:
    with pytest.raises(LookupError, match="correct the kill point"):
        place_of(target)


def test_every_kill_point_has_a_name_of_its_own() -> None:
    for world in WORLDS.values():
        for journal in JOURNALS.values():
            named = points_of(journal, world.arbiter)
            assert len(named) == len(kill_points.executive_points(journal, world.arbiter)) + len(
                journal.points
            )


def url_of(folder: Path) -> str:
    """The URL of an empty database."""
    return make(POSTGRES, folder).read_text().strip()


class Stage:
    """What is wrapped. `seen`: what happened, in order."""

    def __init__(self) -> None:
        self.seen: list[str] = []

    def act(self) -> str:
        self.seen.append("act")
        return "done"

    async def act_later(self) -> str:
        self.seen.append("act")
        return "done"

    def open(self) -> sqlite3.Connection:
        return sqlite3.connect(":memory:", isolation_level=None)

    def migrate(self, connection: Any) -> None:
        connection.execute("CREATE TABLE a (b INTEGER)")
        connection.execute("CREATE TABLE c (d INTEGER)")

    def commit(self, storage: Any) -> None:
        storage.connection.raw.execute("COMMIT")
        self.seen.append("answered")


@pytest.fixture
def stage(monkeypatch: pytest.MonkeyPatch) -> Stage:
    made = Stage()
    module = SimpleNamespace(
        act=made.act,
        act_later=made.act_later,
        open=made.open,
        migrate=made.migrate,
        commit=made.commit,
    )
    monkeypatch.setattr(kill_points, "place_of", lambda target: kill_points.Place(module, target))
    made.module = module  # type: ignore[attr-defined]
    return made


@pytest.mark.parametrize(
    ("when", "seen"), [(When.BEFORE, ["passed", "act"]), (When.AFTER, ["act", "passed"])]
)
async def test_a_passage_is_before_or_after_the_call(
    stage: Stage, when: When, seen: list[str]
) -> None:
    for name in ("act", "act_later"):
        install(KillPoint("", name, when), lambda: stage.seen.append("passed"))
    module = stage.module  # type: ignore[attr-defined]
    assert module.act() == "done"
    assert await module.act_later() == "done"
    assert stage.seen == seen * 2


def test_each_commit_of_a_connection_is_a_passage_before_it_is_done(stage: Stage) -> None:
    install(KillPoint("", "open", When.AT_COMMIT), lambda: stage.seen.append("COMMIT"))
    with closing(stage.module.open()) as connection:  # type: ignore[attr-defined]
        for statement in ("BEGIN", "CREATE TABLE a (b)", "COMMIT", "BEGIN", "ROLLBACK"):
            connection.execute(statement)
    assert stage.seen == ["COMMIT"]


def test_each_statement_of_a_migration_is_a_passage(stage: Stage) -> None:
    install(KillPoint("", "migrate", When.AT_STATEMENT), lambda: stage.seen.append("passed"))
    with closing(stage.open()) as connection:
        stage.module.migrate(connection)  # type: ignore[attr-defined]
        connection.execute("SELECT 1")
    assert stage.seen == ["passed", "passed"]


def test_each_statement_of_a_postgresql_connection_is_a_passage(
    stage: Stage, tmp_path: Path
) -> None:
    install(KillPoint("", "migrate", When.AT_STATEMENT), lambda: stage.seen.append("passed"))
    with psycopg.connect(url_of(tmp_path)) as connection:
        stage.module.migrate(connection)  # type: ignore[attr-defined]
        connection.execute("SELECT 1")
    assert stage.seen == ["passed", "passed"]


def test_a_commit_that_is_sent_and_not_answered_reaches_the_server(
    stage: Stage, tmp_path: Path
) -> None:
    url = url_of(tmp_path)

    def committed() -> bool:
        with psycopg.connect(url) as other:
            return other.execute("SELECT to_regclass('a') IS NOT NULL").fetchone() == (True,)

    def passed() -> None:
        while not committed():
            pass
        stage.seen.append("passed")

    install(KillPoint("", "commit", When.SENT), passed)
    with psycopg.connect(url, autocommit=True) as connection:
        connection.execute("BEGIN")
        connection.execute("CREATE TABLE a (b INTEGER)")
        assert not committed()
        storage = SimpleNamespace(connection=SimpleNamespace(raw=connection))
        stage.module.commit(storage)  # type: ignore[attr-defined]
    assert stage.seen == ["passed", "answered"]


def test_the_process_dies_at_the_passage_that_was_chosen(
    stage: Stage, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "kill", lambda pid, number: stage.seen.append(f"{pid} {number:d}"))
    die_at(KillPoint("", "act"), 2)
    for _ in range(3):
        stage.module.act()  # type: ignore[attr-defined]
    assert stage.seen == ["act", f"{os.getpid()} {signal.SIGKILL:d}", "act", "act"]
