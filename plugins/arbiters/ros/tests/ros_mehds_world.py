"""The mixed fleet of the field tests: its vehicles and its camera simulated by programs of their
own, over real DDS and UDP, and an executive that runs a vignette on them."""

import asyncio
import logging
import socket
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import rclpy
from m2pem_interfaces.msg import Detection
from rclpy.context import Context
from ros_e2e_programs import Program, Programs, programs
from std_msgs.msg import String

from m2pem import load_fleet
from m2pem.api import LinkState, OpenPrompt, ResourceId, StampedRecord, VehicleState
from m2pem.api.clock import SystemClock
from m2pem.engine import records as r
from m2pem.executive.executive import Executive
from m2pem.fleet.allocation import MANNED
from m2pem.journal import MemoryJournal
from m2pem.plugins import PluginManager
from m2pem.rehearsal.answers import Answers, load_answers
from m2pem.rehearsal.scripted import ScriptedPlugins

log = logging.getLogger("mehds")

REPOSITORY = Path(__file__).parents[4]
FLEETS = REPOSITORY / "fleet_configs"
MISSIONS = REPOSITORY / "missions"
COPTER = Path(__file__).with_name("ros_mehds_copter.py")
SPEED = 4.0
LOST_AFTER_S = 20
"""Longer than in the fleet: so long may a busy computer leave a program alone."""

SILENT = f"silent for {LOST_AFTER_S + 2} s"
"""Until it is lost, and hardly longer: it is back, and has stopped, before an operator answers."""

STUCK = "stuck for 25 s"
"""ROUTE_BLOCKED after 15 s."""

THINKS_S = 6.0
"""So long does an operator think, in simulated time."""

PATIENCE_S = 60.0


@dataclass(frozen=True, slots=True)
class Trouble:
    """What goes wrong: so many seconds after the element's task was commanded, or its prompt was
    opened, for the `visit`-th time. `ground`, `air`: a fault of these vehicles; `camera`: of the
    head; `signal`: what an operator sends; `found`: what the computer beside the UAV's camera finds
    below it."""

    element: str
    after_s: float
    visit: int = 1
    ground: str = ""
    air: str = ""
    camera: str = ""
    signal: str = ""
    found: str = ""


@dataclass(frozen=True, slots=True)
class Story:
    """One way through a vignette: its answers file, the end events that it comes to, what goes
    wrong on the way, and for whom the operator does not wait. `live`: services without a script."""

    answers: str
    status: str
    ends: tuple[str, ...]
    problems: tuple[Trouble, ...] = ()
    given_up: tuple[str, ...] = ()
    live: tuple[str, ...] = ()

    @property
    def mission(self) -> Path:
        return MISSIONS / f"{self.answers[: len('mehds_vignette_N')]}.bpmn"


@dataclass(slots=True)
class MissionLog:
    """What came of it. `entered`: the elements; `ended`: of each behavior, how it ended."""

    status: str = ""
    detail: str = ""
    entered: set[str] = field(default_factory=set)
    requested: dict[str, r.BehaviorRequested] = field(default_factory=dict)
    ended: dict[str, r.BehaviorEnded] = field(default_factory=dict)
    errors: list[tuple[str, str]] = field(default_factory=list)
    written: list[tuple[str, object]] = field(default_factory=list)

    def where(self) -> str:
        """How far it has come, for people."""
        going = [
            f"{each.element} of {', '.join(each.resources)}"
            for name, each in self.requested.items()
            if name not in self.ended
        ]
        done = [
            f"{self.requested[name].element}: {each.state} {each.code} {each.reason}"
            for name, each in self.ended.items()
        ]
        return f"going on: {going}; done: {done}; errors: {self.errors}"


class World:
    """The programs that simulate."""

    def __init__(self, made: Programs, fleet: Path, domain: int, port: int) -> None:
        self.fleet = fleet
        self._context = Context()
        self._domain = domain
        speed = f"{SPEED:g}"
        self.ground = made.m2pem("sim", "ros", "--fleet", fleet, "--speed", speed)
        self.cameras = made.m2pem("sim", "ros-cameras", "--fleet", fleet, "--speed", speed)
        self.air = made.python(COPTER, port, speed)
        for program in self._programs:
            program.until_line("ready")
        rclpy.init(context=self._context, domain_id=domain)
        node = rclpy.create_node("troubles", context=self._context)
        self._node = node
        self._camera = node.create_publisher(String, "/evsg2/sim_fault", 10)
        self._detections = node.create_publisher(Detection, "/uav1/detections", 100)

    @property
    def _programs(self) -> tuple[Program, ...]:
        return self.ground, self.cameras, self.air

    def problem(self, problem: Trouble) -> None:
        """Let it happen."""
        if problem.ground:
            self.ground.type(problem.ground)
        if problem.air:
            self.air.type(problem.air)
        if problem.camera:
            self._camera.publish(String(data=problem.camera))
        if problem.found:
            self._detections.publish(Detection(type=problem.found))

    def close(self) -> None:
        self._node.destroy_node()
        rclpy.try_shutdown(context=self._context)


