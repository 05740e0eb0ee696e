"""startQuantity and completionQuantity of activities (table 10.3)."""

from tests.engine.kit import Play

TEAM = """
    <startEvent id="s1"/> <startEvent id="s2"/> <startEvent id="s3"/> <startEvent id="s4"/>
    <exclusiveGateway id="m"/> <userTask id="work" startQuantity="2"/> <task id="after"/>
    s1 -> m
    s2 -> m
    s3 -> m
    s4 -> m -> work -> after
"""


def test_as_many_tokens_as_its_start_quantity_begin_an_activity() -> None:
    play = Play(TEAM).start()
    assert len(play.run.state.prompts) == 2
    assert play.at == "work work"
    assert play.answer().answer().entered().split().count("after") == 2
    assert play.ended == "completed"


def test_an_execution_that_several_tokens_begin_is_completed_once() -> None:
    play = Play(TEAM).start().answer().answer()
    left = [line for line in play.trace("leave") if line.startswith("leave work")]
    assert sorted(left) == [
        "leave work",
        "leave work",
        "leave work consumed",
        "leave work consumed",
    ]


def test_an_execution_that_several_tokens_leave_is_completed_once() -> None:
    play = Play("""
        <startEvent id="start"/> <task id="work" completionQuantity="3"/> <task id="a"/>
        start -> work -> a
    """).start()
    lines = play.trace("leave", "take")
    assert lines.count("leave work") == 1
    assert lines.count("take f2") == 3


def test_too_few_tokens_do_not_begin_it_and_the_run_says_where_it_is_stuck() -> None:
    play = Play(TEAM.replace('"2"', '"3"')).start()
    assert len(play.run.state.prompts) == 1
    play.answer()
    assert play.ended == "failed"
    assert play.detail == "stuck: no token can move from work"


def test_boundary_events_are_armed_when_the_activity_begins() -> None:
    play = Play(
        TEAM.replace('"2"', '"3"') + '<boundaryEvent id="late" attachedToRef="work">'
        "timer PT5S</boundaryEvent>"
    ).start()
    assert len(play.run.state.waits) == 1


def test_as_many_tokens_as_its_completion_quantity_leave_by_each_flow() -> None:
    play = Play("""
        <startEvent id="start"/> <task id="work" completionQuantity="2"/> <task id="a"/>
        <task id="b"/>
        start -> work -> a
        work -> b
    """).start()
    assert play.entered() == "start work a b a b"


def test_the_tokens_of_one_meet_at_the_next() -> None:
    play = Play("""
        <startEvent id="start"/> <task id="make" completionQuantity="3"/>
        <task id="use" startQuantity="3"/> <task id="after"/>
        start -> make -> use -> after
    """).start()
    assert play.entered() == "start make use use use after"
    assert play.ended == "completed"
