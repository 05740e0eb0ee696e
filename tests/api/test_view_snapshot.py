"""A view that goes on from a snapshot is the same as one that applied every record."""

import random
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest

import m2pem
from m2pem.api import (
    Mission,
    RunStatus,
    RunSummary,
    RunView,
    StampedRecord,
    describe,
)
from m2pem.api import records as r
from m2pem.api.run_view import Changes
from m2pem.api.view_snapshot import snapshot_of, view_of

ROOT = Path(__file__).parents[2]
MISSIONS, FLEETS, EXAMPLES = ROOT / "missions", ROOT / "fleet_configs", ROOT / "examples"
ANSWERS = MISSIONS / "answers"
RUNS = [
    (MISSIONS / "vignette1.bpmn", FLEETS / "vignette1.yaml", ANSWERS / "vignette1_detection.yaml"),
    (MISSIONS / "vignette1.bpmn", FLEETS / "vignette1.yaml", ANSWERS / "vignette1_abort.yaml"),
    (
        MISSIONS / "by_need" / "mehds_vignette_4.bpmn",
        FLEETS / "mehds.yaml",
        ANSWERS / "mehds_vignette_4_hazard.yaml",
    ),
    (
        EXAMPLES / "t20_loops" / "mission.bpmn",
        EXAMPLES / "t20_loops" / "fleet.yaml",
        EXAMPLES / "t20_loops" / "answers.yaml",
    ),
    (
        EXAMPLES / "t09_escalation" / "mission.bpmn",
        "sim",
        EXAMPLES / "t09_escalation" / "answers_blocked.yaml",
    ),
    (EXAMPLES / "t19_compensation" / "mission.bpmn", "sim", None),
]


def state_of(view: RunView) -> dict[str, Any]:
    """All that a view holds, but its newest records."""
    fields = {name: value for name, value in vars(view).items() if name not in LEFT_OUT}
    return fields | {"tokens": {each: asdict(token) for each, token in view.tokens.items()}}


LEFT_OUT = ("newest", "changes", "mission")


def begun(mission: Mission | None) -> RunView:
    return RunView(RunSummary("r1", "m.bpmn", "", RunStatus.RUNNING, 0), mission)


def shown(view: RunView, records: Sequence[StampedRecord]) -> list[Any]:
    """What pages show of records: their sentences, and what each changes."""
    view.changes = Changes()
    found: list[Any] = []
    for stamped in records:
        view.apply(stamped)
        changed = asdict(view.changes)
        view.changes.clear()
        found.append((describe(stamped, view), {key: set(each) for key, each in changed.items()}))
    view.changes = None
    return found


@pytest.mark.parametrize(("mission", "fleet", "answers"), RUNS)
def test_a_view_goes_on_from_a_snapshot_as_if_it_had_applied_every_record(
    mission: Path, fleet: Path | str, answers: Path | None
) -> None:
    result = m2pem.rehearse(mission, fleet, answers=answers)
    records = result.records
    assert len(records) >= 10
    parsed = result.mission
    whole = begun(parsed)
    expected = shown(whole, records)
    chance = random.Random(len(records))
    for at in [0, len(records), *(chance.randrange(len(records)) for _ in range(8))]:
        before = begun(parsed)
        for stamped in records[:at]:
            before.apply(stamped)
        after = view_of(snapshot_of(before), parsed)
        assert state_of(after) == state_of(before), at
        assert shown(after, records[at:]) == expected[at:], at
        assert state_of(after) == state_of(whole), at


def test_behaviors_of_tokens_are_those_of_the_view() -> None:
    view = begun(None)
    at = {"token": 1, "process": "P", "element": "Drive", "scope": 1}
    facts = [
        r.TokenEntered(**at),
        r.BehaviorRequested(
            **at,
            behavior="r1.b1",
            name="go",
            type="vehicle",
            resources=("v1",),
            roles={},
            parameters={},
        ),
    ]
    for seq, record in enumerate(facts, 1):
        view.apply(StampedRecord("r1", seq, 0.0, record))
    again = view_of(snapshot_of(view))
    assert again.tokens[1].work["r1.b1"] is again.behaviors["r1.b1"]


def test_damaged_bytes_are_refused() -> None:
    content = snapshot_of(begun(None))
    for damaged in (b"", content[:-3], b"\x90"):
        with pytest.raises(ValueError):
            view_of(damaged)