@contextmanager
def world(folder: Path, domain: int) -> Iterator[World]:
    """In a ROS domain, with a UDP port of its own."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
    for name in ("geo", "routes"):
        (folder / name).symlink_to(FLEETS / name)
    text = (FLEETS / "mehds_mixed.yaml").read_text(encoding="utf-8")
    for old, new in ((":14550", f":{port}"), ("lost_after: 10 s", f"lost_after: {LOST_AFTER_S} s")):
        assert old in text
        text = text.replace(old, new)
    fleet = folder / "fleet.yaml"
    fleet.write_text(text, encoding="utf-8")
    with programs(folder, domain) as made:
        made_world = World(made, fleet, domain, port)
        try:
            yield made_world
        finally:
            made_world.close()


class Play:
    """One run of a story: the operator, and what goes wrong."""

    def __init__(self, world: World, story: Story) -> None:
        self.told = MissionLog()
        self._world = world
        self._story = story
        self._clock = SystemClock(SPEED)
        self._visits: Counter[str] = Counter()
        self._tasks: set[asyncio.Task[None]] = set()
        script = load_answers(MISSIONS / "answers" / f"{story.answers}.yaml")
        self._decisions = {
            key: [each.decision for each in entries]
            for key, entries in script.model.answers.items()
        }
        services = {k: v for k, v in script.model.services.items() if k not in story.live}
        signals = [] if any(each.signal for each in story.problems) else script.model.signals
        self._script = Answers(
            script.model.model_copy(
                update={
                    "answers": {},
                    "behaviors": {},
                    "services": services,
                    "signals": signals,
                }
            ),
            script.source,
        )

    async def run(self, within_s: float) -> MissionLog:
        """To its end; `within_s` of real time."""
        try:
            return await self._run_to_its_end(within_s)
        except TimeoutError:
            raise AssertionError(f"not within {within_s:g} s: {self.told.where()}") from None

    async def _run_to_its_end(self, within_s: float) -> MissionLog:
        executive = Executive(
            load_fleet(self._world.fleet),
            MemoryJournal(),
            ScriptedPlugins(PluginManager(), self._script),
            self._clock,
            on_records=self._script.seen,
        )
        async with executive, asyncio.timeout(within_s):
            self._executive = executive
            self._failed = asyncio.get_running_loop().create_future()
            await self._all_ready()
            self._run = await executive.control.start(self._story.mission)
            act = self._script.act(
                executive.control, self._run, self._clock, default_first_decision=False
            )
            self._begin(act)
            self._begin(self._watch())
            ending = asyncio.ensure_future(self._wait())
            await asyncio.wait((ending, self._failed), return_when=asyncio.FIRST_COMPLETED)
            if self._failed.done():
                ending.cancel()
                self._failed.result()
            ending.result()
            for task in self._tasks:
                task.cancel()
            await asyncio.gather(*self._tasks, return_exceptions=True)
        return self.told

    def _begin(self, coroutine: Any) -> None:
        task = asyncio.get_running_loop().create_task(coroutine)
        self._tasks.add(task)
        task.add_done_callback(self._see_end)

    def _see_end(self, task: asyncio.Task[None]) -> None:
        if not task.cancelled() and task.exception() is not None and not self._failed.done():
            self._failed.set_exception(task.exception())

    async def _wait(self) -> None:
        summary = await self._executive.control.wait(self._run)
        self.told.status, self.told.detail = summary.status.value, summary.detail
        while len(self.told.ended) < len(self.told.requested):  # noqa: ASYNC110  # one loop does both
            await asyncio.sleep(0.05)

    async def _watch(self) -> None:
        async for notice in self._executive.control.subscribe(self._run):
            if isinstance(notice, OpenPrompt):
                self._see(notice.element)
                self._begin(self._answer(notice))
            elif isinstance(notice, StampedRecord):
                self._record(notice.record)

    def _record(self, record: object) -> None:
        told = self.told
        if isinstance(record, r.TokenEntered):
            told.entered.add(record.element)
        elif isinstance(record, r.BehaviorRequested):
            told.requested[record.behavior] = record
            log.info("%s: %s begins %s", record.element, record.resources, record.behavior)
            self._see(record.element)
        elif isinstance(record, r.BehaviorEnded):
            told.ended[record.behavior] = record
            log.info("%s %s %s", record.behavior, record.state, record.reason)
        elif isinstance(record, r.DataWritten):
            told.written.append((record.key, record.value))
        elif isinstance(record, r.ErrorThrown):
            told.errors.append((record.element, record.code))

    def _see(self, element: str) -> None:
        self._visits[element] += 1
        log.info("visit %d of %s", self._visits[element], element)
        for problem in self._story.problems:
            if (problem.element, problem.visit) == (element, self._visits[element]):
                self._begin(self._problem(problem))

    async def _problem(self, problem: Trouble) -> None:
        await self._clock.sleep(problem.after_s)
        log.info("%s", problem)
        if problem.signal:
            await self._executive.control.signal(problem.signal, run=self._run, by="operator")
        else:
            self._world.problem(problem)

    async def _answer(self, prompt: OpenPrompt) -> None:
        """As the answers file says, once all vehicles are received and free that are to be:
        one that has returned ends first what it did."""
        decisions = self._decisions.get(prompt.element) or []
        assert decisions, f"nothing is scripted for {prompt.element} any more: {self.told.errors}"
        decision = decisions.pop(0)
        await self._clock.sleep(THINKS_S)
        await self._all_ready()
        log.info("%s: %s", prompt.element, decision)
        await self._executive.control.answer(prompt.run, prompt.prompt, decision, by="operator")

    async def _all_ready(self) -> None:
        async with asyncio.timeout(PATIENCE_S):
            while missing := self._not_ready():
                assert missing
                await asyncio.sleep(0.05)

    def _not_ready(self) -> Sequence[str]:
        states: Mapping[str, object] = {
            name: self._executive.bus.latest(ResourceId(name))
            for name in self._executive.fleet.vehicles
            if name not in self._story.given_up
        }
        return [
            name
            for name, state in states.items()
            if not isinstance(state, VehicleState)
            or state.link is not LinkState.CONNECTED
            or (name == "uav1" and state.position is None)
            or self._executive.supervisor.availability.reason(ResourceId(name)) not in ("", MANNED)
        ]
