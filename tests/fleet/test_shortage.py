"""Tasks that may be active at the same time, and too few vehicles for them."""

import pytest

from m2pem.findings import Finding, Severity
from m2pem.fleet.check import check_mission
from m2pem.fleet.default_fleet import fleet_for
from tests.engine.notation import mission
from tests.verify.allocator import offers_all, with_vehicles

AIR = "need:requires=vehicle.domain=='air'"
RED = "need:requires='red'in[vehicle.tags[0]]"
WAITS = f"{AIR};wait=unlimited"

FORK = """
<startEvent id="s"/><parallelGateway id="f"/><parallelGateway id="j"/><endEvent id="e"/>
s -> f
j -> e
"""


def task(name: str, roles: str, more: str = "") -> str:
    return f'<scriptTask id="{name}">do drive_stop {roles}{more}</scriptTask>'


def fork(*branches: str) -> str:
    """Parallel branches of one task each: A, B, ..."""
    tasks = [task(chr(65 + n), roles) for n, roles in enumerate(branches)]
    flows = [f"f -> {chr(65 + n)} -> j" for n in range(len(branches))]
    return "\n".join((FORK, *tasks, *flows))


def shortages(text: str, vehicles: int, tag: str = "red") -> list[Finding]:
    read = mission(text)
    tags = {f"uav{number}": tag for number in range(1, vehicles + 1)}
    found = check_mission(read, with_vehicles(fleet_for(read), **tags), offers_all)
    assert {each.rule for each in found} <= {"tasks-compete", "same-vehicle"}, found
    return [each for each in found if each.rule == "tasks-compete"]


def said(text: str, vehicles: int) -> list[tuple[str, str]]:
    """Severity and element of each finding."""
    return [(each.severity.value, each.element) for each in shortages(text, vehicles)]


def test_tasks_of_a_fork_that_do_not_wait_are_an_error_if_the_fleet_has_too_few() -> None:
    (finding,) = shortages(fork(AIR, AIR, AIR), 2)
    assert finding.severity is Severity.ERROR
    assert (finding.file, finding.element) == ("test.bpmn", "C")
    assert finding.line > 1
    assert finding.message.endswith(
        "A (role 'role1'), B (role 'role1') and C (role 'role1') begin at once, do not wait, and "
        "need more than there are of uav1, uav2: one of them ends with RESOURCE_UNAVAILABLE in "
        "every run"
    )
    assert "wait=" in finding.remedy
    assert shortages(fork(AIR, AIR, AIR), 3) == []


def test_only_the_roles_that_share_the_vehicles_are_named() -> None:
    (finding,) = shortages(fork(AIR, "evsg1", AIR), 1)
    assert "A (role 'role1') and C (role 'role1') begin at once" in finding.message


def test_a_task_that_names_a_vehicle_counts() -> None:
    assert said(fork("uav1", AIR), 1) == [("error", "B")]
    assert shortages(fork("uav1", AIR), 2) == []
    assert shortages(fork("uav1", "uav1"), 1) == []  # that is same-vehicle


def test_a_role_for_several_counts_as_often() -> None:
    assert said(fork(f"{AIR};count=2", AIR), 2) == [("error", "B")]
    assert shortages(fork(f"{AIR};count=1..2", AIR), 2) == []


CAUGHT = '<boundaryEvent id="{0}c" attachedToRef="{0}">error {1}</boundaryEvent>\n{0}c -> j'


@pytest.mark.parametrize("code", ["", "RESOURCE_UNAVAILABLE"])
def test_an_error_that_all_of_them_catch_is_a_warning(code: str) -> None:
    caught = [CAUGHT.format(name, code).replace("error <", "error<") for name in "AB"]
    text = fork(AIR, AIR)
    assert said("\n".join((text, caught[0])), 1) == [("error", "B")]
    assert said("\n".join((text, *caught)), 1) == [("warning", "B")]


def test_tasks_that_wait_compete_with_nobody() -> None:
    assert shortages(fork(WAITS, WAITS, WAITS), 1) == []
    assert shortages(fork(AIR, WAITS, WAITS), 1) == []  # A is served first


