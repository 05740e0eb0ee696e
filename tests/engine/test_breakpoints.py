"""Breakpoints, conditions and single steps: where a run is paused; nothing else changes."""

from random import Random

import pytest

from m2pem.engine import inputs as i
from m2pem.engine import records as r
from m2pem.engine.state import RunStatus
from tests.engine.kit import Play
from tests.engine.random_missions import structured
from tests.engine.random_play import RandomPlay
from tests.engine.trace import table
from tests.seeds import named, seeds_for

ROUND = """
    <startEvent id="start"/> <exclusiveGateway id="merge"/>
    <scriptTask id="count">n = n + 1</scriptTask>
    <exclusiveGateway id="more" default="out"/> <userTask id="ask"/> <endEvent id="end"/>
    start -> merge -> count -> more
    again: more -> merge if n < 3
    out: more -> ask -> end
"""
DEBUGGED = ("breakpoints", "reached", "pause", "resume", "yield", "ignored:")


def started(text: str, *elements: str, when: tuple[str, ...] = (), step: bool = False) -> Play:
    play = Play(text)
    play.give(i.StartRun(play.mission.process().id, {"n": 0}, step=True))
    play.give(i.SetBreakpoints(elements, when))
    if not step:
        play.trace()
        play.resume()
    return play


def stops(play: Play) -> list[str]:
    return play.trace("reached")


def undebugged(play: Play) -> list[str]:
    """The trace without what debugging adds."""
    return [line for line in play.trace() if line.split()[0] not in DEBUGGED]


def test_a_run_is_paused_before_the_element_does_anything() -> None:
    play = started(ROUND, "count")
    assert stops(play) == ["reached breakpoint count"]
    assert (play.at, play.data) == ("count", {"n": 0})
    assert stops(play.resume()) == ["reached breakpoint count"]
    assert play.data == {"n": 1}
    play.give(i.SetBreakpoints()).resume()
    assert play.at == "ask"


def test_it_is_paused_when_a_condition_has_become_true_and_not_while_it_stays_true() -> None:
    play = started(ROUND, when=("n >= 2",))
    assert stops(play) == ["reached condition more n >= 2"]
    assert play.data == {"n": 2}
    assert stops(play.resume()) == []
    assert play.at == "ask"


def test_a_condition_whose_names_are_not_there_yet_is_not_true() -> None:
    play = started(ROUND, when=("later.on > n + nothing",))
    assert stops(play) == []


def test_steps_execute_one_token_each() -> None:
    play = started(ROUND, step=True)
    seen = [play.at]
    for _ in range(4):
        play.give(i.StepRun())
        seen.append(play.at)
    assert seen == ["start", "merge", "count", "more", "merge"]
    assert play.resume().at == "ask"
    assert play.answer().ended == "completed"


def test_a_step_where_all_wait_pauses_the_run_when_something_has_come() -> None:
    play = started(ROUND, "ask").give(i.StepRun())
    assert (play.run.state.status, stops(play)) == (RunStatus.RUNNING, ["reached breakpoint ask"])
    assert stops(play.answer()) == ["reached step end"]
    assert play.give(i.StepRun()).ended == "completed"


def test_events_at_a_breakpoint_miss_nothing() -> None:
    play = started(
        """
        <startEvent id="start"/> <parallelGateway id="fork"/> <task id="other"/>
        <intermediateCatchEvent id="catch">signal go</intermediateCatchEvent> <endEvent id="end"/>
        start -> fork -> catch -> end
        fork -> other
        """,
        "catch",
    )
    assert stops(play) == ["reached breakpoint catch"]
    play.signal("go").resume()
    assert play.ended == "completed"


def test_several_timers_do_not_pass_a_breakpoint() -> None:
    play = started(
        """
        <startEvent id="start"/> <userTask id="u"/> <userTask id="v"/>
        <intermediateCatchEvent id="a">timer PT1S</intermediateCatchEvent>
        <intermediateCatchEvent id="b">timer PT2S</intermediateCatchEvent>
        start -> a -> u
        start -> b -> v
        """,
        "u",
    )
    play.now_us += 60_000_000
    play.give(i.Tick())
    assert play.at == "b u"
    play.resume()
    assert play.give(i.Tick()).at == "u v"


