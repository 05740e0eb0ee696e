"""A running mission is revised: what becomes of tokens, of what they do and of what they await."""

import pytest

from m2pem.engine import inputs as i
from m2pem.engine.revision import EffectKind
from m2pem.engine.state import RunStatus
from m2pem.fleet.default_fleet import fleet_for
from m2pem.mission.catalogue import BehaviorState
from tests.engine.kit import Play
from tests.engine.notation import mission

TWO_TASKS = """
    <startEvent id="start"/> <endEvent id="end"/>
    <scriptTask id="go">do goto uav1 speed=5</scriptTask>
    start -> go -> end
"""
THREE_TASKS = """
    <startEvent id="start"/> <endEvent id="end"/>
    <scriptTask id="go">do goto uav1 speed=5</scriptTask>
    <scriptTask id="land">do land uav1</scriptTask>
    start -> go -> land -> end
"""


def kinds(plan_of: object) -> list[tuple[str, str]]:
    return [(each.kind.value, each.element) for each in plan_of.effects]  # type: ignore[attr-defined]


def test_a_task_is_added_behind_the_one_that_runs() -> None:
    play = Play(TWO_TASKS).start()
    play.trace()
    plan = play.plan(THREE_TASKS)
    assert [each.id for each in plan.difference.added] == ["f3", "land"]
    assert not plan.effects
    play.revise(THREE_TASKS)
    assert play.trace() == ["revise"]
    assert play.orders()[-1].startswith("start b1")
    play.report("go")
    assert play.at == "land"
    assert play.report("land").ended == "completed"


def test_a_revision_is_reverted_by_another() -> None:
    play = Play(TWO_TASKS).start().revise(THREE_TASKS).revise(TWO_TASKS)
    assert play.report("go").ended == "completed"


def test_a_token_on_a_removed_element_is_refused_with_a_way_out() -> None:
    play = Play(THREE_TASKS).start().report("go")
    plan = play.plan(TWO_TASKS)
    (refusal,) = plan.refusals
    assert refusal.element == "land"
    assert refusal.token == 1
    assert "behavior land of uav1" in refusal.text
    assert refusal.candidates == ("end", "go")
    item = i.Revise(plan.version, "m.bpmn", mission(TWO_TASKS).source, plan.digest)
    assert "a token is on script task land" in play.give(item).ignored()
    assert play.at == "land"


def test_a_token_is_moved_and_its_behavior_is_cancelled() -> None:
    play = Play(THREE_TASKS).start().report("go")
    play.trace()
    play.orders()
    assert kinds(play.plan(TWO_TASKS, land="go")) == [("moves", "land")]
    play.revise(TWO_TASKS, land="go")
    assert play.trace() == [
        "cancel b2",
        "leave land terminated",
        "revise land=go",
        "enter go",
        "request b3 goto uav1 preempts b2",
    ]
    assert play.orders() == ["cancel b2", "start b3 goto uav1"]


def test_a_token_ends_and_the_run_with_it() -> None:
    play = Play(THREE_TASKS).start().report("go").revise(TWO_TASKS, land="")
    assert play.ended == "completed"


def test_a_move_that_makes_no_sense_is_refused() -> None:
    play = Play(THREE_TASKS).start()
    assert "no token is on" in play.plan(TWO_TASKS, land="go").refusals[0].text
    assert "no element 'lnd'; did you mean" in play.plan(TWO_TASKS, lnd="go").refusals[0].text
    assert "no element 'nd'" in play.plan(TWO_TASKS, go="nd").refusals[0].text


def test_the_version_that_a_run_has_is_refused() -> None:
    play = Play(THREE_TASKS).start()
    (refusal,) = play.plan(THREE_TASKS).refusals
    assert refusal.text == "the run has this version already, and no token is moved"


def test_a_plan_of_an_earlier_state_is_not_carried_out() -> None:
    play = Play(THREE_TASKS).start()
    new = THREE_TASKS.replace("do land uav1", "do hold uav1")
    plan = play.plan(new)
    assert not plan.effects
    play.report("go")
    item = i.Revise(plan.version, "m.bpmn", mission(new).source, plan.digest)
    assert "the run has gone on since" in play.give(item).ignored()
    assert kinds(play.plan(new)) == [("restarts", "land")]


def test_a_plan_holds_while_other_tokens_go_on() -> None:
    play = Play(THREE_TASKS).start()
    new = THREE_TASKS.replace("speed=5", "speed=6")
    plan = play.plan(new)
    play.report("go", state=BehaviorState.RUNNING)
    item = i.Revise(plan.version, "m.bpmn", mission(new).source, plan.digest)
    play.give(item)
    assert play.behavior("go").parameters == {"speed": "6"}


