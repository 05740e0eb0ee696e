"""What event subprocesses catch of their scope (clause 13.5.4): errors and escalations."""

import pytest

from tests.engine.event_subprocesses import NOT, WORK, around, handler
from tests.engine.kit import FAILED, Play
from tests.engine.trace import table

# --- errors -------------------------------------------------------------------------------------

FAILING = """<startEvent id="s"/> <userTask id="a"/> <serviceTask id="t">call Detector</serviceTask>
    {more}
    s -> a
    s -> t
"""


def test_an_error_in_the_scope_begins_it_and_ends_the_rest() -> None:
    play = Play(around(FAILING.format(more="") + handler("error E"))).start()
    play.trace()
    play.fail("t", "E")
    assert play.trace("error", "leave", "enter") == table("""
        error E caught by hs; leave a interrupted; leave t failed; enter h; enter hs; leave hs
        enter hu
    """)
    assert play.answer().entered().endswith("done")


def test_an_error_of_another_code_passes_by() -> None:
    play = Play(around(FAILING.format(more="") + handler("error E"))).start()
    play.fail("t", "OTHER")
    assert play.ended == "failed"


def test_the_one_that_names_the_code_goes_before_one_that_takes_all() -> None:
    play = Play(
        around(FAILING.format(more="") + handler("error") + handler("error E", name="i"))
    ).start()
    assert play.fail("t", "E").at == "iu"


def test_a_tasks_own_boundary_event_goes_first() -> None:
    boundary = """<boundaryEvent id="own" attachedToRef="t">error</boundaryEvent> <userTask id="o"/>
        own -> o
    """
    play = Play(around(FAILING.format(more=boundary) + handler("error E"))).start()
    assert play.fail("t", "E").at == "a o"


def test_an_event_subprocess_goes_before_a_boundary_event_of_the_activity_around() -> None:
    after = """<boundaryEvent id="out" attachedToRef="sub">error E</boundaryEvent>
        <userTask id="o"/> <task id="done"/>
        start -> sub -> done
        out -> o
    """
    play = Play(around(FAILING.format(more="") + handler("error E"), after=after)).start()
    assert play.fail("t", "E").at == "hu"


@pytest.mark.parametrize("again", ["E", "F"])
def test_an_error_in_the_handler_goes_on_outwards(again: str) -> None:
    # It may throw again what began it (clause 13.5.4): the boundary event takes over then.
    inside = f'<endEvent id="he">error {again}</endEvent>\nhs -> he\n'
    after = """<boundaryEvent id="out" attachedToRef="sub">error</boundaryEvent>
        <userTask id="o"/> <task id="done"/>
        start -> sub -> done
        out -> o
    """
    play = Play(around(FAILING.format(more="") + handler("error", "", inside), after=after)).start()
    assert play.fail("t", "E").at == "o"
    assert play.trace("error") == [
        "error E caught by hs",
        f"error {again} caught by out",
    ]


def test_an_error_in_a_handler_is_caught_by_another_one_of_the_same_scope() -> None:
    inside = '<endEvent id="he">error E</endEvent>\nhs -> he\n'
    play = Play(
        around(WORK + handler("signal go", NOT, inside) + handler("error E", name="i"))
    ).start()
    assert play.signal("go").at == "iu"


def test_an_interrupted_scope_begins_no_other_one_for_an_error() -> None:
    inside = '<endEvent id="he">error E</endEvent>\nhs -> he\n'
    play = Play(
        around(WORK + handler("signal go", "", inside) + handler("error E", name="i"))
    ).start()
    assert play.signal("go").ended == "failed"


def test_an_error_climbs_through_scopes_to_the_event_subprocess_of_the_process() -> None:
    play = Play(
        around(FAILING.format(more=""), after=handler("error E") + "\nstart -> sub")
    ).start()
    assert play.fail("t", "E").at == "hu"
    assert play.answer().ended == "completed"


def test_a_failed_behavior_releases_its_vehicle_and_begins_it() -> None:
    play = Play(
        around(
            """<startEvent id="s"/> <scriptTask id="go">do goto uav1 target=p</scriptTask>
            s -> go
            """
            + handler("error")
        )
    ).start()
    assert play.report("go", FAILED, "BATTERY_LOW").at == "hu"


# --- escalations --------------------------------------------------------------------------------

ESCALATING = """<startEvent id="s"/> <userTask id="a"/>
    <intermediateThrowEvent id="up">escalation X</intermediateThrowEvent> <userTask id="b"/>
    s -> up -> b
    s -> a
"""


def test_an_escalation_begins_one_that_interrupts_before_the_next_step() -> None:
    play = Play(around(ESCALATING + handler("escalation X"))).start()
    assert play.at == "hu"


def test_an_escalation_begins_one_beside_the_scope_each_time() -> None:
    again = ESCALATING.replace("s -> a", "s -> a -> up")
    play = Play(around(again + handler("escalation", NOT))).start()
    assert play.at == "a b hu"
    assert play.answer(prompt="a").at == "b hu b hu"


def test_an_escalation_in_the_handler_goes_on_outwards() -> None:
    inside = '<endEvent id="he">escalation X</endEvent>\nhs -> he\n'
    after = """<boundaryEvent id="out" attachedToRef="sub" cancelActivity="false">escalation X
        </boundaryEvent> <userTask id="o"/> <task id="done"/>
        start -> sub -> done
        out -> o
    """
    play = Play(around(ESCALATING + handler("escalation X", NOT, inside), after=after)).start()
    assert play.at == "a b o"
    assert play.trace("escalation") == ["escalation X caught by hs", "escalation X caught by out"]