def test_a_task_that_does_not_wait_may_find_nothing_beside_one_that_does() -> None:
    (finding,) = shortages(fork(WAITS, AIR), 1)
    assert (finding.severity, finding.element) == (Severity.WARNING, "B")
    assert (
        "role 'role1' may find none of uav1 free, and does not wait: A (role 'role1') may have"
        in finding.message
    )
    assert "catch RESOURCE_UNAVAILABLE" in finding.remedy
    first = f"{AIR};priority=1"
    assert shortages(fork(WAITS, first), 1) == []
    assert said(fork(f"{WAITS};priority=1", AIR), 1) == [("warning", "B")]


LATE = """
<startEvent id="s"/><parallelGateway id="f"/><endEvent id="e"/><endEvent id="e2"/>
<userTask id="ask">ask on</userTask>
{}
s -> f
f -> A -> e
f -> ask -> B -> e2
"""


def test_a_later_task_may_find_nothing() -> None:
    text = LATE.format(task("A", AIR) + task("B", RED))
    assert said(text, 1) == [("warning", "B")]
    assert shortages(text, 2) == []
    caught = '<boundaryEvent id="Bc" attachedToRef="B">error RESOURCE_UNAVAILABLE</boundaryEvent>'
    assert shortages(f"{text}{caught}\nBc -> e2", 1) == []
    assert shortages(LATE.format(task("A", AIR) + task("B", f"{RED};wait=PT5S")), 1) == []


def test_a_number_of_instances_that_is_written_counts() -> None:
    row = '<startEvent id="s"/><endEvent id="e"/>{}\ns -> A -> e'
    text = row.format(task("A", AIR, "<each>3</each>"))
    assert "A (role 'role1', several instances) begin at once" in shortages(text, 2)[0].message
    assert shortages(text, 3) == []
    assert shortages(row.format(task("A", AIR, "<each>n</each>")), 1) == []
    assert shortages(row.format(task("A", AIR, '<each isSequential="true">3</each>')), 1) == []
    many = row.format(task("A", AIR, "<each>1000000</each>"))
    assert [each.severity for each in shortages(many, 3)] == [Severity.ERROR]
    scope = f'<subProcess id="A">\n{task("B", AIR)}<each>2</each></subProcess>'
    assert said(row.format(scope), 1) == [("error", "B")]
    assert shortages(row.format(scope), 2) == []


CONDITIONS = """
<startEvent id="s"/><parallelGateway id="f"/><endEvent id="e"/><endEvent id="e2"/>
<exclusiveGateway id="x" default="n1"/><exclusiveGateway id="y" default="n2"/>
<userTask id="ask">ask on</userTask>
{}
s -> f -> x
x -> A if speed > 3
n1: x -> e
A -> e
f -> ask -> y
y -> B if {} > 3
n2: y -> e2
B -> e2
"""


def test_tasks_whose_conditions_read_the_same_data_are_not_taken_to_be_active_together() -> None:
    tasks = task("A", AIR) + task("B", AIR)
    assert shortages(CONDITIONS.format(tasks, "speed"), 1) == []
    assert said(CONDITIONS.format(tasks, "height"), 1) == [("warning", "B")]


@pytest.mark.parametrize(
    ("thrown", "expected"),
    [("", [("warning", "B")]), ("A -> t", [])],
)
def test_a_task_behind_a_signal_of_the_other_branch_is_not_taken_to_be_active_with_it(
    thrown: str, expected: list[tuple[str, str]]
) -> None:
    text = f"""
<startEvent id="s"/><parallelGateway id="f"/><endEvent id="e"/>
<intermediateCatchEvent id="c">signal go</intermediateCatchEvent>
{'<intermediateThrowEvent id="t">signal go</intermediateThrowEvent>' if thrown else ""}
{task("A", AIR)}{task("B", AIR)}
s -> f -> A -> e
{thrown}
f -> c -> B -> e
"""
    assert said(text, 1) == expected


def test_one_after_the_other_compete_for_nothing() -> None:
    text = '<startEvent id="s"/><endEvent id="e"/>' + task("A", AIR) + task("B", AIR)
    assert shortages(f"{text}\ns -> A -> B -> e", 1) == []
    choice = '<exclusiveGateway id="x" default="other"/>'
    assert (
        shortages(f"{text}{choice}\ns -> x\nx -> A if a > 1\nA -> e\nother: x -> B -> e", 1) == []
    )