def test_another_parameter_has_the_task_begin_again() -> None:
    play = Play(TWO_TASKS).start()
    play.orders()
    new = TWO_TASKS.replace("speed=5", "speed=6")
    (effect,) = play.plan(new).effects
    assert effect.kind is EffectKind.RESTARTS
    assert effect.text == (
        "parameter speed of script task go changes: behavior goto of uav1 is cancelled and the "
        "task begins again"
    )
    play.revise(new)
    assert play.orders() == ["cancel b1", "start b2 goto uav1"]
    assert play.report("go").ended == "completed"


def test_a_paused_run_begins_its_task_again_when_it_is_resumed() -> None:
    play = Play(TWO_TASKS).start().pause()
    play.orders()
    play.revise(TWO_TASKS.replace("speed=5", "speed=6"))
    assert play.run.state.status is RunStatus.PAUSED
    assert play.orders() == ["cancel b1"]
    play.resume()
    assert play.orders() == ["start b2 goto uav1"]


FASTER = TWO_TASKS.replace("speed=5", "speed=6")


def test_a_behavior_goes_on_at_another_speed_if_its_arbiter_can() -> None:
    play = Play(TWO_TASKS).start()
    play.trace()
    play.orders()
    (effect,) = play.plan(FASTER, "r1.b1").effects
    assert effect.kind is EffectKind.ADJUSTS
    assert effect.text == (
        "the speed of script task go becomes 6, and behavior goto of uav1 goes on"
    )
    play.revise(FASTER, "r1.b1")
    assert play.trace() == ["revise", "adjust b1 6"]
    assert play.orders() == ["adjust b1 speed=6"]
    assert play.behavior("go").parameters == {"speed": "6"}
    assert play.report("go").ended == "completed"


def test_a_plan_with_another_speed_is_that_of_the_arbiters_that_were_asked() -> None:
    play = Play(TWO_TASKS).start()
    plan = play.plan(FASTER, "r1.b1")
    item = i.Revise(plan.version, "m.bpmn", mission(FASTER).source, plan.digest)
    assert "the run has gone on since" in play.give(item).ignored()


def test_a_paused_run_sends_the_other_speed_when_it_is_resumed() -> None:
    play = Play(TWO_TASKS).start().report("go", state=BehaviorState.RUNNING).pause()
    play.orders()
    play.revise(FASTER, "r1.b1")
    assert play.orders() == []
    play.resume()
    assert play.orders() == ["resume uav1", "adjust b1 speed=6"]


def test_what_resumes_a_run_sends_the_other_speed_once_more() -> None:
    play = Play(TWO_TASKS).start().revise(FASTER, "r1.b1")
    assert [type(each).__name__ for each in play.run.outstanding()] == [
        "StartBehavior",
        "AdjustBehavior",
    ]


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("do goto uav1 speed=5", "do goto uav1 speed=6 altitude=20"),
        ("do goto uav1 speed=5", "do goto uav1"),
        ("do goto uav1", "do goto uav1 speed=6"),
        ("do goto uav1 speed=5", "do goto uav2 speed=6"),
        ("do goto uav1 speed=5", "do goto uav1 speed=${fast}"),
    ],
)
def test_what_differs_in_more_than_a_speed_begins_again(old: str, new: str) -> None:
    begun = TWO_TASKS.replace("do goto uav1 speed=5", old)
    play = Play(begun).start()
    plan = play.plan(begun.replace(old, new), "r1.b1")
    assert kinds(plan) == [("restarts", "go")]


def test_another_prompt_is_asked_again() -> None:
    text = """
        <startEvent id="start"/> <endEvent id="end"/>
        <userTask id="ask">ask yes no</userTask>
        start -> ask -> end
    """
    play = Play(text).start()
    play.trace()
    play.revise(text.replace("yes no", "yes no later"))
    assert play.trace() == ["withdraw p1", "revise", "ask p2 ask"]
    assert play.answer("later").ended == "completed"


def test_another_service_is_run_in_place_of_the_one_that_runs() -> None:
    text = """
        <startEvent id="start"/> <endEvent id="end"/>
        <serviceTask id="find">call detector</serviceTask>
        start -> find -> end
    """
    play = Play(text).start()
    play.revise(text.replace("detector", "tracker"))
    assert [each.name for each in play.run.state.services.values()] == ["tracker"]
    assert play.complete("find").ended == "completed"


