"""Going on at another speed: said once, kept over a hold, and obeyed by autopilots."""

import math
from collections.abc import Callable
from typing import Any

import pytest
from m2pem_plugin_mavlink.simulator.specification import Kind
from mavlink_double import Body, at
from mavlink_play import V, play
from mavlink_simulated import at as place
from mavlink_simulated import fly

from m2pem.api import BehaviorState, Point, Route

FAR = Point((*at(800, 0), 20.0))
WAY = Route(((*at(600, 0), 20.0), (*at(600, 300), 20.0)))
GOING = pytest.mark.parametrize(
    ("behavior", "parameters"),
    [
        ("goto", {"target": FAR, "speed": 8.0}),
        ("goto", {"target": FAR}),
        ("single_vehicle_routing", {"route": WAY, "speed": 8.0}),
    ],
)


def speeds(bench: Any) -> list[float]:
    """What the vehicle was told with `set_speed`."""
    return [call[1] for call in bench.body.calls if call[0] == "set_speed"]


@GOING
def test_a_vehicle_goes_on_at_the_speed_that_it_is_told(behavior: str, parameters: Any) -> None:
    async def main(bench: Any) -> None:
        await bench.start("r1.b1", behavior, V, **parameters)
        await bench.running("r1.b1")
        await bench.arbiter.adjust("r1.b1", 1, {"speed": 3.0, "altitude": 99.0})
        await bench.until(lambda: speeds(bench) == [3.0], 5)
        await bench.clock.sleep(10)
        assert speeds(bench) == [3.0]
        assert bench.body.speed == 3.0
        assert bench.states_of("r1.b1")[-1] is BehaviorState.RUNNING

    play(Body().fly(), main)


@GOING
def test_the_new_speed_holds_after_a_hold(behavior: str, parameters: Any) -> None:
    async def main(bench: Any) -> None:
        await bench.start("r1.b1", behavior, V, **parameters)
        await bench.running("r1.b1")
        await bench.arbiter.adjust("r1.b1", 1, {"speed": 3.0})
        await bench.until(lambda: speeds(bench) == [3.0], 5)
        await bench.arbiter.hold(V)
        await bench.clock.sleep(5)
        before = len(bench.body.calls)
        await bench.arbiter.adjust("r1.b1", 1, {"speed": 4.0})
        await bench.clock.sleep(5)
        assert len(bench.body.calls) == before, "a vehicle that is held is told nothing"
        await bench.arbiter.resume(V)
        await bench.until(lambda: len(bench.body.calls) > before, 5)
        await bench.clock.sleep(2)
        assert bench.body.speed == 4.0

    play(Body().fly(), main)


@pytest.mark.parametrize(
    "adjust",
    [
        ("r1.b1", 1, {"altitude": 30.0}),
        ("r1.b1", 1, {"speed": 0.0}),
        ("r1.b7", 1, {"speed": 3.0}),
    ],
)
def test_what_cannot_be_adjusted_is_left_as_it_is(adjust: Any) -> None:
    async def main(bench: Any) -> None:
        await bench.start("r1.b1", "goto", V, target=FAR)
        await bench.running("r1.b1")
        await bench.arbiter.adjust(*adjust)
        await bench.clock.sleep(3)
        assert bench.told == ["go_to"]

    play(Body().fly(), main)


def test_what_stands_has_no_speed() -> None:
    async def main(bench: Any) -> None:
        await bench.start("r1.b1", "hold", V, duration=20.0)
        await bench.running("r1.b1")
        await bench.arbiter.adjust("r1.b1", 1, {"speed": 3.0})
        assert (await bench.ended("r1.b1", 60)).state is BehaviorState.SUCCEEDED
        assert not speeds(bench)

    play(Body().fly(), main)


def test_a_speed_that_cannot_be_said_does_not_hinder_the_behavior() -> None:
    async def main(bench: Any) -> None:
        bench.body.stuck.add("set_speed")
        await bench.start("r1.b1", "goto", V, target=Point((*at(60, 0), 20.0)))
        await bench.running("r1.b1")
        await bench.arbiter.adjust("r1.b1", 1, {"speed": 3.0})
        assert (await bench.ended("r1.b1", 120)).state is BehaviorState.SUCCEEDED

    play(Body().fly(), main)


@pytest.mark.parametrize(
    "wish",
    [
        lambda: ("goto", {"target": Point((*place(900, 0), None)), "speed": 5.0}),
        lambda: (
            "single_vehicle_routing",
            {
                "route": Route(((*place(50, 0), None), (*place(900, 0), None))),
                "speed": 5.0,
            },
        ),
    ],
)
@pytest.mark.parametrize("kind", [Kind.ROVER, Kind.COPTER])
def test_an_autopilot_obeys_while_it_drives_or_flies(
    kind: Kind, wish: Callable[[], tuple[str, dict[str, Any]]]
) -> None:
    async def main(bench: Any) -> None:
        async def fast(speed_m_s: float) -> None:
            """Wait until it goes about so fast, over two seconds."""
            for _ in range(60):
                begin = bench.level(), bench.truth().autopilot.now_s
                await bench.clock.sleep(2)
                seconds = bench.truth().autopilot.now_s - begin[1]
                went = math.dist(begin[0], bench.level()) / max(seconds, 0.1)
                if went == pytest.approx(speed_m_s, rel=0.15):
                    return
            raise AssertionError(f"it goes at {went:.1f} m/s, not {speed_m_s:g}")

        if kind is Kind.COPTER:
            await bench.do("r1.b1", "takeoff", altitude=10.0)
        behavior, parameters = wish()
        await bench.start("r1.b2", behavior, "v1", **parameters)
        await fast(5.0)
        await bench.arbiter.adjust("r1.b2", 1, {"speed": 2.5})
        await fast(2.5)
        await bench.arbiter.hold("v1")
        await fast(0.0)
        await bench.arbiter.resume("v1")
        await fast(2.5)
        assert bench.states_of("r1.b2")[-1] is BehaviorState.RUNNING

    fly(main, kind)
