"""A run that an earlier m2pem began goes on: what it decided stays, the rest goes by today's rules.

`before_coercion.sql` is the journal, as SQL, of an m2pem by whose rules `${battery < 40}` of the
text "30" was false: its run was killed while it asked the operator at High.
"""

import sqlite3
from pathlib import Path

import pytest

from m2pem.api.description import Importance, describe
from m2pem.api.run_view import RunView
from m2pem.api.runs import RunStatus
from m2pem.engine import records as r
from m2pem.journal import open_journal
from m2pem.mission.expression import EXPRESSION_RULES, parse
from tests.executive.conftest import START_US, World, fleet, mission, question, sequence
from tests.executive.test_recovery import left_behind, resumed

RECORDED = Path(__file__).parent / "data" / "before_coercion.sql"
WHEN_US = 1_796_100_000_000_000


@pytest.fixture
def journal(tmp_path):
    connection = sqlite3.connect(tmp_path / "j.db")
    connection.executescript(RECORDED.read_text(encoding="utf-8"))
    connection.close()
    return open_journal(str(tmp_path / "j.db"))


def flows(records):
    return [each.flow for each in records if isinstance(each, r.FlowTaken)]


def test_a_decision_of_earlier_rules_stays_and_the_next_one_goes_by_todays(play, journal):
    async def story(world: World):
        control = world.executive.control
        before = [each.record for each in await control.records("r1")]
        await world.executive.resume("r1")
        await control.answer("r1", "p1", "done")
        await control.answer("r1", "p2", "done")
        summary = await control.wait("r1")
        return before, summary, await control.records("r1")

    before, summary, after = play(story, fleet=fleet("ugv1"), journal=journal, start_us=WHEN_US)
    condition = parse("${battery < 40}")
    assert condition.holds({"battery": "30"}.get)  # today's rules
    assert flows(before)[-1] == "Before_High"
    assert [each.record for each in after[: len(before)]] == before
    claimed, *later = (each.record for each in after[len(before) :])
    assert claimed == r.RunClaimed(2, expression_rules=EXPRESSION_RULES)
    assert flows(later) == ["High_After", "After_Land"]
    assert summary.status is RunStatus.COMPLETED

    said = describe(after[len(before)], RunView(summary))
    assert "decided from here on by the rules of this version of m2pem" in said.text
    assert said.importance is Importance.WARNING


def test_a_run_that_is_resumed_by_the_rules_it_began_with_says_nothing(play):
    async def story(world: World):
        await world.executive.control.answer("r1", "p1", "yes")
        return await world.executive.control.records("r1")

    recorded = left_behind(mission(sequence(("Ask", question("Ask")))))
    records = [each.record for each in resumed(play, recorded, story)]
    assert records[0] == r.RunStarted("P", START_US, expression_rules=EXPRESSION_RULES)
    assert r.RunClaimed(2) in records
