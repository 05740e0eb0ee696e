"""Random stories of allocation: whatever is taken, given back, lost, received again, ended or
stopped at any time."""

import asyncio
from dataclasses import dataclass, field
from typing import Any

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from m2pem.api.runs import RunStatus
from m2pem.api.telemetry import LinkState, VehicleState
from m2pem.engine.records import (
    BehaviorCancelRequested,
    BehaviorEnded,
    BehaviorRequested,
    ResourcesAllocated,
)
from m2pem.engine.run import MissionRun
from m2pem.fleet.fleet import restore
from m2pem.journal import MemoryJournal
from m2pem.journal.mission import mission_of
from m2pem.mission.catalogue import BehaviorState, ResourceId

from .conftest import World, flow, mission, task

VEHICLES = ("ugv1", "ugv2", "uav1")

NEEDS = (
    "requires='true'",
    "requires=\"vehicle.domain == 'ground'\"",
    "requires=\"vehicle.domain == 'air'\"",
    "vehicle='ugv1'",
)

REASSIGNED = tuple(f"{each} onLoss='reassign'" for each in NEEDS[:3])

Role = tuple[str, int]
"""What a role needs, and its priority."""


def two_tasks(first: Role, second: Role, *, at_once: bool) -> bytes:
    """Tasks that begin together, or one after the other."""
    tasks = "".join(
        task(name, f"{needs} wait='unlimited' priority='{priority}'")
        for name, (needs, priority) in (("A", first), ("B", second))
    )
    between = "F" if at_once else "A"
    fork = '<parallelGateway id="F"/>' if at_once else ""
    flows = flow("S", "F") + flow("F", "A") if at_once else flow("S", "A")
    return mission(
        f'<process id="P" isExecutable="true"><startEvent id="S"/>{fork}{tasks}'
        f"{flows}{flow(between, 'B')}</process>"
    )


ROLES = st.tuples(st.sampled_from(NEEDS), st.integers(0, 2))
MISSIONS = st.builds(two_tasks, ROLES, ROLES, at_once=st.booleans())
DEEDS = st.lists(
    st.one_of(
        st.tuples(st.just("start"), MISSIONS),
        st.tuples(st.just("end"), st.integers(0, 9)),
        st.tuples(st.just("take"), st.sampled_from(VEHICLES)),
        st.tuples(st.just("give back"), st.sampled_from(VEHICLES)),
        st.tuples(st.just("stop"), st.integers(0, 9)),
        st.tuples(st.just("pause"), st.integers(0, 9)),
        st.tuples(st.just("resume"), st.integers(0, 9)),
        st.tuples(st.just("wait"), st.none()),
    ),
    max_size=25,
)


REASSIGNED_ROLES = st.tuples(st.sampled_from(REASSIGNED), st.integers(0, 2))
LOSSES = st.lists(
    st.one_of(
        st.tuples(
            st.just("start"),
            st.builds(two_tasks, REASSIGNED_ROLES, REASSIGNED_ROLES, at_once=st.booleans()),
        ),
        st.tuples(st.just("end"), st.integers(0, 9)),
        st.tuples(
            st.sampled_from(["lose", "return", "run down", "charge", "snatch", "give back"]),
            st.sampled_from(VEHICLES),
        ),
        st.tuples(st.sampled_from(["stop", "pause", "resume"]), st.integers(0, 9)),
        st.tuples(st.just("wait"), st.none()),
    ),
    max_size=25,
)


