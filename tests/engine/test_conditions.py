"""Conditional events (BPMN 2.0.2, table 10.95): when one is looked at, and when it fires."""

import pytest

from m2pem.engine import inputs as i
from m2pem.engine import records as r
from tests.engine.conditional_events import CATCH, handler, writing
from tests.engine.kit import CANCELLED, Play
from tests.engine.trace import table

NOT = 'cancelActivity="false"'


# --- intermediate catch events ------------------------------------------------------------------


def test_a_catch_event_goes_on_as_soon_as_its_condition_becomes_true() -> None:
    play = Play(CATCH + writing("x = 3", "x = 4")).start()
    assert play.at == "catch first"
    assert play.answer().at == "catch second"
    play.entered()
    assert play.answer().entered() == "again third after"


def test_a_catch_event_whose_condition_is_true_already_goes_on_at_once() -> None:
    assert Play(CATCH).start({"x": 4}).ended == "completed"


def test_a_catch_event_goes_on_once_however_often_the_condition_is_written() -> None:
    play = Play(CATCH + writing("x = 4; x = 5", "x = 6")).start()
    play.answer().answer()
    assert play.entered().split().count("after") == 1


def test_a_catch_event_goes_on_before_the_next_step_of_another_branch() -> None:
    play = Play("""<startEvent id="start"/> <startEvent id="w"/>
        <intermediateCatchEvent id="catch">conditional x > 3</intermediateCatchEvent>
        <scriptTask id="seen">seen = x</scriptTask>
        <scriptTask id="up">x = 4</scriptTask> <scriptTask id="down">x = 0</scriptTask>
        start -> catch -> seen
        w -> up -> down
    """).start()
    assert play.ended == "completed"
    assert "seen" in play.entered().split()


def test_a_condition_is_looked_at_after_the_whole_step() -> None:
    # Conditions are not evaluated between two statements of one script.
    play = Play(CATCH + writing("x = 4; x = 0")).start()
    assert play.answer().at == "catch second"


def test_what_a_signal_or_answer_writes_counts_too() -> None:
    play = Play(
        CATCH
        + """<startEvent id="w"/> <intermediateCatchEvent id="s">signal go</intermediateCatchEvent>
        <userTask id="u"/>
        w -> s -> u
        """
    ).start()
    play.entered()
    assert play.signal("go", {"x": 9}).entered() == "u after"


def test_several_fire_in_the_order_in_which_they_were_armed() -> None:
    events = "".join(
        f'<startEvent id="s{n}"/> <intermediateCatchEvent id="c{n}">conditional go'
        f'</intermediateCatchEvent> <task id="t{n}"/>\ns{n} -> c{n} -> t{n}\n'
        for n in (1, 2, 3)
    )
    play = Play(events + writing("go = true")).start()
    play.entered()
    assert play.answer().entered() == "set second t1 t2 t3"


def test_what_is_false_or_null_does_not_fire_and_a_wait_for_nothing_is_a_deadlock() -> None:
    play = Play(CATCH).start()
    assert play.ended == "failed"
    assert play.detail == "stuck: no token can move from catch"


def test_a_condition_reads_what_its_scope_declares() -> None:
    play = Play("""
        <startEvent id="start"/> <subProcess id="sub"> <property id="x" name="x"/>
          <startEvent id="s"/> <startEvent id="s2"/> <userTask id="u"/>
          <scriptTask id="set">x = 4</scriptTask>
          <intermediateCatchEvent id="catch">conditional x > 3</intermediateCatchEvent>
          s -> catch
          s2 -> u -> set
        </subProcess>
        start -> sub
    """).start({"x": 9})
    assert play.at == "catch u"
    assert play.answer().ended == "completed"


def test_a_typed_start_of_the_process_that_the_run_begins_with_waits_until_it_is_true() -> None:
    play = Play(
        '<startEvent id="on">conditional x > 3</startEvent> <userTask id="a"/>\non -> a\n'
        + writing("x = 4")
    ).start()
    assert play.at == "on first"
    assert play.answer().at == "second a"


def test_behind_an_event_based_gateway_the_first_event_wins() -> None:
    text = """<startEvent id="start"/> <eventBasedGateway id="g"/>
        <intermediateCatchEvent id="c">conditional x > 3</intermediateCatchEvent>
        <intermediateCatchEvent id="t">timer PT5S</intermediateCatchEvent>
        <task id="yes"/> <task id="late"/>
        start -> g -> c -> yes
        g -> t -> late
    """
    assert Play(text).start({"x": 4}).entered() == "start g c yes"
    play = Play(text + writing("x = 4")).start()
    assert "yes" in play.answer().entered()
    assert Play(text).start().advance(5).entered() == "start g t late"


