import pytest
from m2pem_plugin_mavlink.vehicle.driver import FlightMode
from mavlink_double import Body, at
from mavlink_play import V, after_a_restart, play

from m2pem.api import BehaviorState

SUCCEEDED, RUNNING, UNKNOWN = (
    BehaviorState.SUCCEEDED,
    BehaviorState.RUNNING,
    BehaviorState.UNKNOWN,
)


def test_a_takeoff_ends_when_the_vehicle_says_it_is_up() -> None:
    async def main(bench) -> None:
        end = await bench.do("takeoff", altitude=20.0)
        assert end.state is SUCCEEDED
        assert bench.body.up == pytest.approx(20.0, abs=1.0)
        assert bench.told == ["take_off"]

    play(Body(), main)


def test_a_takeoff_above_the_sea_is_told_above_home() -> None:
    async def main(bench) -> None:
        await bench.do("takeoff", altitude=500.0, altitude_frame="amsl")
        assert bench.body.calls == [("take_off", 12.0)]

    play(Body(), main)


def test_a_takeoff_to_below_home_is_rejected() -> None:
    async def main(bench) -> None:
        end = await bench.do("takeoff", altitude=470.0, altitude_frame="amsl")
        assert end.state is BehaviorState.REJECTED
        assert "altitude" in end.reason
        assert "-18 m above its home" in end.reason
        assert bench.told == []

    play(Body(), main)


def test_a_takeoff_that_was_held_on_the_way_climbs_on() -> None:
    async def main(bench) -> None:
        await bench.start("r1.b1", "takeoff", "v", altitude=40.0)
        await bench.until(lambda: bench.body.up > 5, 30)
        await bench.arbiter.hold("v")
        await bench.clock.sleep(10)
        assert 5 < bench.body.up < 15
        await bench.arbiter.resume("v")
        assert (await bench.ended("r1.b1", 60)).state is SUCCEEDED
        assert bench.told == ["take_off", "stop", "go_to"]

    play(Body(), main)


def test_a_change_of_altitude_climbs_over_where_the_vehicle_is() -> None:
    async def main(bench) -> None:
        assert (await bench.do("change_altitude", altitude=35.0)).state is SUCCEEDED
        assert bench.body.up == pytest.approx(35.0, abs=1.0)
        assert (bench.body.east, bench.body.north) == pytest.approx((40.0, 0.0), abs=0.1)

    play(Body(east=40.0).fly(), main)


def test_what_must_fly_is_rejected_on_the_ground() -> None:
    async def main(bench) -> None:
        end = await bench.do("change_altitude", altitude=35.0)
        assert end.state is BehaviorState.REJECTED
        assert "take off first" in end.reason

    play(Body(), main)


def test_a_landing_ends_when_the_vehicle_is_down_and_disarmed() -> None:
    async def main(bench) -> None:
        assert (await bench.do("land")).state is SUCCEEDED
        assert (bench.body.up, bench.body.armed) == (0.0, False)

    play(Body().fly(), main)


def test_landing_of_what_has_landed_sends_nothing() -> None:
    async def main(bench) -> None:
        assert (await bench.do("land")).state is SUCCEEDED
        assert bench.told == []

    play(Body(), main)


def test_return_to_launch_ends_at_home_on_the_ground() -> None:
    async def main(bench) -> None:
        assert (await bench.do("return_to_launch")).state is SUCCEEDED
        assert (bench.body.up, bench.body.armed) == (0.0, False)
        assert bench.body.east == pytest.approx(0.0, abs=0.1)

    play(Body(east=50.0).fly(), main)


@pytest.mark.parametrize(
    ("text", "code"), [("Battery 1 is low 10.4V", "BATTERY_LOW"), ("Mode LAND", "TAKEN_OVER")]
)
def test_a_landing_far_from_home_is_not_the_end_of_a_return(text, code) -> None:
    async def main(bench) -> None:
        await bench.start("r1.b1", "return_to_launch", V)
        await bench.running("r1.b1")
        await bench.clock.sleep(2)
        said = "Battery 1 low voltage failsafe" if code == "BATTERY_LOW" else text
        bench.body.texts.append((bench.clock.now_us() / 1e6, said))
        bench.body.mode = FlightMode.LAND
        end = await bench.ended("r1.b1", 10)
        assert (end.state, end.code) == (BehaviorState.FAILED, code)
        assert "from RETURN to LAND" in end.reason
        assert "stop" not in bench.told, "it lands, whatever made it"

    play(Body(east=117.0).fly(), main)


