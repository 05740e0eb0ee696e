"""What is foreseen of requirements from the present of a run is what comes."""

import copy
from collections import Counter
from collections.abc import Callable, Iterator
from random import Random

import pytest

from m2pem.api.runs import RequirementOutlook, RequirementProspect
from m2pem.engine import inputs as i
from m2pem.engine.records import RequirementVerdict
from m2pem.engine.revision import plan_revision
from m2pem.engine.run import MissionRun
from m2pem.engine.state import BehaviorPhase, RunStatus
from m2pem.engine.throwing import catcher_of_error
from m2pem.mission.catalogue import BehaviorState
from m2pem.mission.elements import StartEvent
from m2pem.mission.mission import Mission
from m2pem.monitors.moments import Moments, MomentTables
from m2pem.monitors.product import own_letter
from m2pem.monitors.requirement_outlook import OpenRequirements
from m2pem.monitors.run_monitors import RunMonitors
from m2pem.verify.ltl import parse, show
from m2pem.verify.ltl.formula import OUTCOMES, Active, Completed, Ended, Formula
from m2pem.verify.outlook import Outlook, OutlookLimits, outlook
from tests.engine.kit import Play
from tests.engine.notation import mission
from tests.engine.random_missions import graph, structured
from tests.engine.random_play import RandomPlay
from tests.engine.random_revisions import changed
from tests.engine.test_random import run_seeds
from tests.seeds import seeds_for
from tests.verify.answers import formula_of

HOLDS = RequirementProspect.HOLDS
MAY_BE = RequirementProspect.MAY_BE_VIOLATED
WILL_BE = RequirementProspect.WILL_BE_VIOLATED
UNKNOWN = RequirementProspect.UNKNOWN

FEW = 60
LONG_S = 300.0
LIMITS = OutlookLimits(states=300, seconds=5.0)
MOST_RUNS = 150
MOST_INPUTS = 16


def requirements(*formulas: str) -> tuple[i.MonitoredRequirement, ...]:
    return tuple(
        i.MonitoredRequirement(f"r{n}", show(parse(each)), each) for n, each in enumerate(formulas)
    )


def foreseen(
    play: Play, choice: i.Revise | i.ResolveIncident, limits: OutlookLimits = LIMITS
) -> tuple[Outlook, dict[str, RequirementOutlook]]:
    """What follows a choice; the play itself is not changed."""
    run = MissionRun(play.mission, play.fleet, "r1")
    reader = OpenRequirements(run.state, play.fleet)
    for step in play.steps:
        run.replay(step.records, step.input)
        reader.observe(step.records)
    found = outlook(run, play.now_us, choice, limits, reader=reader)
    return found, {each.requirement: each for each in reader.judge(found.explored)}


def revision(
    play: Play, new: Mission, monitored: tuple[i.MonitoredRequirement, ...], **moves: str
) -> i.Revise:
    plan = plan_revision(play.run.state, new, moves, play.now_us)
    assert not plan.refusals, plan.refusals
    return i.Revise(
        plan.version, "new.bpmn", new.source, plan.digest, moves=moves, requirements=monitored
    )


def renamed(text: str) -> Mission:
    return mission(text.replace('id="end"', 'id="end" name="END"'))


def looked_at(text: str, formula: str, *answers: tuple[str, str]) -> RequirementOutlook:
    """What is foreseen of a formula when the mission is renamed, after some answers."""
    asked = requirements(formula)
    play = Play(text)
    play.give(i.StartRun(play.mission.process().id, {}, requirements=asked))
    for prompt, decision in answers:
        play.answer(decision, prompt=prompt)
    return foreseen(play, revision(play, renamed(text), asked))[1]["r0"]


ASKED = """
    <startEvent id="start"/> <endEvent id="end"/>
    <userTask id="first"/> <userTask id="ask">ask yes no</userTask>
    <exclusiveGateway id="which" default="f4"/> <userTask id="land"/> <userTask id="climb"/>
    start -> first -> ask -> which
    which -> land -> end
    which -> climb if user.decision == 'no'
    climb -> end
"""


def test_a_requirement_is_judged_from_the_present_on() -> None:
    formula = "[] !active(climb)"
    found = looked_at(ASKED, formula)
    assert found.verdict is MAY_BE
    assert found.reason == "after first is answered done, ask is answered no"
    assert found.text == formula
    there = (("first", "done"), ("ask", "yes"))
    assert looked_at(ASKED, formula, *there).verdict is HOLDS


