"""Loops in which nothing waits: findings, compared with what a run does."""

import random
from itertools import pairwise

import pytest
from bpmn_text import definitions, flow, line_of, load, process

from m2pem.bpmn.lint import lint
from m2pem.engine.inputs import StartRun
from m2pem.engine.run import MissionRun
from m2pem.findings import Finding, Severity
from m2pem.mission.mission import Mission

RULES = ("endless-loop", "busy-loop")
MANY = 500
"""Steps after which a run that has not ended does not wait."""


def looped(data: bytes, *known: str) -> list[Finding]:
    return [each for each in lint(load(data), known) if each.rule in RULES]


def rules(data: bytes, *known: str) -> list[str]:
    return [each.rule for each in looped(data, *known)]


def goes_on(mission: Mission, data: dict[str, int] | None = None) -> bool:
    """Whether the engine has not come to a wait or an end after many steps."""
    run = MissionRun(mission, None, "r1", MANY)
    run.receive(StartRun(mission.process().id, dict(data or {})), 0)
    return run.wants_continue


def guarded(source: str, target: str, condition: str) -> str:
    text = condition.replace("&", "&amp;").replace("<", "&lt;")
    return (
        f'<sequenceFlow id="{source}_{target}" sourceRef="{source}" targetRef="{target}">'
        f"<conditionExpression>{text}</conditionExpression></sequenceFlow>"
    )


def script(identifier: str, *statements: str) -> str:
    text = "\n".join(statements).replace("<", "&lt;")
    return f'<scriptTask id="{identifier}"><script>{text}</script></scriptTask>'


def ring(*tasks: str, out: str = "", more: str = "") -> bytes:
    """S > M, the elements, X, and back to M; `out`: the condition under which X leads to E."""
    names = [task.split('id="')[1].split('"')[0] for task in tasks]
    ends = ["S", "M", *names, "X"]
    flows = "".join(flow(one, two) for one, two in pairwise(ends))
    leave = guarded("X", "E", out) + '<endEvent id="E"/>' if out else ""
    return process(
        f'<startEvent id="S"/><exclusiveGateway id="M"/>{"".join(tasks)}'
        f'<exclusiveGateway id="X" default="X-M"/>{flows}{flow("X", "M")}{leave}{more}'
    )


WORK = '<task id="W"/>'


# --- what is found ------------------------------------------------------------------------------


def test_a_loop_without_a_way_out_is_an_error_that_names_its_elements() -> None:
    (found,) = looped(ring(WORK))
    assert (found.rule, found.severity, found.element) == ("endless-loop", Severity.ERROR, "M")
    assert found.message.startswith("'M', 'W' and 'X' follow each other for ever")
    assert found.number == "M313"
    assert goes_on(load(ring(WORK)))


def test_a_loop_that_only_data_can_end_is_a_warning_that_says_which() -> None:
    (found,) = looped(ring(WORK, out="door.open"))
    assert (found.rule, found.severity, found.number) == ("busy-loop", Severity.WARNING, "M314")
    assert "'door.open', which nothing in it writes" in found.message
    assert "only data can end it" in looped(ring(script("W", "n = n * 2"), out="n > 9"))[0].message


@pytest.mark.parametrize(
    "idle",
    [
        WORK,
        '<manualTask id="W"/>',
        '<serviceTask id="W"/>',
        '<sendTask id="W"/>',
        '<scriptTask id="W"><script>a = 1</script></scriptTask>',
        '<intermediateThrowEvent id="W"/>',
        '<intermediateThrowEvent id="W"><signalEventDefinition/></intermediateThrowEvent>',
        '<parallelGateway id="W"/>',
        '<subProcess id="W"><task id="w"/></subProcess>',
        '<subProcess id="W"><subProcess id="V"><task id="w"/></subProcess></subProcess>',
        '<task id="W"><multiInstanceLoopCharacteristics><loopCardinality>3</loopCardinality>'
        "</multiInstanceLoopCharacteristics></task>",
        '<task id="W"><standardLoopCharacteristics loopMaximum="3"/></task>',
    ],
)
def test_what_is_done_at_once(idle: str) -> None:
    assert rules(ring(idle)) == ["endless-loop"]
    assert goes_on(load(ring(idle)))


TIMER = "<timerEventDefinition><timeDuration>PT1S</timeDuration></timerEventDefinition>"
CATCH = f'<intermediateCatchEvent id="W">{TIMER}</intermediateCatchEvent>'


@pytest.mark.parametrize(
    "waits",
    [
        '<userTask id="W"/>',
        '<scriptTask id="W"><script><behavior type="vehicle" name="hold"/></script></scriptTask>',
        '<serviceTask id="W" m2pem:class="any"/>',
        '<receiveTask id="W" messageRef="m"/>',
        CATCH,
        f'<subProcess id="W">{CATCH.replace("W", "w")}</subProcess>',
        '<callActivity id="W" calledElement="Q"/>',
        '<adHocSubProcess id="W"><task id="w"/></adHocSubProcess>',
    ],
)
def test_a_loop_that_waits_is_no_busy_loop(waits: str) -> None:
    text = ring(waits).decode().removesuffix("</definitions>")
    called = '<process id="Q"><userTask id="q"/></process><message id="m"/></definitions>'
    assert rules(f"{text}{called}".encode()) == []


