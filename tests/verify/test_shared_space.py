"""Shared space: the net follows who is in it, who waits for it, and who is refused."""

from dataclasses import replace
from pathlib import Path
from random import Random
from typing import Any

import pytest

from m2pem.cli.group import run_command_line
from m2pem.deconfliction.known_ways import FleetWays
from m2pem.fleet.fleet import Domain, Fleet, OnConflict, SharedSpace, Vehicle
from m2pem.mission.catalogue import ResourceId
from m2pem.verify.check import Report, check
from m2pem.verify.conformance_run import ConformanceRun
from m2pem.verify.net.petri_net import Exactness, PetriNet
from m2pem.verify.net.simplify import simplify
from m2pem.verify.properties.results import Verdict
from m2pem.verify.report.data import as_data
from m2pem.verify.report.findings import findings_of
from m2pem.verify.search.explore import Limits, explore
from m2pem.verify.translate import Options
from tests.deconfliction.conftest import task
from tests.deconfliction.test_clearance_simulate import ROVERS, both_ways, write_rovers
from tests.engine.notation import mission as notation
from tests.executive.conftest import flow, mission
from tests.verify.random_space import (
    ELSEWHERE,
    GEOMETRIES,
    HOMES,
    ORIGIN,
    at,
    net_of,
    options_of,
    place,
    random_fleet,
    random_mission,
)
from tests.verify.space_walk import SpaceWalk
from tests.verify.test_roles_by_need import fork, given, messages, row, verdict
from tests.verify.test_spin_agreement import one_answer, same
from tests.verify.trace_mapping import TooManyStatesError

SMALL = Limits(states=20_000, tokens=3)
BRIDGE, YARD, EAST = at(50, 0), at(50, 40), at(100, 0)


def rovers(*spaces: SharedSpace, homes: dict[str, Any] | None = None, **more: Any) -> Fleet:
    """Rovers at their homes: ugv1 in the west, ugv2 in the east, ugv3 in the yard."""
    vehicles = {
        ResourceId(name): Vehicle(
            ResourceId(name), Domain.GROUND, "sim", {"home": list(place(*home)[:2])}
        )
        for name, home in (homes or HOMES).items()
    }
    shared = {space.name: space for space in spaces or (SharedSpace("bridge", 1),)}
    return Fleet(
        "rovers",
        "rovers.yaml",
        vehicles,
        origin=ORIGIN,
        geometries=GEOMETRIES,
        shared_space=shared,
        **more,
    )


def go(element: str, what: str) -> str:
    return f'<scriptTask id="{element}">do {what}</scriptTask>'


def both(*tasks: str) -> str:
    """Parallel branches of one task each: A, B, ..."""
    found = fork(*["uav1"] * len(tasks))
    for number, what in enumerate(tasks):
        name = chr(ord("A") + number)
        found = found.replace(go(name, "drive_stop uav1"), go(name, what))
    return found


def report_of(text: str, fleet: Fleet, **more: Any) -> Report:
    return check(notation(text), fleet, options=options_of(fleet), **more)


OVER = "single_vehicle_routing ugv1 route=over"
BACK = "single_vehicle_routing ugv2 route=back"
WAITS = "need:vehicle=ugv2;wait=unlimited"


def test_two_that_cross_a_bridge_go_one_after_the_other() -> None:
    fleet = rovers()
    report = report_of(both(OVER, BACK), fleet)
    assert report.verdict is Verdict.HOLDS
    assert report.states < 40
    assert report.net.approximations == ()
    (bridge,) = [each.index for each in report.net.places if each.space]
    counts = [report.found.marking(n).tokens.get(bridge, 0) for n in range(report.states)]
    assert {*counts} == {0, 1}


