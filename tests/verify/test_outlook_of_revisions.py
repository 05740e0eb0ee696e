"""Whether a run completes after a revision: what is foreseen is what comes."""

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from random import Random

import pytest

from m2pem.engine import inputs as i
from m2pem.engine.revision import plan_revision
from m2pem.engine.state import BehaviorPhase, RunStatus
from m2pem.fleet.default_fleet import fleet_for
from m2pem.mission.catalogue import BehaviorState
from m2pem.mission.elements import ErrorPolicy
from m2pem.mission.mission import Mission
from m2pem.verify.outlook import Outlook, OutlookLimits, Verdict, outlook
from tests.engine.kit import Play
from tests.engine.notation import mission
from tests.engine.random_missions import graph, structured
from tests.engine.random_play import RandomPlay
from tests.engine.random_revisions import changed
from tests.engine.test_random import run_seeds
from tests.seeds import seeds_for

FEW = 250
LONG_S = 300.0
PLAYS = 3
MOST_INPUTS = 80
FEW_STATES = OutlookLimits(states=300, seconds=5.0)


def foreseen(play: Play, item: i.Revise) -> Outlook:
    """The outlook of a revision; the play itself is not changed."""
    copied = Play(play.mission, fleet=play.fleet)
    Play.made.remove(copied)
    for step in play.steps:
        copied.run.replay(step.records, step.input)
    return outlook(copied.run, play.now_us, item, FEW_STATES)


def item_of(play: Play, new: Mission, **moves: str) -> i.Revise:
    plan = plan_revision(play.run.state, new, moves, play.now_us)
    assert not plan.refusals, plan.refusals
    return i.Revise(plan.version, "new.bpmn", new.source, plan.digest, moves=moves)


FORK = """
    <startEvent id="start"/> <endEvent id="end"/>
    <parallelGateway id="fork"/> <parallelGateway id="join"/> <userTask id="a"/> <userTask id="b"/>
    start -> fork -> a -> join -> end
    fork -> b -> join
"""


def test_a_version_with_which_a_join_misses_a_token_cannot_complete() -> None:
    play = Play(FORK).start()
    same = mission(FORK.replace('id="a"', 'id="a" name="A"'))
    assert foreseen(play, item_of(play, same)) == Outlook(Verdict.COMPLETES)
    found = foreseen(play, item_of(play, same, a=""))
    assert found.verdict is Verdict.CANNOT_COMPLETE
    assert found.reason == "stuck: no token can move from join"


def test_a_plan_that_holds_no_more_foresees_nothing() -> None:
    play = Play(FORK).start()
    same = mission(FORK.replace('id="a"', 'id="a" name="A"'))
    item = item_of(play, same, a="")
    play.answer(prompt="a")
    found = foreseen(play, item)
    assert found.verdict is Verdict.UNKNOWN
    assert "has gone on since the plan" in found.reason


def test_a_paused_run_is_looked_at_as_it_is_when_it_goes_on() -> None:
    play = Play(FORK).start().pause()
    same = mission(FORK.replace('id="a"', 'id="a" name="A"'))
    assert foreseen(play, item_of(play, same)) == Outlook(Verdict.COMPLETES)


def goes_on(game: RandomPlay, dice: Random) -> None:
    """Let things happen that the outlook counts with, until the run ends or nothing can."""
    state = game.play.run.state
    for _ in range(MOST_INPUTS):
        if state.status is RunStatus.ENDED:
            return
        things: list[i.Input] = []
        for behavior in state.behaviors.values():
            number = behavior.number + 1
            if behavior.phase is BehaviorPhase.CANCELLING:
                ended = BehaviorState.CANCELLED
                things = [i.BehaviorReported(behavior.id, number, ended)]
                break
            if behavior.phase is BehaviorPhase.ACTIVE:
                done = BehaviorState.SUCCEEDED
                things.append(i.BehaviorReported(behavior.id, number, done))
        else:
            for prompt in state.prompts.values():
                things += [i.PromptAnswer(prompt.id, each["value"]) for each in prompt.decisions]
            things += [i.SignalReceived(ref) for kind, ref in state.catchers if kind == "signal"]
            if state.status is RunStatus.PAUSED:
                things = [i.ResumeRun()]
        due_us = game.play.run.next_due_us
        if due_us is not None and (not things or dice.random() < 0.3):
            game.play.now_us = max(game.play.now_us, due_us)
            game.give(i.Tick())
        elif things:
            game.give(dice.choice(things))
        else:
            return