def test_a_called_process_that_does_not_wait() -> None:
    text = ring('<callActivity id="W" calledElement="Q"/>').decode()
    called = '<process id="Q"><task id="q"/></process></definitions>'
    data = text.replace("</definitions>", called).encode()
    assert rules(data) == ["endless-loop"]
    assert goes_on(load(data))


def test_links_close_a_loop() -> None:
    link = '<linkEventDefinition name="L"/>'
    data = process(
        f'<startEvent id="S"/>{flow("S", "A")}<task id="A"/>{flow("A", "T")}'
        f'<intermediateThrowEvent id="T">{link}</intermediateThrowEvent>'
        f'<intermediateCatchEvent id="C">{link}</intermediateCatchEvent>{flow("C", "A")}'
    )
    assert rules(data) == ["endless-loop"]
    assert goes_on(load(data))


def test_an_error_that_is_caught_closes_a_loop() -> None:
    data = process(
        f'<startEvent id="S"/>{flow("S", "A")}{script("A", "throw error X")}'
        '<boundaryEvent id="B" attachedToRef="A"><errorEventDefinition/></boundaryEvent>'
        f"{flow('B', 'A')}"
    )
    assert rules(data) == ["busy-loop"]


def test_a_parallel_join_that_needs_another_token_waits_for_it() -> None:
    data = process(
        f'<startEvent id="S"/>{flow("S", "A")}<task id="A"/>{flow("A", "F")}'
        f'<parallelGateway id="F"/>{flow("F", "J")}{flow("F", "W")}<task id="W"/>{flow("W", "J")}'
        f'<parallelGateway id="J"/>{flow("J", "E")}<endEvent id="E"/>'
    )
    assert rules(data) == []
    stuck = process(
        f'<startEvent id="S"/>{flow("S", "J")}<parallelGateway id="J"/>{flow("J", "W")}'
        f'<task id="W"/>{flow("W", "J")}'
    )
    assert rules(stuck) == []
    assert not goes_on(load(stuck))


def test_an_event_around_the_loop_can_end_it() -> None:
    inner = ring(WORK).decode().split('<process id="P">')[1].split("</process>")[0]
    timer = f'<boundaryEvent id="Late" attachedToRef="T">{TIMER}</boundaryEvent>'
    data = process(
        f'<subProcess id="T">{inner}</subProcess>{timer}'
        f'<startEvent id="S1"/>{flow("S1", "T")}<endEvent id="E1"/>{flow("Late", "E1")}'
    )
    (found,) = looped(data)
    assert found.rule == "busy-loop"
    assert "only 'Late' can end that" in found.message
    assert rules(data.replace(b'"Late" attached', b'"Late" cancelActivity="false" attached')) == [
        "endless-loop"
    ]


def test_a_standard_loop_without_an_end() -> None:
    task = '<task id="T"><standardLoopCharacteristics>{}</standardLoopCharacteristics></task>'
    while_ = "<loopCondition>{}</loopCondition>"
    endless = process(task.format("") + line_of("T"))
    assert rules(endless) == ["endless-loop"]
    assert goes_on(load(endless))
    assert rules(process(task.format(while_.format("x")) + line_of("T"))) == ["busy-loop"]
    counted = process(task.format(while_.format("loopCounter &lt; 3")) + line_of("T"))
    assert rules(counted) == []
    assert not goes_on(load(counted))


def test_what_nothing_reaches_is_not_looked_at() -> None:
    lost = f'<task id="A"/><task id="B"/>{flow("A", "B")}{flow("B", "A")}'
    data = process(f'{lost}<startEvent id="S"/>{flow("S", "E")}<endEvent id="E"/>')
    assert rules(data) == []


# --- loops that count ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("step", "out"),
    [
        ("n = n + 1", "n >= 3"),
        ("n = 2 + n", "n > limit"),
        ("n = n + 1", "done or 3 <= n"),
        ("n = n + 1", "not (n < 3)"),
        ("n = n - 1", "n <= 0"),
        ("n = n - -1", "n > 2 or found"),
    ],
)
def test_a_loop_that_counts(step: str, out: str) -> None:
    data = ring(script("W", step), out=out)
    assert rules(data, "n") == []
    assert not goes_on(load(data), {"n": 2, "limit": 9})


