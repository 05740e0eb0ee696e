"""Aircraft that a mission commands in the air and never takes off."""

from dataclasses import replace
from itertools import count
from typing import TypeAlias, Union

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from m2pem.findings import Finding, Severity
from m2pem.fleet import default_fleet
from m2pem.fleet.behaviors import SHARED
from m2pem.fleet.check import check_mission
from m2pem.fleet.fleet import Domain, Fleet
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.catalogue import BehaviorSpec, ResourceId
from m2pem.mission.mission import Mission
from tests.engine.notation import mission
from tests.seeds import examples

START = '<startEvent id="s"/><endEvent id="e"/>'


def offers(_: ResourceId) -> list[BehaviorSpec]:
    return [spec for spec in SHARED.values() if spec.type is not BehaviorType.PAYLOAD]


def up(name: str, vehicle: str = "uav") -> str:
    return f'<scriptTask id="{name}">do takeoff {vehicle} altitude=20</scriptTask>'


def go(name: str, vehicle: str = "uav") -> str:
    place = "target=[38.1076,-77.3192] altitude=30"
    return f'<scriptTask id="{name}">do goto {vehicle} {place}</scriptTask>'


def land(name: str, vehicle: str = "uav") -> str:
    return f'<scriptTask id="{name}">do land {vehicle}</scriptTask>'


def fleet_for(read: Mission, **settings_: object) -> Fleet:
    fleet = default_fleet.fleet_for(read)
    vehicles = {id_: replace(each, settings=settings_) for id_, each in fleet.vehicles.items()}
    return replace(fleet, vehicles=vehicles)


def found(text: str, **settings_: object) -> list[Finding]:
    all_ = check_mission(mission(text), fleet_for(mission(text), **settings_), offers)
    assert not [each for each in all_ if each.severity is Severity.ERROR], all_
    return [each for each in all_ if each.rule == "no-takeoff"]


def at(text: str, **settings_: object) -> list[str]:
    return [each.element for each in found(text, **settings_)]


def test_an_aircraft_that_never_takes_off_is_a_warning_at_each_task_that_must_fly() -> None:
    (finding,) = found(START + go("A") + land("B") + "\ns -> A -> B -> e")
    assert (finding.severity, finding.element) == (Severity.WARNING, "A")
    assert "uav is on the ground: take off first (takeoff)" in finding.message
    assert finding.line > 0
    assert "takeoff" in finding.remedy


def test_what_takes_off_before_is_fine_and_after_is_not() -> None:
    assert at(START + up("T") + go("A") + "\ns -> T -> A -> e") == []
    assert at(START + up("T") + go("A") + "\ns -> A -> T -> e") == ["A"]
    assert at(START + up("T", "other") + go("A") + "\ns -> T -> A -> e") == ["A"]


def test_after_a_landing_it_takes_off_again() -> None:
    both = START + up("T") + go("A") + land("L") + go("B")
    assert at(both + "\ns -> T -> A -> L -> B -> e") == ["B"]
    home = both.replace("do land", "do return_to_launch")
    assert at(home + "\ns -> T -> A -> L -> B -> e") == ["B"]
    assert at(both + up("U") + "\ns -> T -> A -> L -> U -> B -> e") == []


def test_a_landing_that_an_event_interrupts_may_leave_it_in_the_air() -> None:
    event = '<boundaryEvent id="stop" attachedToRef="L">signal S</boundaryEvent>'
    text = START + up("T") + land("L") + event + go("B") + go("C") + '<endEvent id="x"/>'
    assert at(text + "\ns -> T -> L -> B -> e\nstop -> C -> x") == ["B"]


def test_what_begins_in_the_air_needs_no_take_off() -> None:
    text = START + go("A") + "\ns -> A -> e"
    assert at(text, altitude="30 m") == []
    assert at(text, sim={"altitude": "30 m"}) == []
    assert at(text, sim={}, altitude="30 m") == ["A"]


def test_rovers_and_what_offers_no_takeoff_are_not_looked_at() -> None:
    text = START + go("A") + "\ns -> A -> e"
    fleet = fleet_for(mission(text))
    uav = fleet.vehicles[ResourceId("uav")]
    rover = replace(fleet, vehicles={uav.id: replace(uav, domain=Domain.GROUND)})
    assert check_mission(mission(text), rover, offers) == []

    def none_takes_off(resource: ResourceId) -> list[BehaviorSpec]:
        return [each for each in offers(resource) if each.name != "takeoff"]

    assert check_mission(mission(text), fleet, none_takes_off) == []