# --- boundary events ----------------------------------------------------------------------------


def on_work(attributes: str = "", work: str = '<userTask id="work"/>') -> str:
    return f"""<startEvent id="start"/> {work} <task id="done"/>
        <boundaryEvent id="on" attachedToRef="work" {attributes}>conditional low &lt; 20
        </boundaryEvent> <userTask id="then"/>
        start -> work -> done
        on -> then
    """


def test_an_interrupting_boundary_event_ends_the_activity() -> None:
    play = Play(
        on_work(work='<scriptTask id="work">do goto uav1 target=p</scriptTask>')
        + writing("low = 30", "low = 10")
    ).start()
    assert play.answer().at == "work second"
    play.trace()
    play.answer()
    assert play.trace("cancel", "leave", "enter") == table("""
        leave second; enter again; leave again; enter third
        cancel b1; leave work interrupted; enter on; leave on; enter then
    """)
    assert play.at == "third then"
    play.report("work", CANCELLED)


def test_an_activity_whose_condition_is_true_already_does_not_begin_its_work() -> None:
    play = Play(on_work(work='<scriptTask id="work">do goto uav1 target=p</scriptTask>'))
    play.start({"low": 10})
    assert play.orders() == ["open p1 done"]
    assert play.entered() == "start work on then"


def test_the_inside_of_a_subprocess_is_cut_before_its_next_step() -> None:
    inside = """<subProcess id="work"> <startEvent id="s"/>
        <scriptTask id="set">low = 5</scriptTask> <scriptTask id="next">ran = true</scriptTask>
        s -> set -> next
        </subProcess>"""
    play = Play(on_work(work=inside)).start()
    assert play.at == "then"
    assert "ran" not in play.data


def test_a_boundary_event_that_does_not_interrupt_fires_whenever_the_condition_becomes_true() -> (
    None
):
    play = Play(on_work(NOT) + writing("low = 10", "low = 5")).start()
    assert play.answer(prompt="first").at == "work second then"
    assert play.answer(prompt="second").at == "work then third"  # it has been true all the time


def test_a_condition_must_be_false_before_it_fires_again() -> None:
    play = Play(
        on_work(NOT)
        + writing("low = 10", "low = 30")
        + """<scriptTask id="last">low = 10</scriptTask>
        third -> last
        """
    ).start()
    play.answer(prompt="first").answer(prompt="second")
    assert play.at == "work then third"
    resets = [each for each in play.records() if isinstance(each, r.ConditionReset)]
    assert len(resets) == 1
    assert play.answer(prompt="third").at == "work then then"


def test_a_boundary_event_that_is_true_already_fires_once_beside_the_work() -> None:
    play = Play(on_work(NOT)).start({"low": 10})
    assert play.at == "work then"
    assert play.answer(prompt="work").entered().split().count("on") == 1


def test_a_condition_that_ends_with_its_activity_fires_no_more() -> None:
    play = Play(on_work() + writing("low = 10")).start()
    play.answer(prompt="work")
    assert play.answer().at == "second"


# --- event subprocesses -------------------------------------------------------------------------


def test_an_event_subprocess_interrupts_before_the_next_step_of_its_scope() -> None:
    play = Play(
        """<startEvent id="s"/> <scriptTask id="set">x = 4</scriptTask>
        <scriptTask id="next">ran = true</scriptTask>
        s -> set -> next
        """
        + handler("x > 3")
    ).start()
    assert play.at == "hu"
    assert "ran" not in play.data


def test_an_event_subprocess_whose_condition_is_true_when_its_scope_begins_interrupts_at_once() -> (
    None
):
    play = Play(writing() + handler("x > 3")).start({"x": 4})
    assert play.entered() == "w h hs hu"


def test_an_event_subprocess_that_does_not_interrupt_begins_on_each_change_to_true() -> None:
    play = Play(writing("x = 4", "x = 0") + handler("x > 3", 'isInterrupting="false"')).start()
    assert play.answer(prompt="first").at == "second hu"
    assert play.answer(prompt="second").at == "hu third"
    assert play.signal("none").at == "hu third"


def test_the_last_task_of_a_scope_may_begin_it() -> None:
    play = Play(
        """<startEvent id="s"/> <scriptTask id="set">x = 4</scriptTask>
        s -> set
        """
        + handler("x > 3", 'isInterrupting="false"')
    ).start()
    assert play.at == "hu"
    assert play.answer().ended == "completed"