def test_elements_that_are_called_alike_are_given_with_their_ids() -> None:
    alike = ASKED.replace('id="first"', 'id="first" name="GO"').replace(
        'id="ask"', 'id="ask" name="GO"'
    )
    found = looked_at(alike, "[] !active(climb)")
    assert found.reason == "after GO (first) is answered done, GO (ask) is answered no"


def test_what_came_before_counts() -> None:
    formula = "[](completed(land) -> once(completed(first)))"
    assert looked_at(ASKED, formula, ("first", "done")).verdict is HOLDS
    assert looked_at(ASKED, "<> completed(ask)").verdict is HOLDS


def test_what_no_path_satisfies_will_be_violated() -> None:
    found = looked_at(ASKED, "<> completed(climb)", ("first", "done"), ("ask", "yes"))
    assert found.verdict is WILL_BE
    assert found.reason == "after land is answered done, when nothing more comes"


def test_a_choice_may_violate_a_requirement_at_once() -> None:
    asked = requirements("[] !active(climb)", "<> active(climb)")
    play = Play(ASKED)
    play.give(i.StartRun(play.mission.process().id, {}, requirements=asked))
    _, found = foreseen(play, revision(play, renamed(ASKED), asked, first="climb"))
    assert found["r0"].verdict is WILL_BE
    assert found["r1"].verdict is HOLDS


def test_what_is_decided_already_is_not_foreseen() -> None:
    asked = requirements("<> completed(first)")
    play = Play(ASKED)
    play.give(i.StartRun(play.mission.process().id, {}, requirements=asked)).answer()
    play.give(i.RequirementDecided("r0", RequirementVerdict.SATISFIED, 0, ""))
    assert foreseen(play, revision(play, renamed(ASKED), asked))[1] == {}


def test_what_nothing_can_change_is_decided_at_the_beginning() -> None:
    asked = requirements("[] (active(first) || !active(first))", "<> false", "true")
    play = Play(ASKED)
    play.give(i.StartRun(play.mission.process().id, {}, requirements=asked))
    _, monitors = rebuilt(play)
    decided = [each for each in monitors.take() if type(each) is i.RequirementDecided]
    satisfied, violated = RequirementVerdict.SATISFIED, RequirementVerdict.VIOLATED
    assert {each.requirement: each.verdict for each in decided} == {
        "r0": satisfied,
        "r1": violated,
        "r2": satisfied,
    }


AGAIN = """
    <startEvent id="start"/> <endEvent id="end"/>
    <userTask id="again">ask yes no</userTask> <exclusiveGateway id="which" default="back"/>
    <exclusiveGateway id="merge"/>
    start -> merge -> again -> which -> end if user.decision == 'no'
    back: which -> merge
"""
FOR_EVER = """
    <startEvent id="start"/> <endEvent id="end"/> <exclusiveGateway id="merge"/>
    <exclusiveGateway id="which" default="back"/> <userTask id="away"/> <userTask id="home"/>
    start -> merge -> away -> home -> which -> end if 1 > 2
    back: which -> merge
"""


def test_a_loop_that_can_be_left_is_left_at_some_time() -> None:
    assert looked_at(AGAIN, "<> ended(completed)").verdict is HOLDS


@pytest.mark.parametrize(
    ("formula", "verdict"),
    [
        ("[] !(active(home) && active(away))", HOLDS),
        ("[] <> completed(home)", HOLDS),
        ("<> ended(completed)", WILL_BE),
        ("<> [] !active(home)", WILL_BE),
    ],
)
def test_a_loop_that_is_never_left_is_judged_as_a_whole(
    formula: str, verdict: RequirementProspect
) -> None:
    found = looked_at(FOR_EVER, formula)
    assert found.verdict is verdict
    assert ("it goes round in a loop that it does not leave" in found.reason) == (
        verdict is WILL_BE
    )


def test_what_was_not_explored_is_not_known() -> None:
    asked = requirements("[] !active(climb)", "<> completed(land)", "[] !completed(first)")
    play = Play(ASKED)
    play.give(i.StartRun(play.mission.process().id, {}, requirements=asked))
    item = revision(play, renamed(ASKED), asked)
    _, found = foreseen(play, item, OutlookLimits(states=2))
    assert [found[each].verdict for each in ("r0", "r1", "r2")] == [UNKNOWN, UNKNOWN, WILL_BE]
    assert found["r0"].reason == "there are more than 2 states"
    item = revision(play, renamed(ASKED), asked, first="climb")
    play.answer(prompt="first")
    _, found = foreseen(play, item)
    assert "has gone on since the plan" in found["r0"].reason