@dataclass
class Story:
    """Carries out deeds and keeps what is under way."""

    world: World
    runs: list[str] = field(default_factory=list)
    stopped: set[str] = field(default_factory=set)
    taken: set[str] = field(default_factory=set)
    lost: set[str] = field(default_factory=set)
    low: set[str] = field(default_factory=set)
    answered: set[str] = field(default_factory=set)

    @property
    def active(self) -> dict[str, tuple[str, ...]]:
        """The behaviors that have not ended, and their vehicles; a vehicle is in one of them, and
        in others only if these are being cancelled."""
        found: dict[str, tuple[str, ...]] = {}
        going_on: dict[str, tuple[str, ...]] = {}
        for record in self.world.seen:
            if isinstance(record, BehaviorRequested):
                found[record.behavior] = going_on[record.behavior] = record.resources
            elif isinstance(record, BehaviorEnded):
                del found[record.behavior]
                going_on.pop(record.behavior, None)
            elif isinstance(record, BehaviorCancelRequested):
                going_on.pop(record.behavior, None)
        held = [each for resources in going_on.values() for each in resources]
        assert len(held) == len(set(held))
        return found

    async def send_telemetry(self) -> None:
        """Every vehicle that is not lost sends its state twice a second."""
        while True:
            for name in VEHICLES:
                self.says(name)
            await self.world.clock.sleep(0.5)

    def says(self, name: str) -> None:
        link = LinkState.LOST if name in self.lost else LinkState.CONNECTED
        charge = 0.1 if name in self.low else 1.0
        now_us = self.world.clock.now_us()
        self.world.fake.say(
            VehicleState(ResourceId(name), now_us, link=link, battery_fraction=charge)
        )

    def answer_cancels(self) -> None:
        """What is cancelled stops, if its vehicle is in reach."""
        for behavior, resources in self.active.items():
            asked = self.world.fake.count("cancel", behavior)
            if asked and behavior not in self.answered and self.lost.isdisjoint(resources):
                self.answered.add(behavior)
                self.world.fake.report(behavior, BehaviorState.CANCELLED)

    async def do(self, what: str, subject: Any) -> None:
        control = self.world.executive.control
        live = [run for run in self.runs if run not in self.stopped]
        match what:
            case "start":
                self.runs.append(await control.start(subject, even_if_busy=True))
            case "end" if self.active:
                behavior = list(self.active)[subject % len(self.active)]
                if self.lost.isdisjoint(self.active[behavior]):
                    self.world.fake.report(behavior, BehaviorState.SUCCEEDED)
            case "lose" | "return" | "run down" | "charge":
                facts = self.lost if what in ("lose", "return") else self.low
                (facts.add if what in ("lose", "run down") else facts.discard)(subject)
                self.says(subject)
            case "snatch" if subject not in self.taken:
                self.taken.add(subject)
                await control.take(subject, by="ops")
            case "take" if subject not in self.taken:
                if all(subject not in resources for resources in self.active.values()):
                    self.taken.add(subject)
                    await control.take(subject, by="ops")
            case "give back" if subject in self.taken:
                self.taken.remove(subject)
                await control.give_back(subject, by="ops")
            case "stop" | "pause" | "resume" if live:
                await self.steer(what, live[subject % len(live)])
        await self.world.clock.sleep(0.1)
        self.answer_cancels()

    async def steer(self, what: str, run: str) -> None:
        control = self.world.executive.control
        runner = self.world.executive.runner(run)
        if runner.done.is_set():
            return
        if what == "stop":
            self.stopped.add(run)
            stopping = asyncio.ensure_future(control.stop(run))
            await self.world.clock.sleep(0.1)
            self.answer_cancels()
            await stopping
        elif (runner.run.state.status.value == "paused") is (what == "resume"):
            await (control.resume(run) if what == "resume" else control.pause(run))

    async def finish(self) -> None:
        """Give everything back and let everything end."""
        for vehicle in VEHICLES:
            await self.do("return", vehicle)
            await self.do("charge", vehicle)
        for vehicle in sorted(self.taken):
            await self.do("give back", vehicle)
        for run in self.runs:
            if run not in self.stopped:
                await self.steer("resume", run)
        for _ in range(4 * len(self.runs) + 4):
            self.answer_cancels()
            for behavior in self.active:
                self.world.fake.report(behavior, BehaviorState.SUCCEEDED)
            await self.world.clock.sleep(0.5)


@given(DEEDS)
@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_nobody_waits_for_ever_and_no_vehicle_has_two_holders(play, deeds):
    journal = MemoryJournal()

    async def tell(world: World) -> list[RunStatus]:
        story = Story(world)
        for what, subject in deeds:
            await story.do(what, subject)
        await story.finish()
        control = world.executive.control
        return [(await control.wait(run)).status for run in story.runs if run not in story.stopped]

    statuses = play(tell, *VEHICLES, journal=journal)
    assert statuses == [RunStatus.COMPLETED] * len(statuses)
    asyncio.run(decide_again(journal))


@given(LOSSES)
@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_whatever_is_lost_and_returns_its_work_is_done(play, deeds):
    """The vehicles of all tasks may be replaced by another that fills the role."""
    journal = MemoryJournal()

    async def tell(world: World) -> list[RunStatus]:
        story = Story(world)
        sending = asyncio.create_task(story.send_telemetry())
        for what, subject in deeds:
            await story.do(what, subject)
        await story.finish()
        control = world.executive.control
        found = [(await control.wait(run)).status for run in story.runs if run not in story.stopped]
        sending.cancel()
        return found

    statuses = play(tell, *VEHICLES, journal=journal, watch_links=True)
    assert statuses == [RunStatus.COMPLETED] * len(statuses)
    asyncio.run(decide_again(journal))


async def decide_again(journal: MemoryJournal) -> None:
    """Every decision comes out of the journal alone again."""
    for line in await journal.runs():
        run = MissionRun(
            mission_of(line.header),
            restore(line.header.fleet),
            line.run,
            1_000,
        )
        async for entry in journal.read(line.run):
            step = run.receive(entry.input, entry.at_us)
            assert tuple(step.records) == tuple(entry.records)
            for record in step.records:
                if isinstance(record, ResourcesAllocated):
                    assert record.considered["roles"]
