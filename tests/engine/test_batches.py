"""A run yields when one input causes more than a batch of steps, and goes on at `Continue`."""

import pytest

from m2pem.engine import records as r
from m2pem.engine.inputs import Continue
from tests.engine.kit import Play

LOOP = """
    <startEvent id="start"/> <exclusiveGateway id="merge"/>
    <parallelGateway id="fork"/> <scriptTask id="a">n = n + 1</scriptTask> <task id="b"/>
    <inclusiveGateway id="join"/> <exclusiveGateway id="more" default="out"/>
    <subProcess id="sub"> <startEvent id="s"/> <task id="t"/> <endEvent id="e"/>
      s -> t -> e
    </subProcess>
    <endEvent id="end"/>
    start -> merge -> fork -> a -> join
    fork -> b -> join -> sub -> more
    again: more -> merge if n < 10
    out: more -> end
"""


def without_yields(play: Play) -> list[str]:
    return [line for line in play.trace() if not line.startswith("yield")]


@pytest.mark.parametrize("batch", [1, 2, 3, 7, 50])
def test_a_run_in_batches_leaves_the_same_trace_as_in_one_go(batch: int) -> None:
    whole = Play(LOOP).start({"n": 0})
    parts = Play(LOOP, batch=batch).start({"n": 0})
    assert whole.ended == parts.ended == "completed"
    assert without_yields(parts) == without_yields(whole)
    assert parts.run.steps_done == whole.run.steps_done
    assert all(len(step.records) < 20 * batch + 20 for step in parts.steps)


@pytest.mark.parametrize("batch", range(1, 10))
def test_a_subprocess_completes_in_the_same_order_in_batches(batch: int) -> None:
    # Its scope is in the queue twice: before its last token, when the token moves on to the event,
    # and after it, when the event has occurred at once.
    text = """
        <startEvent id="start"/> <parallelGateway id="fork"/>
        <task id="t"/> <task id="u"/> <task id="v"/> <userTask id="w"/>
        <subProcess id="sub">
          <startEvent id="s"/> <endEvent id="e"/>
          <intermediateCatchEvent id="c">conditional n == 0</intermediateCatchEvent>
          <subProcess id="h" triggeredByEvent="true"> <startEvent id="hs">signal go</startEvent>
          </subProcess>
          s -> c -> e
        </subProcess>
        start -> fork -> t -> u -> v -> w
        fork -> sub
    """
    whole = Play(text).start({"n": 0})
    parts = Play(text, batch=batch).start({"n": 0})
    assert without_yields(parts) == without_yields(whole)


@pytest.mark.parametrize("batch", [1, 2, 3, 5])
def test_timers_due_at_once_fire_in_the_same_order_in_batches(batch: int) -> None:
    text = """
        <startEvent id="start"/> <task id="x"/> <task id="y"/> <userTask id="u"/>
        <intermediateCatchEvent id="a">timer PT1S</intermediateCatchEvent>
        <intermediateCatchEvent id="b">timer PT2S</intermediateCatchEvent>
        start -> a -> x -> y
        start -> b
        start -> u
        <boundaryEvent id="tick" attachedToRef="u" cancelActivity="false">cycle R3/PT1S
        </boundaryEvent>
    """
    traces = []
    for size in (10_000, batch):
        play = Play(text, batch=size).start()
        play.now_us += 60_000_000
        play.advance(0)
        traces.append(without_yields(play))
    assert traces[0] == traces[1]


def test_a_yield_says_what_is_left() -> None:
    play = Play(LOOP, batch=3)
    play.goes_on = False
    play.start({"n": 0})
    assert play.run.wants_continue
    [left] = [record for record in play.records() if isinstance(record, r.RunYielded)]
    assert left.steps == (1, 2)
    assert play.run.steps_done == 3


def test_a_run_can_be_stopped_between_batches() -> None:
    play = Play(LOOP, batch=3)
    play.goes_on = False
    play.start({"n": 0}).stop()
    assert play.ended == "stopped"
    assert not play.run.wants_continue


def test_a_run_can_be_paused_between_batches_and_goes_on_where_it_was() -> None:
    whole = Play(LOOP).start({"n": 0})
    play = Play(LOOP, batch=3)
    play.goes_on = False
    play.start({"n": 0}).pause()
    assert not play.run.wants_continue
    assert play.give(Continue()).ignored() == "Continue while the run is paused"
    play.goes_on = True
    play.resume()
    assert play.ended == "completed"
    lines = [line for line in without_yields(play) if line not in ("pause", "resume")]
    assert [line for line in lines if not line.startswith("ignored:")] == without_yields(whole)


def test_continue_without_anything_left_is_ignored() -> None:
    play = Play('<startEvent id="s"/> <userTask id="u"/>\n s -> u').start().give(Continue())
    assert play.ignored() == "no step was left over"


@pytest.mark.parametrize("batch", range(1, 10))
def test_a_batch_that_ends_on_a_token_that_is_no_more_leaves_nothing_behind(batch: int) -> None:
    # Two tokens reach the last join; the second is consumed there before its turn comes.
    play = Play(
        """
        <startEvent id="start"/> <task id="t"/> <parallelGateway id="fork"/>
        <boundaryEvent id="never" attachedToRef="t">error</boundaryEvent>
        <inclusiveGateway id="or"/> <parallelGateway id="last"/> <userTask id="u"/>
        start -> t -> fork -> or -> u
        never -> or
        fork -> last
        fork -> last
    """,
        batch=batch,
    ).start()
    assert play.at == "u"
    assert play.answer().ended == "completed"


