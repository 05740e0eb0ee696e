"""Whatever is commanded when: motion is continuous, reports are in order, vehicles come free."""

import math
from collections.abc import Sequence

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from m2pem.api.arbiter import ResolvedValue
from m2pem.api.clock import Clock, run_virtual
from m2pem.api.telemetry import PayloadState, VehicleState
from m2pem.mission.catalogue import BehaviorState, ResourceId
from m2pem.mission.geometry import Point, VehiclePosition
from m2pem.simulation.kinematics import DEFAULTS
from m2pem.testing.contracts.arbiter_harness import ArbiterHarness
from tests.seeds import examples
from tests.simulation.conftest import START_US, Fleet, local, make, place, route

STEP_S = 0.1
FLEET: Fleet = {"ugv": ("ground", {}), "uav": ("air", {"altitude": "30 m"}), "lead": ("ground", {})}
VEHICLES = ("ugv", "uav")
BEHAVIORS: list[tuple[str, dict[str, ResolvedValue]]] = [
    ("goto", {"target": Point(place(60, 20, 30))}),
    ("single_vehicle_routing", {"route": route((30, 0), (30, 40), (0, 40)), "loop": True}),
    ("orbit", {"target": Point(place(0, 30)), "radius": 20.0}),
    ("follow", {"target": VehiclePosition("lead")}),
    ("drive_stop", {}),
    ("hold", {"duration": 3.0}),
    ("return_to_launch", {}),
]

commands = st.lists(
    st.tuples(
        st.floats(0, 15),
        st.sampled_from(VEHICLES),
        st.one_of(
            st.sampled_from(["hold", "resume", "cancel"]), st.integers(0, len(BEHAVIORS) - 1)
        ),
    ),
    min_size=1,
    max_size=12,
)


def check_motion(states: Sequence[VehicleState | PayloadState]) -> None:
    """Fail when a vehicle jumped, or was faster than it can be."""
    before: dict[ResourceId, tuple[tuple[float, ...], int]] = {}
    # A state has the time for which it was planned, however late it comes (`EventQueue`).
    for state in sorted(states, key=lambda state: state.time_us):
        assert isinstance(state, VehicleState)
        assert state.position is not None
        assert state.altitude_above_home_m is not None
        assert state.velocity_enu_m_s is not None
        kinematics = DEFAULTS[FLEET[state.resource][0]]
        bound_m_s = math.hypot(kinematics.max_speed_m_s, kinematics.climb_rate_m_s)
        assert math.hypot(*state.velocity_enu_m_s) <= bound_m_s + 1e-6
        place = (*local(state.position), state.altitude_above_home_m)
        at, at_us = before.get(state.resource, (place, state.time_us))
        passed_s = (state.time_us - at_us) / 1e6
        assert math.dist(place, at) <= bound_m_s * passed_s + 1e-5
        before[state.resource] = place, state.time_us
    assert before.keys() == FLEET.keys()


async def play(clock: Clock, script: list[tuple[float, str, str | int]]) -> None:
    arbiter = make(clock, FLEET, telemetry_hz=1 / STEP_S)
    async with ArbiterHarness(arbiter, clock) as bench:
        await bench.start("r1.lead", "goto", "lead", target=Point(place(-200, 90)))
        newest = dict.fromkeys(VEHICLES, "")
        for number, (after_s, vehicle, command) in enumerate(script):
            await clock.sleep(after_s)
            if isinstance(command, int):
                behavior, parameters = BEHAVIORS[command]
                id_ = f"r1.b{number}"
                # The engine takes over from what it has cancelled, and so do we.
                preempts = (newest[vehicle],) if newest[vehicle] else ()
                for old in preempts:
                    await arbiter.cancel(old, 1)
                await bench.start(id_, behavior, vehicle, preempts=preempts, **parameters)  # type: ignore[arg-type]
                newest[vehicle] = id_
            elif command == "cancel":
                await arbiter.cancel(newest[vehicle], 1)
            else:
                act = arbiter.hold if command == "hold" else arbiter.resume
                await act(ResourceId(vehicle))
        for vehicle in VEHICLES:
            await arbiter.resume(ResourceId(vehicle))
            await arbiter.cancel(newest[vehicle], 1)
        await clock.sleep(60)
        check_motion(bench.states)
        for id_ in {report.id for report in bench.reports} - {"r1.lead"}:
            states = bench.states_of(id_)
            if "take off first" in bench.of(id_)[-1].reason:
                assert states == [BehaviorState.REJECTED]
                continue
            assert states[:2] == [BehaviorState.ACCEPTED, BehaviorState.RUNNING]
            assert [state.terminal for state in states] == [False, False, True]
            numbers = [report.number for report in bench.of(id_)]
            assert numbers == list(range(1, len(numbers) + 1))
        for vehicle in VEHICLES:
            await bench.start(f"r2.{vehicle}", "drive_stop", vehicle)
            assert (await bench.ended(f"r2.{vehicle}", 30)).state is BehaviorState.SUCCEEDED


@settings(max_examples=examples(6, 25), deadline=None)
@given(commands)
def test_any_commands_at_any_time(script: list[tuple[float, str, str | int]]) -> None:
    run_virtual(lambda clock: play(clock, script), START_US)


@pytest.mark.long
@settings(max_examples=2000, deadline=None)
@given(commands)
def test_very_many_commands_at_any_time(script: list[tuple[float, str, str | int]]) -> None:
    run_virtual(lambda clock: play(clock, script), START_US)