def test_an_own_behavior_of_an_arbiter_and_an_operator_may_take_it_off() -> None:
    teleop = '<scriptTask id="T">do teleop uav timeout=5</scriptTask>'
    assert at(START + teleop + go("A") + "\ns -> T -> A -> e") == []


FORK = START + '<parallelGateway id="f"/><parallelGateway id="j"/>\ns -> f\nj -> e\n'


def test_a_branch_beside_may_have_taken_it_off_before() -> None:
    assert at(FORK + up("T") + go("A") + "\nf -> T -> j\nf -> A -> j") == []
    assert at(FORK + go("A") + up("T") + go("B", "b") + "\nf -> A -> T -> j\nf -> B -> j") == [
        "A",
        "B",
    ]


def test_a_landing_beside_a_take_off_may_have_come_before_it() -> None:
    beside = FORK + up("T") + land("L") + go("A") + "\nf -> T -> j\nf -> L -> A -> j"
    assert at(beside) == []
    after = FORK + up("T") + go("B", "b") + land("L") + go("A")
    assert at(after.replace("j -> e", "j -> L -> A -> e") + "\nf -> T -> j\nf -> B -> j") == [
        "B",
        "A",
    ]


def test_loops_are_followed_round() -> None:
    text = START + '<exclusiveGateway id="m"/><exclusiveGateway id="x" default="d"/>'
    text += go("A") + up("T") + "\ns -> m -> A -> x\nx -> T -> m if again\nd: x -> e"
    assert at(text) == []
    assert at(text.replace("do takeoff uav altitude=20", "do land uav")) == ["A"]


def test_subprocesses_and_called_processes_are_looked_into() -> None:
    inside = '<startEvent id="is"/><endEvent id="ie"/>'
    sub = f'<subProcess id="S">{inside}{up("T")}\nis -> T -> ie\n</subProcess>'
    assert at(START + sub + go("A") + "\ns -> S -> A -> e") == []
    assert at(START + sub + go("A") + "\ns -> A -> S -> e") == ["A"]
    down = sub.replace("is -> T -> ie", f"{land('L')}\nis -> T -> L -> ie")
    assert at(START + down + go("A") + "\ns -> S -> A -> e") == ["A"]
    call = '<callActivity id="S" calledElement="UP"/>'
    called = f'<process id="UP">{inside}{up("T")}\nis -> T -> ie\n</process>'
    main = '<process id="MAIN" isExecutable="true">{}\n</process>'
    assert at(main.format(START + call + go("A") + "\ns -> S -> A -> e") + called) == []
    assert at(main.format(START + call + go("A") + "\ns -> A -> S -> e") + called) == ["A"]
    flies = called.replace("do takeoff", "do change_altitude")
    assert at(main.format(START + up("U") + call + "\ns -> U -> S -> e") + flies) == []
    assert at(main.format(START + call + up("U") + "\ns -> S -> U -> e") + flies) == ["T"]


def test_an_event_subprocess_may_begin_at_any_time() -> None:
    inside = '<startEvent id="is" isInterrupting="{}">signal S</startEvent><endEvent id="ie"/>'
    handler = (
        f'<subProcess id="H" triggeredByEvent="true">{inside}{{}}\nis -> X -> ie\n</subProcess>'
    )
    away = handler.format("true", go("X"))
    assert at(START + up("T") + away + "\ns -> T -> e") == []
    assert at(START + go("T") + away + "\ns -> T -> e") == ["T", "X"]
    assert at(START + go("A") + handler.format("false", up("X")) + "\ns -> A -> e") == []


def test_a_process_of_its_own_may_have_taken_it_off_before() -> None:
    main = f'<process id="MAIN" isExecutable="true">{START}{go("A")}\ns -> A -> e\n</process>'
    other = '<process id="B"><startEvent id="bs">signal S</startEvent><endEvent id="be"/>'
    assert at(f"{main}{other}{up('T')}\nbs -> T -> be\n</process>") == []
    assert at(f"{main}{other}{land('T')}\nbs -> T -> be\n</process>") == ["A"]


def test_a_role_by_need_is_found_if_none_that_may_fill_it_can_be_in_the_air() -> None:
    air = "need:requires=vehicle.domain=='air'"
    assert at(START + up("T", air) + go("A", air) + "\ns -> T -> A -> e") == []
    assert at(START + go("A", air) + "\ns -> A -> e") == ["A"]