@pytest.mark.parametrize(
    ("formula", "conditions", "reason"),
    [
        ("<>[0 s, 5 s] completed(first)", (), "its times are not explored"),
        ("[] battery(uav1) > 20 %", ("battery(uav1) > 20 %",), "what telemetry will say"),
    ],
)
def test_times_and_telemetry_are_not_foreseen(
    formula: str, conditions: tuple[str, ...], reason: str
) -> None:
    asked = (i.MonitoredRequirement("r0", formula, formula, conditions=conditions),)
    play = Play(ASKED)
    play.give(i.StartRun(play.mission.process().id, {}, requirements=asked))
    found = foreseen(play, revision(play, renamed(ASKED), asked))[1]["r0"]
    assert found.verdict is UNKNOWN
    assert reason in found.reason


# --- compared with all that can come --------------------------------------------------------------


class TooManyError(Exception):
    """More runs, or longer ones, than the test looks at."""


def what_can_come(run: MissionRun, now_us: int) -> list[tuple[i.Input, int]]:
    """The inputs that the outlook counts with."""
    state = run.state
    items: list[i.Input] = []
    codes = dict.fromkeys(("FAILED", *(each.code for each in state.mission.errors.values())))
    for behavior in state.behaviors.values():
        number = behavior.number + 1
        if behavior.phase is BehaviorPhase.CANCELLING:
            ended = i.BehaviorReported(behavior.id, number, BehaviorState.CANCELLED)
            return [(ended, now_us)]
        items.append(i.BehaviorReported(behavior.id, number, BehaviorState.SUCCEEDED))
        token = state.tokens[behavior.token]
        items += [
            i.BehaviorReported(behavior.id, number, BehaviorState.FAILED, code)
            for code in codes
            if catcher_of_error(token, code) is not None
        ]
    for prompt in state.prompts.values():
        items += [i.PromptAnswer(prompt.id, each["value"]) for each in prompt.decisions]
    items += [i.SignalReceived(ref) for kind, ref in state.catchers if kind == "signal"]
    due_us = run.next_due_us
    found = [(item, now_us) for item in items]
    return found if due_us is None else [*found, (i.Tick(), max(now_us, due_us))]


def rebuilt(play: Play) -> tuple[MissionRun, RunMonitors]:
    run = MissionRun(play.mission, play.fleet, "r1")
    monitors = RunMonitors(run.state, play.fleet)
    for step in play.steps:
        run.replay(step.records, step.input)
        monitors.observe(step.t_us, step.records)
    return run, monitors


def all_runs(play: Play, item: i.Revise) -> Iterator[list[tuple[i.Input, int]]]:
    """The inputs of each run that can come after a revision, to its end.

    Raises:
        TooManyError: there are too many, or too long ones.
    """
    run, _ = rebuilt(play)
    begin: list[tuple[i.Input, int]] = [(item, play.now_us), (i.SetBreakpoints(), play.now_us)]
    for each, at_us in begin:
        run.receive(each, at_us)
    if run.state.status is RunStatus.PAUSED:
        begin.append((i.ResumeRun(), play.now_us))
        run.receive(*begin[-1])
    waiting = [(run, begin)]
    ended = 0
    while waiting:
        run, inputs = waiting.pop()
        over = run.state.status is RunStatus.ENDED
        coming = [] if over else what_can_come(run, inputs[-1][1])
        if not coming:
            ended += 1
            yield inputs
        if run.wants_continue or len(inputs) > MOST_INPUTS or ended > MOST_RUNS:
            raise TooManyError
        for each, at_us in coming:
            following = copy.deepcopy(run)
            following.receive(each, at_us)
            waiting.append((following, [*inputs, (each, at_us)]))


def verdicts_of(play: Play, inputs: list[tuple[i.Input, int]]) -> dict[str, RequirementVerdict]:
    """What monitors find in a run that goes on so."""
    run, monitors = rebuilt(play)
    found = []
    for item, at_us in inputs:
        step = run.receive(item, at_us)
        monitors.observe(step.t_us, step.records)
        found += monitors.take()
    verdicts = {
        each.requirement: each.verdict for each in found if type(each) is i.RequirementDecided
    }
    known, state = monitors.propositions, run.state
    tables = MomentTables(known, state.mission)
    now = Moments.after(state, known, play.fleet, lambda letter, before: None, tables)
    for name, position in monitors.positions().items():  # nothing more comes
        assert position is not None
        own = own_letter(position.bits, now.letter)
        verdicts[name] = RequirementVerdict(position.monitor.at_end(position.state, own).value)
    return verdicts


