"""Multi-instance activities (BPMN 2.0.2, clauses 10.3.8 and 13.3.7)."""

import pytest

from m2pem.engine import records as r
from m2pem.engine.commands import CancelBehavior
from m2pem.engine.inputs import Continue, StartRun
from m2pem.engine.run import MissionRun
from m2pem.mission.values import Value
from tests.engine.instances import asked, scripted
from tests.engine.kit import FAILED, Play
from tests.engine.notation import mission
from tests.engine.trace import table

# --- how many -------------------------------------------------------------------------------------


def test_parallel_instances_all_begin_at_once() -> None:
    play = asked("<each>3</each>")
    assert play.at == "u u u"
    play.answer().answer()
    assert play.at == "u"
    assert play.answer().ended == "completed"


def test_sequential_instances_begin_one_after_the_other() -> None:
    play = asked('<each isSequential="true">3</each>')
    assert play.at == "u"
    play.answer().answer()
    assert play.at == "u"
    assert play.answer().ended == "completed"


@pytest.mark.parametrize("sequential", ["true", "false"])
def test_the_whole_and_each_instance_are_entered_and_left(sequential: str) -> None:
    play = scripted(f'<each isSequential="{sequential}">2</each>', "x = 1")
    entered = [
        (record.element, record.scope, record.instance)
        for record in play.records()
        if isinstance(record, r.TokenEntered)
    ]
    assert entered == [("s", 1, None), ("t", 1, None), ("t", 2, 0), ("t", 2, 1), ("e", 1, None)]
    left = [
        (record.element, record.instance)
        for record in play.records()
        if isinstance(record, r.TokenLeft)
    ]
    assert left == [("s", None), ("t", 0), ("t", 1), ("t", None), ("e", None)]


@pytest.mark.parametrize("marker", ["<each>n - 2</each>", '<each in="items"> </each>'])
def test_no_instances_complete_at_once(marker: str) -> None:
    play = scripted(marker, "never = true", n=2, items=[])
    assert play.ended == "completed"
    assert "never" not in play.data
    assert "open t" not in play.trace()


def test_a_cardinality_may_be_any_expression_that_gives_a_natural_number() -> None:
    assert scripted("<each>4 / 2</each>", "k = loopCounter").data["k"] == 1


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("-1", "the number -1"),
        ("1.5", "the number 1.5"),
        ("'3'", "the text '3'"),
        ("nothing", "null"),
        ("true", "true"),
    ],
)
def test_another_cardinality_is_an_error_that_says_what_it_is(text: str, said: str) -> None:
    play = scripted(f"<each>{text}</each>", "x = 1")
    assert play.ended == "failed"
    assert "error EXPRESSION from t, which no event catches: instances of t: the" in play.detail
    assert said in play.detail


@pytest.mark.parametrize("items", [None, "abc", {"a": 1}, 7])
def test_a_collection_that_is_no_list_is_an_error(items: Value) -> None:
    play = scripted('<each in="items" item="one"> </each>', "x = 1", items=items)
    assert play.ended == "failed"
    assert "the collection 'items' is" in play.detail
    assert "not a list" in play.detail


def test_more_parallel_instances_than_memory_holds_are_an_error() -> None:
    assert "more than" in scripted("<each>1000 * 1000 + 1</each>", "x = 1").detail


def test_its_own_boundary_event_catches_a_wrong_number() -> None:
    play = Play("""
        <startEvent id="s"/> <task id="t"><each>-1</each></task> <userTask id="u"/>
        <boundaryEvent id="b" attachedToRef="t">error EXPRESSION</boundaryEvent>
        s -> t
        b -> u
    """).start()
    assert play.at == "u"


# --- completion -----------------------------------------------------------------------------------


def test_a_true_completion_condition_cancels_the_others() -> None:
    play = Play("""
        <dataObject id="items"/> <startEvent id="s"/> <userTask id="after"/>
        <subProcess id="each"><each in="items" item="field">
             until numberOfCompletedInstances >= 2</each>
          <userTask id="look"/>
        </subProcess>
        s -> each -> after
    """).start({"items": ["a", "b", "c", "d"]})
    play.answer(prompt="p2").trace()
    assert play.answer(prompt="p4").trace("leave", "withdraw", "close", "enter") == table("""
        leave look; close each; leave each
        withdraw p3; leave look interrupted; close each interrupted
        withdraw p1; leave look interrupted; close each interrupted
        leave each interrupted; leave each interrupted; close each
        leave each; enter after
    """)
    assert play.at == "after"


