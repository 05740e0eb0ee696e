"""An executive with simulated vehicles, at each moment of which the owners of behaviors are asked.

A story is a list of steps. After a `crash` the next executive goes on with the journal and the
vehicles as they were at that moment; after a `crash_and_forget` the arbiter knows nothing any more.
"""

import asyncio
import shutil
from collections.abc import Awaitable, Callable, Sequence
from contextlib import suppress
from copy import deepcopy
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from m2pem.api.arbiter import BehaviorRequest
from m2pem.api.clock import VirtualClock, run_virtual
from m2pem.engine.records import BehaviorRequested, Record
from m2pem.engine.state import RunStatus
from m2pem.errors import M2pemError
from m2pem.executive.behavior_lifecycle import (
    JOINT_STATES,
    TRANSITIONS,
    ArbiterView,
    BehaviorViews,
    VehicleView,
)
from m2pem.executive.executive import Executive
from m2pem.fleet.fleet import Domain, Fleet, Vehicle
from m2pem.journal import MemoryJournal
from m2pem.mission.catalogue import BehaviorState, ResourceId
from m2pem.plugins import PluginManager
from m2pem.simulation.arbiters import SimArbiter
from m2pem.simulation.settings import Fault

from .conftest import START_US, behavior, flow, mission

ORIGIN = (38.1075, -77.3192, 60.0)
HOMES = {"ugv1": (38.1075, -77.3192), "uav1": (38.1085, -77.3192), "uav2": (38.1075, -77.3172)}
VEHICLES = tuple(ResourceId(name) for name in HOMES)


def follows(before: str, after: str) -> bool:
    """Whether one stage can come after another, with others between them that took no time."""
    reached, edge = {before}, {before}
    while edge:
        edge = {each.target for each in TRANSITIONS if each.source in edge} - reached
        reached |= edge
    return after in reached


FAR = '<m2pem:property name="target" value="[38.1175, -77.3192, 90]"/>'
NEAR = '<m2pem:property name="target" value="[38.1077, -77.3190, 80]"/>'


def errand(vehicle: str) -> bytes:
    """A way far off; the signal "Turn" interrupts it with a way back, and an error ends it."""
    elements = (
        behavior("Out", "goto", vehicle, parameters=FAR)
        + behavior("Back", "goto", vehicle, parameters=NEAR)
        + '<boundaryEvent id="Turned" attachedToRef="Out"><signalEventDefinition signalRef="Turn"/>'
        '</boundaryEvent><boundaryEvent id="Failed" attachedToRef="Out"><errorEventDefinition/>'
        '</boundaryEvent><startEvent id="S"/><endEvent id="E"/><endEvent id="F"/>'
    )
    ends = [("S", "Out"), ("Out", "Back"), ("Turned", "Back"), ("Back", "E"), ("Failed", "F")]
    flows = "".join(flow(*each) for each in ends)
    return mission(
        f'<signal id="Turn"/><process id="P" isExecutable="true">{elements}{flows}</process>'
    )


def climb(vehicle: str) -> bytes:
    """A takeoff, which is needed once before an aircraft can go anywhere."""
    task = behavior(
        "Up", "takeoff", vehicle, parameters='<m2pem:property name="altitude" value="20 m"/>'
    )
    flows = flow("S", "Up") + flow("Up", "E")
    return mission(
        f'<process id="P" isExecutable="true"><startEvent id="S"/>{task}<endEvent id="E"/>{flows}'
        "</process>"
    )


class SlowSim(SimArbiter):
    """Takes `slow_s` to hand over a start or a cancel; `deaf`: a cancel has no effect."""

    slow_s = 0.0
    deaf = False

    async def start(self, request: BehaviorRequest) -> None:
        if self.slow_s:
            await self._clock.sleep(self.slow_s)
        await super().start(request)

    async def cancel(self, behavior: str, epoch: int) -> None:
        if self.slow_s:
            await self._clock.sleep(self.slow_s)
        if not self.deaf:
            await super().cancel(behavior, epoch)


class Sims(PluginManager):
    """The built-in plugins; keeps the simulated arbiter that was made."""

    def __init__(self) -> None:
        super().__init__(block=("all",))
        self.made: list[SlowSim] = []

    def arbiter(self, name: str) -> Callable[..., Any]:
        def make(*arguments: Any) -> SlowSim:
            self.made.append(SlowSim(*arguments))
            return self.made[-1]

        return make


