"""Routes, surveys and circles, flown as missions."""

import math
from dataclasses import replace
from itertools import pairwise

import pytest
from m2pem_plugin_mavlink.microservices.mission_items import MissionItem
from m2pem_plugin_mavlink.vehicle.driver import FlightMode
from m2pem_plugin_mavlink.vehicle.identity import Firmware
from mavlink_double import HOME, Body, at
from mavlink_play import after_a_restart, play
from shapely import LineString, Polygon, box

from m2pem.api import (
    SHARED,
    Area,
    BehaviorState,
    BehaviorType,
    LocalFrame,
    Point,
    Route,
)
from m2pem.fleet.parameters import resolve
from tests.geo.passes import lawn_mower

SUCCEEDED, RUNNING = BehaviorState.SUCCEEDED, BehaviorState.RUNNING
WAYPOINT, CHANGE_SPEED = 16, 178


def route(*places, frame="relative") -> Route:
    return Route(tuple((*at(e, n), a) for e, n, a in places), frame)


L_SHAPE = route((30, 0, 20.0), (60, 0, 20.0), (60, 40, 20.0))


def square(east: float, north: float, side: float) -> tuple:
    corners = [(0, 0), (side, 0), (side, side), (0, side), (0, 0)]
    return tuple((*at(east + e, north + n), None) for e, n in corners)


FIELD = Area((square(20, 20, 60),))
PIT = Area((square(20, 20, 60), square(30, 26, 34)))


def levels(items) -> list[tuple[float, float]]:
    frame = LocalFrame(HOME)
    return [
        frame.to_local((i.latitude_deg, i.longitude_deg)) for i in items if i.command == WAYPOINT
    ]


@pytest.mark.parametrize("firmware", [Firmware.ARDUPILOT, Firmware.PX4])
def test_a_route_is_uploaded_and_flown_to_its_end(firmware) -> None:
    async def main(bench) -> None:
        end = await bench.do("single_vehicle_routing", route=L_SHAPE, speed=4.0)
        assert end.state is SUCCEEDED, end
        assert (bench.body.east, bench.body.north) == pytest.approx((60, 40), abs=0.1)
        assert bench.told == ["upload", "start_mission"]
        first = bench.body.mission[0]
        assert (first.command, first.frame, first.params[1]) == (CHANGE_SPEED, 2, 4.0)

    play(Body(firmware=firmware).fly(), main)


@pytest.mark.parametrize(
    ("way", "asked", "stored"),
    [
        (L_SHAPE, {}, (3, 20.0)),
        (route((9, 9, 500.0), frame="amsl"), {}, (0, 500.0)),
        (route((9, 9, 25.0), frame="terrain"), {}, (10, 25.0)),
        (route((9, 9, None)), {}, (3, 33.0)),
        (L_SHAPE, {"altitude": 12.0}, (3, 12.0)),
        (L_SHAPE, {"altitude": 520.0, "altitude_frame": "amsl"}, (0, 520.0)),
    ],
)
def test_waypoints_have_the_altitude_and_frame_that_were_asked_for(way, asked, stored) -> None:
    async def main(bench) -> None:
        await bench.start("r1.b1", "single_vehicle_routing", "v", route=way, **asked)
        await bench.running("r1.b1")
        item = bench.body.mission[-1]
        assert (item.frame, item.altitude_m) == stored

    play(Body().fly(33.0), main)


MIXED = Route.of(
    route((30, 0, 20.0), (60, 0, 500.0), (60, 40, 30.0)).waypoints, ("relative", "amsl", "terrain")
)


def test_each_waypoint_is_sent_in_its_own_frame() -> None:
    async def main(bench) -> None:
        await bench.start("r1.b1", "single_vehicle_routing", "v", route=MIXED)
        await bench.running("r1.b1")
        sent = [(item.frame, item.altitude_m) for item in bench.body.mission]
        assert sent == [(3, 20.0), (0, 500.0), (10, 30.0)]
        await bench.until(lambda: way_left(bench).frames == ("relative", "amsl", "terrain"), 20)

    play(Body().fly(33.0), main)


FAST_THEN_SLOW = replace(L_SHAPE, speeds_m_s=(8.0, 2.0, None))


@pytest.mark.parametrize("firmware", [Firmware.ARDUPILOT, Firmware.PX4])
def test_waypoints_are_left_at_their_own_speeds(firmware) -> None:
    async def main(bench) -> None:
        end = await bench.do("single_vehicle_routing", route=FAST_THEN_SLOW)
        assert end.state is SUCCEEDED, end
        commands = [(item.command, item.params[1]) for item in bench.body.mission]
        assert commands == [
            (WAYPOINT, 2.0),
            (CHANGE_SPEED, 8.0),
            (WAYPOINT, 2.0),
            (CHANGE_SPEED, 2.0),
            (WAYPOINT, 2.0),
        ]

    play(Body(firmware=firmware).fly(), main)


