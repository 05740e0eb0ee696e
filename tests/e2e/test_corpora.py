"""Public models that others drew, rehearsed: what is known of them is what happens.

`M2PEM_CORPORA` names a folder of BPMN files. An `expected.json` in it says what is known of models
(paths from the folder): `option_to_complete` 0 when no execution of it completes, 1 when every one
can; a rehearsal is one execution, and must be among them.
"""

import json
import os
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from m2pem.api.runs import RunStatus, StampedRecord
from m2pem.bpmn import parse_mission
from m2pem.errors import MissionError
from m2pem.findings import has_errors
from m2pem.fleet.default_fleet import fleet_for
from m2pem.mission.mission import Mission
from m2pem.plugins import PluginManager
from m2pem.rehearsal.rehearsal import rehearse

if not os.environ.get("M2PEM_CORPORA"):
    pytest.skip("M2PEM_CORPORA names no folder of foreign BPMN files", allow_module_level=True)

CORPORA = Path(os.environ["M2PEM_CORPORA"])
MODELS = sorted(CORPORA.rglob("*.bpmn"))
MAX_STEPS = 50_000
"""Enough for every model that ends; many draw loops without a condition, which never do."""

ENDS = (RunStatus.COMPLETED, RunStatus.TERMINATED)

pytestmark = pytest.mark.long


@cache
def expected() -> dict[str, dict[str, Any]]:
    """What is known of models, by path."""
    return {
        str(path): known
        for file in CORPORA.rglob("expected.json")
        for name, known in json.loads(file.read_text(encoding="utf-8")).items()
        for path in [CORPORA / name]
    }


def loaded(path: Path) -> Mission | None:
    """The model, or None when it is refused as it should be."""
    try:
        return parse_mission(path.read_bytes(), str(path))
    except MissionError as error:
        assert has_errors(error.findings)
        return None


def outcome(path: Path, mission: Mission, process: str) -> tuple[RunStatus | None, str]:
    """How a rehearsal that begins with a process ends; None: it is refused."""
    count = 0

    def listen(_: StampedRecord) -> None:
        nonlocal count
        count += 1

    try:
        result = rehearse(
            path,
            fleet_for(mission),
            plugins=PluginManager(block=("all",)),
            process=process,
            max_steps=MAX_STEPS,
            on_record=listen,
        )
    except MissionError as error:
        assert has_errors(error.findings)
        return None, ""
    assert count == result.summary.records > 0
    return result.summary.status, result.summary.detail


def test_the_corpora_have_models() -> None:
    assert MODELS, f"no .bpmn file in {CORPORA}"


@pytest.mark.parametrize("path", MODELS, ids=lambda path: str(path.relative_to(CORPORA)))
def test_a_rehearsal_agrees_with_what_is_known_of_the_model(path: Path) -> None:
    mission = loaded(path)
    known = expected().get(str(path), {}).get("option_to_complete")
    # What is known of several pools holds when all of them begin at once.
    if mission is None or known is None or len(mission.processes) > 1:
        return
    status, detail = outcome(path, mission, mission.processes[0].id)
    if known == 0:
        assert status in (None, RunStatus.FAILED)
    else:
        assert status in ENDS, detail
