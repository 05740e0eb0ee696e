"""A run as it is sent to browsers."""

from m2pem_plugin_web.live.live_run import LiveRun, debugging

from m2pem.api import RunStatus, RunSummary, RunView, StampedRecord, parse_mission
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


MISSION = b"""<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"
  xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="t" id="d">
  <process id="Process" isExecutable="true">
    <startEvent id="Start"/><sequenceFlow id="f" sourceRef="Start" targetRef="Each"/>
    <subProcess id="Each">
      <multiInstanceLoopCharacteristics><loopCardinality>2</loopCardinality>
      </multiInstanceLoopCharacteristics>
      <scriptTask id="Drive"><extensionElements>
        <m2pem:behavior type="vehicle" name="drive_stop">
          <m2pem:resources><m2pem:role name="actor" vehicle="ugv1"/></m2pem:resources>
        </m2pem:behavior>
      </extensionElements></scriptTask>
    </subProcess>
  </process></definitions>"""


def scope(number: int, parent: int, token: int, instances: int | None = None) -> r.ScopeOpened:
    return r.ScopeOpened(
        scope=number, process=P, element="Each", parent=parent, token=token, instances=instances
    )


def test_a_stop_says_in_which_instance_it_is_and_which_vehicles_are_next() -> None:
    summary = RunSummary("r1", "m.bpmn", P, RunStatus.RUNNING, 0)
    view = RunView(summary, parse_mission(MISSION, "m.bpmn"))
    assert debugging(view) is None
    reached = r.BreakpointReached(r.StopReason.BREAKPOINT, 4, P, "Drive", 3)
    at = {"process": P, "element": "Each"}
    for seq, record in enumerate(
        (
            r.BreakpointsSet(("Drive",), ("n > 3",)),
            r.TokenEntered(token=1, scope=1, **at),
            scope(2, 1, 1, instances=2),
            r.TokenEntered(token=2, scope=2, instance=1, **at),
            scope(3, 2, 2),
            r.TokenEntered(token=4, process=P, element="Drive", scope=3),
            reached,
        ),
        1,
    ):
        view.apply(StampedRecord("r1", seq, 1.0, record))
    assert debugging(view) == {
        "elements": ("Drive",),
        "conditions": ("n > 3",),
        "stepping": False,
        "reached": {
            "reason": "breakpoint",
            "condition": "",
            "process": P,
            "element": "Drive",
            "token": 4,
            "scope": 3,
            "instance": None,
            "within": [{"process": P, "element": "Each", "instance": 1}],
            "resources": ["ugv1"],
        },
    }
    view.apply(StampedRecord("r1", 8, 1.0, r.RunPaused(1)))
    view.apply(StampedRecord("r1", 9, 1.0, r.BreakpointsSet(step=True)))
    view.apply(StampedRecord("r1", 10, 1.0, r.RunResumed(1)))
    assert debugging(view) == {
        "elements": (),
        "conditions": (),
        "stepping": True,
        "reached": None,
    }
    view.apply(StampedRecord("r1", 11, 1.0, r.RunPaused(1)))
    assert debugging(view) is None