def test_a_speed_of_the_task_replaces_those_of_waypoints() -> None:
    async def main(bench) -> None:
        await bench.do("single_vehicle_routing", route=FAST_THEN_SLOW, speed=4.0)
        speeds = [item.params[1] for item in bench.body.mission if item.command == CHANGE_SPEED]
        assert speeds == [4.0]

    play(Body().fly(), main)


def test_after_a_hold_the_vehicle_has_the_speed_of_the_waypoint_again() -> None:
    async def main(bench) -> None:
        await bench.start("r1.b1", "single_vehicle_routing", "v", route=FAST_THEN_SLOW)
        await bench.until(lambda: bench.body.current == 4, 90)
        await bench.until(lambda: way_left(bench).speeds_m_s == (2.0, None), 20)
        await bench.arbiter.hold("v")
        await bench.clock.sleep(20)
        await bench.arbiter.resume("v")
        assert (await bench.ended("r1.b1", 90)).state is SUCCEEDED
        sent = [call[:2] for call in bench.body.calls]
        assert sent[2:] == [("stop",), ("start_mission", 4), ("set_speed", 2.0)]

    play(Body().fly(), main)


def test_the_way_back_of_a_loop_has_the_speed_of_the_last_waypoint() -> None:
    async def main(bench) -> None:
        way = replace(L_SHAPE, speeds_m_s=(8.0, None, 3.0))
        await bench.start("r1.b1", "single_vehicle_routing", "v", route=way, loop=True)
        await bench.until(lambda: bench.told.count("start_mission") == 2, 300)
        await bench.until(lambda: bench.told[-1] == "set_speed", 10)
        assert bench.body.calls[-1][:2] == ("set_speed", 3.0)

    play(Body().fly(), main)


def test_the_speeds_of_a_stored_route_are_known_after_a_restart() -> None:
    async def main(bench, reference: str) -> None:
        assert (await bench.arbiter.query("r1.b1", reference)).state is RUNNING
        assert (await bench.ended("r1.b1", 600)).state is SUCCEEDED
        assert way_left(bench).speeds_m_s[0] == 2.0

    speeds = (*(5.0 for _ in LONG_ROUTE.waypoints[:-2]), 2.0, None)
    after_a_restart(
        Body().fly(), "single_vehicle_routing", main, route=replace(LONG_ROUTE, speeds_m_s=speeds)
    )


def test_a_route_of_a_rover_lies_on_the_ground() -> None:
    async def main(bench) -> None:
        assert (await bench.do("single_vehicle_routing", route=L_SHAPE)).state is SUCCEEDED
        assert {item.altitude_m for item in bench.body.mission} == {0.0}

    play(Body("ground"), main)


def test_a_route_that_is_a_loop_begins_again_until_it_is_cancelled() -> None:
    async def main(bench) -> None:
        await bench.start("r1.b1", "single_vehicle_routing", "v", route=L_SHAPE, loop=True)
        await bench.until(lambda: bench.told.count("start_mission") == 3, 300)
        assert bench.states_of("r1.b1")[-1] is RUNNING
        await bench.arbiter.cancel("r1.b1", 1)
        assert (await bench.ended("r1.b1", 10)).state is BehaviorState.CANCELLED

    play(Body().fly(), main)


def test_a_long_route_is_uploaded_whole() -> None:
    way = route(*((i * 2.0, 0, 20.0) for i in range(600)))

    async def main(bench) -> None:
        await bench.start("r1.b1", "single_vehicle_routing", "v", route=way)
        await bench.running("r1.b1")
        assert len(bench.body.mission) == 600
        assert len(bench.of("r1.b1")[0].native_ref) < 400

    play(Body().fly(), main)


def test_after_a_hold_the_mission_goes_on_where_it_was() -> None:
    async def main(bench) -> None:
        await bench.start("r1.b1", "single_vehicle_routing", "v", route=L_SHAPE, speed=4.0)
        await bench.until(lambda: bench.body.current == 2, 60)
        await bench.arbiter.hold("v")
        await bench.clock.sleep(20)
        await bench.arbiter.resume("v")
        assert (await bench.ended("r1.b1", 60)).state is SUCCEEDED
        sent = [call[:2] for call in bench.body.calls]
        assert sent[2:] == [("stop",), ("start_mission", 2), ("set_speed", 4.0)]

    play(Body().fly(), main)


