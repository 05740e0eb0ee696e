"""A run as it is sent to browsers."""

from m2pem_plugin_web.live.live_run import LiveRun

from m2pem.api import RunStatus, RunSummary, RunView, StampedRecord
from m2pem.api import records as r

P = "Process"


def enter(view: RunView, token: int, element: str) -> None:
    record = r.TokenEntered(token=token, process=P, element=element, scope=1)
    view.apply(StampedRecord("r1", view.seq + 1, 1.0, record))


def test_only_what_changed_is_encoded_again() -> None:
    live = LiveRun(RunView(RunSummary("r1", "m.bpmn", "", RunStatus.RUNNING, 0)))
    live.begin_changes()
    enter(live.view, 1, "A")
    enter(live.view, 2, "B")
    live.clear_changes()
    before = live.encoded((P, "A")), live.encoded((P, "B"))
    enter(live.view, 3, "B")
    live.clear_changes()
    assert live.encoded((P, "A")) is before[0]
    assert live.encoded((P, "B")) is not before[1]


def test_nothing_is_noted_while_no_browser_watches() -> None:
    live = LiveRun(RunView(RunSummary("r1", "m.bpmn", "", RunStatus.RUNNING, 0)))
    live.begin_changes()
    enter(live.view, 1, "A")
    old = live.encoded((P, "A"))
    live.end_changes()
    enter(live.view, 2, "A")
    assert live.view.changes is None
    live.begin_changes()
    assert live.encoded((P, "A")) is not old