@dataclass
class Lives:
    """The behaviors that were seen, with all that their owners said.

    `stages`: the stages of each behavior, one after the other. `wrong`: where no joint state fits.
    """

    resources: dict[str, tuple[ResourceId, ...]] = field(default_factory=dict)
    stages: dict[str, list[str]] = field(default_factory=dict)
    wrong: list[str] = field(default_factory=list)


class World:
    """One executive's part of a story."""

    def __init__(
        self, clock: VirtualClock, executive: Executive, arbiter: SlowSim, lives: Lives
    ) -> None:
        self.clock = clock
        self.executive = executive
        self.arbiter = arbiter
        self.lives = lives
        self.step = ""

    # --- what owners say ------------------------------------------------------------------------

    def look(self, _: float | None) -> bool:
        """Compare what the owners of each behavior say with the table; called between moments."""
        for name, resources in self.lives.resources.items():
            views = self.views(name, resources)
            fitting = [each.name for each in JOINT_STATES if each.allows(views)]
            stages = self.lives.stages.setdefault(name, [])
            if len(fitting) != 1 or (stages and not follows(stages[-1], fitting[0])):
                text = f"{name} at {self.step}, after {stages[-3:]}: {fitting} fit {views}"
                if text not in self.lives.wrong:
                    self.lives.wrong.append(text)
            elif stages[-1:] != fitting:
                stages.append(fitting[0])
        return False

    def views(self, name: str, resources: tuple[ResourceId, ...]) -> BehaviorViews:
        """What all owners say of a behavior."""
        own = self.executive.supervisor.views(name, resources)
        report = _at_once(self.arbiter.query(name, None))
        if report.state is BehaviorState.UNKNOWN:
            arbiter = ArbiterView.UNKNOWN
        else:
            arbiter = ArbiterView.ENDED if report.state.terminal else ArbiterView.UNDER_WAY
        if any(self.arbiter.sight(each) is None for each in resources):
            vehicle = VehicleView.OUT_OF_REACH
        elif not any(self.arbiter.doing(each) == name for each in resources):
            vehicle = VehicleView.IDLE
        else:
            vehicle = VehicleView.HELD if report.held else VehicleView.BUSY
        return BehaviorViews(
            own.engine, own.dispatcher, own.availability, own.airspace, arbiter, vehicle
        )

    # --- what happens ---------------------------------------------------------------------------

    async def do(self, step: tuple[Any, ...]) -> None:
        """Carry out a step; what an operator is refused is no matter here."""
        self.step = str(step)
        what, *arguments = step
        with suppress(M2pemError):
            await getattr(self, what)(*arguments)

    async def sleep(self, seconds: float) -> None:
        await self.clock.sleep(seconds)

    async def begin(self, vehicle: str) -> None:
        await self.executive.control.start(errand(vehicle), even_if_busy=True)

    async def climb(self, vehicle: str) -> None:
        await self.executive.control.start(climb(vehicle), even_if_busy=True)

    async def turn(self) -> None:
        await self.executive.control.signal("Turn")

    async def pause(self, place: int) -> None:
        await self.executive.control.pause(self._run(place))

    async def resume(self, place: int) -> None:
        await self.executive.control.resume(self._run(place))

    async def stop(self, place: int) -> None:
        await self.executive.control.stop(self._run(place))

    async def take(self, vehicle: str) -> None:
        await self.executive.control.take(vehicle, by="ann")

    async def give_back(self, vehicle: str) -> None:
        await self.executive.control.give_back(vehicle, by="ann")

    async def answer(self, decision: str) -> None:
        for prompt in self.executive.control.prompts():
            await self.executive.control.answer(prompt.run, prompt.prompt, decision)

    async def cut(self, vehicle: str) -> None:
        self.arbiter.lose_link(ResourceId(vehicle))

    async def mend(self, vehicle: str) -> None:
        self.arbiter.restore_link(ResourceId(vehicle))

    async def fault(self, vehicle: str, kind: str, after_s: float) -> None:
        self.arbiter.inject(ResourceId(vehicle), Fault(kind, after_s=after_s))

    async def slow(self, seconds: float) -> None:
        self.arbiter.slow_s = seconds

    async def deafen(self) -> None:
        self.arbiter.deaf = True

    async def old_command(self) -> None:
        """The executive before this one did not die: its commands come late, and change nothing."""
        for name, resources in self.lives.resources.items():
            runner = self.executive.runners.get(name.partition(".")[0])
            if runner is None or runner.epoch == 1 or name not in runner.run.state.behaviors:
                continue
            before = self.views(name, resources)
            await self.arbiter.cancel(name, runner.epoch - 1)
            await self.arbiter.start(BehaviorRequest(name, runner.epoch - 1, "goto", {}, resources))
            assert self.views(name, resources) == before, name

    def _run(self, place: int) -> str:
        runs = list(self.executive.runners)
        return runs[place % len(runs)] if runs else "none"