def test_behaviors_of_the_same_moment_are_held() -> None:
    play = started(
        """
        <startEvent id="start"/> <scriptTask id="drive">do drive_stop evsg1</scriptTask>
        <task id="t"/> <userTask id="u"/>
        start -> drive
        start -> t -> u
        """,
        "u",
    )
    # The executive starts nothing of a run that is paused by then.
    assert play.orders() == ["start b1 drive_stop evsg1", "hold evsg1"]
    assert play.resume().orders() == ["resume evsg1", "open p1 done"]


def test_an_operator_changes_data_in_the_pause() -> None:
    play = started(ROUND, "more").give(i.SetData({"n": 7, "map": {"x": 1}}, by="ann"))
    assert play.data == {"n": 7, "map.x": 1}
    assert [each.by for each in play.records() if isinstance(each, r.OperatorSetData)] == ["ann"]
    play.resume()
    assert play.at == "ask"


def test_what_is_written_in_the_pause_triggers_conditions_at_resume() -> None:
    play = started(
        """
        <startEvent id="start"/> <userTask id="u"/> <endEvent id="end"/>
        <intermediateCatchEvent id="catch">conditional n > 4</intermediateCatchEvent>
        start -> catch -> end
        start -> u
        """,
        "u",
    )
    play.give(i.SetData({"n": 5}))
    assert play.at == "catch u"
    assert play.resume().at == "u"


@pytest.mark.parametrize(
    ("item", "why"),
    [
        (i.SetBreakpoints(("cuont",)), "the mission has no 'cuont': did you mean 'count'?"),
        (i.SetBreakpoints((), ("n >",)), "'n >' is no condition: "),
        (i.SetData({"n": 1}, 99), "scope 99 is not open"),
    ],
)
def test_what_cannot_be_done_is_refused(item: i.Input, why: str) -> None:
    assert why in started(ROUND, "count").give(item).ignored()


def test_only_a_paused_run_is_stepped_and_changed() -> None:
    play = started(ROUND)
    assert play.give(i.StepRun()).ignored() == "StepRun while the run is running"
    assert play.give(i.SetData({"n": 1})).ignored() == "SetData while the run is running"


def test_inputs_of_a_pause_that_the_next_breakpoint_meets_wait_again() -> None:
    play = started(
        """
        <startEvent id="start"/> <userTask id="u"/> <userTask id="v"/> <task id="x"/>
        <endEvent id="end"/>
        start -> u -> x -> end
        start -> v
        """,
        "x",
    ).pause()
    play.answer(prompt="u").answer(prompt="v")
    play.trace()
    play.resume()
    assert play.trace("reached", "defer", "answer") == table("""
        answer p1 done; reached breakpoint x; defer PromptAnswer
    """)
    assert play.resume().ended == "completed"


class Stepped(RandomPlay):
    """Executes every step alone."""

    def give(self, item: i.Input) -> None:
        if isinstance(item, i.StartRun):
            item = i.StartRun(item.process, item.data, step=True)
        super().give(item)
        run = self.play.run
        while run.state.status is RunStatus.PAUSED:
            super().give(i.StepRun())
        # A step ended before the other timers of this moment could fire.
        if run.next_due_us is not None and run.next_due_us <= self.play.now_us:
            self.give(i.Tick())


MOST_STEPS = 2_000
"""After one input; with more, a mission is without end."""


def check_single_steps(seed: int) -> None:
    text = structured(Random(seed))
    plays = []
    for kind in (RandomPlay, Stepped):
        game = kind(text, MOST_STEPS)
        game.spare = 0
        game.go([])
        game.finish()
        if game.play.run.wants_continue:
            return  # such as a process whose end event throws the signal that begins it
        plays.append(game.play)
    assert undebugged(plays[1]) == undebugged(plays[0]), (seed, text)


@pytest.mark.parametrize("seed", [*range(60), 88001152])
def test_single_steps_change_nothing_else(seed: int) -> None:
    check_single_steps(seed)


@pytest.mark.long
def test_single_steps_of_many_missions_change_nothing_else() -> None:
    for seed in seeds_for(120.0):
        with named(seed):
            check_single_steps(seed)
            while Play.made:
                Play.made.pop().verify()