def test_a_hold_before_the_upload_has_ended_begins_anew_afterwards() -> None:
    async def main(bench) -> None:
        bench.body.stuck.add("upload")
        await bench.start("r1.b1", "single_vehicle_routing", "v", route=L_SHAPE)
        await bench.clock.sleep(1)
        await bench.arbiter.hold("v")
        await bench.until(lambda: "stop" in bench.told, 0.5)
        assert "stop" in bench.told, "a hold does not wait for an exchange in flight"
        bench.body.stuck.clear()
        await bench.arbiter.resume("v")
        assert (await bench.ended("r1.b1", 60)).state is SUCCEEDED
        assert bench.told == ["upload", "stop", "upload", "start_mission"]

    play(Body().fly(), main)


def test_a_refused_upload_fails_with_the_vehicles_reason() -> None:
    async def main(bench) -> None:
        bench.body.refuses["upload"] = "no space for 3 items"
        end = await bench.do("single_vehicle_routing", route=L_SHAPE)
        assert (end.state, end.reason) == (BehaviorState.FAILED, "no space for 3 items")

    play(Body().fly(), main)


def test_a_survey_passes_over_the_whole_area() -> None:
    async def main(bench) -> None:
        end = await bench.do("area_survey", area=FIELD, spacing=20.1, altitude=30.0, heading=0.0)
        assert end.state is SUCCEEDED
        passes = levels(bench.body.mission)
        assert [round(east) for east, _ in passes] in (
            [30, 30, 50, 50, 70, 70],
            [70, 70, 50, 50, 30, 30],
        )
        assert {round(north) for _, north in passes} == {20, 80}
        assert {item.altitude_m for item in bench.body.mission} == {30.0}

    play(Body().fly(), main)


def test_a_survey_overshoots_and_begins_at_its_nearer_end() -> None:
    async def main(bench) -> None:
        await bench.start(
            "r1.b1", "area_survey", "v", area=FIELD, spacing=20.0, heading=0.0, overshoot=5.0
        )
        await bench.running("r1.b1")
        passes = levels(bench.body.mission)
        assert {round(north) for _, north in passes} == {15, 85}
        assert math.dist(passes[0], (200, 85)) < math.dist(passes[-1], (200, 85))

    play(Body(east=200.0, north=85.0).fly(), main)


def test_a_survey_with_too_many_passes_is_rejected_by_its_spacing() -> None:
    async def main(bench) -> None:
        huge = Area((square(0, 0, 9000),))
        end = await bench.do("area_survey", area=huge, spacing=0.5)
        assert end.state is BehaviorState.REJECTED
        assert "spacing" in end.reason

    play(Body().fly(), main)


def test_an_orbit_is_one_turn_of_waypoints_round_the_circle() -> None:
    async def main(bench) -> None:
        center = Point((*at(50, 0), 25.0))
        assert (await bench.do("orbit", target=center, radius=20.0)).state is SUCCEEDED
        around = levels(bench.body.mission)
        assert all(math.dist(place, (50, 0)) == pytest.approx(20, abs=0.1) for place in around)
        assert around[0] == pytest.approx((30, 0), abs=0.1), "begun at the near side"
        assert around[0] == pytest.approx(around[-1], abs=0.1)
        turn = [math.atan2(n, e - 50) for e, n in around[:3]]
        assert all(math.remainder(b - a, math.tau) < 0 for a, b in pairwise(turn))

    play(Body().fly(), main)


@pytest.mark.parametrize("circles", [True, False])
@pytest.mark.parametrize(
    ("asked", "lasts_s"),
    [({"turns": 2.0}, 2 * math.tau * 20 / 5), ({"duration": 60.0}, 60.0), ({"turns": 0.0}, 0.0)],
)
def test_an_orbit_lasts_its_turns_or_its_duration(circles, asked, lasts_s) -> None:
    async def main(bench) -> None:
        began_us = bench.clock.now_us()
        center = Point((*at(0, 0), 20.0))
        end = await bench.do("orbit", target=center, radius=20.0, speed=5.0, **asked)
        assert end.state is SUCCEEDED
        took_s = (bench.clock.now_us() - began_us) / 1e6
        assert took_s == pytest.approx(lasts_s, abs=0.1 * lasts_s + 3.0)
        assert ("orbit" in bench.told) is (circles and lasts_s > 0)

    play(Body(east=20.0, circles=circles).fly(), main)


