"""The journal of a killed executive has lost its tail: it is told, and nothing moves unasked."""

from collections.abc import Sequence
from pathlib import Path

from m2pem.simulation.executions import EffectKind
from m2pem.simulation.state_file import recorded_effects
from tests.command_line import CommandLine, fleet_with_state
from tests.wal import commits

from .test_operator import driving


def cut(journal: Path, lost: int) -> None:
    """Leave out the last commits of the log, as a flipped bit in the first of them would."""
    log = journal.with_name(f"{journal.name}-wal")
    content = log.read_bytes()
    log.write_bytes(content[: commits(content)[-1 - lost]])
    journal.with_name(f"{journal.name}-shm").unlink()


def of_the_vehicle(state: Path) -> Sequence[EffectKind]:
    return [each.kind for each in recorded_effects(state) if each.resource == "evsg1"]


def test_a_lost_tail_is_told_everywhere_and_nothing_moves_before_the_operator_says_so(
    m2pem: CommandLine, tmp_path: Path
) -> None:
    fleet, state = fleet_with_state(tmp_path)
    program = driving(m2pem, fleet, speed="1")
    program.kill()
    (journal,) = tmp_path.rglob("journal.db")
    cut(journal, 2)

    status, listed, errors = m2pem.run("runs")
    assert status == 0
    assert "the journal has lost records: it acknowledged record" in listed
    assert "the journal has lost records" in errors
    status, verified, _ = m2pem.run("replay", "r1", "--verify")
    assert status == 1
    assert "r1: the journal has lost records" in verified

    before = of_the_vehicle(state)
    assert before[-1] is EffectKind.START
    resumed = m2pem.start("resume", "r1")
    asked = resumed.until_text("[loss]")
    assert "Look where they are. Go on from the last record there is" in asked
    resumed.until_text("Stop the mission (stop)")
    resumed.type("loss stop")
    resumed.until_text("r1 stopped")
    assert resumed.rest()[0] == 130
    after = of_the_vehicle(state)[len(before) :]
    assert EffectKind.START not in after
    assert EffectKind.RESUME not in after
    assert EffectKind.CANCEL in after
    assert "it acknowledged" not in m2pem.run("runs")[1]


def test_a_journal_that_is_removed_during_a_run_holds_the_vehicles_and_says_what_to_do(
    m2pem: CommandLine, tmp_path: Path
) -> None:
    fleet, state = fleet_with_state(tmp_path)
    program = driving(m2pem, fleet, speed="1")
    (journal,) = tmp_path.rglob("journal.db")
    journal.unlink()
    program.type("takeover evsg2")
    status, errors = program.rest()
    assert status == 1
    assert "journal.db was removed while it was in use" in errors
    assert "look at the vehicles before you begin a new journal" in errors
    assert of_the_vehicle(state)[-1] is EffectKind.HOLD