JOIN = """
    <startEvent id="start"/> <endEvent id="end"/>
    <parallelGateway id="fork"/> <parallelGateway id="join"/>
    <userTask id="a"/> <userTask id="b"/> <userTask id="c"/>
    start -> fork
    a1: fork -> a
    a2: a -> join
    b1: fork -> b
    b2: b -> join
    c1: fork -> c
    c2: c -> join
    join -> end
"""
NO_C = "\n".join(line for line in JOIN.splitlines() if "c1:" not in line and "c2:" not in line)
NO_C = NO_C.replace('<userTask id="c"/>', "")


def test_a_branch_with_a_token_is_removed_and_the_join_waits_for_fewer() -> None:
    play = Play(JOIN).start().answer(prompt="a").answer(prompt="b")
    (refusal,) = play.plan(NO_C).refusals
    assert refusal.element == "c"
    assert refusal.candidates[:2] == ("end", "fork")
    plan = play.plan(NO_C, c="")
    assert kinds(plan) == [("ends", "c"), ("goes on", "join"), ("goes on", "join")]
    assert play.revise(NO_C, c="").ended == "completed"


def test_a_token_that_came_to_a_join_by_a_removed_flow_is_refused() -> None:
    play = Play(JOIN).start().answer(prompt="c")
    (refusal,) = play.plan(NO_C).refusals
    assert "where it came by c2, which does not lead there" in refusal.text
    assert refusal.candidates[:2] == ("a2", "b2")
    play.revise(NO_C, join="").answer(prompt="b").answer(prompt="a")
    assert play.ended == "completed"


TIMED = """
    <startEvent id="start"/> <endEvent id="end"/> <endEvent id="late"/>
    <userTask id="ask"/>
    <boundaryEvent id="limit" attachedToRef="ask">timer PT60S</boundaryEvent>
    start -> ask -> end
    limit -> late
"""


def test_a_duration_counts_from_when_it_was_armed() -> None:
    play = Play(TIMED).start().advance(20)
    new = TIMED.replace("PT60S", "PT30S")
    assert kinds(play.plan(new)) == [("rearms", "limit")]
    play.revise(new).advance(9)
    assert play.at == "ask"
    assert play.advance(2).ended == "completed"
    assert "enter late" in play.trace("enter")


def test_a_duration_that_is_past_fires_at_once() -> None:
    play = Play(TIMED).start().advance(20)
    new = TIMED.replace("PT60S", "PT10S")
    assert "is over: it fires at once" in play.plan(new).effects[0].text
    play.revise(new).advance(0)
    assert play.ended == "completed"


def test_a_duration_counts_over_two_revisions() -> None:
    play = Play(TIMED).start().advance(20).revise(TIMED.replace("PT60S", "PT50S")).advance(20)
    play.revise(TIMED.replace("PT60S", "PT45S")).advance(4)
    assert play.at == "ask"
    assert play.advance(2).ended == "completed"


def test_events_at_a_running_task_are_armed_and_disarmed() -> None:
    without = "\n".join(line for line in TIMED.splitlines() if "limit" not in line)
    without = without.replace('<endEvent id="late"/>', "")
    play = Play(without).start()
    assert kinds(play.plan(TIMED)) == [("arms", "limit")]
    play.revise(TIMED).advance(30)
    assert play.at == "ask"
    assert kinds(play.plan(without)) == [("disarms", "limit")]
    play.revise(without).advance(100)
    assert play.at == "ask"


def test_what_has_occurred_does_not_occur_again() -> None:
    text = TIMED.replace('attachedToRef="ask"', 'attachedToRef="ask" cancelActivity="false"')
    play = Play(text).start().advance(61)
    new = text.replace("PT60S", "PT90S")
    assert not play.plan(new).effects
    assert play.revise(new).advance(100).at == "ask"


def test_another_signal_is_awaited() -> None:
    text = """
        <startEvent id="start"/> <endEvent id="end"/>
        <intermediateCatchEvent id="wait">signal A</intermediateCatchEvent>
        start -> wait -> end
    """
    play = Play(text).start()
    play.revise(text.replace("signal A", "signal B"))
    assert play.signal("A").at == "wait"
    assert play.signal("B").ended == "completed"


GATEWAY = """
    <startEvent id="start"/> <endEvent id="end"/> <eventBasedGateway id="first"/>
    <intermediateCatchEvent id="a">signal A</intermediateCatchEvent>
    <intermediateCatchEvent id="b">timer PT60S</intermediateCatchEvent>
    start -> first -> a -> end
    first -> b -> end
"""


