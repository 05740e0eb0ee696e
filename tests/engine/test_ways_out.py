"""What is refused of a revision because of a token has a way out, where there is one."""

import pytest

from m2pem.engine.revision import Refusal
from tests.engine.kit import Play
from tests.engine.notation import mission
from tests.engine.ways_out import check_ways_out


def refused(play: Play, text: str) -> Refusal:
    """The only refusal of a plan, of which each way out was chosen."""
    plan = play.plan(text)
    (refusal,) = plan.refusals
    check_ways_out(play.run.state, mission(text), plan, {}, play.now_us)
    return refusal


EACH = """
    <startEvent id="start"/> <endEvent id="end"/>
    <userTask id="ask"><each>3</each></userTask>
    start -> ask -> end
"""


def test_instances_are_moved_with_their_activity_as_a_whole() -> None:
    play = Play(EACH).start()
    refusal = refused(play, EACH.replace(">3<", ">4<"))
    assert refusal.can_end
    assert refusal.candidates == ("ask", "end")
    assert refusal.text.endswith("it can go to ask (begins again), end, or end")
    assert play.revise(EACH.replace(">3<", ">4<"), ask="").ended == "completed"


INSTANCES = """
    <startEvent id="start"/> <endEvent id="end"/>
    <subProcess id="each"><each>2</each>
        <startEvent id="in"/> <endEvent id="out"/> <callActivity id="call" calledElement="ONE"/>
        in -> call -> out
    </subProcess>
    start -> each -> end
"""
CALLED = """
    <process id="MAIN" isExecutable="true">{main}</process>
    <process id="ONE">
        <startEvent id="s1"/> <userTask id="a1"/>
        s1 -> a1
    </process>
    <process id="TWO">
        <startEvent id="s2"/> <userTask id="a2"/>
        s2 -> a2
    </process>
"""


def test_a_call_of_another_process_begins_again_or_ends() -> None:
    text = CALLED.format(
        main="""
            <startEvent id="start"/> <endEvent id="end"/>
            <callActivity id="call" calledElement="ONE"/>
            start -> call -> end
        """
    )
    play = Play(text).start()
    new = text.replace('calledElement="ONE"', 'calledElement="TWO"')
    refusal = refused(play, new)
    assert refusal.can_end
    assert refusal.candidates == ("call", "end")
    play.revise(new, call="call")
    assert play.at == "a2"


def test_a_call_in_an_instance_is_refused_at_its_own_element() -> None:
    text = CALLED.format(main=INSTANCES)
    play = Play(text).start()
    new = text.replace('calledElement="ONE"', 'calledElement="TWO"')
    plan = play.plan(new)
    assert [each.element for each in plan.refusals] == ["call", "call"]
    tried = check_ways_out(play.run.state, mission(new), plan, {}, play.now_us)
    assert tried["go"] == 4
    assert tried["end"] == 2


AD_HOC = """
    <startEvent id="start"/> <endEvent id="end"/>
    <adHocSubProcess id="look" {choice}>
        <callActivity id="call" calledElement="ONE"/> <userTask id="b"/>
    </adHocSubProcess>
    start -> look -> end
"""


def test_a_token_in_an_ad_hoc_subprocess_can_only_end() -> None:
    text = CALLED.format(main=AD_HOC.format(choice="m2pem:activeElements=\"['call']\""))
    play = Play(text).start()
    new = text.replace('calledElement="ONE"', 'calledElement="TWO"')
    refusal = refused(play, new)
    assert refusal.element == "call"
    assert refusal.candidates == ()
    assert refusal.can_end
    assert play.revise(new, call="").ended == "completed"


def test_another_one_who_chooses_activities_is_refused_with_a_way_out() -> None:
    text = CALLED.format(main=AD_HOC.format(choice="m2pem:activeElements=\"['call']\""))
    play = Play(text).start()
    refusal = refused(play, CALLED.format(main=AD_HOC.format(choice="")))
    assert refusal.element == "look"
    assert refusal.candidates == ("look", "end")
    assert refusal.can_end


