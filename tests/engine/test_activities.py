"""Tasks: what each kind does, and what completes it."""

import re

import pytest

from m2pem.engine import records as r
from m2pem.engine.commands import OpenPrompt, RunService, StartBehavior
from m2pem.fleet.fleet import Domain, Fleet, Payload, Vehicle
from tests.engine.kit import FAILED, Play
from tests.engine.trace import table

ONE_TASK = """
    <startEvent id="start"/> {task} <endEvent id="end"/> <endEvent id="caught"/>
    <boundaryEvent id="error" attachedToRef="task">error</boundaryEvent>
    start -> task -> end
    error -> caught
"""


def one_task(task: str) -> Play:
    """A process of one task, whose errors lead to the end event `caught`."""
    return Play(ONE_TASK.format(task=task))


def thrown(play: Play) -> str:
    """Code and reason of the last error."""
    error = [record for record in play.records() if isinstance(record, r.ErrorThrown)][-1]
    assert error.element == "task"
    return f"{error.code}: {error.reason}"


@pytest.mark.parametrize(
    "task",
    ['<task id="task"/>', '<manualTask id="task"/>', '<scriptTask id="task"/>'],
    ids=["plain", "manual", "empty script"],
)
def test_a_task_without_work_of_its_own_is_done_at_once(task: str) -> None:
    play = one_task(task).start()
    assert play.entered() == "start task end"
    assert play.ended == "completed"


# --- script tasks -------------------------------------------------------------------------------


def test_a_script_writes_its_assignments_in_order() -> None:
    play = one_task('<scriptTask id="task">a = 1; b = a + 1; a = b * 2</scriptTask>').start()
    assert play.trace("write") == ["write a = 1", "write b = 2", "write a = 4"]
    assert play.data == {"a": 4, "b": 2}
    assert play.ended == "completed"


def test_a_script_throws_an_error_and_what_follows_is_not_run() -> None:
    play = one_task('<scriptTask id="task">a = 1; throw error NO_FUEL; a = 2</scriptTask>').start()
    assert play.entered() == "start task error caught"
    assert re.fullmatch(r"NO_FUEL: thrown at line \d+", thrown(play))
    assert play.data == {"a": 1}


def test_the_lines_of_a_script_share_what_they_may_look_at() -> None:
    play = one_task('<scriptTask id="task">a = max(l); b = max(l); a = max(l)</scriptTask>')
    play.start({"l": [0] * 40_000})
    assert play.entered() == "start task error caught"
    assert "it looks at more than 100,000 values, in 'max(l)'" in thrown(play)


def test_a_script_that_divides_by_zero_throws_expression_with_the_line() -> None:
    play = one_task('<scriptTask id="task">a = 1; b = a / 0</scriptTask>').start()
    assert play.entered() == "start task error caught"
    assert re.match(r"EXPRESSION: line \d+: '/' divides", thrown(play))


# --- behaviors ----------------------------------------------------------------------------------


def test_a_behavior_runs_until_its_arbiter_reports_success() -> None:
    play = one_task('<scriptTask id="task">do goto uav1 speed=${v} target=[1,2,3]</scriptTask>')
    play.start({"v": 4.5})
    [command] = play.commands()
    assert isinstance(command, StartBehavior)
    assert (command.behavior, command.element, command.epoch) == ("r1.b1", "task", 1)
    assert (command.type, command.name, command.resources) == ("vehicle", "goto", ("uav1",))
    assert command.roles == {"role1": ("uav1",)}
    assert command.parameters == {"speed": 4.5, "target": "[1,2,3]"}
    assert play.at == "task"
    assert play.report("task").ended == "completed"


@pytest.mark.parametrize(("code", "expected"), [("ROUTE_BLOCKED", "ROUTE_BLOCKED"), ("", "FAILED")])
def test_a_failed_behavior_throws_its_code(code: str, expected: str) -> None:
    play = one_task('<scriptTask id="task">do goto uav1 target=[1,2,3]</scriptTask>').start()
    play.report("task", FAILED, code)
    assert play.entered() == "start task error caught"
    assert thrown(play) == f"{expected}: goto ended FAILED"