@pytest.mark.parametrize(
    ("steps", "out"),
    [
        (["n = n + 1"], "n <= 3"),
        (["n = n + 1"], "n >= 3 and found"),
        (["n = n + 1", "n = 0"], "n >= 3"),
        (["n = n + 1", "n = n - 1"], "n >= 3"),
        (["n = n + 1", "limit = n + 2"], "n >= limit"),
        (["n = n + 0"], "n >= 3"),
        (["m = n + 1"], "m >= 3"),
        (["n.a = n.a + 1", "n = 1"], "n.a >= 3"),
    ],
)
def test_a_loop_that_only_seems_to_count(steps: list[str], out: str) -> None:
    assert rules(ring(script("W", *steps), out=out), "n", "limit") == ["busy-loop"]


def test_a_counter_that_nothing_begins_never_ends_the_loop() -> None:
    data = ring(script("W", "n = n + 1"), out="n >= 3")
    assert rules(data) == ["busy-loop"]
    assert goes_on(load(data))


def test_a_counter_in_a_subprocess_counts() -> None:
    inner = f'{script("w", "n = n + 1")}<startEvent id="s"/>{flow("s", "w")}'
    assert rules(ring(f'<subProcess id="W">{inner}</subProcess>', out="n > 2"), "n") == []
    own = f'<subProcess id="W">{inner}<dataObject id="n"/></subProcess>'
    assert rules(ring(own, out="n > 2"), "n") == ["busy-loop"]


def test_a_round_that_passes_by_the_counter_is_found() -> None:
    bypass = guarded("M", "X", "skip")
    data = ring(script("W", "n = n + 1"), out="n >= 3", more=bypass)
    assert rules(data, "n") == ["busy-loop"]


def test_a_loop_in_a_loop_that_each_count() -> None:
    data = process(
        f'<startEvent id="S"/>{flow("S", "A")}{script("A", "i = 0")}{flow("A", "M")}'
        f'<exclusiveGateway id="M"/>{flow("M", "B")}{script("B", "i = i + 1", "j = 0")}'
        f'{flow("B", "N")}<exclusiveGateway id="N"/>{flow("N", "C")}{script("C", "j = j + 1")}'
        f'{flow("C", "Y")}<exclusiveGateway id="Y" default="Y-X"/>{guarded("Y", "N", "j < 3")}'
        f'{flow("Y", "X")}<exclusiveGateway id="X" default="X-E"/>{guarded("X", "M", "i < 3")}'
        f'{flow("X", "E")}<endEvent id="E"/>'
    )
    assert rules(data) == []
    assert not goes_on(load(data))


# --- compared with the engine -------------------------------------------------------------------


def _random_mission(seed: int) -> bytes:
    """A few scripts and gateways, joined at random."""
    pick = random.Random(seed)
    names = [f"n{number}" for number in range(pick.randint(2, 6))]
    parts = ['<startEvent id="S"/><endEvent id="E"/>', flow("S", "n0")]
    conditions = ["a < 5", "a > 5", "b <= 3", "b >= a", "not (b < 4)", "a < 5 and b < 5", "b > 9"]
    steps = ["a = a + 1", "b = b + 1", "a = 0", "b = b - 1", "c = 1", "b = a"]
    for name in names:
        targets = pick.sample([*names, "E"], pick.randint(1, 2))
        if len(targets) == 1 and pick.random() < 0.7:
            parts.append(script(name, *pick.sample(steps, pick.randint(0, 2))))
            parts.append(flow(name, targets[0]))
        else:
            default = f"{name}-{targets[0]}"
            parts.append(f'<exclusiveGateway id="{name}" default="{default}"/>')
            parts.append(flow(name, targets[0]))
            parts += [guarded(name, each, pick.choice(conditions)) for each in targets[1:]]
    return process("".join(parts))


def test_random_loops_do_as_the_findings_say() -> None:
    found = {"": 0, **dict.fromkeys(RULES, 0)}
    for seed in range(200):
        data = _random_mission(seed)
        told = rules(data, "a", "b")
        found[told[0] if told else ""] += 1
        if not told:
            for a, b in ((0, 0), (9, 1), (-3, 7)):
                assert not goes_on(load(data), {"a": a, "b": b}), seed
    assert min(found.values()) > 10


def test_random_loops_without_a_way_out_never_end() -> None:
    for seed in range(200):
        data = _random_mission(seed)
        for each in looped(data, "a", "b"):
            if each.rule == "endless-loop":
                mission = load(data)
                run = MissionRun(mission, None, "r1", MANY)
                step = run.receive(StartRun(mission.process().id, {"a": 0, "b": 0}), 0)
                entered = {getattr(record, "element", "") for record in step.records}
                assert run.wants_continue or each.element not in entered, seed


def test_a_long_row_in_a_loop_is_named_in_short() -> None:
    (found,) = looped(ring(*(f'<task id="t{number}"/>' for number in range(200))))
    assert "'t6' and 194 more follow each other" in found.message


def test_processes_that_call_each_other_in_a_loop_are_read() -> None:
    text = '<process id="P"><callActivity id="c" calledElement="P"/></process>'
    assert rules(definitions(text)) == []