def test_what_undoes_an_activity_has_no_way_out_but_to_wait() -> None:
    text = """
        <startEvent id="start"/> <endEvent id="end"/> <task id="do"/>
        <intermediateThrowEvent id="back">compensate do</intermediateThrowEvent>
        <userTask id="undo" isForCompensation="true"><each>2</each></userTask>
        start -> do -> back -> end
        do undo undo
    """
    play = Play(text).start()
    refusal = refused(play, text.replace(">2<", ">3<"))
    assert refusal.element == "undo"
    assert not (refusal.candidates or refusal.can_end)
    assert refusal.text.endswith("it undoes an activity: wait until that is done")
    (other,) = play.plan(text.replace(">2<", ">3<"), undo="").refusals
    assert not other.can_end


def test_a_token_whose_event_awaits_nothing_can_go_elsewhere_or_end() -> None:
    text = """
        <startEvent id="start"/> <endEvent id="end"/>
        <intermediateCatchEvent id="wait">signal A</intermediateCatchEvent>
        start -> wait -> end
    """
    none = text.replace("CatchEvent", "ThrowEvent")
    refusal = refused(Play(text).start(), none)
    assert refusal.element == "wait"
    assert refusal.can_end


PARALLEL = """
    <eventBasedGateway id="g" instantiate="true" eventGatewayType="Parallel"/>
    <intermediateCatchEvent id="a">message A</intermediateCatchEvent>
    <intermediateCatchEvent id="b">message B</intermediateCatchEvent>
    <endEvent id="end"/>
    g -> a -> end
    g -> b -> end
"""


def test_a_gateway_that_waits_for_all_events_has_a_way_out() -> None:
    play = Play(PARALLEL).start().message("A")
    assert play.at == "g"
    new = PARALLEL.replace('id="b"', 'id="c"').replace("-> b", "-> c")
    refusal = refused(play, new)
    assert refusal.element == "g"
    assert refusal.can_end
    assert refusal.candidates[:1] == ("g",)
    assert play.revise(new, g="").ended == "completed"


@pytest.mark.parametrize("is_boundary", [True, False], ids=["boundary", "catch"])
def test_an_event_that_has_had_one_of_its_triggers(is_boundary: bool) -> None:
    boundary = """
        <userTask id="work"/> <userTask id="after"/>
        <boundaryEvent id="on" attachedToRef="work" {several}>signal A; signal B</boundaryEvent>
        start -> work -> end
        on -> after
    """
    catch = """
        <intermediateCatchEvent id="on" {several}>signal A; signal B</intermediateCatchEvent>
        start -> on -> end
    """
    head = '<startEvent id="start"/> <endEvent id="end"/>'
    event = (boundary if is_boundary else catch).replace("{several}", 'parallelMultiple="true"')
    text = f"{head}{event}"
    play = Play(text).start().signal("A")
    refusal = refused(play, text.replace("signal B", "signal C"))
    assert refusal.element == ("work" if is_boundary else "on")
    assert "has had one of its triggers, and they change" in refusal.text
    assert refusal.can_end
    assert "end" in refusal.candidates


def test_a_start_event_in_a_subprocess_that_has_had_one_of_its_triggers() -> None:
    text = """
        <startEvent id="start"/> <endEvent id="end"/>
        <subProcess id="sub">
            <startEvent id="in"/> <userTask id="work"/> <endEvent id="out"/>
            in -> work -> out
            <subProcess id="handler" triggeredByEvent="true">
                <startEvent id="on" parallelMultiple="true">signal A; signal B</startEvent>
                <endEvent id="done"/>
                on -> done
            </subProcess>
        </subProcess>
        start -> sub -> end
    """
    play = Play(text).start().signal("A")
    refusal = refused(play, text.replace("signal B", "signal C"))
    assert refusal.element == "sub"
    assert refusal.candidates == ("sub", "end")
    assert play.revise(text.replace("signal B", "signal C"), sub="").ended == "completed"


def test_a_start_event_of_the_mission_that_has_had_one_of_its_triggers_must_stay() -> None:
    text = """
        <startEvent id="start"/> <userTask id="work"/> <endEvent id="end"/>
        start -> work -> end
        <subProcess id="handler" triggeredByEvent="true">
            <startEvent id="on" parallelMultiple="true">signal A; signal B</startEvent>
            <endEvent id="done"/>
            on -> done
        </subProcess>
    """
    play = Play(text).start().signal("A")
    refusal = refused(play, text.replace("signal B", "signal C"))
    assert not (refusal.token or refusal.candidates or refusal.can_end)
    assert refusal.text.endswith("keep them")