def test_cancelled_instances_have_their_vehicles_cancelled() -> None:
    play = Play("""
        <startEvent id="s"/> <userTask id="after"/>
        <subProcess id="both"><each>2 until true</each>
          <exclusiveGateway id="which" default="two"/>
          <scriptTask id="one">do goto uav1</scriptTask>
          <scriptTask id="other">do goto uav2</scriptTask>
          which -> one if loopCounter == 0
          two: which -> other
        </subProcess>
        s -> both -> after
    """).start()
    play.report("one")
    assert play.at == "after"
    [cancelled] = [each for each in play.commands() if isinstance(each, CancelBehavior)]
    assert cancelled.behavior == "r1.b2"


def test_a_sequential_one_begins_no_more_when_its_completion_condition_is_true() -> None:
    play = scripted('<each isSequential="true">10 until loopCounter == 3</each>', "n = n + 1", n=0)
    assert play.data["n"] == 4


def test_a_completion_condition_reads_how_far_the_instances_are() -> None:
    play = asked(
        "<each>4 until numberOfInstances - numberOfCompletedInstances == 1"
        " and numberOfActiveInstances == 1 and numberOfTerminatedInstances == 0</each>"
    )
    play.answer().answer()
    assert play.at == "u u"
    assert play.answer().ended == "completed"


def test_a_completion_condition_reads_what_the_instance_has_of_its_own() -> None:
    play = scripted(
        '<each in="items" item="one" isSequential="true"> until one == 2</each>',
        "seen = one",
        items=[1, 2, 3],
    )
    assert play.data["seen"] == 2


def test_a_wrong_completion_condition_is_an_error_of_the_activity() -> None:
    play = scripted("<each>2 until 1 / 0 > 1</each>", "x = 1")
    assert play.ended == "failed"
    assert "completion condition of t" in play.detail


# --- nesting --------------------------------------------------------------------------------------


def test_instances_within_instances() -> None:
    play = Play("""
        <dataObject id="rows"/> <dataObject id="results"/> <startEvent id="s"/>
        <subProcess id="outer"><each in="rows" item="row" out="results" result="found"> </each>
          <scriptTask id="t">
            <multiInstanceLoopCharacteristics m2pem:collection="row.cells"
                m2pem:elementVariable="c">
              <loopDataOutputRef>found</loopDataOutputRef><outputDataItem name="out"/>
            </multiInstanceLoopCharacteristics>
            <script>out = c + 10 * row.k
            total = numberOfInstances</script>
          </scriptTask>
        </subProcess>
        s -> outer
    """).start({"rows": [{"k": 1, "cells": [1, 2]}, {"k": 2, "cells": []}]})
    assert play.data["results"] == [[11, 12], []]
    assert play.data["total"] == 2


def test_an_error_in_an_instance_within_an_instance_climbs_to_what_catches_it() -> None:
    play = Play("""
        <startEvent id="s"/> <userTask id="u"/>
        <subProcess id="outer"><each>2</each>
          <userTask id="ask">ask done<each>2</each></userTask>
          <scriptTask id="bad">throw error E1</scriptTask>
          ask -> bad
        </subProcess>
        <boundaryEvent id="b" attachedToRef="outer">error E1</boundaryEvent>
        s -> outer
        b -> u
    """).start()
    assert play.at == "ask ask ask ask"
    play.answer(prompt="p1").answer(prompt="p2")
    assert play.at == "u"
    assert play.run.state.scopes.keys() == {1}


def test_a_terminate_end_event_ends_its_own_instance_only() -> None:
    play = Play("""
        <startEvent id="s"/> <userTask id="after"/>
        <subProcess id="sub"><each>3 until numberOfTerminatedInstances == 2</each>
          <startEvent id="in"/> <userTask id="u">ask yes no</userTask> <userTask id="other"/>
          <exclusiveGateway id="g" default="stay"/> <endEvent id="t">terminate</endEvent>
          <endEvent id="stays"/>
          in -> u -> g -> t if user.decision == 'no'
          stay: g -> stays
          in -> other
        </subProcess>
        s -> sub -> after
    """).start()
    play.answer("no", prompt="p1")
    assert play.at == "u other u other"
    assert play.answer("no", prompt="u").at == "after"