def test_a_behavior_whose_parameter_cannot_be_read_throws_expression() -> None:
    play = one_task('<scriptTask id="task">do goto uav1 speed=${1/x}</scriptTask>').start({"x": 0})
    assert play.entered() == "start task error caught"
    assert thrown(play).startswith("EXPRESSION: parameter speed: the result of the expression is")
    assert play.orders() == []


@pytest.mark.parametrize("duration", ["5 s", "5", "PT5S"])
def test_a_hold_without_a_role_is_a_wait(duration: str) -> None:
    play = Play(f"""
        <startEvent id="start"/> <endEvent id="end"/>
        <scriptTask id="task"><script><![CDATA[
            <behavior type="vehicle" name="hold">
              <properties><property name="duration" value="{duration}"/></properties>
            </behavior>]]></script></scriptTask>
        start -> task -> end
    """).start()
    assert play.orders() == []
    assert play.advance(4.999).at == "task"
    assert play.advance(0.001).ended == "completed"


@pytest.mark.parametrize("duration", ["${x}", "5m", "-5s", "1e300s", "P1X", "P9999Y"])
def test_a_wait_of_no_duration_is_rejected(duration: str) -> None:
    play = one_task(f'<scriptTask id="task">do hold duration={duration}</scriptTask>')
    play.start({"x": [1]})
    assert play.entered() == "start task error caught"
    assert thrown(play).startswith("REJECTED: parameter duration: ")


def test_a_send_or_service_task_may_carry_a_behavior() -> None:
    behavior = (
        '<extensionElements><m2pem:behavior type="vehicle" name="drive_stop"><m2pem:resources>'
        '<m2pem:role name="driver" vehicle="evsg1"/></m2pem:resources></m2pem:behavior>'
        "</extensionElements>"
    )
    play = Play(f"""
        <startEvent id="start"/> <endEvent id="end"/>
        <sendTask id="send">{behavior}</sendTask> <serviceTask id="serve">{behavior}</serviceTask>
        start -> send -> serve -> end
    """).start()
    assert play.report("send").report("serve").orders() == [
        "start b1 drive_stop evsg1",
        "start b2 drive_stop evsg1",
    ]
    assert play.ended == "completed"


# --- service tasks ------------------------------------------------------------------------------


def test_a_service_gets_its_roles_and_properties_and_what_it_writes_is_stored() -> None:
    play = one_task(
        '<serviceTask id="task">call Detector evsg1/gpr since=${t} kind=x</serviceTask>'
    )
    play.start({"t": 3})
    [command] = play.commands()
    assert isinstance(command, RunService)
    assert (command.service, command.name, command.element) == ("s1", "Detector", "task")
    assert command.roles == {"role1": ("evsg1/gpr",)}
    assert command.properties == {"since": 3, "kind": "x"}
    play.complete("task", detection={"type": "gpr", "position": [1.0, 2.0, None]})
    assert play.data == {"t": 3, "detection.type": "gpr", "detection.position": [1.0, 2.0, None]}
    assert play.ended == "completed"


def test_a_failed_service_throws_its_code_and_writes_nothing() -> None:
    play = one_task('<serviceTask id="task">call Detector</serviceTask>').start()
    play.fail("task", "NO_SENSOR")
    assert thrown(play) == "NO_SENSOR: "
    assert play.entered() == "start task error caught"


def test_a_service_task_that_is_interrupted_withdraws_its_service() -> None:
    play = Play("""
        <startEvent id="start"/> <endEvent id="end"/>
        <serviceTask id="task">call Detector</serviceTask>
        <boundaryEvent id="late" attachedToRef="task">timer PT5S</boundaryEvent>
        start -> task -> end
        late -> end
    """).start()
    assert play.advance(5).orders() == ["run s1 Detector", "cancel s1"]
    assert play.entered() == "start task late end"


