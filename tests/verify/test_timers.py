"""Timers that begin to run together, in the order of their times if that is asked for."""

from dataclasses import replace
from random import Random

import pytest

from m2pem.fleet.default_fleet import fleet_for
from m2pem.mission.mission import Mission
from m2pem.verify.check import Report, check
from m2pem.verify.net.petri_net import PetriNet, Trigger
from m2pem.verify.properties.results import Result, Verdict
from m2pem.verify.search.explore import Limits, explore
from m2pem.verify.spin.check import check_with_spin
from m2pem.verify.spin.promela import text_of
from m2pem.verify.translate import Options, translate
from tests.engine.notation import mission
from tests.verify.models import Walk

IN_ORDER = Options(timers_in_order=True)

WARNED_FIRST = """
<startEvent id="s"/><scriptTask id="begin">warned = false</scriptTask>
<userTask id="ask">ask done</userTask><endEvent id="e"/>
<boundaryEvent id="soon" attachedToRef="ask" cancelActivity="false">timer PT1M</boundaryEvent>
<scriptTask id="warn">warned = true</scriptTask><endEvent id="ew"/>
<boundaryEvent id="late" attachedToRef="ask">timer PT5M</boundaryEvent>
<exclusiveGateway id="x"/><endEvent id="el"/>
s -> begin -> ask -> e
soon -> warn -> ew
late -> x
x -> el if warned
"""
"""Who is late was warned: without an order, the gateway may find that nobody was."""

BEHIND = """
<startEvent id="s"/><eventBasedGateway id="g"/>
<intermediateCatchEvent id="one">timer {0}</intermediateCatchEvent>
<intermediateCatchEvent id="two">timer {1}</intermediateCatchEvent>
<endEvent id="e1"/><endEvent id="e2"/>
s -> g
g -> one
g -> two
one -> e1
two -> e2
"""
NESTED = """
<startEvent id="s"/><endEvent id="e"/>
<subProcess id="sub"><startEvent id="i"/><userTask id="ask">ask done</userTask><endEvent id="j"/>
i -> ask -> j
<subProcess id="handler" triggeredByEvent="true">
<startEvent id="due"{0}>timer {1}</startEvent><endEvent id="k"/>
due -> k
</subProcess></subProcess>
<boundaryEvent id="late" attachedToRef="sub">timer {2}</boundaryEvent><endEvent id="el"/>
s -> sub -> e
late -> el
"""
PARALLEL = """
<startEvent id="s"/><parallelGateway id="f"/><parallelGateway id="j"/><endEvent id="e"/>
<intermediateCatchEvent id="one">timer PT1M</intermediateCatchEvent>
<intermediateCatchEvent id="two">timer PT5M</intermediateCatchEvent>
s -> f
f -> one -> j
f -> two -> j
j -> e
"""


def result(report: Report, name: str) -> Result:
    return next(each for each in report.results if each.property == name)


def reached(net: PetriNet) -> set[str]:
    found = explore(net, Limits(tokens=3))
    assert found.complete
    return {
        step.element for transition in found.fired for step in net.transitions[transition].steps
    }


def orders(net: PetriNet) -> set[tuple[str, ...]]:
    """In which orders timers can come."""
    found = explore(net)
    transitions = net.transitions
    complete = set()
    waiting: list[tuple[int, tuple[str, ...]]] = [(0, ())]
    while waiting:
        state, came = waiting.pop()
        after = list(found.successors(state))
        if not after:
            complete.add(came)
        for transition, to in after:
            timed = transitions[transition].trigger is Trigger.TIMER
            waiting.append((to, (*came, transitions[transition].element) if timed else came))
    return complete


def test_an_alarm_about_timers_in_a_wrong_order_is_gone_with_the_right_one() -> None:
    text = mission(WARNED_FIRST)
    false_alarm = result(check(text), "errors-caught")
    assert false_alarm.verdict is Verdict.MAY_BE_VIOLATED
    assert "the engine does not follow its run" in false_alarm.violations[0].doubt
    assert false_alarm.violations[0].elements[0] == "x"
    report = check(text, options=IN_ORDER)
    assert {r.verdict for r in report.results if not r.warning} == {Verdict.HOLDS}


