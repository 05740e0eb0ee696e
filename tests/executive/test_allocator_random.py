"""Random stories of allocation: whatever is taken, given back, ended or stopped at any time."""

import asyncio
from dataclasses import dataclass, field
from typing import Any

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from m2pem.api.control import RunStatus
from m2pem.engine.records import BehaviorEnded, BehaviorRequested, ResourcesAllocated
from m2pem.engine.run import MissionRun
from m2pem.fleet.fleet import restore
from m2pem.journal import MemoryJournal
from m2pem.journal.mission import mission_of
from m2pem.mission.catalogue import BehaviorState

from .conftest import World, flow, mission
from .test_allocator import task

VEHICLES = ("ugv1", "ugv2", "uav1")

NEEDS = (
    "requires='true'",
    "requires=\"vehicle.domain == 'ground'\"",
    "requires=\"vehicle.domain == 'air'\"",
    "vehicle='ugv1'",
)

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


@dataclass
class Story:
    """Carries out deeds and keeps what is under way."""

    world: World
    runs: list[str] = field(default_factory=list)
    stopped: set[str] = field(default_factory=set)
    taken: set[str] = field(default_factory=set)

    @property
    def active(self) -> dict[str, tuple[str, ...]]:
        """The behaviors that have not ended, and their vehicles; a vehicle is in one of them."""
        found: dict[str, tuple[str, ...]] = {}
        for record in self.world.seen:
            if isinstance(record, BehaviorRequested):
                found[record.behavior] = record.resources
            elif isinstance(record, BehaviorEnded):
                del found[record.behavior]
        held = [each for resources in found.values() for each in resources]
        assert len(held) == len(set(held))
        return found

    async def do(self, what: str, subject: Any) -> None:
        control = self.world.executive.control
        live = [run for run in self.runs if run not in self.stopped]
        match what:
            case "start":
                self.runs.append(await control.start(subject, even_if_busy=True))
            case "end" if self.active:
                behavior = list(self.active)[subject % len(self.active)]
                self.world.fake.report(behavior, BehaviorState.SUCCEEDED)
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
        assert self.active is not None

    async def steer(self, what: str, run: str) -> None:
        control = self.world.executive.control
        runner = self.world.executive.runner(run)
        if runner.done.is_set():
            return
        if what == "stop":
            self.stopped.add(run)
            stopping = asyncio.ensure_future(control.stop(run))
            await self.world.clock.sleep(0.1)
            for behavior in [each for each in self.active if each.startswith(f"{run}.")]:
                self.world.fake.report(behavior, BehaviorState.CANCELLED)
            await stopping
        elif (runner.run.state.status.value == "paused") is (what == "resume"):
            await (control.resume(run) if what == "resume" else control.pause(run))

    async def finish(self) -> None:
        """Give everything back and let everything end."""
        for vehicle in sorted(self.taken):
            await self.do("give back", vehicle)
        for run in self.runs:
            if run not in self.stopped:
                await self.steer("resume", run)
        for _ in range(4 * len(self.runs) + 4):
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