def test_the_events_after_a_gateway_change() -> None:
    play = Play(GATEWAY).start().advance(10)
    new = GATEWAY.replace("PT60S", "PT20S")
    new += """
        <intermediateCatchEvent id="c">signal C</intermediateCatchEvent>
        first -> c -> end
    """
    assert kinds(play.plan(new)) == [("rearms", "b"), ("arms", "c")]
    assert play.revise(new).signal("C").ended == "completed"


INSIDE = """
    <startEvent id="start"/> <endEvent id="end"/>
    <subProcess id="search">
        <startEvent id="in"/> <endEvent id="out"/>
        <userTask id="look"/> <userTask id="report"/>
        in -> look -> report -> out
    </subProcess>
    start -> search -> end
"""


def test_a_subprocess_is_replaced_with_a_token_in_it() -> None:
    play = Play(INSIDE).start()
    new = INSIDE.replace("look -> report -> out", "look -> out").replace(
        '<userTask id="report"/>', ""
    )
    assert not play.plan(new).effects
    assert play.revise(new).answer(prompt="look").ended == "completed"


def test_a_token_in_a_subprocess_that_is_removed_is_refused_once() -> None:
    play = Play(INSIDE, fleet=fleet_for(mission(TWO_TASKS))).start()
    (refusal,) = play.plan(TWO_TASKS).refusals
    assert refusal.element == "search"
    play.revise(TWO_TASKS, search="go")
    assert play.at == "go"


def test_an_element_that_goes_into_a_subprocess_is_refused() -> None:
    play = Play(INSIDE).start()
    outside = """
        <startEvent id="start"/> <endEvent id="end"/> <userTask id="look"/>
        <subProcess id="search"><startEvent id="in"/> <endEvent id="out"/>
        in -> out
        </subProcess>
        start -> search -> look -> end
    """
    (refusal,) = play.plan(outside).refusals
    assert "which the new version has in process MAIN" in refusal.text


def test_an_event_subprocess_of_an_active_scope_is_armed() -> None:
    play = Play(INSIDE).start()
    new = INSIDE.replace(
        "in -> look",
        """<subProcess id="handler" triggeredByEvent="true">
            <startEvent id="alarm">signal ALARM</startEvent> <endEvent id="done"/>
            alarm -> done
        </subProcess>
        in -> look""",
    )
    assert kinds(play.plan(new)) == [("arms", "alarm")]
    assert play.revise(new).signal("ALARM").ended == "completed"


def test_the_instances_of_an_activity_cannot_become_others() -> None:
    text = """
        <startEvent id="start"/> <endEvent id="end"/>
        <userTask id="ask"><each>3</each></userTask>
        start -> ask -> end
    """
    play = Play(text).start()
    (refusal,) = play.plan(text.replace(">3<", ">4<")).refusals
    assert "its instances, and their cardinality changes" in refusal.text
    play.revise(text.replace(">3<", ">4<"), ask="ask")
    assert len(play.run.state.prompts) == 4


def test_what_can_be_undone_must_stay() -> None:
    text = """
        <startEvent id="start"/> <endEvent id="end"/> <userTask id="ask"/> <task id="do"/>
        <task id="undo" isForCompensation="true"/>
        start -> do -> ask -> end
        do undo undo
    """
    play = Play(text).start()
    new = """
        <startEvent id="start"/> <endEvent id="end"/> <userTask id="ask"/>
        start -> ask -> end
    """
    (refusal,) = play.plan(new).refusals
    assert "has completed and may be undone" in refusal.text


def test_an_open_incident_stays_and_is_retried_with_the_new_task() -> None:
    text = TWO_TASKS
    head = '<process id="MAIN" isExecutable="true" m2pem:onError="incident">'
    play = Play(f"{head}{text}</process>").start().report("go", BehaviorState.FAILED, "STUCK")
    assert play.run.state.incidents
    play.revise(f"{head}{text.replace('goto', 'area_survey')}</process>")
    play.resolve("retry")
    assert play.behavior("go").name == "area_survey"


def test_a_run_that_has_ended_is_not_revised() -> None:
    play = Play(TWO_TASKS).start().report("go")
    assert "the run is ended" in play.plan(THREE_TASKS).refusals[0].text


def test_a_process_that_is_gone_is_refused() -> None:
    play = Play(TWO_TASKS).start()
    new = f'<process id="OTHER" isExecutable="true">{TWO_TASKS}</process>'
    (refusal,) = play.plan(new).refusals
    assert "process MAIN is under way, and not in the new version" in refusal.text