def branching(dice: Random) -> str:
    """A mission in which operators choose ways, and branches run beside each other."""
    lines = ['<startEvent id="start"/> <endEvent id="end"/>']
    numbers = iter(range(1, 100))

    def part(before: str, depth: int) -> str:
        n = next(numbers)
        kind = dice.choice(("task", "choice", "choice", "both", "row", "row")) if depth else "task"
        if kind == "task":
            lines.append(f'<userTask id="t{n}"/>\n{before} -> t{n}')
            return f"t{n}"
        if kind == "row":
            return part(part(before, depth - 1), depth - 1)
        gateway = "exclusive" if kind == "choice" else "parallel"
        default = f' default="d{n}"' if kind == "choice" else ""
        lines.append(f'<{gateway}Gateway id="g{n}"{default}/> <{gateway}Gateway id="m{n}"/>')
        if kind == "choice":
            lines.append(f'<userTask id="u{n}">ask a b</userTask>\n{before} -> u{n} -> g{n}')
        else:
            lines.append(f"{before} -> g{n}")
        for way in "de":
            lines.append(f'<task id="{way}{n}t"/>')
            name = f"{way}{n}: " if way == "d" else ""
            condition = " if user.decision == 'b'" if kind == "choice" and way == "e" else ""
            lines.append(f"{name}g{n} -> {way}{n}t{condition}")
            lines.append(f"{part(f'{way}{n}t', depth - 1)} -> m{n}")
        return f"m{n}"

    lines.append(f"{part('start', 3)} -> end")
    return "\n".join(lines)


def compared(make: Callable[[Random], str], dice: Random) -> list[RequirementProspect]:
    """Revise a random run, and compare what was foreseen with all that can come."""
    Play.made.clear()
    game = RandomPlay(make(dice), 100)
    play = game.play
    named = [each.id for each in play.mission.nodes if not isinstance(each, StartEvent)]
    atoms: list[Formula] = [Active(dice.choice(named)) for _ in range(3)]
    atoms += [Completed(dice.choice(named)) for _ in range(2)]
    atoms.append(Ended(dice.choice(OUTCOMES)))
    formulas = [show(formula_of(dice, atoms)) for _ in range(4)]
    before, after = requirements(*formulas[:3]), requirements(*formulas[:2], formulas[3])
    data = {"a": 1, "b": 1}
    game.give(i.StartRun(play.mission.process().id, dict(data), requirements=before))
    game.go_on([dice.randrange(10_000) for _ in range(dice.randrange(4))])
    new = changed(play.mission.source, dice)
    if play.run.state.status is not RunStatus.RUNNING or play.run.wants_continue or new is None:
        return []
    moves: dict[str, str] = {}
    for refusal in plan_revision(play.run.state, new, moves, play.now_us).refusals:
        if refusal.token:
            moves[refusal.element] = dice.choice((*refusal.candidates[:3], ""))
    plan = plan_revision(play.run.state, new, moves, play.now_us)
    if plan.refusals or plan.version == plan.previous:
        return []
    item = revision(play, new, after, **moves)
    foresight, found = foreseen(play, item)
    if foresight.explored.why_incomplete:
        return []
    came: dict[str, set[RequirementVerdict]] = {each: set() for each in found}
    try:
        for inputs in all_runs(play, item):
            for name, verdict in verdicts_of(play, inputs).items():
                came[name].add(verdict)
    except TooManyError:
        return []
    for name, verdicts in came.items():
        expected = {
            HOLDS: {RequirementVerdict.SATISFIED},
            WILL_BE: {RequirementVerdict.VIOLATED},
            MAY_BE: {RequirementVerdict.SATISFIED, RequirementVerdict.VIOLATED},
        }
        assert verdicts == expected[found[name].verdict], (
            verdicts,
            str(found[name]),
            moves,
            formulas,
        )
    return [each.verdict for each in found.values()]


def one_of_both(dice: Random) -> list[RequirementProspect]:
    return compared(dice.choice((graph, structured, branching, branching)), dice)


def test_what_is_foreseen_of_requirements_is_what_all_runs_show() -> None:
    found: Counter[RequirementProspect] = Counter()
    run_seeds(lambda dice: found.update(one_of_both(dice)), range(FEW))
    assert min(found[each] for each in (HOLDS, MAY_BE, WILL_BE)) > 3


@pytest.mark.long
@pytest.mark.timeout(3600)
def test_what_is_foreseen_of_many_requirements_is_what_all_runs_show() -> None:
    found: Counter[RequirementProspect] = Counter()
    run_seeds(lambda dice: found.update(one_of_both(dice)), seeds_for(LONG_S))