@pytest.mark.parametrize(
    ("space", "wants"),
    [
        (SharedSpace("bridge", 2), (OVER, BACK)),
        (SharedSpace("bridge", 1_000_000), (OVER, BACK)),
        (SharedSpace("bridge", 1), (OVER, f"goto ugv2 target={at(120, 0)}")),
        (SharedSpace("field", 1), (OVER, BACK)),
        (SharedSpace("bridge", 1, domains=(Domain.AIR,)), (OVER, BACK)),
    ],
)
def test_a_space_that_nobody_competes_for_is_left_out(
    space: SharedSpace, wants: tuple[str, ...]
) -> None:
    fleet = rovers(space)
    report = report_of(both(*wants), fleet)
    assert not any(each.space for each in report.net.places)
    assert report.net.approximations == ()
    free = check(notation(both(*wants)), replace(fleet, shared_space={}))
    assert report.states == free.states


def test_who_waits_for_a_place_that_another_one_stands_in_is_stuck() -> None:
    stays = f"goto ugv1 target={BRIDGE}"
    text = both(stays, f"single_vehicle_routing {WAITS} route=back")
    report = report_of(text, rovers())
    (said,) = messages(text, report, "no-deadlock")
    assert "script task B waits for bridge, where ugv1 is" in said
    limited = report_of(both(stays, BACK), rovers())
    assert verdict(limited, "no-deadlock") is Verdict.HOLDS
    assert verdict(limited, "can-complete") is Verdict.VIOLATED
    (said,) = messages(both(stays, BACK), limited, "can-complete")
    assert "script task B waits for bridge, where ugv1 is with script task A" in said


def test_two_that_each_wait_for_where_the_other_one_stands_are_stuck() -> None:
    west = "need:vehicle=ugv1;wait=unlimited"
    text = "\n".join(
        [
            '<startEvent id="s"/><parallelGateway id="f"/><parallelGateway id="j"/>',
            '<endEvent id="e"/>',
            go("A", f"goto {west} target={BRIDGE}"),
            go("A2", f"goto {west} target={YARD}"),
            go("B", f"goto {WAITS} target={YARD}"),
            go("B2", f"goto {WAITS} target={BRIDGE}"),
            "s -> f -> A -> A2 -> j -> e",
            "f -> B -> B2 -> j",
        ]
    )
    fleet = rovers(
        SharedSpace("bridge", 1), SharedSpace("yard", 1), homes={**HOMES, "ugv3": (0, 90)}
    )
    report = report_of(text, fleet)
    (said,) = messages(text, report, "no-deadlock")
    assert "script task A2 waits for yard, where ugv2 is" in said
    assert "script task B2 waits for bridge, where ugv1 is" in said
    bigger = replace(fleet, shared_space={**fleet.shared_space, "bridge": SharedSpace("bridge", 2)})
    assert verdict(report_of(text, bigger), "no-deadlock") is Verdict.HOLDS


CROSSWISE = f"""
<startEvent id="s"/><parallelGateway id="f"/><parallelGateway id="j"/><endEvent id="e"/>
<exclusiveGateway id="x"/>
<scriptTask id="A">do follow need:vehicle=ugv1;wait=unlimited target=ugv3</scriptTask>
<boundaryEvent id="a" attachedToRef="A">signal done</boundaryEvent>
<scriptTask id="B">do goto {WAITS} target={BRIDGE}</scriptTask>
<intermediateThrowEvent id="t">signal done</intermediateThrowEvent>
s -> f -> A -> x -> j
a -> x
f -> B -> t -> j
j -> e
"""


def test_a_task_that_waits_for_space_and_one_that_waits_for_it_are_a_circle() -> None:
    fleet = rovers()
    report = check(notation(CROSSWISE), fleet, options=Options(ways=FleetWays(fleet)))
    (said,) = messages(CROSSWISE, report, "can-complete")
    assert "script task B waits for bridge, where ugv1 is with script task A" in said