@pytest.mark.parametrize("batch", range(1, 9))
def test_a_stuck_run_is_noticed_in_batches_too(batch: int) -> None:
    play = Play(
        """
        <startEvent id="start"/> <parallelGateway id="one"/> <parallelGateway id="two"/>
        <parallelGateway id="fork"/> <task id="t"/>
        <subProcess id="sub"> <startEvent id="s"/> <task id="x"/>
          <endEvent id="e">error E</endEvent>
          s -> x
          s -> e
        </subProcess>
        <boundaryEvent id="catch" attachedToRef="sub">error</boundaryEvent>
        start -> fork -> one -> two
        fork -> sub
        catch -> two -> one
    """,
        batch=batch,
    ).start()
    assert play.ended == "failed"
    assert play.detail == "stuck: no token can move from one, two"


def test_events_whose_conditions_are_true_leave_the_batch_its_bound() -> None:
    play = Play(
        """
        <startEvent id="start"/> <exclusiveGateway id="merge"/>
        <intermediateCatchEvent id="a">conditional n > 0</intermediateCatchEvent>
        <intermediateCatchEvent id="b">conditional n > 0</intermediateCatchEvent>
        start -> merge -> a -> b -> merge
    """,
        batch=20,
    )
    play.goes_on = False
    play.start({"n": 1})
    assert play.run.wants_continue
    for _ in range(3):
        assert len(play.give(Continue()).steps[-1].records) < 200
    assert play.run.wants_continue
    assert play.stop().ended == "stopped"


def test_tokens_that_double_at_each_turn_leave_the_batch_its_bound() -> None:
    """Else a mission of three elements blocks its executive, and takes all of its memory."""
    play = Play(
        """
        <startEvent id="start"/>
        <intermediateCatchEvent id="n">conditional c == null</intermediateCatchEvent>
        start -> n
        n -> n
        n -> n
    """,
        batch=20,
    )
    play.goes_on = False
    play.start()
    for _ in range(100):
        assert len(play.give(Continue()).steps[-1].records) < 200
    assert play.run.wants_continue
    assert len(play.run.state.tokens) < 2_000
    assert play.stop().ended == "stopped"


@pytest.mark.parametrize("batch", range(1, 9))
def test_what_has_been_entered_misses_no_signal_that_comes_between_batches(batch: int) -> None:
    play = Play(
        """
        <startEvent id="start"/> <parallelGateway id="fork"/> <userTask id="u"/>
        <intermediateCatchEvent id="x">signal S</intermediateCatchEvent>
        <intermediateCatchEvent id="y">signal S</intermediateCatchEvent>
        <intermediateCatchEvent id="z">signal S</intermediateCatchEvent>
        start -> fork -> x
        fork -> y
        fork -> z
        fork -> u
    """,
        batch=batch,
    )
    play.goes_on = False
    play.start()
    entered = [each for each in "xyz" if f"enter {each}" in play.trace()]
    play.pause().signal("S")
    play.goes_on = True
    play.resume()
    play.answer()
    assert play.trace().count("triggered") >= len(entered)
    if len(entered) == 3:
        assert play.ended == "completed"


def test_a_signal_that_meets_tokens_that_double_at_each_turn_ends() -> None:
    play = Play(
        """
        <startEvent id="start"/>
        <intermediateCatchEvent id="n">conditional c == null</intermediateCatchEvent>
        <intermediateCatchEvent id="s">signal S</intermediateCatchEvent> <userTask id="u"/>
        start -> n
        start -> s -> u
        n -> n
        n -> n
    """,
        batch=20,
    )
    play.goes_on = False
    play.start().give(Continue())
    assert play.run.wants_continue
    play.trace()
    assert len(play.signal("S").steps[-1].records) < 400
    assert "enter u" in play.trace()
    assert play.stop().ended == "stopped"


@pytest.mark.parametrize("batch", range(1, 9))
def test_tokens_that_gather_before_an_activity_with_a_boundary_event_go_on_in_batches(
    batch: int,
) -> None:
    text = """
        <startEvent id="start"/> <userTask id="v"/>
        <task id="t" startQuantity="2"/> <userTask id="u" startQuantity="2"/>
        <boundaryEvent id="tick" attachedToRef="u" cancelActivity="false">timer PT1S</boundaryEvent>
        start -> u
        start -> v -> u
        start -> t -> u
        start -> t
    """
    traces = []
    for size in (10_000, batch):
        play = Play(text, batch=size).start()
        assert not play.run.wants_continue
        traces.append(without_yields(play))
    assert traces[0] == traces[1]


@pytest.mark.parametrize("batch", range(1, 5))
@pytest.mark.parametrize("length", range(1, 6))
def test_a_signal_that_comes_while_the_run_is_paused_finds_it_ended_by_a_wrong_condition(
    batch: int, length: int
) -> None:
    tasks = [f"x{number}" for number in range(length)]
    play = Play(
        "\n".join(f'<task id="{task}"/>' for task in tasks)
        + """
        <startEvent id="start"/> <userTask id="u"/>
        <boundaryEvent id="wrong" attachedToRef="u">conditional 1 / b > 0</boundaryEvent>
        """
        + f"start -> {' -> '.join(tasks)} -> u",
        batch=batch,
    )
    play.goes_on = False
    play.start({"b": 0}).pause().signal("S")
    play.goes_on = True
    play.resume()
    assert play.ended == "failed"
    assert "divides the number 1 by zero" in play.detail
