import math

import pytest
import shapely
from m2pem_plugin_mavlink.vehicle.driver import FlightMode
from mavlink_double import Body, at
from mavlink_play import V, after_a_restart, play

from m2pem.api import Area, BehaviorState, Fence, Point, Route


def ring(*corners: tuple[float, float]) -> tuple:
    return tuple((*at(*corner), None) for corner in (*corners, corners[0]))


HOLE_M = ((40, 40), (60, 40), (60, 60), (40, 60))
HOLE = ring(*HOLE_M)
RIM = ring((0, 0), (100, 0), (100, 100), (0, 100))
FIELD = Fence(Area((RIM, HOLE)))


@pytest.mark.parametrize(
    ("behavior", "parameters", "said"),
    [
        ("goto", {"target": Point((*at(130, 10), None))}, "the target"),
        ("goto", {"target": Point((*at(90, 50), None))}, "the way to the target"),
        (
            "single_vehicle_routing",
            {"route": Route(((*at(20, 10), 9.0), (*at(20, 130), 9.0)))},
            "waypoint 2 of the route",
        ),
        (
            "single_vehicle_routing",
            {
                "route": Route(((*at(10, 70), 9.0), (*at(50, 70), 9.0), (*at(90, 30), 9.0))),
                "loop": True,
            },
            "between waypoint 3 of the route and waypoint 1",
        ),
        (
            "area_survey",
            {"area": Area((ring((60, 0), (90, 0), (90, 30), (60, 30)),)), "overshoot": 15.0},
            "of the survey",
        ),
        ("orbit", {"target": Point((*at(20, 20), None)), "radius": 25.0}, "a point of the circle"),
        ("area_observe", {"target": Point((*at(50, 15), None))}, "circle"),
    ],
)
def test_what_would_leave_the_fence_is_rejected_before_anything_is_sent(
    behavior, parameters, said
) -> None:
    async def main(bench) -> None:
        end = await bench.do(behavior, **parameters)
        assert end.state is BehaviorState.REJECTED, end
        assert said in end.reason
        assert "fence" in end.reason
        assert bench.told == []

    play(Body(east=10.0, north=50.0).fly(), main, fence=FIELD)


def test_a_circle_is_checked_between_the_corners_of_its_polygon() -> None:
    """Of 16 sides, which keep within 29.5 m of the centre to the south; the circle does not."""

    async def main(bench) -> None:
        end = await bench.do("orbit", target=Point((*at(50, 29.7), None)), radius=30.0)
        assert end.state is BehaviorState.REJECTED
        assert "a point of the circle" in end.reason
        assert bench.told == []

    angle = math.pi / 2 + math.tau / 32
    start = (50 + 35 * math.cos(angle), 29.7 + 35 * math.sin(angle))
    hole_free = Fence(Area((RIM,)))
    play(Body(east=start[0], north=start[1]).fly(), main, fence=hole_free)


def test_a_reverse_out_of_the_fence_is_rejected() -> None:
    async def main(bench) -> None:
        end = await bench.do("reverse", distance=20.0)
        assert end.state is BehaviorState.REJECTED
        assert "10 m outside" in end.reason
        assert bench.told == []

    play(Body("ground", east=10.0, north=10.0), main, fence=FIELD)


def test_within_the_fence_all_is_well() -> None:
    async def main(bench) -> None:
        end = await bench.do("goto", target=Point((*at(90, 20), None)))
        assert end.state is BehaviorState.SUCCEEDED
        await bench.start("r1.b2", "orbit", V, target=Point((*at(80, 20), None)), radius=10.0)
        assert (await bench.ended("r1.b2", 120)).state is BehaviorState.SUCCEEDED

    play(Body(east=10.0, north=20.0).fly(), main, fence=FIELD)


@pytest.mark.parametrize("domain", ["air", "ground"])
def test_a_return_leads_around_what_is_kept_out(domain) -> None:
    async def main(bench) -> None:
        await bench.start("r1.b1", "return_to_launch", V)
        await bench.running("r1.b1")
        track = [(bench.body.east, bench.body.north)]
        while not bench.states_of("r1.b1")[-1].terminal:
            await bench.clock.sleep(0.1)
            track.append((bench.body.east, bench.body.north))
        assert (await bench.ended("r1.b1", 1)).state is BehaviorState.SUCCEEDED
        hole = shapely.Polygon(HOLE_M)
        assert not shapely.LineString(track).intersects(hole)
        assert bench.told[0] == "go_to"
        assert "return_home" in bench.told

    body = Body(domain, east=85.0, north=85.0)
    play(body.fly() if domain == "air" else body, main, fence=FIELD)


def test_a_return_with_no_way_around_is_done_and_said(caplog) -> None:
    moat = Fence(Area((RIM, ring((-5, 40), (110, 40), (110, 60), (-5, 60)))))

    async def main(bench) -> None:
        end = await bench.do("return_to_launch")
        assert end.state is BehaviorState.SUCCEEDED
        assert bench.told[0] == "return_home"

    play(Body(east=10.0, north=90.0).fly(), main, fence=moat)
    assert "returns: the way to its home leaves the fleet's fence by 10 m" in caplog.text


def test_a_vehicle_that_refuses_the_way_around_returns_all_the_same(caplog) -> None:
    async def main(bench) -> None:
        end = await bench.do("return_to_launch")
        assert end.state is BehaviorState.SUCCEEDED
        assert bench.told[:2] == ["go_to", "return_home"]

    body = Body(east=85.0, north=85.0).fly()
    body.refuses["go_to"] = "no position"
    play(body, main, fence=FIELD)
    assert "returns on a straight line" in caplog.text


def test_a_vehicle_that_stays_on_its_way_around_returns_all_the_same(caplog) -> None:
    async def main(bench) -> None:
        await bench.start("r1.b1", "return_to_launch", V)
        await bench.running("r1.b1")
        bench.body.speed = 0.0
        assert await bench.until(lambda: "return_home" in bench.told, 60)

    play(Body(east=85.0, north=85.0).fly(), main, fence=FIELD)
    assert "it does not move on" in caplog.text


def held(body: Body) -> None:
    body.mode = FlightMode.HOLD


@pytest.mark.parametrize(
    ("meanwhile", "state", "told"),
    [
        (lambda body: None, "RUNNING", ["go_to", "return_home"]),
        (lambda body: body.step(60.0), "RUNNING", ["go_to", "return_home"]),  # it hovers there
        (held, "UNKNOWN", []),
    ],
)
def test_a_return_that_leads_around_goes_on_after_a_restart(meanwhile, state, told) -> None:
    async def main(bench, reference) -> None:
        report = await bench.arbiter.query("r1.b1", reference)
        assert report.state == state
        if told:
            assert (await bench.ended("r1.b1", 300)).state is BehaviorState.SUCCEEDED
        assert bench.told == told

    body = Body(east=85.0, north=85.0).fly()
    after_a_restart(body, "return_to_launch", main, meanwhile=meanwhile, fence=FIELD)
