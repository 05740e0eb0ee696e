"""Taking over, being taken over, falling silent: who steers a vehicle."""

import pytest
from m2pem_plugin_mavlink import arbiter
from m2pem_plugin_mavlink.vehicle.driver import FlightMode
from mavlink_double import Body, at
from mavlink_play import V, after_a_restart, play

from m2pem.api import BehaviorState, LinkState, Point, Route

FAILED, CANCELLED, RUNNING = BehaviorState.FAILED, BehaviorState.CANCELLED, BehaviorState.RUNNING
FAR = Point((*at(800, 0), 20.0))
WAY = Route(((*at(300, 0), 20.0), (*at(300, 300), 20.0)))


async def flying(bench, behavior="goto", **parameters) -> None:
    await bench.start("r1.b1", behavior, V, **(parameters or {"target": FAR}))
    await bench.running("r1.b1")


def test_a_cancel_stops_the_vehicle_and_says_so() -> None:
    async def main(bench) -> None:
        await flying(bench)
        await bench.arbiter.cancel("r1.b1", 1)
        assert (await bench.ended("r1.b1", 10)).state is CANCELLED
        assert bench.body.mode is FlightMode.HOLD

    play(Body().fly(), main)


@pytest.mark.parametrize("stuck", ["upload", "start_mission"])
def test_a_cancel_does_not_wait_for_an_exchange_in_flight(stuck) -> None:
    async def main(bench) -> None:
        bench.body.stuck.add(stuck)
        await bench.start("r1.b1", "single_vehicle_routing", V, route=WAY)
        await bench.clock.sleep(1)
        await bench.arbiter.cancel("r1.b1", 1)
        end = await bench.ended("r1.b1", 1.0)
        assert end.state is CANCELLED

    play(Body().fly(), main)


def test_a_vehicle_that_does_not_stop_is_a_failure_within_the_bound() -> None:
    async def main(bench) -> None:
        await flying(bench)
        bench.body.stuck.add("stop")
        await bench.arbiter.cancel("r1.b1", 1)
        end = await bench.ended("r1.b1", bench.arbiter.limits(V).cancel_timeout_s)
        assert (end.state, end.code) == (FAILED, "TIMEOUT")

    play(Body().fly(), main)


def test_what_preempts_takes_over_without_a_stop() -> None:
    async def main(bench) -> None:
        await flying(bench)
        target = Point((*at(0, 40), 20.0))
        await bench.start("r1.b2", "goto", V, target=target, preempts=("r1.b1",))
        assert (await bench.ended("r1.b2", 60)).state is BehaviorState.SUCCEEDED
        assert bench.told == ["go_to", "go_to"]
        assert bench.states_of("r1.b1")[-1] is CANCELLED

    play(Body().fly(), main)


def test_what_preempts_a_cancel_in_flight_takes_over() -> None:
    async def main(bench) -> None:
        await flying(bench)
        bench.body.stuck.add("stop")
        await bench.arbiter.cancel("r1.b1", 1)
        target = Point((*at(0, 40), 20.0))
        await bench.start("r1.b2", "goto", V, target=target, preempts=("r1.b1",))
        assert (await bench.ended("r1.b2", 60)).state is BehaviorState.SUCCEEDED
        assert bench.states_of("r1.b1") == [BehaviorState.ACCEPTED, RUNNING, CANCELLED]

    play(Body().fly(), main)


@pytest.mark.parametrize(
    ("mode", "held"),
    [
        (FlightMode.MANUAL, False),
        (FlightMode.HOLD, False),
        (FlightMode.RETURN, False),
        (FlightMode.MANUAL, True),
        (FlightMode.GUIDED, True),
    ],
)
def test_a_mode_that_nobody_here_asked_for_fails_the_behavior_and_is_not_fought(mode, held) -> None:
    async def main(bench) -> None:
        await flying(bench)
        if held:
            await bench.arbiter.hold(V)
        await bench.clock.sleep(3)
        told = len(bench.told)
        bench.body.mode = mode
        end = await bench.ended("r1.b1", 10)
        assert (end.state, end.code) == (FAILED, "TAKEN_OVER"), end
        assert mode.upper() in end.reason
        await bench.clock.sleep(20)
        assert len(bench.told) == told, "nothing is sent any more"
        assert bench.body.mode is mode

    play(Body().fly(), main)