def _at_once(call: Awaitable[Any]) -> Any:
    """The result of a coroutine that waits for nothing."""
    try:
        call.__await__().send(None)
    except StopIteration as done:
        return done.value
    raise AssertionError("it waits")


def fleet(state: Path) -> Fleet:
    """A ground vehicle, and two aircraft that are kept apart."""
    return Fleet(
        "test",
        "test.yaml",
        {
            name: Vehicle(
                name,
                Domain.AIR if name.startswith("uav") else Domain.GROUND,
                "sim",
                {"home": [*HOMES[name]], "state": str(state)},
            )
            for name in VEHICLES
        },
        origin=ORIGIN,
        vertical_separation_m=10.0,
    )


def live(steps: Sequence[tuple[Any, ...]], folder: Path) -> Lives:
    """Play a story to its end, and return what was seen."""
    lives = Lives()
    journal, start_us, number = MemoryJournal(), START_US, 0
    rest = list(steps)
    while True:
        here = folder / str(number)
        following = folder / str(number + 1)
        for each in (here, following):
            each.mkdir(exist_ok=True)

        async def main(clock: VirtualClock) -> MemoryJournal | None:
            return await _drive(clock, rest, journal, here, following, lives)  # noqa: B023

        left = run_virtual(main, start_us)
        if left is None:
            return lives
        outage_s = rest.pop(0)[1]
        journal, number = left, number + 1
        decided_us = [entry.at_us for entry in entries_of(left)]
        start_us = max(decided_us, default=start_us) + round(outage_s * 1_000_000)


def entries_of(journal: MemoryJournal) -> list[Any]:
    """All entries of a journal."""

    async def read() -> list[Any]:
        return [entry for line in await journal.runs() async for entry in journal.read(line.run)]

    return asyncio.run(read())


def _copy(here: Path, following: Path) -> None:
    for file in here.glob("world.db*"):
        shutil.copy(file, following / file.name)


async def _drive(
    clock: VirtualClock,
    rest: list[tuple[Any, ...]],
    journal: MemoryJournal,
    here: Path,
    following: Path,
    lives: Lives,
) -> MemoryJournal | None:
    """Carry out steps until a crash, which stays the first of the rest, or to the end."""

    def note(_: str, records: Sequence[Record]) -> None:
        for record in records:
            if isinstance(record, BehaviorRequested):
                ids = tuple(ResourceId(each) for each in record.resources)
                lives.resources.setdefault(record.behavior, ids)

    plugins = Sims()
    state = here / "world.db"
    executive = Executive(fleet(state), journal, plugins, clock, on_records=note)
    async with executive:
        world = World(clock, executive, plugins.made[0], lives)
        clock.when_idle(world.look)
        for line in await journal.runs():
            if line.outcome is None:
                await executive.resume(line.run)
        while rest and rest[0][0] not in ("crash", "crash_and_forget"):
            await world.do(rest.pop(0))
        if rest:
            clock.when_idle(lambda _: False)  # what becomes of these is seen by the next executive
            if rest[0][0] == "crash":
                _copy(here, following)
            left = deepcopy(journal)
            for run, runner in executive.runners.items():
                if runner.run.state.status is not RunStatus.ENDED:
                    await left.release(run)
            return left
        world.step = "the end"
    world.look(None)
    return None
