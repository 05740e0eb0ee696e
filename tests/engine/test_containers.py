"""Subprocesses and call activities: their data, their depth, their ends."""

import pytest

from m2pem.bpmn import MAX_DEPTH
from m2pem.engine import records as r
from tests.engine.kit import Play
from tests.engine.trace import table


def test_a_subprocess_runs_its_inside_and_goes_on() -> None:
    play = Play("""
        <startEvent id="start"/> <endEvent id="end"/>
        <subProcess id="sub"> <startEvent id="s"/> <userTask id="u"/> <endEvent id="e"/>
          s -> u -> e
        </subProcess>
        start -> sub -> end
    """).start()
    assert play.at == "u"
    play.trace()
    assert play.answer().trace("leave", "enter", "close") == table("""
        leave u; enter e; leave e; close sub; leave sub; enter end; leave end; close MAIN
    """)


def test_a_subprocess_ends_when_its_last_token_has() -> None:
    play = Play("""
        <startEvent id="start"/> <userTask id="after"/>
        <subProcess id="sub"> <startEvent id="s"/> <userTask id="a"/> <userTask id="b"/>
          s -> a
          s -> b
        </subProcess>
        start -> sub -> after
    """).start()
    assert play.answer(prompt="a").at == "b"
    assert play.answer(prompt="b").at == "after"


def test_an_empty_subprocess_ends_as_soon_as_it_is_entered() -> None:
    play = Play("""
        <startEvent id="start"/> <subProcess id="sub"/> <endEvent id="end"/>
        start -> sub -> end
    """).start()
    assert play.ended == "completed"


def test_a_container_without_start_events_begins_at_what_nothing_leads_to() -> None:
    play = Play("""
        <startEvent id="start"/>
        <subProcess id="sub"> <userTask id="a"/> <userTask id="b"/> <task id="c"/>
          b -> c
        </subProcess>
        start -> sub
    """).start()
    assert play.at == "a b"


# --- data ---------------------------------------------------------------------------------------

SHARED = """
    <startEvent id="start"/>
    <subProcess id="sub"> {declared} <startEvent id="s"/>
      <scriptTask id="in">seen = x; x = 2; y = x</scriptTask>
      s -> in
    </subProcess>
    <scriptTask id="after">after = x</scriptTask>
    start -> sub -> after
"""


def test_a_subprocess_shares_its_parents_data() -> None:
    play = Play(SHARED.format(declared="")).start({"x": 1})
    assert play.data == {"x": 2, "seen": 1, "y": 2, "after": 2}


def test_what_a_subprocess_declares_is_its_own_and_gone_with_it() -> None:
    play = Play(SHARED.format(declared='<dataObject id="d1" name="x"/>')).start({"x": 1})
    assert play.data == {"x": 1, "seen": None, "y": 2, "after": 1}


def test_entries_of_a_declared_name_are_local_too() -> None:
    play = Play("""
        <startEvent id="start"/>
        <subProcess id="sub"> <property id="p1" name="pose"/> <startEvent id="s"/>
          <scriptTask id="in">pose.x = 5; poses = 6</scriptTask>
          s -> in
        </subProcess>
        start -> sub
    """).start({"pose": {"x": 1}})
    assert play.data == {"pose.x": 1, "poses": 6}


CALL = """
    <process id="MAIN" isExecutable="true"> <startEvent id="start"/> <endEvent id="end"/>
      <callActivity id="call" calledElement="P">{mappings}</callActivity>
      start -> call -> end
    </process>
    <process id="P"> <startEvent id="s"/>
      <scriptTask id="in">seen = x; got = a; x = 2; y = 3</scriptTask>
      <endEvent id="e"/>
      s -> in -> e
    </process>
"""


def test_a_called_process_sees_only_what_is_mapped_in_and_gives_only_what_is_mapped_out() -> None:
    text = CALL.format(mappings="in x+1 as a, out y as z.y, out seen as seen, out got as got")
    play = Play(text).start({"x": 1})
    assert play.data == {"x": 1, "z.y": 3, "seen": None, "got": 2}


def test_without_mappings_nothing_passes() -> None:
    text = CALL.format(mappings="")
    assert Play(text).start({"x": 1, "a": 5}).data == {"x": 1, "a": 5}


def test_an_output_goes_to_the_nearest_scope_that_declares_its_name() -> None:
    play = Play("""
        <process id="MAIN" isExecutable="true"> <startEvent id="start"/>
          <subProcess id="sub"> <property id="p1" name="z"/> <startEvent id="s"/>
            <callActivity id="call" calledElement="P">out 5 as z, out 6 as w</callActivity>
            <scriptTask id="copy">copied = z</scriptTask>
            s -> call -> copy
          </subProcess>
          start -> sub
        </process>
        <process id="P"> <startEvent id="s2"/> <endEvent id="e2"/>
          s2 -> e2
        </process>
    """).start()
    assert play.data == {"w": 6, "copied": 5}