def test_after_being_taken_over_it_can_be_commanded_again() -> None:
    async def main(bench) -> None:
        await flying(bench)
        bench.body.mode = FlightMode.MANUAL
        await bench.ended("r1.b1", 10)
        await bench.start("r1.b2", "goto", V, target=Point((*at(30, 0), 20.0)))
        assert (await bench.ended("r1.b2", 60)).state is BehaviorState.SUCCEEDED

    play(Body().fly(), main)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("Battery 1 low voltage failsafe", "BATTERY_LOW"),
        ("GCS Failsafe", "FAILED"),
        ("EKF Failsafe: changed to LAND Mode", "FAILED"),
    ],
)
def test_a_failsafe_fails_the_behavior_with_its_text(text, code) -> None:
    async def main(bench) -> None:
        await flying(bench)
        bench.body.texts.append((bench.clock.now_us() / 1e6, text))
        bench.body.mode = FlightMode.RETURN
        end = await bench.ended("r1.b1", 10)
        assert (end.state, end.code) == (FAILED, code)
        assert text in end.reason

    play(Body().fly(), main)


def test_a_return_that_a_failsafe_began_before_a_restart_is_not_held() -> None:
    def low_battery(body) -> None:
        body.mode = FlightMode.RETURN

    async def main(bench, reference) -> None:
        assert (await bench.arbiter.query("r1.b1", reference)).state is BehaviorState.UNKNOWN
        await bench.arbiter.hold(V)
        await bench.clock.sleep(5)
        assert bench.body.mode is FlightMode.RETURN
        assert "stop" not in bench.told

    after_a_restart(Body().fly(), "goto", main, meanwhile=low_battery, target=FAR)


@pytest.mark.parametrize("mode", [FlightMode.GUIDED, FlightMode.MANUAL, FlightMode.RETURN])
def test_a_vehicle_that_is_silent_after_a_restart_is_held_when_it_is_back(mode) -> None:
    """Unless a pilot steers it by then, or it returns by itself."""

    def silent(body) -> None:
        body.heard_by_us = False

    async def main(bench, reference) -> None:
        assert (await bench.arbiter.query("r1.b1", reference)).state is BehaviorState.UNKNOWN
        await bench.arbiter.hold(V)
        await bench.clock.sleep(20)
        assert bench.body.mode is FlightMode.GUIDED
        bench.body.mode, bench.body.heard_by_us = mode, True
        await bench.clock.sleep(5)
        assert bench.body.mode is (FlightMode.HOLD if mode is FlightMode.GUIDED else mode)
        assert ("stop" in bench.told) == (mode is FlightMode.GUIDED)

    after_a_restart(Body().fly(), "goto", main, meanwhile=silent, target=FAR)


@pytest.mark.parametrize("resumed", [False, True])
def test_a_vehicle_that_falls_silent_is_held_when_it_is_back_unless_it_was_resumed(resumed) -> None:
    async def main(bench) -> None:
        await flying(bench)
        bench.body.heard_by_us = False
        await bench.arbiter.hold(V)
        await bench.clock.sleep(8)
        if resumed:
            await bench.arbiter.resume(V)
        bench.body.heard_by_us = True
        await bench.clock.sleep(8)
        assert (bench.body.mode is FlightMode.HOLD) is not resumed
        assert bench.states_of("r1.b1")[-1] is RUNNING

    play(Body().fly(), main, lost_after_s=60.0)


