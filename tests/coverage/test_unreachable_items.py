"""Random runs of the repository's missions reach nothing but what the checker says can be reached:
no item that no run reaches, and no uncaught error that is not listed. All items of most missions
can be reached; there it is the errors that could differ."""

import json
from pathlib import Path
from typing import Any

import pytest

from m2pem.campaign.variations import Variations, read_variations
from m2pem.coverage.items import error_item, items_of, seen_in
from m2pem.coverage.mission_test import MissionTest
from m2pem.coverage.reach import Reach
from m2pem.coverage.scenario_file import read_scenarios
from m2pem.coverage.suite import Target, find_targets
from m2pem.mission.elements import ScriptTask, SendTask, ServiceTask, UserTask
from m2pem.mission.mission import Mission
from m2pem.plugins import PluginManager
from m2pem.rehearsal.answers import Answers
from m2pem.rehearsal.answers_file import AnswersModel
from m2pem.verify.search.explore import Limits

ROOT = Path(__file__).parents[2]
TARGETS = [each for each in find_targets([ROOT / "missions"]) if each.scenarios is not None]
RUNS = 15
LIMITS = Limits(seconds=30)
MAX_STEPS = 20_000


def everything_varies(mission: Mission) -> Variations:
    """Failures of every task, any decision, and signals and messages at any time."""
    fails = {"probability": 0.2, "after": "0..60 s"}
    said: dict[str, Any] = {"behaviors": {}, "services": {}, "answers": {}}
    for task in mission.activities():
        if isinstance(task, UserTask) and task.prompt is not None:
            said["answers"][task.id] = {each.value: 1 for each in task.prompt.decisions}
        elif isinstance(task, ScriptTask | ServiceTask | SendTask) and task.behavior:
            said["behaviors"][task.id] = {"fails": fails}
        elif isinstance(task, ServiceTask) and task.call:
            said["services"][task.id] = {"after": "0..60 s", "fails": fails}
    for kind, known in (("signals", mission.signals), ("messages", mission.messages)):
        said[kind] = [{"id": each, "at": "0..300 s", "probability": 0.3} for each in known]
    return read_variations(json.dumps(said).encode())


@pytest.mark.parametrize("target", TARGETS, ids=lambda each: each.mission.stem)
def test_no_random_run_reaches_what_no_run_can_reach(target: Target) -> None:
    assert target.scenarios is not None
    plugins = PluginManager()
    test = MissionTest(target.mission, read_scenarios(target.scenarios), plugins)
    mission, model = test.mission, test.file.model
    rehearser, process = test.rehearser(None), mission.process(model.process).id
    writes = plugins.service_writes()
    items = {item.key for item in items_of(mission)}
    reach = Reach(mission, rehearser.fleet, process, model.data, writes, LIMITS, items)
    unreachable = {item.key for item in items_of(mission) if reach.cannot_reach(item)}
    varied = everything_varies(mission)
    for run in range(RUNS):
        drawn = varied.draw(7, run)
        result = rehearser.rehearse(
            data=model.data,
            answers=Answers(AnswersModel.model_validate(drawn.answers)),
            max_steps=MAX_STEPS,
            observed=False,
        )
        seen = seen_in(each.record for each in result.records)
        assert not seen & unreachable
        errors = {key for key in seen if key.startswith(error_item("").key)}
        if reach.complete:
            assert errors <= {error_item(code).key for code in reach.uncaught}
