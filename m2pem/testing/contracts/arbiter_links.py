"""What every arbiter must keep to in asking, holding, losing and closing."""

import asyncio
import os
import threading
from collections.abc import Callable
from contextlib import suppress

from m2pem.api.arbiter import ReclaimingArbiter
from m2pem.api.clock import Clock
from m2pem.mission.catalogue import BehaviorState
from m2pem.testing.contracts.arbiter_case import (
    ArbiterCase,
    ArbiterFixtures,
    CutLink,
    Main,
    MakeArbiter,
    heard,
    is_moving,
    is_standing,
    on_bench,
    speed,
    start,
    terminal,
)
from m2pem.testing.contracts.bench import ArbiterBench, context
from m2pem.testing.contracts.contract import needs, skip_unsupported

SETTLING_STEPS = 10
"""A socket is closed some turns of the event loop after its owner said so."""


class ArbiterLinks(ArbiterFixtures):
    """Queries, epochs, holds, links, and what is left after the end."""

    def test_query_tells_what_runs_and_what_has_ended(
        self, make_arbiter: MakeArbiter, case: ArbiterCase, run: Callable[[Main], None]
    ) -> None:
        """RUNNING while it runs, then what it ended with."""

        async def main(bench: ArbiterBench) -> None:
            await start(bench, "r1.b1", case.short, case.vehicle)
            await bench.running("r1.b1")
            reference = bench.of("r1.b1")[-1].native_ref
            found = await bench.arbiter.query("r1.b1", reference)
            assert found.state is BehaviorState.RUNNING, found
            end = await bench.ended("r1.b1", case.short_s)
            found = await bench.arbiter.query("r1.b1", reference)
            assert found.state is end.state, found

        on_bench(make_arbiter, run, main)

    def test_query_of_an_unknown_behavior_is_unknown(
        self, make_arbiter: MakeArbiter, run: Callable[[Main], None]
    ) -> None:
        """State UNKNOWN, and no report."""

        async def main(bench: ArbiterBench) -> None:
            found = await bench.arbiter.query("r9.b9", None)
            assert (found.id, found.state) == ("r9.b9", BehaviorState.UNKNOWN), found
            assert bench.reports == [], "a query answers; it does not report"

        on_bench(make_arbiter, run, main)

    @needs("reconnect")
    def test_another_arbiter_finds_the_behavior_again(
        self, make_arbiter: MakeArbiter, case: ArbiterCase, run: Callable[[Main], None]
    ) -> None:
        """After a restart the same behavior still runs, or ended well meanwhile."""

        async def main(clock: Clock) -> None:
            async with ArbiterBench(make_arbiter(context(clock)), clock) as bench:
                await start(bench, "r1.b1", case.short, case.vehicle)
                await bench.running("r1.b1")
                reference = bench.of("r1.b1")[-1].native_ref
            async with ArbiterBench(make_arbiter(context(clock)), clock) as bench:
                found = await bench.arbiter.query("r1.b1", reference)
                assert found.id == "r1.b1", found
                assert found.state in (BehaviorState.RUNNING, BehaviorState.SUCCEEDED), found
                if found.state is BehaviorState.RUNNING:
                    end = await bench.ended("r1.b1", case.short_s)
                    assert end.state is BehaviorState.SUCCEEDED, end

        run(main)

    @needs("hold", "reconnect")
    def test_a_vehicle_that_another_arbiter_has_held_does_not_wait_unseen(
        self, make_arbiter: MakeArbiter, case: ArbiterCase, run: Callable[[Main], None]
    ) -> None:
        """It goes on by itself, or `query` says `held` or UNKNOWN; `resume` lets it go on."""

        async def main(clock: Clock) -> None:
            async with ArbiterBench(make_arbiter(context(clock)), clock) as bench:
                await start(bench, "r1.b1", case.short, case.vehicle)
                await bench.running("r1.b1")
                reference = bench.of("r1.b1")[-1].native_ref
                await bench.arbiter.hold(case.vehicle)
                await clock.sleep(bench.arbiter.limits(case.vehicle).hold_within_s)
            async with ArbiterBench(make_arbiter(context(clock)), clock) as bench:
                found = await bench.arbiter.query("r1.b1", reference)
                if found.state in (BehaviorState.ACCEPTED, BehaviorState.RUNNING):
                    if found.held:
                        await bench.arbiter.resume(case.vehicle)
                    end = await bench.ended("r1.b1", 2 * case.short_s)
                    assert end.state is BehaviorState.SUCCEEDED, end

        run(main)

    @needs("second vehicle")
    def test_a_start_of_a_past_epoch_is_refused(
        self, make_arbiter: MakeArbiter, case: ArbiterCase, run: Callable[[Main], None]
    ) -> None:
        """Another executive has taken the run over; other runs are not concerned."""

        async def main(bench: ArbiterBench) -> None:
            await start(bench, "r1.b1", case.long, case.vehicle, epoch=2)
            await bench.running("r1.b1")
            await start(bench, "r1.b2", case.long, case.other, epoch=1)
            await bench.clock.sleep(case.watch_s)
            assert BehaviorState.RUNNING not in bench.states_of("r1.b2")
            await start(bench, "r2.b1", case.long, case.other, epoch=1)
            await bench.running("r2.b1", 10)

        on_bench(make_arbiter, run, main)

    def test_a_cancel_of_a_past_epoch_is_refused(
        self, make_arbiter: MakeArbiter, case: ArbiterCase, run: Callable[[Main], None]
    ) -> None:
        """Another executive has taken the run over."""

        async def main(bench: ArbiterBench) -> None:
            await start(bench, "r1.b1", case.long, case.vehicle, epoch=2)
            await bench.running("r1.b1")
            await bench.arbiter.cancel("r1.b1", 1)
            await bench.clock.sleep(case.watch_s)
            assert not terminal(bench, "r1.b1"), bench.of("r1.b1")

        on_bench(make_arbiter, run, main)

    @needs("hold", "telemetry")
    def test_hold_brings_the_vehicle_to_a_stand_within_the_declared_bound(
        self, make_arbiter: MakeArbiter, case: ArbiterCase, run: Callable[[Main], None]
    ) -> None:
        """Within `limits().hold_within_s`, and it stays until resumed."""

        async def main(bench: ArbiterBench) -> None:
            await start(bench, "r1.b1", case.long, case.vehicle)
            moving = await bench.until(lambda: is_moving(bench, case), 30)
            assert moving, "the long behavior must move the vehicle"
            await bench.arbiter.hold(case.vehicle)
            bound_s = bench.arbiter.limits(case.vehicle).hold_within_s
            stands = await bench.until(lambda: is_standing(bench, case), bound_s)
            assert stands, f"still at {speed(bench, case.vehicle):.1f} m/s after {bound_s:g} s"
            await bench.clock.sleep(case.watch_s)
            assert is_standing(bench, case), "it does not move by itself"
            assert not terminal(bench, "r1.b1"), "it keeps its behavior"

        on_bench(make_arbiter, run, main)

    @needs("hold")
    def test_resume_goes_on_with_the_behavior(
        self, make_arbiter: MakeArbiter, case: ArbiterCase, run: Callable[[Main], None]
    ) -> None:
        """A held behavior does not end; a resumed one ends as it would have."""

        async def main(bench: ArbiterBench) -> None:
            await start(bench, "r1.b1", case.short, case.vehicle)
            await bench.running("r1.b1")
            await bench.arbiter.hold(case.vehicle)
            await bench.clock.sleep(2 * case.short_s)
            assert not terminal(bench, "r1.b1"), "a held behavior does not end"
            await bench.arbiter.resume(case.vehicle)
            end = await bench.ended("r1.b1", 2 * case.short_s)
            assert end.state is BehaviorState.SUCCEEDED, end

        on_bench(make_arbiter, run, main)

    @needs("hold")
    def test_hold_and_resume_of_an_idle_vehicle_are_quiet(
        self, make_arbiter: MakeArbiter, case: ArbiterCase, run: Callable[[Main], None]
    ) -> None:
        """There is nothing to report about."""

        async def main(bench: ArbiterBench) -> None:
            await bench.arbiter.hold(case.vehicle)
            await bench.arbiter.hold(case.vehicle)
            await bench.arbiter.resume(case.vehicle)
            await bench.arbiter.resume(case.vehicle)
            await bench.clock.sleep(case.watch_s)
            assert bench.reports == []

        on_bench(make_arbiter, run, main)

    @needs("link", "second vehicle")
    def test_a_cut_link_is_lost_within_the_declared_bound(
        self,
        make_arbiter: MakeArbiter,
        case: ArbiterCase,
        cut_link: CutLink | None,
        run: Callable[[Main], None],
    ) -> None:
        """LOST within `limits().lost_after_s`, and only what that link carries."""
        if cut_link is None:
            skip_unsupported("link", "the fixture `cut_link` is not overridden")

        async def main(bench: ArbiterBench) -> None:
            await start(bench, "r1.b1", case.long, case.vehicle)
            await start(bench, "r1.b2", case.long, case.other)
            await bench.running("r1.b1")
            await bench.running("r1.b2")
            cut_link(bench.arbiter, case.vehicle)
            bound_s = bench.arbiter.limits(case.vehicle).lost_after_s
            end = await bench.ended("r1.b1", bound_s + 1 + bench.late_s)
            assert end.state is BehaviorState.LOST, end
            assert not terminal(bench, "r1.b2"), "the other vehicle's link is up"

        on_bench(make_arbiter, run, main)

    @needs("link", "return", "telemetry")
    def test_a_lost_vehicle_that_is_heard_again_stops_before_it_is_free(
        self,
        make_arbiter: MakeArbiter,
        case: ArbiterCase,
        cut_link: CutLink | None,
        mend_link: CutLink | None,
        run: Callable[[Main], None],
    ) -> None:
        """The executive asks it to `reclaim`, or to `hold`; after that it stands, and then it does
        what it is given."""
        if cut_link is None or mend_link is None:
            skip_unsupported("return", "the fixture `mend_link` is not overridden")

        async def main(bench: ArbiterBench) -> None:
            await start(bench, "r1.b1", case.long, case.vehicle)
            moving = await bench.until(lambda: is_moving(bench, case), 30)
            assert moving, "the long behavior must move the vehicle"
            cut_link(bench.arbiter, case.vehicle)
            limits = bench.arbiter.limits(case.vehicle)
            end = await bench.ended("r1.b1", limits.lost_after_s + 1 + bench.late_s)
            assert end.state is BehaviorState.LOST, end
            mend_link(bench.arbiter, case.vehicle)
            assert await bench.until(lambda: heard(bench, case.vehicle), 30), "it is heard again"
            arbiter = bench.arbiter
            if isinstance(arbiter, ReclaimingArbiter):
                limit = bench.clock.now_us() + round(1e6 * limits.cancel_timeout_s)
                while why := await arbiter.reclaim(case.vehicle):
                    assert bench.clock.now_us() < limit, why
                    await bench.clock.sleep(1)
            else:
                await arbiter.hold(case.vehicle)
            stands = await bench.until(lambda: is_standing(bench, case), limits.hold_within_s)
            assert stands, f"still at {speed(bench, case.vehicle):.1f} m/s, though it is free"
            await bench.clock.sleep(case.watch_s)
            assert is_standing(bench, case), "it does not move by itself"
            await start(bench, "r1.b2", case.long, case.vehicle)
            moving = await bench.until(lambda: is_moving(bench, case), 30)
            assert moving, f"it must do what it is given: {bench.of('r1.b2')}"

        on_bench(make_arbiter, run, main)

    @needs("second vehicle")
    def test_two_vehicles_do_not_mix(
        self, make_arbiter: MakeArbiter, case: ArbiterCase, run: Callable[[Main], None]
    ) -> None:
        """A command to one vehicle leaves the other alone."""

        async def main(bench: ArbiterBench) -> None:
            await start(bench, "r1.b1", case.long, case.vehicle)
            await start(bench, "r1.b2", case.long, case.other)
            await bench.running("r1.b1")
            await bench.running("r1.b2")
            await bench.arbiter.cancel("r1.b1", 1)
            await bench.ended("r1.b1", 60)
            assert bench.states_of("r1.b2") == [BehaviorState.ACCEPTED, BehaviorState.RUNNING]

        on_bench(make_arbiter, run, main)

    @needs("hold", "second vehicle", "telemetry")
    def test_a_held_vehicle_does_not_hold_up_the_other(
        self, make_arbiter: MakeArbiter, case: ArbiterCase, run: Callable[[Main], None]
    ) -> None:
        """One stands, the other goes on."""

        async def main(bench: ArbiterBench) -> None:
            await start(bench, "r1.b1", case.long, case.vehicle)
            await start(bench, "r1.b2", case.long, case.other)
            await bench.running("r1.b1")
            await bench.running("r1.b2")
            await bench.arbiter.hold(case.vehicle)
            await bench.clock.sleep(case.watch_s)
            assert is_standing(bench, case)
            assert speed(bench, case.other) > case.standing_m_s, "the other was not held"

        on_bench(make_arbiter, run, main)

    @needs("telemetry")
    def test_telemetry_names_the_resource_and_rises_in_time(
        self, make_arbiter: MakeArbiter, case: ArbiterCase, run: Callable[[Main], None]
    ) -> None:
        """States carry the id of the fleet, and don't go back in time."""

        async def main(bench: ArbiterBench) -> None:
            await start(bench, "r1.b1", case.long, case.vehicle)
            await bench.clock.sleep(case.watch_s)
            states = [state for state in bench.states if state.resource == case.vehicle]
            assert states, "a vehicle that moves says where it is"
            times = [state.time_us for state in states]
            assert times == sorted(times)

        on_bench(make_arbiter, run, main)

    @needs("telemetry")
    def test_states_are_stamped_by_the_clock_that_was_lent(
        self, make_arbiter: MakeArbiter, case: ArbiterCase, run: Callable[[Main], None]
    ) -> None:
        """Mission time may run faster than the wall clock, or be virtual."""

        async def main(bench: ArbiterBench) -> None:
            began_us = bench.clock.now_us()
            await start(bench, "r1.b1", case.long, case.vehicle)
            await bench.clock.sleep(case.watch_s)
            state = bench.latest(case.vehicle)
            assert state is not None, "a vehicle that moves says where it is"
            assert began_us < state.time_us <= bench.clock.now_us() + 1_000_000

        on_bench(make_arbiter, run, main)

    @needs("virtual clock")
    def test_a_behavior_takes_its_time_of_the_clock_that_was_lent(
        self, make_arbiter: MakeArbiter, case: ArbiterCase, run: Callable[[Main], None]
    ) -> None:
        """In virtual time a rehearsal of hours takes seconds, and nothing real is waited for."""

        async def main(bench: ArbiterBench) -> None:
            await start(bench, "r1.b1", case.long, case.vehicle)
            await bench.running("r1.b1")
            running_us = bench.clock.now_us()
            await bench.until(lambda: bool(terminal(bench, "r1.b1")), 5 * case.watch_s)
            took_s = (bench.clock.now_us() - running_us) / 1_000_000
            assert took_s >= 5 * case.watch_s, f"the long behavior took {took_s:g} s of the clock"

        on_bench(make_arbiter, run, main)

    def test_nothing_leaks_after_close(
        self, make_arbiter: MakeArbiter, case: ArbiterCase, run: Callable[[Main], None]
    ) -> None:
        """No task, thread or file is left behind."""

        async def main(clock: Clock) -> None:
            before = asyncio.all_tasks()
            threads, files = _threads(), _open_files()
            async with ArbiterBench(make_arbiter(context(clock)), clock) as bench:
                await start(bench, "r1.b1", case.long, case.vehicle)
                await bench.running("r1.b1")
            await asyncio.sleep(0)
            leaked = asyncio.all_tasks() - before
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
    """How many files and sockets this process has open; 0 where nobody can tell."""
    with suppress(OSError):
        return len(os.listdir("/dev/fd"))  # noqa: PTH208  # a Path would be made of each
    return 0