def test_what_is_wrong_in_the_right_order_too_stays_an_alarm() -> None:
    text = WARNED_FIRST.replace("if warned", "if not warned")
    report = check(mission(text), options=IN_ORDER)
    assert result(report, "errors-caught").verdict is Verdict.VIOLATED


@pytest.mark.parametrize(
    ("one", "two", "can_come"),
    [
        ("PT1M", "PT5M", {"one"}),
        ("PT300S", "PT90S", {"two"}),
        ("PT60S", "PT1M", {"one", "two"}),
        ("P1M", "P29D", {"one", "two"}),
        ("P1W", "P8D", {"one"}),
    ],
)
def test_behind_a_gateway_the_timer_that_is_due_first_comes(
    one: str, two: str, can_come: set[str]
) -> None:
    text = mission(BEHIND.format(one, two))
    assert reached(translate(text)) & {"one", "two"} == {"one", "two"}
    assert reached(translate(text, options=IN_ORDER)) & {"one", "two"} == can_come


def test_durations_from_data_come_at_any_time() -> None:
    text = mission(BEHIND.format("PT5M", "${limit}"))
    data = replace(IN_ORDER, data={"limit": "PT1M"})
    assert {"one", "two"} <= reached(translate(text, options=data))


def test_timers_of_other_scopes_come_in_any_order() -> None:
    both = {("one", "two"), ("two", "one")}
    assert orders(translate(mission(PARALLEL), options=IN_ORDER)) == both


@pytest.mark.parametrize(
    ("attributes", "inner", "outer", "can_come"),
    [
        ("", "PT1M", "PT5M", {"due"}),
        ("", "PT5M", "PT1M", {"late"}),
        (' isInterrupting="false"', "PT1M", "PT5M", {"due", "late"}),
        (' isInterrupting="false"', "PT5M", "PT1M", {"late"}),
    ],
)
def test_timers_of_an_activity_and_of_what_begins_with_it_are_compared(
    attributes: str, inner: str, outer: str, can_come: set[str]
) -> None:
    text = mission(NESTED.format(attributes, inner, outer))
    assert reached(translate(text)) & {"due", "late"} == {"due", "late"}
    assert reached(translate(text, options=IN_ORDER)) & {"due", "late"} == can_come


def test_a_timer_around_a_handler_that_has_begun_comes_all_the_same() -> None:
    text = NESTED.format("", "PT1M", "PT5M").replace(
        '<endEvent id="k"/>\ndue -> k', '<userTask id="w">ask on</userTask><endEvent id="k"/>\n'
        "due -> w -> k"
    )  # fmt: skip
    net = translate(mission(text), options=IN_ORDER)
    assert ("due", "late") in orders(net)
    assert ("late",) not in orders(net)


def test_a_prompt_that_times_out_first_lets_no_later_timer_come() -> None:
    prompt = '<userTask id="ask" m2pem:timeout="{}">ask done</userTask>'
    for limit, can_come in (("PT30S", False), ("PT2M", False), ("PT5M", True), ("PT6M", True)):
        text = WARNED_FIRST.replace('<userTask id="ask">ask done</userTask>', prompt.format(limit))
        came = reached(translate(mission(text), options=IN_ORDER))
        assert ("late" in came) is can_come
        assert ("soon" in came) is (limit != "PT30S")


def test_timers_of_several_tokens_on_one_task_are_not_taken_for_each_others() -> None:
    """A second token's warning may still run when the first one's time is up."""
    text = """<startEvent id="s"/><userTask id="u">ask on</userTask><endEvent id="e"/>
<boundaryEvent id="b" attachedToRef="u" cancelActivity="false">cycle R3/PT1S</boundaryEvent>
<userTask id="task">ask on</userTask><endEvent id="et"/>
<boundaryEvent id="soon" attachedToRef="task" cancelActivity="false">timer PT2S</boundaryEvent>
<boundaryEvent id="late" attachedToRef="task">timer PT3S</boundaryEvent>
<endEvent id="es"/><endEvent id="el"/>
s -> u -> e
b -> task -> et
soon -> es
late -> el
"""

    def waits(text: str) -> bool:
        net = translate(mission(text), options=IN_ORDER)
        (late,) = [r for r in net.transitions if r.element == "late" and r.trigger is not None]
        return any(net.places[place].element == "soon" for place in late.inhibit)

    assert not waits(text)
    alone = text.replace("b -> task -> et", "b -> e").replace("u -> e", "u -> task -> et")
    assert waits(alone)