def test_a_mission_that_somebody_else_disarms_fails() -> None:
    async def main(bench) -> None:
        await flying(bench, "goto", target=Point((*at(300, 0), None)))
        bench.body.armed = False
        end = await bench.ended("r1.b1", 10)
        assert (end.state, end.code) == (FAILED, "TAKEN_OVER")
        assert "disarmed" in end.reason

    play(Body("ground"), main)


@pytest.mark.parametrize("mode", [FlightMode.RETURN, FlightMode.LAND])
def test_a_failsafe_that_has_just_begun_is_interrupted_by_no_cancel_and_no_hold(mode) -> None:
    """A change of mode is judged only when there was time for the text that explains it."""

    async def main(bench) -> None:
        await flying(bench)
        await bench.clock.sleep(2)
        told = list(bench.told)
        bench.body.mode = mode
        await bench.clock.sleep(0.2)
        await bench.arbiter.hold(V)
        await bench.clock.sleep(0.2)
        await bench.arbiter.cancel("r1.b1", 1)
        end = await bench.ended("r1.b1", 10)
        assert (end.state, end.code) == (FAILED, "TAKEN_OVER")
        await bench.arbiter.hold(V)
        await bench.clock.sleep(5)
        assert (bench.body.mode, bench.told) == (mode, told)

    play(Body().fly(), main)


def test_a_behavior_that_fails_does_not_interrupt_a_failsafe() -> None:
    async def main(bench) -> None:
        bench.body.refuses["start_mission"] = "no"
        bench.body.mode = FlightMode.RETURN
        await bench.clock.sleep(1)
        await bench.start("r1.b1", "single_vehicle_routing", V, route=WAY)
        assert (await bench.ended("r1.b1", 20)).state is FAILED
        assert bench.body.mode is FlightMode.RETURN
        assert "stop" not in bench.told

    play(Body().fly(), main)


def test_an_autopilot_that_restarts_in_flight_has_not_been_taken_over() -> None:
    async def main(bench) -> None:
        await bench.start("r1.b1", "land", V)
        await bench.running("r1.b1")
        bench.body.armed = False
        await bench.clock.sleep(1)
        bench.body.boots += 1
        end = await bench.ended("r1.b1", 10)
        assert (end.state, end.code) == (FAILED, "FAILED")
        assert "its autopilot has restarted" in end.reason

    play(Body().fly(40), main)


@pytest.mark.parametrize(
    ("behavior", "parameters"),
    [("goto", {"target": FAR}), ("single_vehicle_routing", {"route": WAY})],
)
def test_a_vehicle_that_should_move_and_does_not_is_a_failure(behavior, parameters) -> None:
    async def main(bench) -> None:
        await flying(bench, behavior, **parameters)
        await bench.clock.sleep(10)
        bench.body.speed = 0.0
        bench.body.texts.append((bench.clock.now_us() / 1e6, "Motor failure"))
        await bench.clock.sleep(30)
        await bench.arbiter.hold(V)
        await bench.clock.sleep(300)
        assert bench.states_of("r1.b1")[-1] is RUNNING, "who is held may stand"
        await bench.arbiter.resume(V)
        await bench.clock.sleep(1)
        bench.body.speed = 0.0
        bench.body.texts.append((bench.clock.now_us() / 1e6, "Motor failure"))
        end = await bench.ended("r1.b1", 70)
        assert end.state is FAILED
        assert "has not moved for 60 s" in end.reason
        assert "Motor failure" in end.reason

    play(Body().fly(), main)


@pytest.mark.parametrize(("behavior", "after_s"), [("land", 60), ("return_to_launch", 120)])
def test_a_landing_that_hangs_is_a_failure_and_goes_on(behavior: str, after_s: int) -> None:
    """A tree, or a motor: to leave that mode would make it no better."""

    async def main(bench) -> None:
        bench.body.east = 200.0
        await bench.start("r1.b1", behavior, V)
        await bench.running("r1.b1")
        await bench.clock.sleep(2)
        bench.body.speed = 0.0
        before = len(bench.told)
        end = await bench.ended("r1.b1", after_s + 10)
        assert end.state is FAILED
        assert f"has not moved for {after_s} s" in end.reason
        assert "stop" not in bench.told[before:]
        assert bench.body.mode in (FlightMode.LAND, FlightMode.RETURN)

    play(Body().fly(40), main)