EVENTS = {
    "non-interrupting boundary event": """
<startEvent id="s"/><endEvent id="e"/><endEvent id="e2"/>
{}<boundaryEvent id="b" attachedToRef="A" cancelActivity="{}">timer PT5S</boundaryEvent>{}
s -> A -> e
b -> B -> e2
""",
    "event subprocess": """
<startEvent id="s"/><endEvent id="e"/>{}
s -> A -> e
<subProcess id="sub" triggeredByEvent="true">
<startEvent id="t" isInterrupting="{}">timer PT5S</startEvent>{}
t -> B
</subProcess>
""",
}


@pytest.mark.parametrize("which", EVENTS)
def test_an_event_that_does_not_interrupt_begins_tasks_beside_others(which: str) -> None:
    for interrupts, expected in (("false", [("warning", "B")]), ("true", [])):
        text = EVENTS[which].format(task("A", AIR), interrupts, task("B", AIR))
        assert said(text, 1) == expected
        assert shortages(text, 2) == []


def test_a_loop_back_to_a_fork_does_not_join_its_branches() -> None:
    text = f"""
<startEvent id="s"/><exclusiveGateway id="m"/><parallelGateway id="f"/><parallelGateway id="j"/>
<exclusiveGateway id="x" default="out"/><endEvent id="e"/>{task("A", AIR)}{task("B", AIR)}
s -> m -> f -> A -> j
f -> B -> j
j -> x -> m if again == 1
out: x -> e
"""
    assert said(text, 1) == [("error", "B")]
    assert shortages(text, 2) == []


def test_called_processes_and_subprocesses_are_looked_into() -> None:
    text = f"""
<process id="MAIN" isExecutable="true">
<startEvent id="s"/><parallelGateway id="f"/><endEvent id="e"/>
<callActivity id="one" calledElement="FLY"/>
<subProcess id="two"><startEvent id="s2"/>{task("B", AIR)}
s2 -> B
</subProcess>
s -> f -> one -> e
f -> two -> e
</process>
<process id="FLY"><startEvent id="s3"/>{task("A", AIR)}
s3 -> A
</process>
"""
    assert said(text, 1) == [("error", "B")]
    assert shortages(text, 2) == []


def test_forks_one_after_the_other_are_looked_at_by_themselves() -> None:
    blocks = [
        f'<parallelGateway id="g{n}"/><parallelGateway id="h{n}"/>{task(f"A{n}", AIR)}'
        f"{task(f'B{n}', RED)}\ng{n} -> A{n} -> h{n}\ng{n} -> B{n} -> h{n}"
        for n in range(250)
    ]
    chain = [f"h{n} -> g{n + 1}" for n in range(249)]
    ends = '<startEvent id="s"/><endEvent id="e"/>\ns -> g0\nh249 -> e'
    read = mission("\n".join((ends, *blocks, *chain)))
    fleet = with_vehicles(fleet_for(read), **{f"uav{n}": "red" for n in range(1, 51)})
    assert check_mission(read, fleet, offers_all) == []


@pytest.mark.parametrize(("keep", "found"), [("process", ["X"]), ("task", []), ("", [])])
def test_what_is_kept_between_tasks_counts_as_held(keep: str, found: list[str]) -> None:
    kept = f"need:requires=vehicle.name=='uav1'{f';keep={keep}' if keep else ''}"
    other = "need:requires=vehicle.name=='uav2'"
    text = f"""
    <startEvent id="s"/><parallelGateway id="f"/><endEvent id="e"/><endEvent id="e2"/>
    <subProcess id="P"><startEvent id="ps"/>{task("A", kept)}{task("B", other)}<endEvent id="pe"/>
      ps -> A -> B -> pe
    </subProcess>
    <userTask id="ask">ask on</userTask>{task("X", AIR)}
    s -> f -> P -> e
    f -> ask -> X -> e2
    """
    within = text.replace("keep=process", "keep=subprocess")
    assert [each.element for each in shortages(within, 2)] == found
    assert shortages(within, 3) == []