@pytest.mark.parametrize(
    ("code", "answer"), [("REJECTED", Verdict.HOLDS), ("LINK_LOST", Verdict.VIOLATED)]
)
@pytest.mark.parametrize("waits", [False, True])
def test_who_may_not_enter_is_rejected(code: str, answer: Verdict, waits: bool) -> None:
    refuse = SharedSpace("bridge", 1, on_conflict=OnConflict.REFUSE)
    # A task waits for one of the spaces, and then may ask for all.
    spaces = (refuse, SharedSpace("yard", 1)) if waits else (refuse,)
    caught = "\n".join(
        f'<boundaryEvent id="{name}c" attachedToRef="{name}">error {code}</boundaryEvent>\n'
        f"<endEvent id='{name}e'/>\n{name}c -> {name}e"
        for name in "AB"
    )
    text = both(OVER, BACK, f"goto ugv3 target={YARD}") + "\n" + caught
    text = text.replace('<parallelGateway id="j"/>', '<exclusiveGateway id="j"/>')
    report = report_of(text, rovers(*spaces))
    assert verdict(report, "errors-caught") is answer
    if answer is Verdict.VIOLATED:
        said = messages(text, report, "errors-caught")
        assert "error REJECTED of A is caught by nothing: the run fails" in said


def test_a_space_without_room_rejects_whoever_comes() -> None:
    text = row(go("A", OVER))
    report = report_of(text, rovers(SharedSpace("bridge", 0)))
    said = messages(text, report, "errors-caught")
    assert said == ["error REJECTED of A is caught by nothing: the run fails"]
    assert verdict(report, "no-deadlock") is Verdict.HOLDS


@pytest.mark.parametrize(
    ("behavior", "answer"),
    [("road_following_formation", Verdict.VIOLATED), ("bridge_crossing", Verdict.HOLDS)],
)
def test_a_team_needs_a_place_for_each_unless_one_moves_at_a_time(
    behavior: str, answer: Verdict
) -> None:
    where = "need:count=2;requires=vehicle.name!='ugv3' route=over"
    text = row(go("A", f"{behavior} {where}"))
    report = report_of(text, rovers())
    assert verdict(report, "errors-caught") is answer


def test_alike_rovers_that_cross_a_bridge_are_few_states() -> None:
    homes = {f"ugv{number}": (10.0 * number - 90, 0.0) for number in range(1, 9)}
    need = "single_vehicle_routing need:requires=vehicle.domain=='ground' route=over"
    report = report_of(both(*[need] * 4), rovers(homes=homes))
    assert given(report.net, "A") == {"one of ugv1, ugv2, ugv3, ugv4, ugv5, ugv6, ugv7 and ugv8"}
    assert report.verdict is Verdict.HOLDS
    assert report.states < 1_200


def test_what_is_not_known_of_ways_is_said_and_both_are_followed() -> None:
    text = row(go("W", OVER), go("A", "goto ugv1 target=${there}"), go("B", BACK))
    fleet = rovers(homes={"ugv1": HOMES["ugv1"], "ugv2": HOMES["ugv2"]})
    del fleet.vehicles[ResourceId("ugv2")].settings["home"]  # type: ignore[attr-defined]
    report = report_of(text, fleet)
    said = {(each.element, each.exactness): each.what for each in report.net.approximations}
    assert "whether its way enters bridge is not known" in said["A", Exactness.MORE]
    assert ("W", Exactness.MORE) not in said
    assert said["MAIN", Exactness.BOUNDED].startswith("where ugv2 is at first is not known")
    assert verdict(report, "can-complete") is Verdict.MAY_BE_VIOLATED  # A may end on the bridge


# --- the engine, the executive and Spin -----------------------------------------------------------


def random_one(seed: int) -> tuple[Any, Fleet, PetriNet]:
    dice = Random(seed)
    fleet = random_fleet(dice)
    found = notation(random_mission(dice))
    return found, fleet, net_of(found, fleet)


def walked(seed: int) -> tuple[int, int]:
    found, fleet, net = random_one(seed)
    waits = refusals = 0
    for number in range(2):
        walk = SpaceWalk(found, fleet, net, number, ELSEWHERE)
        try:
            assert walk.go() == "", (seed, number)
        except TooManyStatesError:
            continue
        waits, refusals = waits + walk.waits, refusals + walk.refusals
    return waits, refusals


def test_the_net_can_do_what_engine_and_reservations_do() -> None:
    found = [walked(seed) for seed in (8, 31, 40, 44)]
    assert any(waits for waits, _ in found)
    assert any(refusals for _, refusals in found)