def test_an_area_is_observed_from_a_circle_over_it_for_the_duration() -> None:
    async def main(bench) -> None:
        end = await bench.do("area_observe", area=FIELD, altitude=40.0, duration=90.0)
        assert end.state is SUCCEEDED
        around = levels(bench.body.mission)
        radii = [math.dist(place, (50, 50)) for place in around]
        assert radii == pytest.approx([30 * math.sqrt(2)] * len(radii), abs=0.2)

    play(Body().fly(), main)


def test_a_rover_observes_an_area_from_its_edge_until_it_is_cancelled() -> None:
    async def main(bench) -> None:
        await bench.start("r1.b1", "area_observe", "v", area=FIELD)
        await bench.clock.sleep(120)
        assert bench.states_of("r1.b1")[-1] is RUNNING
        assert (bench.body.east, bench.body.north) == pytest.approx((20, 20), abs=3)
        await bench.arbiter.cancel("r1.b1", 1)
        assert (await bench.ended("r1.b1", 10)).state is BehaviorState.CANCELLED

    play(Body("ground"), main)


def test_an_onboard_mission_is_flown_from_an_item_on() -> None:
    async def main(bench) -> None:
        bench.body.mission = stored()
        assert (await bench.do("run_onboard_mission", first=1)).state is SUCCEEDED
        assert bench.body.calls == [("downloaded",), ("start_mission", 1)]
        assert bench.body.east == pytest.approx(40, abs=0.1)

    play(Body().fly(), main)


def stored() -> tuple[MissionItem, ...]:
    return tuple(MissionItem(WAYPOINT, 3, (0.0,) * 4, *at(e, 0), 20.0) for e in (20, 30, 40))


@pytest.mark.parametrize(
    ("mission", "first", "said"),
    [((), 0, "no mission is stored"), (stored(), 3, "no item 3")],
)
def test_an_onboard_mission_that_is_not_there_fails(mission, first, said) -> None:
    async def main(bench) -> None:
        bench.body.mission = mission
        end = await bench.do("run_onboard_mission", first=first)
        assert end.state is BehaviorState.FAILED
        assert said in end.reason
        assert bench.body.current is None

    play(Body().fly(), main)


FOUND = [
    ("single_vehicle_routing", Body().fly(), {"route": L_SHAPE}),
    ("area_survey", Body().fly(), {"area": FIELD}),
    ("area_survey", Body().fly(), {"area": PIT}),
    ("orbit", Body().fly(), {"target": Point((*at(50, 0), 25.0))}),
    ("orbit", Body(circles=True).fly(), {"target": Point((*at(30, 0), 25.0)), "turns": 2.0}),
    ("area_observe", Body().fly(), {"area": FIELD, "duration": 60.0}),
    ("area_observe", Body("ground"), {"area": FIELD, "duration": 60.0}),
]


@pytest.mark.parametrize(("behavior", "body", "parameters"), FOUND)
def test_a_mission_is_found_again_after_a_restart_and_goes_on(behavior, body, parameters) -> None:
    async def main(bench, reference: str) -> None:
        assert (await bench.arbiter.query("r1.b1", reference)).state is RUNNING
        assert not set(bench.told) - {"downloaded"}, "nothing is sent"
        assert (await bench.ended("r1.b1", 600)).state is SUCCEEDED
        assert "upload" not in bench.told

    after_a_restart(body, behavior, main, **parameters)


LONG_ROUTE = route((30, 0, 20.0), (130, 0, 20.0), (130, 100, 20.0))


def way_left(bench) -> Route:
    """The route that is left by the last report that says so."""
    said = [each for each in bench.of("r1.b1") if each.remaining]
    return left(said[-1], "single_vehicle_routing")["route"] if said else Route(())


def left(report, behavior: str) -> dict:
    spec = SHARED[behavior, BehaviorType.VEHICLE]
    return resolve(spec, report.remaining, lambda _: None, ())


def survey_left_m(report) -> float:
    """Return the length of the passes over the area that is left."""
    values, frame = left(report, "area_survey"), LocalFrame(HOME)
    rings = [[frame.to_local(corner[:2]) for corner in ring] for ring in values["area"].rings]
    points = lawn_mower(rings, values["spacing"], math.pi / 2 - values["heading"])
    return sum(math.dist(*points[index : index + 2]) for index in range(0, len(points), 2))


def test_what_is_left_of_a_survey_is_told_on_the_way() -> None:
    async def main(bench) -> None:
        end = await bench.do("area_survey", area=FIELD, spacing=20.1, heading=0.0, altitude=30.0)
        assert end.state is SUCCEEDED
        said = [each for each in bench.of("r1.b1") if each.remaining]
        assert 10 <= len(said) <= 20
        lengths = [survey_left_m(each) for each in said]
        assert all(a >= b for a, b in pairwise(lengths)), lengths
        assert lengths[0] == pytest.approx(180.0 - 12.0, abs=12.0)
        assert lengths[-1] < 30.0
        assert left(said[-1], "area_survey")["altitude"] == 30.0

    play(Body().fly(), main)