def test_all_members_of_a_team_must_have_taken_off() -> None:
    road = '<scriptTask id="A">do formation team:wing route=road</scriptTask>'
    one, two, three = (up(f"T{n}", f"wing_{n}") for n in (1, 2, 3))
    (finding,) = found(START + one + road + two + three + "\ns -> T1 -> T2 -> A -> T3 -> e")
    assert finding.element == "A"
    assert finding.message.startswith("A (line 2): wing_3 is on the ground")
    assert at(START + one + road + two + three + "\ns -> T1 -> T2 -> T3 -> A -> e") == []


Tree: TypeAlias = Union[str, tuple["str | Tree", ...]]
"""What is done: `up`, `go`, `land`, or ("seq" | "xor" | "par", what, what ...)."""

TREES = st.recursive(
    st.sampled_from(["up", "go", "go", "land"]),
    lambda inner: st.tuples(st.sampled_from(["seq", "seq", "xor", "par"]), inner, inner),
    max_leaves=8,
)


def numbered(tree: Tree, numbers: "count[int]") -> Tree:
    if isinstance(tree, str):
        return f"{tree}{next(numbers)}"
    return (tree[0], *(numbered(each, numbers) for each in tree[1:]))


def drawn(tree: Tree, lines: list[str], numbers: "count[int]") -> tuple[str, str]:
    """Add the elements; return the first and the last one."""
    if isinstance(tree, str):
        make = {"up": up, "go": go, "la": land}[tree[:2]]
        lines.append(make(tree))
        return tree, tree
    parts = [drawn(each, lines, numbers) for each in tree[1:]]
    if tree[0] == "seq":
        lines.append(f"\n{parts[0][1]} -> {parts[1][0]}\n")
        return parts[0][0], parts[1][1]
    kind = "parallelGateway" if tree[0] == "par" else "exclusiveGateway"
    fork, join = (f"{side}{next(numbers)}" for side in ("fork", "join"))
    lines.append(f'<{kind} id="{fork}"/><{kind} id="{join}"/>')
    for number, (first, last) in enumerate(parts):
        condition = f" if x == {number}" if tree[0] == "xor" else ""
        lines.append(f"\n{fork} -> {first}{condition}\n{last} -> {join}\n")
    return fork, join


def steps(tree: Tree) -> list[tuple[str, Tree]]:
    """What may be done next, and what is left then; "" is nothing."""
    if isinstance(tree, str):
        return [(tree, "")] if tree else []
    kind, one, other = tree
    if kind == "xor":
        return [*steps(one), *steps(other)]
    after = [(done, (kind, left, other) if left else other) for done, left in steps(one)]
    if kind == "par":
        after += [(done, (kind, one, left) if left else one) for done, left in steps(other)]
    return after


def flown_in_the_air(tree: Tree) -> set[str]:
    """Try all orders: the `go` that may begin in the air."""
    found_, seen = set(), set()
    waiting: list[tuple[Tree, bool]] = [(tree, False)]
    while waiting:
        state = waiting.pop()
        if state in seen:
            continue
        seen.add(state)
        for done, left in steps(state[0]):
            aloft = done.startswith("up") or (state[1] and not done.startswith("land"))
            if done.startswith("go") and state[1]:
                found_.add(done)
            waiting.append((left, aloft))
    return found_


def goes(tree: Tree) -> set[str]:
    if isinstance(tree, str):
        return {tree} if tree.startswith("go") else set()
    return set().union(*map(goes, tree[1:]))


@settings(max_examples=examples(60, 600), deadline=None)
@given(TREES)
@example(("par", "up", ("seq", "land", "go")))
def test_what_is_found_is_on_the_ground_in_every_order(drawn_tree: Tree) -> None:
    tree = numbered(drawn_tree, count(1))
    lines: list[str] = [START]
    first, last = drawn(tree, lines, count(1))
    text = "".join(lines) + f"\ns -> {first}\n{last} -> e"
    fleet = fleet_for(mission(text))
    uav = fleet.vehicles[ResourceId("uav")]
    fleet = replace(fleet, vehicles={uav.id: replace(uav, domain=Domain.AIR)})
    said = {
        each.element
        for each in check_mission(mission(text), fleet, offers)
        if each.rule == "no-takeoff"
    }
    grounded = goes(tree) - flown_in_the_air(tree)
    assert said <= grounded
    if "par" not in str(tree):
        assert said == grounded


@pytest.mark.parametrize("vehicles", [200])
def test_large_missions_are_looked_at_in_one_go(vehicles: int) -> None:
    names = [f"u{number}" for number in range(vehicles)]
    tasks = "".join(up(f"T{each}", each) + go(f"A{each}", each) for each in names)
    flows = "\n".join(f"f -> T{each} -> A{each} -> j" for each in names)
    assert at(FORK + tasks + "\n" + flows) == []