def test_an_input_that_cannot_be_evaluated_throws_expression_at_the_call() -> None:
    play = Play(CALL.format(mappings="in 1/a as b")).start({"a": 0})
    [error] = [record for record in play.records() if isinstance(record, r.ErrorThrown)]
    assert (error.element, error.code) == ("call", "EXPRESSION")
    assert error.reason.startswith("mapping to b: '/' divides")
    assert play.entered() == "start call"


def test_an_output_that_cannot_be_evaluated_throws_expression_at_the_call() -> None:
    play = Play(CALL.format(mappings="out y as c, out 1/(y-3) as b")).start()
    [error] = [record for record in play.records() if isinstance(record, r.ErrorThrown)]
    assert (error.element, error.code) == ("call", "EXPRESSION")
    assert error.reason.startswith("mapping to b: '/' divides")
    assert play.data == {}


# --- depth --------------------------------------------------------------------------------------


def nested(depth: int) -> str:
    text = '<userTask id="deep"/>'
    for level in range(depth):
        text = f'<subProcess id="sub{level}">{text}</subProcess>'
    return text


@pytest.mark.parametrize("depth", [500, MAX_DEPTH])
def test_subprocesses_nest_as_deep_as_they_can_be_read(depth: int) -> None:
    play = Play(nested(depth)).start()
    assert play.at == "deep"
    assert play.answer().ended == "completed"


def test_an_interruption_reaches_500_deep() -> None:
    play = Play(f"""
        <startEvent id="start"/> <userTask id="after"/> {nested(500)}
        <boundaryEvent id="stop" attachedToRef="sub499">signal go</boundaryEvent>
        start -> sub499
        stop -> after
    """).start()
    assert play.at == "deep"
    assert play.signal("go").at == "after"
    assert play.orders() == ["open p1 done", "close p1", "open p2 done"]


def test_a_call_that_never_stops_calling_itself_throws_recursion() -> None:
    play = Play("""
        <process id="MAIN" isExecutable="true"> <startEvent id="start"/>
          <callActivity id="call" calledElement="P"/> <userTask id="after"/>
          <boundaryEvent id="deep" attachedToRef="call">error RECURSION</boundaryEvent>
          start -> call
          deep -> after
        </process>
        <process id="P"> <startEvent id="s"/> <callActivity id="again" calledElement="P"/>
          s -> again
        </process>
    """).start()
    [error] = [record for record in play.records() if isinstance(record, r.ErrorThrown)]
    assert (error.element, error.code) == ("again", "RECURSION")
    assert play.at == "after"


def test_recursion_that_no_event_catches_fails_the_run() -> None:
    play = Play("""
        <startEvent id="s"/> <callActivity id="again" calledElement="MAIN"/>
        s -> again
    """).start()
    assert play.ended == "failed"
    assert "RECURSION" in play.detail


# --- terminate ----------------------------------------------------------------------------------

INSIDE = """<startEvent id="s"/> <userTask id="u"/> <userTask id="v"/>
    <endEvent id="kill">terminate</endEvent>
    s -> u -> kill
    s -> v
"""


def test_terminate_ends_its_subprocess_and_the_parent_goes_on() -> None:
    play = Play(f"""
        <startEvent id="start"/> <userTask id="other"/> <userTask id="after"/>
        <subProcess id="sub">{INSIDE}</subProcess>
        start -> sub -> after
        start -> other
    """).start()
    play.trace()
    play.answer(prompt="u")
    assert play.at == "other after"
    assert play.trace("leave", "close", "withdraw") == table("""
        leave u; leave kill; withdraw p3; leave v terminated; close sub terminated; leave sub
    """)


def test_terminate_ends_a_called_process_and_its_outputs_pass() -> None:
    play = Play(f"""
        <process id="MAIN" isExecutable="true"> <startEvent id="start"/> <userTask id="after"/>
          <callActivity id="call" calledElement="P">out user.decision as said</callActivity>
          start -> call -> after
        </process>
        <process id="P">{INSIDE}</process>
    """).start()
    assert play.answer(prompt="u").at == "after"
    assert play.data == {"said": "done"}


def test_terminate_ends_a_triggered_instance_only() -> None:
    play = Play(f"""
        <process id="MAIN" isExecutable="true"> <startEvent id="start"/> <userTask id="main"/>
          start -> main
        </process>
        <process id="P">{
        INSIDE.replace('<startEvent id="s"/>', '<startEvent id="s">signal go</startEvent>')
    }</process>
    """).start()
    play.signal("go")
    assert play.at == "main u v"
    assert play.answer(prompt="u").at == "main"
    assert play.answer(prompt="main").ended == "completed"


def test_terminate_in_the_process_the_run_began_with_ends_the_run_as_terminated() -> None:
    play = Play(f"""
        <process id="MAIN" isExecutable="true">{INSIDE}</process>
        <process id="P"> <startEvent id="g">signal go</startEvent> <userTask id="p"/>
          g -> p
        </process>
    """).start()
    play.signal("go")
    assert play.at == "u v p"
    play.trace()
    play.answer(prompt="u")
    assert play.ended == "terminated"
    assert "leave p terminated" in play.trace()
    assert "kill" in play.detail