def several_timers(dice: Random) -> Mission:
    """Timers on activities, behind gateways and of event subprocesses, with close times."""

    def timer() -> str:
        return f"timer PT{dice.randint(1, 4)}S"

    def ends(number: int) -> str:
        return f'<endEvent id="e{number}"/>'

    kinds = ["", ' cancelActivity="false"']
    starts = ["", ' isInterrupting="false"']
    inner = dice.choice(
        ['<userTask id="u">ask a b</userTask>', '<userTask id="u">ask a</userTask>']
    )
    inside = "".join(
        f'<subProcess id="h{n}" triggeredByEvent="true"><startEvent id="hs{n}"'
        f'{dice.choice(starts)}>{timer()}</startEvent><userTask id="hu{n}">ask a</userTask>'
        f'<endEvent id="he{n}"/>\nhs{n} -> hu{n} -> he{n}\n</subProcess>'
        for n in range(dice.randint(0, 2))
    )
    around = "".join(
        f'<boundaryEvent id="b{n}" attachedToRef="{dice.choice(["sub", "u2"])}"'
        f"{dice.choice(kinds)}>{timer()}</boundaryEvent>{ends(n)}\nb{n} -> e{n}\n"
        for n in range(dice.randint(1, 4))
    )
    boundary = "".join(
        f'<boundaryEvent id="ib{n}" attachedToRef="u"{dice.choice(kinds)}>{timer()}'
        f'</boundaryEvent><endEvent id="ie{n}"/>\nib{n} -> ie{n}\n'
        for n in range(dice.randint(0, 3))
    )
    again = dice.choice(["g2 -> e", "g2 -> m"])
    return mission(
        f"""<startEvent id="s"/><exclusiveGateway id="m"/><endEvent id="e"/>
<subProcess id="sub"><startEvent id="i"/>{inner}<endEvent id="j"/>
i -> u -> j
{boundary}{inside}</subProcess>
<userTask id="u2">ask a b</userTask>{around}<eventBasedGateway id="g"/>
<intermediateCatchEvent id="g1">{timer()}</intermediateCatchEvent>
<intermediateCatchEvent id="g2">{timer()}</intermediateCatchEvent>
s -> m -> sub -> u2 -> g
g -> g1
g -> g2
g1 -> e
{again}
"""
    )


@pytest.mark.parametrize("seed", range(30))
def test_what_the_engine_does_with_timers_the_transitions_can_do_in_order(seed: int) -> None:
    text = several_timers(Random(seed))
    fleet = fleet_for(text)
    net = translate(text, fleet, options=IN_ORDER)
    for walk in range(4):
        assert Walk(text, fleet, net, walk).go() == ""


def test_some_of_those_missions_do_less_in_order() -> None:
    texts = [several_timers(Random(seed)) for seed in range(6)]
    limits = Limits(states=4_000, tokens=3)
    any_order = [explore(translate(each), limits).transitions for each in texts]
    in_order = [explore(translate(each, options=IN_ORDER), limits).transitions for each in texts]
    assert all(one >= other for one, other in zip(any_order, in_order, strict=True))
    assert sum(one > other for one, other in zip(any_order, in_order, strict=True)) >= 3


def test_spin_is_given_the_same_order() -> None:
    text = mission(WARNED_FIRST)
    ordered, free = (text_of(translate(text, options=o)).text for o in (IN_ORDER, Options()))
    late = [line for line in ordered.splitlines() if "timer: late triggered" in line]
    assert len(late) == 1
    assert "!at_ask_soon_control_armed0" in late[0]
    assert len([line for line in free.splitlines() if "timer: late triggered" in line]) == 1
    assert "!at_ask_soon_control_armed0" not in free
    ours, spins = check(text, options=IN_ORDER), check_with_spin(text, options=IN_ORDER)
    assert [(r.property, r.verdict) for r in ours.results] == [
        (r.property, r.verdict) for r in spins.results
    ]