def test_an_event_subprocess_catches_the_error_of_its_instance_alone() -> None:
    play = Play("""
        <startEvent id="s"/> <userTask id="after"/>
        <subProcess id="sub"><each>2</each>
          <subProcess id="handler" triggeredByEvent="true">
            <startEvent id="on">error E1</startEvent> <userTask id="repair"/>
            on -> repair
          </subProcess>
          <startEvent id="in"/> <userTask id="u"/>
          <scriptTask id="bad">throw error E1</scriptTask>
          in -> u -> bad
        </subProcess>
        s -> sub -> after
    """).start()
    assert play.answer(prompt="p1").at == "u repair"
    play.answer(prompt="repair").answer(prompt="u")
    assert play.at == "repair"
    assert play.answer(prompt="repair").at == "after"


# --- what ends it early ---------------------------------------------------------------------------


def test_an_interrupting_boundary_event_ends_all_instances_innermost_first() -> None:
    play = Play("""
        <startEvent id="s"/> <userTask id="after"/>
        <subProcess id="sub"><each>2</each>
          <exclusiveGateway id="g" default="two"/>
          <scriptTask id="one">do goto uav1</scriptTask>
          <scriptTask id="other">do goto uav2</scriptTask>
          g -> one if loopCounter == 0
          two: g -> other
        </subProcess>
        <boundaryEvent id="b" attachedToRef="sub">signal S</boundaryEvent>
        s -> sub
        b -> after
    """).start()
    play.trace()
    assert play.signal("S").trace("cancel", "leave", "close", "enter") == table("""
        cancel b2; leave other interrupted; close sub interrupted
        cancel b1; leave one interrupted; close sub interrupted
        leave sub interrupted; leave sub interrupted; close sub interrupted
        leave sub interrupted; enter b; leave b; enter after
    """)


def test_a_failing_vehicle_ends_the_whole() -> None:
    play = Play("""
        <startEvent id="s"/> <userTask id="after"/>
        <subProcess id="sub"><each>2</each>
          <scriptTask id="fly">do goto uav1</scriptTask>
          <boundaryEvent id="busy" attachedToRef="fly">error RESOURCE_UNAVAILABLE</boundaryEvent>
          <userTask id="wait"/>
          busy -> wait
        </subProcess>
        <boundaryEvent id="b" attachedToRef="sub">error FAILED</boundaryEvent>
        s -> sub
        b -> after
    """).start()
    assert play.at == "fly wait"
    assert play.report("fly", FAILED).at == "after"


def test_an_instance_that_is_stuck_is_noticed() -> None:
    play = Play("""
        <startEvent id="s"/>
        <subProcess id="sub"><each>2</each>
          <startEvent id="in"/> <exclusiveGateway id="g" default="no"/> <task id="a"/>
          <parallelGateway id="join"/>
          in -> g -> join if loopCounter == 1
          no: g -> a
          a -> join
        </subProcess>
        s -> sub
    """).start()
    assert play.ended == "failed"
    assert play.detail == "stuck: no token can move from join"


# --- size -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("sequential", ["true", "false"])
def test_ten_thousand_instances_take_as_many_steps_and_leave_nothing(sequential: str) -> None:
    made = mission(f"""
        <dataObject id="items"/> <dataObject id="results"/> <startEvent id="s"/>
        <scriptTask id="t">
          <each in="items" item="one" out="results" result="two" isSequential="{sequential}">
            until numberOfActiveInstances < 0</each>
          <script>two = one * 2</script>
        </scriptTask>
        s -> t
    """)
    run = MissionRun(made, None, "r1", 1000)
    items: list[Value] = list(range(10_000))
    steps = [run.receive(StartRun("MAIN", {"items": items}), 0)]
    while run.wants_continue:
        steps.append(run.receive(Continue(), 0))
    records = [record for step in steps for record in step.records]
    [opened] = [each for each in records if isinstance(each, r.ScopeOpened) and each.items]
    assert opened.instances == 10_000
    written = [each for each in records if isinstance(each, r.DataWritten)]
    results = [each.value for each in written if each.key == "results"]
    assert results == [[2 * number for number in range(10_000)]]
    assert len(records) < 6 * 10_000
    assert run.steps_done <= 2 * 10_000 + 5
    assert run.state.outcome == "completed"


def test_a_stop_gets_its_turn_while_instances_are_still_being_begun() -> None:
    play = Play(
        """
        <startEvent id="s"/> <userTask id="u">ask done<each>1000</each></userTask>
        s -> u
        """,
        batch=100,
    )
    play.goes_on = False
    play.start()
    assert len(play.run.state.tokens) == 100
    assert play.stop().ended == "stopped"
