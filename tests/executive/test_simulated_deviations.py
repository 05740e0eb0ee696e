"""Faults of simulated vehicles that only telemetry shows: each is found."""

import re
from typing import Any

import pytest

from m2pem.engine.records import BehaviorEnded, RunEnded
from m2pem.fleet.fleet import Conformance, Domain, Fleet, Vehicle
from m2pem.mission.catalogue import BehaviorState, ResourceId
from m2pem.mission.geometry import Route

from .conftest import World, behavior, mission, sequence

LAT, LON = 47.4, 8.5
NORTH, EAST = 1 / 111_190, 1 / 75_400
"""Degrees of a metre."""


def route(*points: tuple[float, float]) -> Route:
    """Waypoints so far east and north of home, 25 m high."""
    return Route(tuple((LAT + n * NORTH, LON + e * EAST, 25.0) for e, n in points))


ZIGZAG = route((0, 50), (0, 150), (100, 150), (100, 250), (0, 250), (0, 350))


def aircraft(*faults: str, conformance: Conformance | None = None, hz: float = 5.0) -> Fleet:
    """One aircraft that hovers at 25 m."""
    settings = {"home": [LAT, LON], "altitude": 25.0, "faults": list(faults), "telemetry_hz": hz}
    uav = ResourceId("uav1")
    vehicle = Vehicle(uav, Domain.AIR, "sim", settings, conformance=conformance)
    return Fleet(
        "test", "test.yaml", {uav: vehicle}, geometries={"zigzag": ZIGZAG}, origin=(LAT, LON, 0.0)
    )


def flies(name: str = "single_vehicle_routing", **parameters: str) -> bytes:
    given = "".join(
        f'<m2pem:property name="{key}" value="{value}"/>' for key, value in parameters.items()
    )
    return mission(sequence(("Fly", behavior("Fly", name, "uav1", parameters=given))))


FAR = f"[{LAT + 300 * NORTH}, {LON}, 25]"


async def ended(world: World, file: bytes) -> tuple[BehaviorEnded, list[str]]:
    """The end of the first behavior, and the alerts of deviations."""
    said: list[str] = []
    world.executive.events.on_alert = lambda each: (
        said.append(each.text) if each.code == "DEVIATION" else None
    )
    await world.executive.control.start(file)
    while not any(isinstance(each, RunEnded) for each in world.seen):
        await world.clock.sleep(1.0)
    return next(each for each in world.seen if isinstance(each, BehaviorEnded)), said


def test_without_a_fault_it_has_succeeded_with_evidence(play: Any) -> None:
    async def story(world: World) -> None:
        end, said = await ended(world, flies(route="zigzag"))
        assert (end.state, said) == (BehaviorState.SUCCEEDED, [])
        assert end.evidence["waypoints_passed"] == 6
        assert isinstance(end.evidence["cross_track_m"], float)
        assert end.evidence["cross_track_m"] < 5

    play(story, fleet=aircraft())


@pytest.mark.parametrize("hz", [5.0, 0.0])
@pytest.mark.parametrize(
    ("fault", "code", "reason"),
    [
        ("disarm at 10 s", "FAILED", r"uav1: disarmed 25 m above home"),
        ("fall at 10 s", "FAILED", r"uav1: falls at 12 m/s \(bound: 8 m/s\)"),
        ("jump 50 m at 8 s", "FAILED", r"uav1: its position has jumped by \d+ m in [\d.]+ s"),
        (
            "skip waypoints 3 to 4",
            "FAILED",
            r"uav1: \d+ m off the way to waypoint 3 for \d+ s \(bound: \d+ m\)",
        ),
        (
            "drift 40 m",
            "FAILED",
            r"uav1: \d+ m off the way to waypoint \d for \d+ s \(bound: \d+ m\)",
        ),
        (
            "end early at 10 s",
            "INCOMPLETE",
            r"uav1: waypoints \d to 6 of 6 were not passed; it is \d+ m from waypoint \d",
        ),
    ],
)
def test_each_deviation_is_found(play: Any, fault: str, code: str, reason: str, hz: float) -> None:
    """Also where only changes are published, as in rehearsals."""

    async def story(world: World) -> None:
        end, said = await ended(world, flies(route="zigzag"))
        assert (end.state, end.code) == (BehaviorState.FAILED, code), (end, said)
        assert re.fullmatch(reason, end.reason)
        what = f"{end.reason}. single_vehicle_routing is ended"
        assert said == ([] if code == "INCOMPLETE" else [what])

    play(story, fleet=aircraft(fault, hz=hz))


def test_a_success_far_from_the_target_is_incomplete(play: Any) -> None:
    async def story(world: World) -> None:
        end, _ = await ended(world, flies("goto", target=FAR))
        assert end.code == "INCOMPLETE"
        assert re.fullmatch(r"uav1: it is \d\d\d m from its target", end.reason)

    play(story, fleet=aircraft("end early at 5 s"))


def test_a_vehicle_on_its_way_down_is_not_stopped(play: Any) -> None:
    async def story(world: World) -> None:
        end, said = await ended(world, flies("return_to_launch"))
        (text,) = said
        assert re.fullmatch(
            r"uav1: its position has jumped by 5\d m in 0\.\d s\. return_to_launch: "
            r"it comes home or down, and goes on",
            text,
        ), text
        assert (end.state, end.code) == (BehaviorState.FAILED, "FAILED")

    play(story, fleet=aircraft("jump 50 m at 3 s"))


def test_bounds_are_those_of_the_vehicle(play: Any) -> None:
    async def story(world: World) -> None:
        end, said = await ended(world, flies(route="zigzag"))
        assert (end.state, said) == (BehaviorState.SUCCEEDED, [])

    wide = Conformance({"cross_track_m": 60.0, "waypoint_m": 60.0})
    play(story, fleet=aircraft("drift 40 m", conformance=wide))
    play(story, fleet=aircraft("drift 40 m", conformance=Conformance(watched=False)))


@pytest.mark.parametrize("fault", ["go on after cancel", ""])
def test_a_vehicle_that_goes_on_after_a_stop_does_not_obey(play: Any, fault: str) -> None:
    async def story(world: World) -> None:
        said: list[str] = []
        world.executive.events.on_alert = lambda each: (
            said.append(each.text) if each.code == "NOT_STOPPED" else None
        )
        run = await world.executive.control.start(flies("goto", target=FAR))
        await world.clock.sleep(6.0)
        await world.executive.control.stop(run, by="anna")
        await world.clock.sleep(20.0)
        if not fault:
            assert said == []
            return
        (text,) = said
        assert re.fullmatch(
            r"uav1 does NOT obey the cancel of goto \(r1\.b1\): it moves at 10\.0 m/s, "
            r"1\d\d m from where it was to stop\. Use its own stop",
            text,
        ), text

    play(story, fleet=aircraft(*([fault] if fault else [])))
