"""Where a run and its processes begin."""

from tests.engine.kit import Play
from tests.engine.trace import table

TWO_POOLS = """
    <process id="MAIN" isExecutable="true"> <startEvent id="start"/> <userTask id="main"/>
      start -> main
    </process>
    <process id="OTHER"> {starts}
      {flows}
    </process>
"""


def test_every_start_event_gets_a_token() -> None:
    play = Play("""
        <startEvent id="one"/> <startEvent id="two"/> <userTask id="a"/> <userTask id="b"/>
        one -> a
        two -> b
    """).start()
    assert play.at == "a b"


def test_the_data_given_at_start_is_in_the_store_before_anything_runs() -> None:
    play = Play("""
        <startEvent id="start"/> <scriptTask id="t">y = speed.max</scriptTask>
        start -> t
    """).start({"speed": {"max": 5, "unit": "m/s"}})
    assert play.data == {"speed.max": 5, "speed.unit": "m/s", "y": 5}


TYPED = """
    <startEvent id="plain"/> <startEvent id="on">{trigger}</startEvent>
    <userTask id="a"/> <userTask id="b"/>
    plain -> a
    on -> b
"""


def test_a_signal_start_of_the_begun_process_waits_for_its_signal() -> None:
    play = Play(TYPED.format(trigger="signal go")).start()
    assert play.at == "on a"
    assert play.signal("go", {"x": 1}).at == "a b"
    assert play.data == {"x": 1}
    assert play.signal("go").at == "a b"


def test_a_message_start_of_the_begun_process_waits_for_its_message() -> None:
    play = Play(TYPED.format(trigger="message m")).start()
    assert play.message("m", {"x": 1}).at == "a b"
    assert play.data == {"x": 1}


def test_a_timer_start_of_the_begun_process_waits_for_its_time() -> None:
    play = Play(TYPED.format(trigger="timer PT5S")).start()
    assert play.advance(4.9).at == "on a"
    assert play.advance(0.1).at == "a b"


def test_typed_starts_of_a_called_process_wait_likewise() -> None:
    play = Play(f"""
        <process id="MAIN" isExecutable="true"> <startEvent id="start"/> <endEvent id="end"/>
          <callActivity id="call" calledElement="P"/>
          start -> call -> end
        </process>
        <process id="P">{TYPED.format(trigger="signal go")}</process>
    """).start()
    assert play.at == "on a"
    assert play.answer(prompt="a").at == "on"
    assert play.signal("go").at == "b"
    assert play.answer().ended == "completed"


def test_another_process_gets_one_instance_for_each_trigger() -> None:
    play = Play(
        TWO_POOLS.format(
            starts='<startEvent id="g">signal go</startEvent> <startEvent id="got">message m'
            '</startEvent> <startEvent id="t">timer PT1S</startEvent> <startEvent id="p"/>'
            '<userTask id="a"/> <userTask id="b"/> <task id="c"/>',
            flows="g -> a\ngot -> b\nt -> c\np -> c",
        )
    ).start()
    assert play.at == "main"
    assert play.signal("go").signal("go").at == "main a a"
    assert play.message("m").at == "main a a b"
    assert play.advance(10).at == "main a a b"


def test_the_run_ends_when_the_last_instance_has() -> None:
    play = Play(
        TWO_POOLS.format(
            starts='<startEvent id="g">signal go</startEvent> <userTask id="a"/>', flows="g -> a"
        )
    ).start()
    play.signal("go")
    play.answer(prompt="main")
    assert (play.at, play.ended) == ("a", "")
    assert play.answer(prompt="a").ended == "completed"


def test_an_instance_has_a_store_of_its_own_with_the_triggers_data() -> None:
    play = Play(
        TWO_POOLS.format(
            starts='<startEvent id="g">signal go</startEvent>'
            '<scriptTask id="t">y = x</scriptTask> <userTask id="a"/>',
            flows="g -> t -> a",
        )
    ).start({"x": 1})
    play.signal("go", {"x": 5})
    assert play.data == {"x": 1}
    [instance] = [scope for scope in play.run.state.scopes.values() if scope.id != 1]
    assert instance.data == {"x": 5, "y": 5}


def test_a_process_that_is_called_gets_no_instance_by_a_trigger() -> None:
    play = Play("""
        <process id="MAIN" isExecutable="true"> <startEvent id="start"/> <userTask id="main"/>
          <callActivity id="call" calledElement="P"/>
          start -> main -> call
        </process>
        <process id="P"> <startEvent id="g">signal go</startEvent> <userTask id="a"/>
          g -> a
        </process>
    """).start()
    assert play.signal("go").at == "main"
    assert play.answer().at == "g"
    assert play.signal("go").at == "a"


def test_a_message_of_one_pool_starts_another_and_the_answer_comes_back() -> None:
    play = Play("""
        <process id="MAIN" isExecutable="true"> <startEvent id="start"/> <endEvent id="end"/>
          <sendTask id="send" messageRef="request"/>
          <receiveTask id="receive" messageRef="reply"/>
          start -> send -> receive -> end
        </process>
        <process id="OTHER"> <startEvent id="s">message request</startEvent>
          <endEvent id="e">message reply</endEvent>
          s -> e
        </process>
    """).start()
    assert play.trace("message", "enter", "end") == table("""
        enter start; enter send; message request; enter s; enter receive; enter e; message reply
        enter end; end completed
    """)