@pytest.mark.long
@pytest.mark.parametrize("seed", range(100, 160))
def test_the_net_can_do_what_they_do_with_others(seed: int) -> None:
    walked(seed)


@pytest.mark.parametrize("seed", [1, 3, 9, 44])
def test_the_engine_follows_the_runs_that_violate_a_property(seed: int) -> None:
    found, fleet, _ = random_one(seed)
    report = check(found, fleet, options=options_of(fleet), limits=SMALL)
    played = 0
    for violation in as_data(findings_of(found, report))["violations"]:
        # The engine has its own order of timers, and of tasks that name what they need.
        timers = [s for s in violation["steps"] if s["trigger"] == "timer"]
        if violation["property"] == "one-behavior" or timers:
            continue
        player = ConformanceRun(found, fleet, "MAIN", ways=FleetWays(fleet))
        for step in violation["steps"]:
            player.play(step)
        assert not player.undone
        played += 1
    assert played


@pytest.mark.parametrize("seed", [8, pytest.param(44, marks=pytest.mark.long)])
def test_spin_sees_the_same_states(seed: int) -> None:
    same(simplify(random_one(seed)[2]))


def test_spin_says_the_same() -> None:
    fleet = rovers()
    text = both(f"goto ugv1 target={BRIDGE}", f"single_vehicle_routing {WAITS} route=back")
    answer = one_answer(notation(text), fleet, options_of(fleet))
    assert answer is Verdict.VIOLATED


def onto_and_over() -> bytes:
    """One vehicle stops on the bridge, and another one is to cross it."""
    return mission(
        '<process id="P" isExecutable="true"><startEvent id="S"/><parallelGateway id="F"/>'
        + task("Onto", "goto", "one", target="[38.0, -76.9995]", speed="3 m/s")[1]
        + task("Over", "goto", "two", target="[38.0, -77.0005]", speed="3 m/s")[1]
        + flow("S", "F")
        + flow("F", "Onto")
        + flow("F", "Over")
        + "</process>"
    )


@pytest.mark.parametrize(
    ("content", "space", "holds", "completes"),
    [
        (both_ways(), "1", True, True),
        (onto_and_over(), "1", False, False),
        (onto_and_over(), "2", True, True),
        (onto_and_over(), "{capacity: 1, on_conflict: refuse}", False, False),
    ],
)
def test_verify_and_simulate_agree(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    content: bytes,
    space: str,
    holds: bool,
    completes: bool,
) -> None:
    (tmp_path / "mission.bpmn").write_bytes(content)
    fleet = write_rovers(tmp_path)
    fleet.write_text(ROVERS.replace("bridge: 1", f"bridge: {space}"), encoding="utf-8")
    words = [str(tmp_path / "mission.bpmn"), "--fleet", str(fleet)]
    assert run_command_line(["verify", *words]) == (0 if holds else 1)
    assert "space" not in capsys.readouterr().out
    assert (run_command_line(["simulate", *words]) == 0) is completes


def test_a_run_that_violates_a_property_is_played(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "mission.bpmn").write_bytes(onto_and_over())
    fleet, report = str(write_rovers(tmp_path)), str(tmp_path / "report.json")
    words = [str(tmp_path / "mission.bpmn"), "--fleet", fleet, "--report", report]
    assert run_command_line(["verify", *words]) == 1
    assert "Over waits for bridge, where one is" in capsys.readouterr().out
    assert run_command_line(["replay", "--counterexample", report, "--fleet", fleet]) == 0


@pytest.mark.parametrize("seed", [1, 5, 44])
def test_vehicles_in_spaces_are_counted(seed: int) -> None:
    found = explore(random_one(seed)[2], SMALL)
    for state in range(0, len(found.states), 7):
        tokens = found.marking(state).tokens
        if tokens.keys() & found.net.ends:
            continue
        for space in {each.space for each in found.net.places} - {""}:
            inside = sum(tokens.get(p.index, 0) for p in found.net.places if space in p.inside)
            counted = sum(tokens.get(p.index, 0) for p in found.net.places if p.space == space)
            assert inside == counted