def test_a_survey_leads_around_a_hole_of_its_area() -> None:
    async def main(bench) -> None:
        end = await bench.do("area_survey", area=PIT, spacing=20.1, heading=0.0, altitude=30.0)
        assert end.state is SUCCEEDED
        flown = LineString([(0.0, 0.0), *levels(bench.body.mission)])
        assert flown.intersection(box(30, 26, 64, 60).buffer(-0.05)).length == 0.0
        assert len(flown.coords) > 1 + 8, "and more than the ends of four passes"
        said = [left(each, "area_survey") for each in bench.of("r1.b1") if each.remaining]
        assert said
        frame = LocalFrame(HOME)
        for each in said:
            rings = [[frame.to_local(corner[:2]) for corner in ring] for ring in each["area"].rings]
            rest = Polygon(rings[0], rings[1:])
            assert rest.intersection(box(30, 26, 64, 60).buffer(-0.05)).area < 0.1

    play(Body().fly(), main)


@pytest.mark.parametrize("behavior", ["single_vehicle_routing", "area_survey"])
def test_what_is_left_is_told_after_a_restart(behavior) -> None:
    """The way is that of the stored mission: the reference has neither a route nor an area."""

    async def main(bench, reference: str) -> None:
        assert (await bench.arbiter.query("r1.b1", reference)).state is RUNNING
        assert (await bench.ended("r1.b1", 600)).state is SUCCEEDED
        said = [each for each in bench.of("r1.b1") if each.remaining]
        assert len(said) > 10
        rest = left(said[-1], behavior)
        assert rest["speed"] == 5.0
        if behavior == "area_survey":
            assert survey_left_m(said[-1]) < 30.0
        else:
            assert rest["route"].waypoints[-1][:2] == pytest.approx(at(130, 100), abs=1e-6)
            assert rest["route"].waypoints[-1][2] == pytest.approx(20.0, abs=0.01)

    way = {"area": FIELD, "spacing": 20.1} if behavior == "area_survey" else {"route": LONG_ROUTE}
    after_a_restart(Body().fly(), behavior, main, speed=5.0, **way)


def test_what_is_left_of_a_lost_vehicle_is_where_it_was_seen_last() -> None:
    async def main(bench) -> None:
        await bench.start("r1.b1", "single_vehicle_routing", "v", route=LONG_ROUTE, speed=5.0)
        assert await bench.until(lambda: bench.body.east > 90.0 and len(bench.of("r1.b1")) > 4, 100)
        east = bench.body.east
        bench.body.heard_by_us = False
        end = await bench.ended("r1.b1", 100)
        assert end.state is BehaviorState.LOST
        place = LocalFrame(HOME).to_local(
            left(end, "single_vehicle_routing")["route"].waypoints[0][:2]
        )
        assert place == pytest.approx((east, 0.0), abs=3.0)

    play(Body().fly(), main)


@pytest.mark.parametrize(
    "meanwhile",
    [
        lambda body: setattr(body, "mission", stored()),
        lambda body: setattr(body, "mode", FlightMode.HOLD),
    ],
    ids=["another mission", "another mode"],
)
def test_a_mission_that_is_not_flown_any_more_is_not_known(meanwhile) -> None:
    async def main(bench, reference: str) -> None:
        found = await bench.arbiter.query("r1.b1", reference)
        assert found.state is BehaviorState.UNKNOWN, found
        assert bench.told == ["downloaded"]

    way = route((30, 0, 20.0), (300, 0, 20.0))
    after_a_restart(Body().fly(), "single_vehicle_routing", main, meanwhile=meanwhile, route=way)


def test_a_mission_that_has_ended_meanwhile_has_succeeded() -> None:
    async def main(bench, reference: str) -> None:
        assert (await bench.arbiter.query("r1.b1", reference)).state is SUCCEEDED

    def ended(body: Body) -> None:
        for _ in range(600):
            body.step(0.1)
        body.reached = None

    after_a_restart(Body().fly(), "single_vehicle_routing", main, meanwhile=ended, route=L_SHAPE)


def test_an_onboard_mission_is_found_again_after_a_restart() -> None:
    async def main(bench, reference: str) -> None:
        assert (await bench.arbiter.query("r1.b1", reference)).state is RUNNING
        assert (await bench.ended("r1.b1", 600)).state is SUCCEEDED

    body = Body(mission=stored()).fly()
    after_a_restart(body, "run_onboard_mission", main)