def agreed(make: Callable[[Random], str], dice: Random) -> Verdict | None:
    """Revise a random run, and compare what was foreseen with what comes. None: not revised."""
    Play.made.clear()
    game = RandomPlay(make(dice), 100)
    game.go([dice.randrange(10_000) for _ in range(dice.randrange(8))])
    play = game.play
    if play.run.state.status is RunStatus.ENDED or play.run.wants_continue:
        return None
    new = changed(play.mission.source, dice)
    if new is None:
        return None
    moves: dict[str, str] = {}
    plan = plan_revision(play.run.state, new, moves, play.now_us)
    for refusal in plan.refusals:
        if refusal.token:
            moves[refusal.element] = dice.choice((*refusal.candidates[:3], ""))
    plan = plan_revision(play.run.state, new, moves, play.now_us)
    if plan.refusals or plan.version == plan.previous:
        return None
    item = i.Revise(plan.version, "new.bpmn", new.source, plan.digest, moves=moves)
    found = foreseen(play, item)
    game.give(item)
    if play.run.wants_continue:
        return None
    if found.verdict in (Verdict.UNKNOWN, Verdict.MAY_NOT_COMPLETE):
        return found.verdict
    goes_on(game, dice)
    if found.verdict is Verdict.COMPLETES:
        assert play.ended in ("", "completed", "terminated"), play.detail
        assert play.ended or play.awaits()
    else:
        # Before the revision, an operator may have stopped it.
        assert play.ended in ("", "failed", "stopped"), found.reason
    return found.verdict


def one_of_both(dice: Random) -> Verdict | None:
    return agreed(dice.choice((graph, structured)), dice)


def test_what_is_foreseen_of_random_revisions_comes() -> None:
    found: Counter[Verdict | None] = Counter()
    run_seeds(lambda dice: found.update([one_of_both(dice)]), range(FEW))
    assert found[Verdict.COMPLETES] > 15
    assert found[Verdict.CANNOT_COMPLETE] > 5


@pytest.mark.long
@pytest.mark.timeout(3600)
def test_what_is_foreseen_of_many_random_revisions_comes() -> None:
    found: Counter[Verdict | None] = Counter()
    run_seeds(lambda dice: found.update([one_of_both(dice)]), seeds_for(LONG_S))


def test_a_breakpoint_on_the_way_is_no_end() -> None:
    play = Play(FORK).start()
    play.give(i.SetBreakpoints(tuple(node.id for node in play.mission.nodes)))
    same = mission(FORK.replace('id="a"', 'id="a" name="A"'))
    assert foreseen(play, item_of(play, same)) == Outlook(Verdict.COMPLETES)


GATE = """
    <startEvent id="start"/> <endEvent id="end"/> <exclusiveGateway id="gate"/> <userTask id="a"/>
    start -> gate
    a -> end
    one: gate -> a if z == 2
    two: gate -> end if z == 1
"""


def test_a_version_that_mends_the_gateway_of_an_incident_completes() -> None:
    wrong = mission(GATE)
    play = Play(wrong, fleet=replace(fleet_for(wrong), on_error=ErrorPolicy.INCIDENT))
    play.start({"z": 0})
    mended = mission(GATE.replace("z == 2", "z == 0"))
    assert foreseen(play, item_of(play, mended)) == Outlook(Verdict.COMPLETES)
    others = Outlook(Verdict.UNKNOWN, "operators must decide about gate, too: NO_FLOW")
    assert foreseen(play, item_of(play, mission(GATE.replace("z == 2", "z == 3")))) == others
