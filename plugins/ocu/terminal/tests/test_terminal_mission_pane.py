"""The tree of active elements, drawn from records."""

import re

from m2pem_plugin_terminal.log_pane import line_of
from m2pem_plugin_terminal.mission_pane import mission_tree

from m2pem.api import RunStatus, RunSummary, RunView, StampedRecord
from m2pem.api import records as r

TASK = (1, "P", "Survey", 1)
HELD = "role 'surveyor': uav1 is held by r2.b1"
ASKED: list[r.Record] = [
    r.ScopeOpened(1, "P", "P"),
    r.TokenEntered(*TASK),
    r.AllocationRequested(*TASK, "r1.a1", "area_survey", "vehicle", {}, 0, 0),
]


def folded(*records: r.Record) -> RunView:
    view = RunView(RunSummary("r1", "m.bpmn", "", RunStatus.RUNNING, 0))
    for seq, record in enumerate(records, 1):
        view.apply(StampedRecord("r1", seq, 0.0, record))
    return view


def test_a_task_without_resources_waits_and_says_for_what() -> None:
    view = folded(*ASKED, r.AllocationDelayed("r1.a1", HELD, {"uav1": "r2.b1"}))
    tree = mission_tree(view, (), 0.0, 0.0, 80).plain
    assert re.fullmatch(r"P\n└ ○ Survey  waits for role 'surveyor': uav1 is held by r2.b1", tree)


def test_the_log_says_what_was_chosen() -> None:
    given = r.ResourcesAllocated(*TASK, "r1.a1", {"surveyor": ("uav1",)}, {"roles": {}})
    view = folded(*ASKED, given)
    line = line_of(view, StampedRecord("r1", 4, 0.0, given))
    assert line is not None
    assert line.text == "Survey: uav1 for surveyor"
