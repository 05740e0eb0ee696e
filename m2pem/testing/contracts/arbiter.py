"""The contract of arbiters, as tests to inherit: here, from the start of a behavior to its end.

The tests of queries, epochs, holds and links are in `m2pem.testing.contracts.arbiter_links`.
"""

from itertools import pairwise

from m2pem.api.arbiter import ResolvedValue
from m2pem.api.behavior_parameters import refusal
from m2pem.api.capabilities import arbiter_problem
from m2pem.fleet.parameters import resolve
from m2pem.geo.local_frame import distance_m
from m2pem.mission.catalogue import BehaviorState
from m2pem.mission.geometry import Route
from m2pem.testing.contracts.arbiter_harness import (
    ArbiterCase,
    ArbiterHarness,
    CutLink,
    Effects,
    MakeArbiter,
    connected,
    has_evidence,
    is_at_rest,
    speed,
    start,
    terminal,
)
from m2pem.testing.contracts.arbiter_links import ArbiterLinks
from m2pem.testing.contracts.contract import needs, skip_unsupported

__all__ = ["ArbiterCase", "ArbiterContract", "CutLink", "Effects", "MakeArbiter"]


MOST_REPORTS = 30
"""Of what is left of one route."""


def length_m(route: ResolvedValue) -> float:
    """Return the length of a route."""
    assert isinstance(route, Route), route
    return sum(distance_m(a[:2], b[:2]) for a, b in pairwise(route.waypoints))


