"""Random faults and operators, on one executive after the other, in virtual time.

Whatever happens, in whichever order: after each step the journal, the vehicles and what is held
agree, and in the end every mission ends.
"""

import asyncio
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    initialize,
    invariant,
    precondition,
    rule,
)

from m2pem.api.arbiter import BehaviorId
from m2pem.api.authoring import MissionFiles
from m2pem.api.runs import RunId
from m2pem.engine import records as r
from m2pem.engine.state import BehaviorPhase, RunStatus
from m2pem.journal.sqlite import SqliteJournal
from m2pem.mission.catalogue import ResourceId
from m2pem.simulation.arbiters import SimArbiter
from tests.chaos.model import Life, Unreliable
from tests.chaos.worlds import SimulatedVehicles
from tests.executive.conftest import START_US
from tests.incident_rows import verify_replays

US_PER_S = 1_000_000
MOST_RUNS = 4
VEHICLES = st.sampled_from(["ugv1", "ugv2", "uav1"])
RUN = st.integers(0, MOST_RUNS)
ENDS_WITHIN_S = 3600.0


class Faults(RuleBasedStateMachine):
    """Executives, vehicles and operators. `committed`: what observers have seen of each run."""

    @initialize()
    def begin(self) -> None:
        self._folder = TemporaryDirectory(prefix="m2pem-model-")
        self._path = Path(self._folder.name)
        self._vehicles = SimulatedVehicles(self._path)
        self._life = Life(self._path, self._vehicles, START_US)
        self._before: list[tuple[RunId, r.Record]] = []
        self._cut: set[str] = set()

    # --- operators ------------------------------------------------------------------------------

    @property
    def _runs(self) -> list[RunId]:
        return list(self._life.executive.runners)

    def _run(self, number: int) -> RunId:
        return self._runs[number % len(self._runs)] if self._runs else RunId("r0")

    @precondition(lambda self: len(self._runs) < MOST_RUNS)
    @rule(which=st.integers(0, 1))
    def start(self, which: int) -> None:
        mission = self._vehicles.missions[which]
        source = MissionFiles(mission.name, mission.source)
        self._life.act(self._life.control.start(source, even_if_busy=True, by="anna"))

    @rule(seconds=st.sampled_from([0.1, 1.0, 3.0, 8.0, 20.0]))
    def time_passes(self, seconds: float) -> None:
        self._life.pass_s(seconds)

    @rule(number=RUN)
    def pause(self, number: int) -> None:
        self._life.ask(self._life.control.pause(self._run(number), by="anna"))

    @rule(number=RUN)
    def resume(self, number: int) -> None:
        self._life.ask(self._life.control.resume(self._run(number), by="anna"))

    @rule(number=RUN)
    def stop(self, number: int) -> None:
        """It reaches the vehicles before anything else."""
        run = self._run(number)
        runner = self._life.executive.runners.get(run)
        if runner is None or runner.done.is_set():
            return
        active = [
            each
            for each in runner.run.state.behaviors.values()
            if each.phase is BehaviorPhase.ACTIVE and each.state is not None
        ]
        self._life.ask(self._life.control.stop(run, by="anna"))
        cancelled = self._life.cancelled.get(run, set())
        for each in active:
            if not self._cut.intersection(each.resources):
                doing = [self._life.vehicles.doing(ResourceId(name)) for name in each.resources]
                assert each.id in cancelled or each.id not in doing, f"{each.id} goes on"

    @rule(number=RUN, decision=st.sampled_from(["yes", "no", "resume", "skip", "abort"]))
    def answer(self, number: int, decision: str) -> None:
        prompts = self._life.control.prompts()
        if prompts:
            prompt = prompts[number % len(prompts)]
            known = [each.value for each in prompt.decisions]
            decision = decision if decision in known else known[0]
            self._life.ask(
                self._life.control.answer(prompt.run, prompt.prompt, decision, by="anna")
            )

    @rule(vehicle=VEHICLES)
    def take(self, vehicle: str) -> None:
        self._life.ask(self._life.control.take(vehicle, by="ben"))

    @rule(vehicle=VEHICLES)
    def give_back(self, vehicle: str) -> None:
        self._life.ask(self._life.control.give_back(vehicle, by="ben"))

    # --- faults ---------------------------------------------------------------------------------

    @rule(place=st.integers(0, 30))
    def a_report_comes_again(self, place: int) -> None:
        self._life.vehicles.again.append(place)

    @rule(vehicle=VEHICLES)
    def a_link_breaks(self, vehicle: str) -> None:
        self._life.link(vehicle, up=False)
        self._cut.add(vehicle)

    @rule(vehicle=VEHICLES)
    def a_link_is_back(self, vehicle: str) -> None:
        self._life.link(vehicle, up=True)
        self._cut.discard(vehicle)

    @rule(outage_s=st.sampled_from([0.0, 0.5, 5.0, 60.0, 4000.0]))
    def the_executive_dies(self, outage_s: float) -> None:
        """The next one is there after a time, by a clock that may have jumped."""
        self._before += self._life.seen
        now_us = self._life.clock.now_us() + round(outage_s * US_PER_S)
        self._life.drop()
        self._life = Life(self._path, self._vehicles, now_us)
        self._cut.clear()

    # --- what always holds ----------------------------------------------------------------------

    @invariant()
    def vehicles_do_what_was_requested_once_and_one_thing_at_a_time(self) -> None:
        records = [each for _, each in [*self._before, *self._life.seen]]
        requested = {e.behavior: e for e in records if isinstance(e, r.BehaviorRequested)}
        again: dict[str, set[int]] = {}
        for each in records:
            if isinstance(each, r.BehaviorRestarted):
                again.setdefault(each.behavior, set()).add(each.epoch)
        begun = self._vehicles.begun()
        for each in begun:
            assert each.behavior in requested, f"{each} was not requested"
            assert not each.overlaps, each
        for behavior, count in Counter(each.behavior for each in begun).items():
            assert count <= 1 + len(again.get(behavior, ())), f"{behavior} was begun {count} times"

    @invariant()
    def what_a_run_commands_is_held_for_it_alone(self) -> None:
        held: dict[str, str] = {}
        for runner in self._life.executive.runners.values():
            for behavior in runner.run.state.behaviors.values():
                if behavior.state is None or behavior.phase is not BehaviorPhase.ACTIVE:
                    continue
                for name in behavior.resources:
                    assert name not in held, f"{name}: {held[name]} and {behavior.id}"
                    held[name] = behavior.id
        for name, behavior in held.items():
            holder = self._life.executive.supervisor.availability.holder(ResourceId(name))
            assert holder == behavior, f"{name} does {behavior}, and {holder} has it"

    def give_up(self) -> None:
        """End without a look at how the runs end."""
        self._life.drop()
        self._folder.cleanup()

    def teardown(self) -> None:
        """What is broken is mended, what is asked is answered: every run ends."""
        life = self._life
        for vehicle in ("ugv1", "ugv2", "uav1"):
            life.link(vehicle, up=True)
            life.pass_s(1.0)
            life.ask(life.control.give_back(vehicle, by="ben"))
        until_us = life.clock.now_us() + round(ENDS_WITHIN_S * US_PER_S)
        while running := [e for e in life.executive.runners.values() if not e.done.is_set()]:
            for each in running:
                if each.run.state.status is RunStatus.PAUSED:
                    life.ask(life.control.resume(each.id, by="anna"))
            for prompt in life.control.prompts():
                decision = prompt.decisions[0].value
                life.ask(life.control.answer(prompt.run, prompt.prompt, decision, by="anna"))
            life.pass_s(5.0)
            assert life.clock.now_us() < until_us, f"they do not end: {[e.id for e in running]}"
        seen = [*self._before, *life.seen]
        life.drop()
        asyncio.run(self._compare(seen))
        self._folder.cleanup()

    async def _compare(self, seen: list[tuple[RunId, r.Record]]) -> None:
        """All that was seen is in the journal, and each run is replayed to the same records."""
        journal = SqliteJournal.open(self._path / "journal.db")
        try:
            infos = await journal.runs()
            assert not [each.loss for each in infos if each.loss]
            kept = {
                each.run: [record async for e in journal.read(each.run) for record in e.records]
                for each in infos
            }
            for run, record in seen:
                assert record in kept[run], f"{run} has lost {record}"
            await verify_replays(journal, [each.run for each in infos if each.last_seq])
        finally:
            await journal.close()


TestFaults = Faults.TestCase
TestFaults.settings = settings(max_examples=20, stateful_step_count=25)


async def _no_cancel(vehicles: Unreliable, behavior: BehaviorId, epoch: int) -> None:
    """A cancel that reaches no vehicle."""


async def _late_cancel(vehicles: Unreliable, behavior: BehaviorId, epoch: int) -> None:
    """A cancel that comes when the stop has been committed."""
    await asyncio.sleep(2.0)
    await SimArbiter.cancel(vehicles, behavior, epoch)


@pytest.mark.parametrize("mutant", [_no_cancel, _late_cancel])
def test_a_stop_that_reaches_no_vehicle_or_comes_late_is_found(
    mutant: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stopped() -> Faults:
        played = Faults()
        played.begin()
        played.start(0)
        played.time_passes(3.0)
        return played

    sound = stopped()
    sound.stop(0)
    sound.give_up()
    monkeypatch.setattr(Unreliable, "cancel", mutant)
    worse = stopped()
    with pytest.raises(AssertionError, match="goes on"):
        worse.stop(0)
    worse.give_up()