@pytest.mark.parametrize("rally", [(), (at(110.0, 0.0),)])
def test_a_return_ends_at_home_or_at_a_rally_point_and_nowhere_else(rally) -> None:
    async def main(bench) -> None:
        await bench.start("r1.b1", "return_to_launch", V)
        await bench.running("r1.b1")
        await bench.clock.sleep(1)
        bench.body.texts.append((bench.clock.now_us() / 1e6, "Crash: Disarming"))
        bench.body.up, bench.body.armed = 0.0, False
        end = await bench.ended("r1.b1", 20)
        assert end.state is (SUCCEEDED if rally else BehaviorState.FAILED)
        where = "" if rally else "it is on the ground, 11"
        assert end.reason.startswith(where)
        assert rally or "Crash: Disarming" in end.reason

    play(Body(east=117.0, rally=list(rally)).fly(), main)


def test_a_speed_that_is_refused_where_it_stands_is_that_of_what_follows() -> None:
    """A copter in BRAKE and a rover in HOLD acknowledge FAILED."""

    async def main(bench) -> None:
        bench.body.refuses["set_speed"] = "failed"
        assert (await bench.do("set_speed", speed=2.5)).state is SUCCEEDED
        await bench.start("r1.b2", "goto", V, target=_point())
        await bench.running("r1.b2")
        assert bench.body.calls[-1][2] == 2.5

    play(Body().fly(), main)


def test_a_rover_returns_and_stands_at_home() -> None:
    async def main(bench) -> None:
        assert (await bench.do("return_to_launch")).state is SUCCEEDED
        assert abs(bench.body.east) < 5

    play(Body("ground", east=50.0), main)


def test_an_aircraft_that_stands_somewhere_else_does_not_return() -> None:
    async def main(bench) -> None:
        assert (await bench.do("return_to_launch")).state is BehaviorState.REJECTED
        assert bench.told == []

    play(Body(east=50.0), main)


def test_a_speed_that_was_set_is_that_of_what_follows() -> None:
    async def main(bench) -> None:
        assert (await bench.do("set_speed", speed=2.5)).state is SUCCEEDED
        await bench.start("r1.b2", "change_altitude", "v", altitude=25.0)
        await bench.ended("r1.b2", 60)
        await bench.start("r1.b3", "orbit", "v", target=_point(), radius=10.0)
        await bench.running("r1.b3")
        assert bench.body.mission[0].params[1] == 2.5

    play(Body().fly(), main)


def _point():

    from m2pem.api import Point

    return Point((*at(0.0, 0.0), None))


@pytest.mark.parametrize(
    ("behavior", "body", "parameters"),
    [
        ("takeoff", Body(), {"altitude": 100.0}),
        ("change_altitude", Body().fly(), {"altitude": 100.0}),
        ("land", Body().fly(50.0), {}),
        ("return_to_launch", Body(east=200.0).fly(), {}),
        ("return_to_launch", Body("ground", east=200.0), {}),
    ],
)
def test_is_found_again_after_a_restart_and_goes_on(behavior, body, parameters) -> None:
    async def main(bench, reference: str) -> None:
        found = await bench.arbiter.query("r1.b1", reference)
        assert found.state is RUNNING
        assert (await bench.ended("r1.b1", 300)).state is SUCCEEDED
        assert not set(bench.told) - {"disarm"}, "nothing is sent again"

    after_a_restart(body, behavior, main, **parameters)


@pytest.mark.parametrize(
    ("behavior", "body", "parameters"),
    [
        ("takeoff", Body(), {"altitude": 100.0}),
        ("change_altitude", Body().fly(), {"altitude": 100.0}),
        ("land", Body().fly(50.0), {}),
        ("return_to_launch", Body(east=200.0).fly(), {}),
    ],
)
def test_is_not_known_after_a_restart_if_the_vehicle_does_something_else(
    behavior, body, parameters
) -> None:
    def stopped(body: Body) -> None:
        body.mode = FlightMode.MANUAL

    async def main(bench, reference: str) -> None:
        found = await bench.arbiter.query("r1.b1", reference)
        assert found.state is UNKNOWN
        assert "MANUAL" in found.reason
        assert bench.told == []

    after_a_restart(body, behavior, main, meanwhile=stopped, **parameters)


def test_what_has_ended_meanwhile_has_succeeded() -> None:
    def arrived(body: Body) -> None:
        body.up, body.armed = 0.0, False

    async def main(bench, reference: str) -> None:
        found = await bench.arbiter.query("r1.b1", reference)
        assert found.state is SUCCEEDED

    after_a_restart(Body().fly(50.0), "land", main, meanwhile=arrived)