class ArbiterContract(ArbiterLinks):
    """Override the fixtures `make_arbiter` and `case`; `cut_link` and `effects` too, if you can.

    Declare in `unsupported` what the arbiter does not support, with the reason, by the subjects of
    `subjects`:

        class TestRover(ArbiterContract):
            unsupported = {"hold": "the base has no brake"}

    Those tests are skipped, and the summary at the end lists them. All others must pass.
    """

    @connected
    async def test_the_arbiter_declares_what_it_can_do_beyond_its_protocol(
        self, harness: ArbiterHarness
    ) -> None:
        """`capabilities` names what is there, and nothing else: the executive asks for no more."""
        problem = arbiter_problem(harness.arbiter)
        assert not problem, problem

    @connected
    async def test_accepted_comes_before_running_and_one_terminal_report_last(
        self, harness: ArbiterHarness, case: ArbiterCase
    ) -> None:
        """ACCEPTED, RUNNING, then exactly one terminal report, and none after it; telemetry shows
        what a success promises."""
        await start(harness, "r1.b1", case.short, case.vehicle)
        end = await harness.ended("r1.b1", case.short_s)
        assert end.state is BehaviorState.SUCCEEDED, end
        await has_evidence(harness, case, case.short)
        await harness.clock.sleep(case.watch_s)
        assert harness.states_of("r1.b1") == [
            BehaviorState.ACCEPTED,
            BehaviorState.RUNNING,
            BehaviorState.SUCCEEDED,
        ]

    @connected
    async def test_report_numbers_rise_from_one(
        self, harness: ArbiterHarness, case: ArbiterCase
    ) -> None:
        """The executive distinguishes old reports from new ones by their numbers."""
        await start(harness, "r1.b1", case.short, case.vehicle)
        await harness.ended("r1.b1", case.short_s)
        numbers = [report.number for report in harness.of("r1.b1")]
        assert numbers[0] == 1, numbers
        assert all(a < b for a, b in pairwise(numbers)), numbers

    @connected
    async def test_a_second_start_of_the_same_behavior_has_no_effect(
        self, harness: ArbiterHarness, case: ArbiterCase
    ) -> None:
        """The executive sends a start again when it does not know whether it arrived."""
        await start(harness, "r1.b1", case.short, case.vehicle)
        await start(harness, "r1.b1", case.short, case.vehicle)
        await harness.ended("r1.b1", case.short_s)
        before = harness.of("r1.b1")
        await start(harness, "r1.b1", case.short, case.vehicle)
        await harness.clock.sleep(case.short_s)
        assert harness.of("r1.b1") == before
        states = [BehaviorState.ACCEPTED, BehaviorState.RUNNING, BehaviorState.SUCCEEDED]
        assert harness.states_of("r1.b1") == states

    @needs("effects")
    @connected
    async def test_a_second_start_has_one_physical_effect(
        self, harness: ArbiterHarness, case: ArbiterCase, effects: Effects | None
    ) -> None:
        """Whether it comes at once, meanwhile or afterwards, the vehicle begins once."""
        if effects is None:
            skip_unsupported("effects", "the fixture `effects` is not overridden")
        before = effects(harness.arbiter, case.vehicle)
        await start(harness, "r1.b1", case.short, case.vehicle)
        await start(harness, "r1.b1", case.short, case.vehicle)
        await harness.running("r1.b1")
        await start(harness, "r1.b1", case.short, case.vehicle)
        await harness.ended("r1.b1", case.short_s)
        await start(harness, "r1.b1", case.short, case.vehicle)
        await harness.clock.sleep(case.watch_s)
        assert effects(harness.arbiter, case.vehicle) - before == 1

    @connected
    async def test_an_unknown_behavior_is_rejected_by_name(
        self, harness: ArbiterHarness, case: ArbiterCase
    ) -> None:
        """REJECTED, with a code, and a reason that names the behavior."""
        await harness.start("r1.b1", "no_such_behavior", case.vehicle)
        end = await harness.ended("r1.b1", 10)
        assert end.state is BehaviorState.REJECTED, end
        assert end.code, "a rejection has a code"
        assert "no_such_behavior" in end.reason, end.reason

    @connected
    async def test_a_bad_parameter_is_rejected_by_name(
        self, harness: ArbiterHarness, case: ArbiterCase
    ) -> None:
        """REJECTED, with a reason that names the parameter; nothing has moved."""
        name, value = case.bad
        behavior, parameters = case.long
        await start(harness, "r1.b1", (behavior, {**parameters, name: value}), case.vehicle)
        end = await harness.ended("r1.b1", 10)
        assert end.state is BehaviorState.REJECTED, end
        assert name in end.reason, end.reason
        assert harness.states_of("r1.b1") == [BehaviorState.REJECTED]

    @connected
    async def test_an_unknown_parameter_is_rejected_by_name(
        self, harness: ArbiterHarness, case: ArbiterCase
    ) -> None:
        """A parameter that is not in the catalogue is not silently left out."""
        behavior, parameters = case.long
        await start(harness, "r1.b1", (behavior, {**parameters, "colour": 1.0}), case.vehicle)
        end = await harness.ended("r1.b1", 10)
        assert end.state is BehaviorState.REJECTED, end
        assert "colour" in end.reason, end.reason

    @connected
    async def test_a_busy_vehicle_refuses_another_behavior(
        self, harness: ArbiterHarness, case: ArbiterCase
    ) -> None:
        """Code RESOURCE_UNAVAILABLE; what runs is not disturbed."""
        await start(harness, "r1.b1", case.long, case.vehicle)
        await harness.running("r1.b1")
        await start(harness, "r1.b2", case.short, case.vehicle)
        end = await harness.ended("r1.b2", 10)
        assert (end.state, end.code) == (BehaviorState.REJECTED, "RESOURCE_UNAVAILABLE"), end
        assert not terminal(harness, "r1.b1"), "the first goes on"

    @needs("preempt")
    @connected
    async def test_a_behavior_that_preempts_takes_the_vehicle_over(
        self, harness: ArbiterHarness, case: ArbiterCase
    ) -> None:
        """`preempts` names what is being cancelled: it ends CANCELLED at once."""
        await start(harness, "r1.b1", case.long, case.vehicle)
        await harness.running("r1.b1")
        await start(harness, "r1.b2", case.long, case.vehicle, preempts=("r1.b1",))
        assert (await harness.ended("r1.b1", 10)).state is BehaviorState.CANCELLED
        await harness.running("r1.b2", 10)

    @needs("remaining")
    @connected
    async def test_less_and_less_is_left_of_a_route(
        self, harness: ArbiterHarness, case: ArbiterCase
    ) -> None:
        """`remaining`: parameters of the same behavior, with the rest of its route."""
        if case.route is None:
            skip_unsupported("remaining", "the case has no `route`")
        name, parameters = case.route
        specs = {each.name: each for each in harness.arbiter.catalogue(case.vehicle)}
        spec = specs[name]
        await start(harness, "r1.b1", (name, parameters), case.vehicle)
        end = await harness.ended("r1.b1", case.route_s)
        if end.state is BehaviorState.SUCCEEDED:
            await has_evidence(harness, case, case.route)
        said = [report.remaining for report in harness.of("r1.b1") if report.remaining]
        assert len(said) > 1, harness.of("r1.b1")
        assert len(said) <= MOST_REPORTS, f"each is a record of the journal: {len(said)}"
        routes = [resolve(spec, each, lambda _: None, ())["route"] for each in said]
        lengths = [length_m(route) for route in (parameters["route"], *routes)]
        assert all(a > b for a, b in pairwise(lengths)), lengths
        assert lengths[-1] < lengths[0] / 2, lengths
        problem = refusal(spec, resolve(spec, said[-1], lambda _: None, ()))
        assert not problem, problem

    @connected
    async def test_cancel_ends_a_behavior_within_the_declared_bound(
        self, harness: ArbiterHarness, case: ArbiterCase
    ) -> None:
        """A cancel ends a behavior within `limits().cancel_timeout_s`, and the vehicle, if it says
        how fast it is, comes to rest within as much."""
        await start(harness, "r1.b1", case.long, case.vehicle)
        await harness.running("r1.b1")
        await harness.clock.sleep(case.watch_s / 2)
        await harness.arbiter.cancel("r1.b1", 1)
        bound_s = harness.arbiter.limits(case.vehicle).cancel_timeout_s
        assert (await harness.ended("r1.b1", bound_s)).state is BehaviorState.CANCELLED
        at_rest = await harness.until(lambda: is_at_rest(harness, case), bound_s)
        assert at_rest, f"cancelled, and moves at {speed(harness, case.vehicle):.1f} m/s"

    @connected
    async def test_a_second_cancel_changes_nothing(
        self, harness: ArbiterHarness, case: ArbiterCase
    ) -> None:
        """A behavior has one terminal report, however often it is cancelled."""
        await start(harness, "r1.b1", case.long, case.vehicle)
        await harness.running("r1.b1")
        await harness.arbiter.cancel("r1.b1", 1)
        await harness.arbiter.cancel("r1.b1", 1)
        await harness.ended("r1.b1", 60)
        await harness.arbiter.cancel("r1.b1", 1)
        await harness.clock.sleep(case.watch_s)
        assert len(terminal(harness, "r1.b1")) == 1, harness.of("r1.b1")

    @connected
    async def test_cancel_of_an_unknown_behavior_is_quiet(
        self, harness: ArbiterHarness, case: ArbiterCase
    ) -> None:
        """No report and no exception."""
        await harness.arbiter.cancel("r9.b9", 1)
        await harness.clock.sleep(case.watch_s)
        assert harness.reports == []

    @connected
    async def test_a_cancelled_vehicle_can_be_commanded_again(
        self, harness: ArbiterHarness, case: ArbiterCase
    ) -> None:
        """The terminal report says that the vehicle is free."""
        await start(harness, "r1.b1", case.long, case.vehicle)
        await harness.running("r1.b1")
        await harness.arbiter.cancel("r1.b1", 1)
        await harness.ended("r1.b1", 60)
        await start(harness, "r1.b2", case.long, case.vehicle)
        await harness.running("r1.b2", 10)
