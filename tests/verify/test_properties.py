"""Each property catches a mission that breaks it, at the elements where it shows."""

import pytest

from m2pem.verify.check import check
from m2pem.verify.properties.results import Verdict
from tests.engine.notation import mission

JOIN_FED_BY_ONE = """
<process id="MAIN"><startEvent id="s"/><exclusiveGateway id="x"/><userTask id="a">ask l r</userTask>
<userTask id="b">ask l r</userTask><parallelGateway id="join"/><endEvent id="e"/>
s -> x
x -> a
x -> b
a -> join
b -> join
join -> e
</process>
"""
TWO_ON_ONE = """
<process id="MAIN"><startEvent id="s"/><parallelGateway id="fork"/><parallelGateway id="join"/>
<scriptTask id="a">do drive_stop evsg1</scriptTask>
<scriptTask id="b">do drive_stop evsg1</scriptTask>
<endEvent id="e"/>
s -> fork
fork -> a
fork -> b
a -> join
b -> join
join -> e
</process>
"""
UNJOINED = """
<process id="MAIN"><startEvent id="s"/><parallelGateway id="fork"/><exclusiveGateway id="merge"/>
<userTask id="a">ask l r</userTask><userTask id="b">ask l r</userTask>
<userTask id="c">ask l r</userTask><endEvent id="e"/>
s -> fork
fork -> a
fork -> b
a -> merge
b -> merge
merge -> c
c -> e
</process>
"""
UNSENT = """
<process id="MAIN"><startEvent id="s"/>
<intermediateCatchEvent id="wait">signal gone</intermediateCatchEvent>
<endEvent id="e"/>
s -> wait
wait -> e
</process>
"""
UNHANDLED = """
<process id="MAIN"><startEvent id="s"/><userTask id="ask">ask go stop</userTask>
<exclusiveGateway id="x"/><endEvent id="e"/>
s -> ask
ask -> x
x -> e if user.decision == 'go'
</process>
"""
ROUND = """
<process id="MAIN"><startEvent id="s"/><exclusiveGateway id="x"/><userTask id="a">ask l r</userTask>
<exclusiveGateway id="y"/><endEvent id="e"/>
s -> x
x -> a
a -> y
y -> x if 1 == 1
y -> e if 1 == 2
</process>
"""


@pytest.mark.parametrize(
    ("text", "broken", "element"),
    [
        (JOIN_FED_BY_ONE, "no-deadlock", "join"),
        (JOIN_FED_BY_ONE, "can-complete", "s"),
        (JOIN_FED_BY_ONE, "no-dead-element", "e"),
        (TWO_ON_ONE, "one-behavior", "a"),
        (UNJOINED, "one-token", "c"),
        (UNJOINED, "proper-completion", "e"),
        (UNSENT, "can-be-triggered", "wait"),
        (UNSENT, "no-deadlock", "wait"),
        (UNHANDLED, "decisions-handled", "x"),
        (UNHANDLED, "errors-caught", "x"),
        (ROUND, "no-livelock", "a"),
        (ROUND, "no-dead-element", "e"),
    ],
)
def test_a_broken_mission_is_caught(text: str, broken: str, element: str) -> None:
    report = check(mission(text))
    result = next(each for each in report.results if each.property == broken)
    assert result.verdict is Verdict.VIOLATED
    assert element in {each for violation in result.violations for each in violation.elements}
    assert report.verdict is Verdict.VIOLATED


@pytest.mark.parametrize(
    ("named", "uncaught"),
    [([], "FAILED"), (["LINK_LOST"], "FAILED"), (["FAILED"], "LINK_LOST"), ([""], None)],
)
def test_an_error_that_no_event_names_is_not_caught(named: list[str], uncaught: str | None) -> None:
    events = "".join(
        f'<boundaryEvent id="b{code}" attachedToRef="go">error {code}</boundaryEvent>\n'
        for code in named
    )
    flows = "".join(f"b{code} -> e\n" for code in named)
    text = f"""
<startEvent id="s"/><scriptTask id="go">do goto uav1</scriptTask><endEvent id="e"/>
{events}s -> go -> e
{flows}"""
    (result,) = [
        each for each in check(mission(text)).results if each.property == "failures-handled"
    ]
    found = [each.message.partition("(")[2].partition(")")[0] for each in result.violations]
    assert found == ([] if uncaught is None else [uncaught])


def test_what_an_expression_may_lead_to_that_is_not_followed_is_not_dead_for_certain() -> None:
    """A collection that is none ends the activity with error EXPRESSION."""
    inside = """
<process id="MAIN"><startEvent id="s"/>
<userTask id="each"><multiInstanceLoopCharacteristics isSequential="true">
<loopDataInputRef>items</loopDataInputRef></multiInstanceLoopCharacteristics></userTask>
<dataObject id="items"/>
<boundaryEvent id="failed" attachedToRef="each"><errorEventDefinition/></boundaryEvent>
<userTask id="after"/><endEvent id="e"/><endEvent id="over"/>
s -> each -> e
failed -> after -> over
</process>
"""
    (found,) = (
        each for each in check(mission(inside)).results if each.property == "no-dead-element"
    )
    assert found.verdict is Verdict.MAY_BE_VIOLATED
    assert {each.elements for each in found.violations} == {("failed",), ("after",), ("over",)}
    assert {each.doubt for each in found.violations} == {
        "an expression may fail whose data are not followed"
    }


def test_an_instance_of_a_process_begins_without_the_data_of_the_one_before() -> None:
    inside = """
<message id="m" name="m"/>
<process id="MAIN"><startEvent id="s"/>
<intermediateThrowEvent id="one"><messageEventDefinition messageRef="m"/></intermediateThrowEvent>
<userTask id="wait"/>
<intermediateThrowEvent id="two"><messageEventDefinition messageRef="m"/></intermediateThrowEvent>
<endEvent id="e"/>
s -> one -> wait -> two -> e
</process>
<process id="OTHER"><startEvent id="begun"><messageEventDefinition messageRef="m"/></startEvent>
<exclusiveGateway id="gate" default="first"/><userTask id="again"/>
<scriptTask id="write"><script>a = 1</script></scriptTask><endEvent id="end"/><endEvent id="over"/>
begun -> gate
first: gate -> write
second: gate -> again if a == 1
write -> end
again -> over
</process>
"""
    (found,) = (
        each for each in check(mission(inside)).results if each.property == "no-dead-element"
    )
    assert {(each.elements, each.doubt) for each in found.violations} == {
        (("again",), ""),
        (("over",), ""),
    }