def test_a_vehicle_is_lost_after_the_time_that_was_set_and_not_before() -> None:
    async def main(bench) -> None:
        await flying(bench)
        bench.body.heard_by_us = False
        await bench.clock.sleep(9.7)
        assert bench.states_of("r1.b1")[-1] is RUNNING
        assert (await bench.ended("r1.b1", 0.5)).state is BehaviorState.LOST

    play(Body().fly(), main, lost_after_s=10.0)


def test_a_silent_vehicle_is_lost_and_its_state_says_so() -> None:
    async def main(bench) -> None:
        await flying(bench)
        bench.body.heard_by_us = False
        end = await bench.ended("r1.b1", 3.0)
        assert (end.state, end.code) == (BehaviorState.LOST, "LINK_LOST")
        await bench.clock.sleep(1)
        assert bench.latest(V).link is LinkState.LOST

    play(Body().fly(), main)


def test_a_change_of_mode_is_in_its_state_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    async def main(bench) -> None:
        await flying(bench)
        await bench.clock.sleep(1)
        monkeypatch.setattr(arbiter, "TELEMETRY_EVERY_S", 60.0)
        await bench.clock.sleep(1)
        before = bench.latest(V).mode
        bench.body.mode = FlightMode.RETURN
        assert await bench.until(lambda: bench.latest(V).mode != before, 2.0)

    play(Body().fly(), main)


def test_a_vehicle_that_was_never_heard_is_lost_and_it_is_said_where_it_was_expected() -> None:
    async def main(bench) -> None:
        end = await bench.do("goto", 10.0, target=FAR)
        assert end.state is BehaviorState.LOST
        assert end.reason == (
            "no message of system 1 has ever arrived on udpin://127.0.0.1:14550: is its "
            "autopilot, or the simulation of it, running, and does it send there?"
        )
        assert bench.told == []

    play(Body(heard_by_us=False), main)


def test_a_lost_vehicle_that_comes_back_can_be_commanded() -> None:
    async def main(bench) -> None:
        await flying(bench)
        bench.body.heard_by_us = False
        await bench.ended("r1.b1", 5)
        bench.body.heard_by_us = True
        await bench.clock.sleep(1)
        await bench.start("r1.b2", "goto", V, target=Point((*at(30, 0), 20.0)))
        assert (await bench.ended("r1.b2", 60)).state is BehaviorState.SUCCEEDED

    play(Body().fly(), main)


@pytest.mark.parametrize("mode", [FlightMode.RETURN, FlightMode.LAND])
def test_a_lost_vehicle_that_comes_back_in_a_failsafe_is_not_interrupted(mode) -> None:
    async def main(bench) -> None:
        await flying(bench)
        bench.body.heard_by_us = False
        await bench.ended("r1.b1", 5)
        bench.body.mode, bench.body.heard_by_us = mode, True
        await bench.clock.sleep(1)
        told = list(bench.told)
        why = await bench.arbiter.reclaim(V)
        assert "is not interrupted: free when it stops" in why
        assert mode.name in why.upper()
        while await bench.arbiter.reclaim(V):
            await bench.clock.sleep(1)
        assert bench.body.landed
        assert bench.told == told

    play(Body().fly(), main)


@pytest.mark.parametrize("mode", [FlightMode.MANUAL, FlightMode.HOLD])
def test_a_lost_vehicle_that_somebody_else_has_stopped_is_left_alone(mode) -> None:
    async def main(bench) -> None:
        await flying(bench)
        bench.body.heard_by_us = False
        await bench.ended("r1.b1", 5)
        bench.body.mode, bench.body.heard_by_us = mode, True
        await bench.clock.sleep(1)
        told = list(bench.told)
        assert await bench.arbiter.reclaim(V) == ""
        assert bench.told == told

    play(Body().fly(), main)


