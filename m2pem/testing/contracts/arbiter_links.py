"""The contract of arbiters: queries, epochs, holds, links, telemetry and closing."""

import asyncio
import os
import threading
from collections.abc import Callable
from contextlib import suppress

from m2pem.api.arbiter import adjusts, fences, reclaims
from m2pem.api.clock import Clock
from m2pem.mission.catalogue import BehaviorState
from m2pem.testing.contracts.arbiter_harness import (
    ArbiterCase,
    ArbiterFixtures,
    ArbiterHarness,
    CutLink,
    IsArbiters,
    Main,
    MakeArbiter,
    connected,
    context,
    is_at_rest,
    is_moving,
    link_is_up,
    refusal,
    speed,
    start,
    terminal,
)
from m2pem.testing.contracts.contract import needs, skip_unsupported

SETTLING_STEPS = 10
"""Iterations of the event loop until a socket is closed."""


class ArbiterLinks(ArbiterFixtures):
    """Tests of queries, epochs, holds, links, telemetry, and of what is left after the end."""

    @connected
    async def test_query_tells_what_runs_and_what_has_ended(
        self, harness: ArbiterHarness, case: ArbiterCase
    ) -> None:
        """RUNNING while it runs, then what it ended with."""
        await start(harness, "r1.b1", case.short, case.vehicle)
        await harness.running("r1.b1")
        reference = harness.of("r1.b1")[-1].native_ref
        found = await harness.arbiter.query("r1.b1", reference)
        assert found.state is BehaviorState.RUNNING, found
        end = await harness.ended("r1.b1", case.short_s)
        found = await harness.arbiter.query("r1.b1", reference)
        assert found.state is end.state, found

    @connected
    async def test_query_of_an_unknown_behavior_is_unknown(self, harness: ArbiterHarness) -> None:
        """State UNKNOWN, and no report."""
        found = await harness.arbiter.query("r9.b9", None)
        assert (found.id, found.state) == ("r9.b9", BehaviorState.UNKNOWN), found
        assert harness.reports == [], "a query answers; it does not report"

    @needs("reconnect")
    def test_another_arbiter_finds_the_behavior_again(
        self, make_arbiter: MakeArbiter, case: ArbiterCase, run: Callable[[Main], None]
    ) -> None:
        """After a restart the same behavior still runs, or ended well meanwhile."""

        async def main(clock: Clock) -> None:
            async with ArbiterHarness(make_arbiter(context(clock)), clock) as harness:
                await start(harness, "r1.b1", case.short, case.vehicle)
                await harness.running("r1.b1")
                reference = harness.of("r1.b1")[-1].native_ref
            async with ArbiterHarness(make_arbiter(context(clock)), clock) as harness:
                found = await harness.arbiter.query("r1.b1", reference)
                assert found.id == "r1.b1", found
                assert found.state in (BehaviorState.RUNNING, BehaviorState.SUCCEEDED), found
                if found.state is BehaviorState.RUNNING:
                    end = await harness.ended("r1.b1", case.short_s)
                    assert end.state is BehaviorState.SUCCEEDED, end

        run(main)

    @needs("hold", "reconnect")
    def test_a_vehicle_that_another_arbiter_has_held_is_reported_as_held(
        self, make_arbiter: MakeArbiter, case: ArbiterCase, run: Callable[[Main], None]
    ) -> None:
        """It continues by itself, or `query` says `held` or UNKNOWN; `resume` lets it go on."""

        async def main(clock: Clock) -> None:
            async with ArbiterHarness(make_arbiter(context(clock)), clock) as harness:
                await start(harness, "r1.b1", case.short, case.vehicle)
                await harness.running("r1.b1")
                reference = harness.of("r1.b1")[-1].native_ref
                await harness.arbiter.hold(case.vehicle)
                await clock.sleep(harness.arbiter.limits(case.vehicle).hold_within_s)
            async with ArbiterHarness(make_arbiter(context(clock)), clock) as harness:
                found = await harness.arbiter.query("r1.b1", reference)
                if found.state in (BehaviorState.ACCEPTED, BehaviorState.RUNNING):
                    if found.held:
                        await harness.arbiter.resume(case.vehicle)
                    end = await harness.ended("r1.b1", 2 * case.short_s)
                    assert end.state is BehaviorState.SUCCEEDED, end

        run(main)

    @needs("second vehicle")
    @connected
    async def test_a_start_of_a_past_epoch_is_refused(
        self, harness: ArbiterHarness, case: ArbiterCase
    ) -> None:
        """Another executive has taken the run over: `StaleCommandError` names its epoch. Other runs
        are not concerned."""
        await start(harness, "r1.b1", case.long, case.vehicle, epoch=2)
        await harness.running("r1.b1")
        late = start(harness, "r1.b2", case.long, case.other, epoch=1)
        assert "epoch 2" in await refusal(late)
        await harness.clock.sleep(case.watch_s)
        assert harness.of("r1.b2") == []
        await start(harness, "r2.b1", case.long, case.other, epoch=1)
        await harness.running("r2.b1", 10)

    @needs("second vehicle")
    @connected
    async def test_a_start_of_the_same_or_a_newer_epoch_is_accepted(
        self, harness: ArbiterHarness, case: ArbiterCase
    ) -> None:
        """A takeover leaves the other vehicles of the run as they are."""
        await start(harness, "r1.b1", case.long, case.vehicle, epoch=2)
        await harness.running("r1.b1")
        await start(harness, "r1.b2", case.long, case.other, epoch=2)
        await harness.running("r1.b2", 10)
        await harness.arbiter.cancel("r1.b2", 3)
        await harness.ended("r1.b2", 60)
        assert not terminal(harness, "r1.b1"), "only r1.b2 was cancelled"

    @connected
    async def test_a_cancel_of_a_past_epoch_is_refused(
        self, harness: ArbiterHarness, case: ArbiterCase
    ) -> None:
        """Another executive has taken the run over; `adjust` is refused in the same way."""
        arbiter = harness.arbiter
        await start(harness, "r1.b1", case.long, case.vehicle, epoch=2)
        await harness.running("r1.b1")
        assert "epoch 2" in await refusal(arbiter.cancel("r1.b1", 1))
        if adjusts(arbiter):
            assert "epoch 2" in await refusal(arbiter.adjust("r1.b1", 1, {"speed": 1.0}))
        await harness.clock.sleep(case.watch_s)
        assert not terminal(harness, "r1.b1"), harness.of("r1.b1")

    def test_a_query_names_the_epoch_that_was_seen(
        self, make_arbiter: MakeArbiter, case: ArbiterCase, run: Callable[[Main], None]
    ) -> None:
        """It is that of the executive that asks, or a newer one, and it refuses past ones."""

        async def main(clock: Clock) -> None:
            async with ArbiterHarness(make_arbiter(context(clock, epoch=3)), clock) as harness:
                await start(harness, "r1.b1", case.long, case.vehicle, epoch=2)
                await harness.running("r1.b1")
                reference = harness.of("r1.b1")[-1].native_ref
                assert (await harness.arbiter.query("r1.b1", reference)).epoch == 3
                assert "epoch 3" in await refusal(harness.arbiter.cancel("r1.b1", 2))
                await harness.arbiter.cancel("r1.b1", 5)
                assert (await harness.arbiter.query("r1.b1", reference)).epoch == 5

        run(main)

    @needs("second vehicle")
    def test_a_takeover_refuses_the_past_executive_for_every_vehicle(
        self, make_arbiter: MakeArbiter, case: ArbiterCase, run: Callable[[Main], None]
    ) -> None:
        """Also for one that the new executive has commanded nothing yet."""

        async def main(clock: Clock) -> None:
            async with ArbiterHarness(make_arbiter(context(clock, epoch=2)), clock) as harness:
                arbiter = harness.arbiter
                await start(harness, "r1.b1", case.long, case.vehicle, epoch=1)
                await harness.running("r1.b1")
                if fences(arbiter):
                    await arbiter.fence("r1", 2)
                else:
                    await arbiter.query("r1.b1", harness.of("r1.b1")[-1].native_ref)
                late = start(harness, "r1.b2", case.long, case.other, epoch=1)
                assert "epoch 2" in await refusal(late)

        run(main)

    @needs("telemetry")
    @connected
    async def test_a_vehicle_goes_on_with_what_is_disowned(
        self, harness: ArbiterHarness, case: ArbiterCase
    ) -> None:
        """`disown`: another executive drives the run, so that nothing is cancelled here."""
        arbiter = harness.arbiter
        if not fences(arbiter):
            return
        await start(harness, "r1.b1", case.long, case.vehicle)
        moving = await harness.until(lambda: is_moving(harness, case), 30)
        assert moving, "the long behavior must move the vehicle"
        await harness.running("r1.b1", 30)  # what begins it in steps has no more to send
        await arbiter.disown("r1")
        assert not terminal(harness, "r1.b1"), harness.of("r1.b1")
        await harness.clock.sleep(case.watch_s / 2)
        assert speed(harness, case.vehicle) > case.standing_m_s, "it was stopped"

    @needs("hold", "telemetry")
    @connected
    async def test_hold_stops_the_vehicle_within_the_declared_bound(
        self, harness: ArbiterHarness, case: ArbiterCase
    ) -> None:
        """Within `limits().hold_within_s`, and it stays until resumed."""
        await start(harness, "r1.b1", case.long, case.vehicle)
        moving = await harness.until(lambda: is_moving(harness, case), 30)
        assert moving, "the long behavior must move the vehicle"
        await harness.arbiter.hold(case.vehicle)
        bound_s = harness.arbiter.limits(case.vehicle).hold_within_s
        at_rest = await harness.until(lambda: is_at_rest(harness, case), bound_s)
        assert at_rest, f"still at {speed(harness, case.vehicle):.1f} m/s after {bound_s:g} s"
        await harness.clock.sleep(case.watch_s)
        assert is_at_rest(harness, case), "it does not move by itself"
        assert not terminal(harness, "r1.b1"), "it keeps its behavior"

    @needs("hold")
    @connected
    async def test_resume_goes_on_with_the_behavior(
        self, harness: ArbiterHarness, case: ArbiterCase
    ) -> None:
        """A held behavior does not end; a resumed one ends as it would have."""
        await start(harness, "r1.b1", case.short, case.vehicle)
        await harness.running("r1.b1")
        await harness.arbiter.hold(case.vehicle)
        await harness.clock.sleep(2 * case.short_s)
        assert not terminal(harness, "r1.b1"), "a held behavior does not end"
        await harness.arbiter.resume(case.vehicle)
        end = await harness.ended("r1.b1", 2 * case.short_s)
        assert end.state is BehaviorState.SUCCEEDED, end

    @needs("hold")
    @connected
    async def test_hold_and_resume_of_an_idle_vehicle_are_quiet(
        self, harness: ArbiterHarness, case: ArbiterCase
    ) -> None:
        """There is nothing to report about."""
        await harness.arbiter.hold(case.vehicle)
        await harness.arbiter.hold(case.vehicle)
        await harness.arbiter.resume(case.vehicle)
        await harness.arbiter.resume(case.vehicle)
        await harness.clock.sleep(case.watch_s)
        assert harness.reports == []

    @needs("link", "second vehicle")
    @connected
    async def test_a_cut_link_is_lost_within_the_declared_bound(
        self, harness: ArbiterHarness, case: ArbiterCase, cut_link: CutLink | None
    ) -> None:
        """LOST within `limits().lost_after_s`, and only what that link carries."""
        if cut_link is None:
            skip_unsupported("link", "the fixture `cut_link` is not overridden")
        await start(harness, "r1.b1", case.long, case.vehicle)
        await start(harness, "r1.b2", case.long, case.other)
        await harness.running("r1.b1")
        await harness.running("r1.b2")
        cut_link(harness.arbiter, case.vehicle)
        bound_s = harness.arbiter.limits(case.vehicle).lost_after_s
        end = await harness.ended("r1.b1", bound_s + 1 + harness.late_s)
        assert end.state is BehaviorState.LOST, end
        assert not terminal(harness, "r1.b2"), "the other vehicle's link is up"

    @needs("link", "return", "telemetry")
    @connected
    async def test_a_lost_vehicle_whose_link_returns_stops_before_it_is_free(
        self,
        harness: ArbiterHarness,
        case: ArbiterCase,
        cut_link: CutLink | None,
        mend_link: CutLink | None,
    ) -> None:
        """The executive calls `reclaim` or `hold`. Then the vehicle is at rest, and executes a new
        behavior."""
        if cut_link is None or mend_link is None:
            skip_unsupported("return", "the fixture `mend_link` is not overridden")
        await start(harness, "r1.b1", case.long, case.vehicle)
        moving = await harness.until(lambda: is_moving(harness, case), 30)
        assert moving, "the long behavior must move the vehicle"
        cut_link(harness.arbiter, case.vehicle)
        limits = harness.arbiter.limits(case.vehicle)
        end = await harness.ended("r1.b1", limits.lost_after_s + 1 + harness.late_s)
        assert end.state is BehaviorState.LOST, end
        mend_link(harness.arbiter, case.vehicle)
        assert await harness.until(lambda: link_is_up(harness, case.vehicle), 30), (
            "its link is up again"
        )
        arbiter = harness.arbiter
        if reclaims(arbiter):
            limit = harness.clock.now_us() + round(1e6 * limits.cancel_timeout_s)
            while why := await arbiter.reclaim(case.vehicle):
                assert harness.clock.now_us() < limit, why
                await harness.clock.sleep(1)
        else:
            await arbiter.hold(case.vehicle)
        at_rest = await harness.until(lambda: is_at_rest(harness, case), limits.hold_within_s)
        assert at_rest, f"still at {speed(harness, case.vehicle):.1f} m/s, though it is free"
        await harness.clock.sleep(case.watch_s)
        assert is_at_rest(harness, case), "it does not move by itself"
        await start(harness, "r1.b2", case.long, case.vehicle)
        moving = await harness.until(lambda: is_moving(harness, case), 30)
        assert moving, f"it must execute a new behavior: {harness.of('r1.b2')}"

    @needs("second vehicle")
    @connected
    async def test_two_vehicles_do_not_mix(
        self, harness: ArbiterHarness, case: ArbiterCase
    ) -> None:
        """A command to one vehicle leaves the other alone."""
        await start(harness, "r1.b1", case.long, case.vehicle)
        await start(harness, "r1.b2", case.long, case.other)
        await harness.running("r1.b1")
        await harness.running("r1.b2")
        await harness.arbiter.cancel("r1.b1", 1)
        await harness.ended("r1.b1", 60)
        assert harness.states_of("r1.b2") == [BehaviorState.ACCEPTED, BehaviorState.RUNNING]

    @needs("hold", "second vehicle", "telemetry")
    @connected
    async def test_a_held_vehicle_does_not_hold_up_the_other(
        self, harness: ArbiterHarness, case: ArbiterCase
    ) -> None:
        """One vehicle is at rest, the other one continues."""
        await start(harness, "r1.b1", case.long, case.vehicle)
        await start(harness, "r1.b2", case.long, case.other)
        await harness.running("r1.b1")
        await harness.running("r1.b2")
        await harness.arbiter.hold(case.vehicle)
        await harness.clock.sleep(case.watch_s)
        assert is_at_rest(harness, case)
        assert speed(harness, case.other) > case.standing_m_s, "the other was not held"

    @needs("telemetry")
    @connected
    async def test_telemetry_names_the_resource_and_rises_in_time(
        self, harness: ArbiterHarness, case: ArbiterCase
    ) -> None:
        """States have the resource id of the fleet, and their times do not decrease."""
        await start(harness, "r1.b1", case.long, case.vehicle)
        await harness.clock.sleep(case.watch_s)
        states = [state for state in harness.states if state.resource == case.vehicle]
        assert states, "a vehicle that moves reports its position"
        times = [state.time_us for state in states]
        assert times == sorted(times)

    @needs("telemetry")
    @connected
    async def test_states_are_stamped_by_the_clock_of_the_context(
        self, harness: ArbiterHarness, case: ArbiterCase
    ) -> None:
        """Mission time may run faster than the wall clock, or be virtual."""
        began_us = harness.clock.now_us()
        await start(harness, "r1.b1", case.long, case.vehicle)
        await harness.clock.sleep(case.watch_s)
        state = harness.latest(case.vehicle)
        assert state is not None, "a vehicle that moves reports its position"
        assert began_us < state.time_us <= harness.clock.now_us() + 1_000_000

    @needs("virtual clock")
    @connected
    async def test_a_behavior_takes_its_time_of_the_clock_that_was_lent(
        self, harness: ArbiterHarness, case: ArbiterCase
    ) -> None:
        """In virtual time a rehearsal of hours takes seconds, and nothing real is waited for."""
        await start(harness, "r1.b1", case.long, case.vehicle)
        await harness.running("r1.b1")
        running_us = harness.clock.now_us()
        await harness.until(lambda: bool(terminal(harness, "r1.b1")), 5 * case.watch_s)
        took_s = (harness.clock.now_us() - running_us) / 1_000_000
        assert took_s >= 5 * case.watch_s, f"the long behavior took {took_s:g} s of the clock"

    def test_nothing_leaks_after_close(
        self,
        make_arbiter: MakeArbiter,
        case: ArbiterCase,
        is_arbiters: IsArbiters,
        run: Callable[[Main], None],
    ) -> None:
        """No task, thread or file is left behind."""

        async def main(clock: Clock) -> None:
            before = asyncio.all_tasks()
            threads, files = _threads(), _open_files()
            async with ArbiterHarness(make_arbiter(context(clock)), clock) as harness:
                await start(harness, "r1.b1", case.long, case.vehicle)
                await harness.running("r1.b1")
            await asyncio.sleep(0)
            leaked = {*filter(is_arbiters, asyncio.all_tasks() - before)}
            assert not leaked, f"tasks go on after close: {leaked}"
            assert _threads() <= threads, f"threads go on: {_threads() - threads}"
            for _ in range(SETTLING_STEPS):
                if _open_files() <= files:
                    break
                await clock.sleep(case.watch_s / SETTLING_STEPS)
            assert _open_files() <= files, f"{_open_files() - files} files or sockets stay open"

        run(main)

    def test_close_is_quiet_when_it_was_never_connected_or_is_closed_already(
        self, make_arbiter: MakeArbiter, run: Callable[[Main], None]
    ) -> None:
        """An executive that fails to start closes what it has made."""

        async def main(clock: Clock) -> None:
            arbiter = make_arbiter(context(clock))
            await arbiter.close()
            await arbiter.close()

        run(main)

    def test_the_catalogue_needs_no_connection(
        self, make_arbiter: MakeArbiter, case: ArbiterCase, run: Callable[[Main], None]
    ) -> None:
        """`m2pem check` asks for it without any vehicle."""

        async def main(clock: Clock) -> None:
            arbiter = make_arbiter(context(clock))
            names = {spec.name for spec in arbiter.catalogue(case.vehicle)}
            assert {case.long[0], case.short[0]} <= names
            limits = arbiter.limits(case.vehicle)
            assert min(limits.lost_after_s, limits.hold_within_s, limits.cancel_timeout_s) > 0
            await arbiter.close()

        run(main)


def _threads() -> set[threading.Thread]:
    """Threads that go on, but for those in which the event loop itself runs blocking calls."""
    return {each for each in threading.enumerate() if not each.name.startswith("asyncio_")}


def _open_files() -> int:
    """Return how many files and sockets this process has open; 0: it is not known."""
    with suppress(OSError):
        return len(os.listdir("/dev/fd"))  # noqa: PTH208  # a Path would be made of each
    return 0