def test_a_service_property_that_cannot_be_read_throws_expression() -> None:
    play = one_task('<serviceTask id="task">call Detector since=${1/x}</serviceTask>')
    play.start({"x": 0})
    assert thrown(play).startswith("EXPRESSION: property since: the result of the expression is")
    assert play.orders() == []


def test_a_service_whose_role_the_fleet_lacks_is_unavailable() -> None:
    fleet = Fleet("f", "fleet.yaml", {})
    play = Play(
        ONE_TASK.format(task='<serviceTask id="task">call Detector evsg1/gpr</serviceTask>'),
        fleet=fleet,
    ).start()
    assert thrown(play).startswith("RESOURCE_UNAVAILABLE: role 'role1': fleet.yaml has no payload")


def test_an_optional_role_that_the_fleet_lacks_is_left_out() -> None:
    vehicle = Vehicle("uav1", Domain.AIR, "sim", {})  # type: ignore[arg-type]
    play = Play(
        ONE_TASK.format(task='<scriptTask id="task">do goto uav1 uav2?</scriptTask>'),
        fleet=Fleet("f", "fleet.yaml", {vehicle.id: vehicle}),
    ).start()
    assert play.orders() == ["start b1 goto uav1"]


def test_a_behavior_left_without_any_resource_is_unavailable() -> None:
    payload = Payload("evsg1/gpr", "evsg1", "sim", {})  # type: ignore[arg-type]
    play = Play(
        ONE_TASK.format(task='<scriptTask id="task">do goto uav1?</scriptTask>'),
        fleet=Fleet("f", "fleet.yaml", {}, {payload.id: payload}),
    ).start()
    assert thrown(play) == "RESOURCE_UNAVAILABLE: no resource is allocated to goto"


# --- user tasks ---------------------------------------------------------------------------------


def test_a_user_task_asks_and_stores_the_decision() -> None:
    play = one_task("""<userTask id="task" name="Go on?"><extensionElements>
        <m2pem:userTask store="operator.said" role="commander"/>
        <m2pem:prompt>Really?</m2pem:prompt>
        <m2pem:decision value="yes" label="Yes!"/> <m2pem:decision value="no"/>
        </extensionElements></userTask>""").start()
    [command] = play.commands()
    assert isinstance(command, OpenPrompt)
    assert (command.prompt, command.element, command.text) == ("p1", "task", "Really?")
    assert [(d.value, d.label) for d in command.decisions] == [("yes", "Yes!"), ("no", "no")]
    assert command.role == "commander"
    assert play.answer("no").data == {"operator.said": "no"}
    assert play.ended == "completed"


def test_a_user_task_without_decisions_is_confirmed() -> None:
    play = one_task('<userTask id="task"/>').start()
    assert play.orders() == ["open p1 done"]
    assert play.answer("done").data == {"user.decision": "done"}


# --- send and receive tasks ---------------------------------------------------------------------


def test_a_send_task_sends_and_goes_on() -> None:
    play = Play("""
        <process id="MAIN" isExecutable="true"> <startEvent id="start"/> <endEvent id="end"/>
          <sendTask id="send" messageRef="m"/>
          start -> send -> end
        </process>
        <process id="OTHER"> <startEvent id="got">message m</startEvent> <endEvent id="stop"/>
          got -> stop
        </process>
    """).start()
    assert play.trace("message", "enter", "open", "end") == table("""
        open MAIN; enter start; enter send
        message m; open OTHER; enter got
        enter end; enter stop; end completed
    """)


def test_a_receive_task_waits_for_its_message_and_takes_its_data() -> None:
    play = one_task('<receiveTask id="task" messageRef="m"/>').start()
    assert play.at == "task"
    play.message("m", {"route": "alpha"})
    assert play.data == {"route": "alpha"}
    assert play.ended == "completed"