def test_states_say_what_the_vehicle_does() -> None:
    async def main(bench) -> None:
        await flying(bench)
        await bench.clock.sleep(1)
        assert bench.latest(V).behavior == "goto"

    play(Body().fly(), main)


def test_a_start_whose_answer_was_lost_is_looked_for_before_it_is_sent_again() -> None:
    """The executive crashed before it heard of the start, and so has no reference."""

    async def main(bench, _: str) -> None:
        await bench.arbiter.query("r1.b1", None)
        await bench.start("r1.b1", "goto", V, target=FAR)
        await bench.running("r1.b1")
        assert bench.told == []
        assert (await bench.ended("r1.b1", 300)).state is BehaviorState.SUCCEEDED

    after_a_restart(Body().fly(), "goto", main, target=FAR)


def test_an_executive_that_comes_back_finds_nothing_on_an_idle_vehicle_and_starts_it() -> None:
    async def main(bench) -> None:
        await bench.arbiter.query("r1.b1", None)
        await flying(bench)
        assert bench.told == ["go_to"]

    play(Body().fly(), main)


@pytest.mark.parametrize("reference", ["", "{}", "[1]", '{"v":9}', "nonsense", "null"])
def test_a_reference_of_somebody_else_is_not_known(reference) -> None:
    async def main(bench) -> None:
        found = await bench.arbiter.query("r1.b1", reference)
        assert found.state is BehaviorState.UNKNOWN
        assert bench.told == []

    play(Body().fly(), main)


def test_what_is_held_on_the_ground_and_disarms_itself_takes_off_after_the_hold() -> None:
    async def main(bench) -> None:
        await bench.start("r1.b1", "takeoff", V, altitude=20.0)
        await bench.running("r1.b1")
        await bench.arbiter.hold(V)
        await bench.clock.sleep(1)
        bench.body.up, bench.body.armed = 0.0, False
        await bench.clock.sleep(20)
        assert bench.states_of("r1.b1")[-1] is RUNNING
        await bench.arbiter.resume(V)
        assert (await bench.ended("r1.b1", 60)).state is BehaviorState.SUCCEEDED

    play(Body(), main)


@pytest.mark.parametrize("failsafe", ["return_to_launch", ""])
def test_a_failsafe_that_is_not_the_fleets_is_told_at_connect(failsafe, caplog) -> None:
    async def main(bench) -> None:
        await bench.clock.sleep(2)
        assert bench.states[-1].failsafe_problems == (("FS_GCS_ENABLE is 0",) if failsafe else None)

    caplog.set_level("WARNING")
    body = Body(findings=["FS_GCS_ENABLE is 0"])
    play(body, main, failsafe=failsafe)
    assert ("FS_GCS_ENABLE is 0" in caplog.text) is bool(failsafe)


def test_a_failsafe_that_changes_is_said_and_published(caplog) -> None:
    body = Body(findings=["FS_GCS_ENABLE is 0"])

    async def main(bench) -> None:
        await bench.clock.sleep(2)
        body.findings = ["FS_GCS_ENABLE is 0", "RTL_ALT is 0"]
        await bench.clock.sleep(2)
        assert bench.states[-1].failsafe_problems == ("FS_GCS_ENABLE is 0", "RTL_ALT is 0")
        body.findings = []
        await bench.clock.sleep(2)
        assert bench.states[-1].failsafe_problems == ()

    caplog.set_level("INFO")
    play(body, main, failsafe="return_to_launch")
    assert caplog.text.count("FS_GCS_ENABLE is 0") == 1
    assert caplog.text.count("RTL_ALT is 0") == 1
    assert "its failsafes are as the fleet says now" in caplog.text