def test_a_handler_that_writes_what_begins_it_yields_between_its_rounds() -> None:
    inside = """<scriptTask id="off">x = 0</scriptTask> <scriptTask id="on">x = 4; n = n + 1
        </scriptTask>
        hs -> off -> on
    """
    play = Play(
        writing() + handler("x > 3", 'isInterrupting="false"', inside),
        batch=25,
    )
    play.goes_on = False
    play.start({"x": 4, "n": 0})
    for _ in range(20):
        assert play.run.wants_continue
        play.give(i.Continue())
    assert play.data["n"] >= 50
    assert len(play.run.state.scopes) < 10  # rounds that are over leave nothing behind
    play.stop()


def test_a_condition_together_with_a_signal_needs_both() -> None:
    both = (
        '<signalEventDefinition signalRef="S"/><conditionalEventDefinition><condition>x > 3'
        "</condition></conditionalEventDefinition>"
    )
    text = (
        '<startEvent id="s"/> <userTask id="a"/>\ns -> a\n'
        '<subProcess id="h" triggeredByEvent="true"> <startEvent id="hs" isInterrupting="false" '
        f'parallelMultiple="true">{both}</startEvent> <userTask id="hu"/>\nhs -> hu\n'
        "</subProcess>" + writing("x = 4")
    )
    play = Play(text).start()
    assert play.signal("S").at == "a first"
    assert play.answer(prompt="first").at == "a second hu"
    assert play.signal("S").at == "a second hu"  # the condition was not false in between


# --- errors -------------------------------------------------------------------------------------

BAD = "'a' + 1 > 2"


def test_a_condition_that_cannot_be_evaluated_is_an_error_at_the_element() -> None:
    play = Play(CATCH.replace("x > 3", "1 / x > 3")).start({"x": 0})
    assert play.ended == "failed"
    assert "error EXPRESSION from catch" in play.detail
    assert "condition of catch" in play.detail


def test_at_a_boundary_it_is_an_error_of_the_activity() -> None:
    text = (
        on_work(NOT).replace("low &lt; 20", "1 / low &lt; 20")
        + """
        <boundaryEvent id="bad" attachedToRef="work">error EXPRESSION</boundaryEvent>
        <userTask id="b"/>
        bad -> b
    """
        + writing("low = 0")
    )
    play = Play(text).start({"low": 1})
    assert play.at == "work first then"
    assert play.answer(prompt="first").at == "then second b"


def test_at_an_event_subprocess_it_is_an_error_of_the_activity_around() -> None:
    text = f"""<startEvent id="start"/>
        <subProcess id="sub"> <startEvent id="s"/> <userTask id="a"/>
          s -> a
          {handler("1 / x > 3")}
        </subProcess>
        <boundaryEvent id="bad" attachedToRef="sub">error EXPRESSION</boundaryEvent>
        <userTask id="b"/>
        start -> sub
        bad -> b
    """
    assert Play(text).start({"x": 0}).at == "b"


# --- pause, resume, data stores -----------------------------------------------------------------


def test_a_paused_run_looks_at_what_was_written_when_it_goes_on() -> None:
    play = Play(CATCH + writing("x = 4")).start()
    play.pause().answer()
    assert play.at == "catch first"
    assert play.resume().at == "second"


def test_a_condition_on_a_data_store_waits_for_a_process_that_may_still_begin() -> None:
    play = Play("""
        <process id="MAIN" isExecutable="true"> <startEvent id="start"/>
          <dataStoreReference id="shared" name="x"/>
          <intermediateCatchEvent id="catch">conditional x > 3</intermediateCatchEvent>
          start -> catch
        </process>
        <process id="OTHER"> <startEvent id="on">signal go</startEvent>
          <scriptTask id="set">x = 4</scriptTask>
          on -> set
        </process>
    """).start()
    assert (play.at, play.ended) == ("catch", "")
    assert play.signal("go").ended == "completed"


@pytest.mark.parametrize("batch", [1, 2, 3, 7])
def test_batches_of_any_size_give_the_same(batch: int) -> None:
    text = on_work(NOT) + writing("low = 10", "low = 30") + handler("low > 20")
    whole = Play(text).start()
    whole.answer(prompt="first").answer(prompt="second")
    parts = Play(text, batch=batch).start()
    parts.answer(prompt="first").answer(prompt="second")
    skipped = ("yield", "end")
    assert [each for each in parts.trace() if each.split()[0] not in skipped] == [
        each for each in whole.trace() if each.split()[0] not in skipped
    ]
