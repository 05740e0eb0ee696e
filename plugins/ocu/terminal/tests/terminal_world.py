"""An executive whose time stands still, a fake arbiter, and terminals to look at them."""

import asyncio
import re
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from m2pem_plugin_terminal.app import TerminalApp
from textual.pilot import Pilot

from m2pem.api.alerts import AlertsChanged
from m2pem.api.arbiter import ArbiterContext, Connection
from m2pem.api.control import MissionControl
from m2pem.api.runs import RunId
from m2pem.api.telemetry import GeoPosition, VehicleState
from m2pem.executive.executive import Executive
from m2pem.fleet.fleet import Domain, Fleet, Payload, Vehicle
from m2pem.journal import MemoryJournal
from m2pem.mission.catalogue import ResourceId
from m2pem.plugins import PluginManager
from m2pem.testing.fake_arbiter import FakeArbiter

START_US = 1_767_225_600_000_000
SIZE = (80, 24)
CELL_WIDTH = 12.2
MISSION = Path(__file__).with_name("patrol.bpmn")
PATIENCE_S = 40.0


class StillClock:
    """Time that goes on only when a test says so."""

    def __init__(self) -> None:
        self._now_us = START_US
        self._moved = asyncio.Condition()

    def now_us(self) -> int:
        return self._now_us

    async def sleep(self, seconds: float) -> None:
        await self.sleep_until(self._now_us + round(seconds * 1_000_000))

    async def sleep_until(self, time_us: int) -> None:
        async with self._moved:
            await self._moved.wait_for(lambda: self._now_us >= time_us)

    async def advance(self, seconds: float) -> None:
        async with self._moved:
            self._now_us += round(seconds * 1_000_000)
            self._moved.notify_all()


class Plugins(PluginManager):
    """The built-in plugins, and the arbiter `fake`."""

    def __init__(self) -> None:
        super().__init__(block=("all",))
        self.made: list[FakeArbiter] = []

    def arbiter(self, name: str) -> Callable[..., Any]:
        return self._make if name == "fake" else super().arbiter(name)

    def _make(
        self, connections: dict[ResourceId, Connection], context: ArbiterContext
    ) -> FakeArbiter:
        self.made.append(FakeArbiter(connections, context))
        return self.made[-1]


def fleet() -> Fleet:
    scout, uav, eye = ResourceId("scout"), ResourceId("uav"), ResourceId("uav/eye")
    return Fleet(
        "test",
        "test.yaml",
        {
            scout: Vehicle(scout, Domain.GROUND, "fake", {}),
            uav: Vehicle(uav, Domain.AIR, "fake", {}, payloads=(eye,), lost_after_s=5.0),
        },
        {eye: Payload(eye, uav, "fake", {})},
        unattended=True,
    )


def scout(battery: float, **more: Any) -> VehicleState:
    """The ground vehicle, on its way."""
    return VehicleState(
        ResourceId("scout"),
        0,
        GeoPosition(38.1075, -77.3192, 60.0),
        velocity_enu_m_s=(3.0, 4.0, 0.0),
        battery_fraction=battery,
        mode="auto",
        **more,
    )


class Terminal:
    """One operator's terminal: keys go in, and what is on the screen comes out."""

    def __init__(
        self,
        app: TerminalApp,
        pilot: Pilot[None],
        operator: "Hand",
        size: tuple[int, int] = SIZE,
    ) -> None:
        self.app = app
        self._size = size
        self.pilot = pilot
        self._operator = operator

    def pass_time(self, seconds: float) -> None:
        """Let so much time pass for the operator."""
        self._operator.now_s += seconds

    async def press(self, *keys: str) -> None:
        """Press keys, a while after whatever was pressed or shown before."""
        self._operator.now_s += 1.0
        await self.pilot.press(*keys)

    async def until(self, condition: Callable[[], Any]) -> None:
        """Wait until something holds of the screen."""
        async with asyncio.timeout(PATIENCE_S):
            while not condition():
                self.app.show()
                await self.pilot.pause(0.01)

    async def until_shown(self, *texts: str) -> None:
        def shown() -> bool:
            screen = self.screen  # once for all texts: taking it is what costs most
            return all(text in screen for text in texts)

        try:
            await self.until(shown)
        except TimeoutError:
            pytest.fail(f"not shown: {texts}\n{self.screen}")

    async def until_gone(self, text: str) -> None:
        try:
            await self.until(lambda: not self.shows(text))
        except TimeoutError:
            pytest.fail(f"still shown: {text}\n{self.screen}")

    def shows(self, text: str) -> bool:
        return text in self.screen

    @property
    def screen(self) -> str:
        """The characters on the screen, line by line."""
        return "\n".join(characters(self.app.export_screenshot(), *self._size))

    def line(self, text: str) -> str:
        """The first line that has a text in it."""
        return next(line for line in self.screen.splitlines() if text in line)


def characters(svg: str, columns: int, rows: int) -> list[str]:
    """The lines of a screenshot."""
    grid = [[" "] * columns for _ in range(rows)]
    for element in ElementTree.fromstring(svg).iter("{http://www.w3.org/2000/svg}text"):
        place = re.search(r"-line-(\d+)\)", element.get("clip-path", ""))
        if place is None:
            continue
        column = round(float(element.get("x", "0")) / CELL_WIDTH)
        for offset, character in enumerate(element.text or ""):
            if column + offset < columns:
                grid[int(place[1])][column + offset] = character.replace("\xa0", " ")
    return ["".join(line).rstrip() for line in grid]


@dataclass
class Hand:
    """The operator's clock."""

    now_s: float = 1000.0

    def now(self) -> float:
        return self.now_s


@dataclass
class World:
    """The executive, and what surrounds it."""

    executive: Executive
    clock: StillClock
    fake: FakeArbiter
    hand: Hand = field(default_factory=Hand)

    @property
    def control(self) -> MissionControl:
        return self.executive.control

    async def start(self) -> RunId:
        return await self.control.start(MISSION)

    def look(self) -> None:
        """What an executive on the clock of the system does twice a second: update the alerts."""
        self.executive.look()
        self.executive.events.publish(AlertsChanged())

    @asynccontextmanager
    async def terminal(
        self,
        by: str = "anna@gcs1",
        control: MissionControl | None = None,
        size: tuple[int, int] = SIZE,
    ) -> AsyncIterator[Terminal]:
        app = TerminalApp(control or self.control, now=self.hand.now, by=by)
        async with app.run_test(size=size) as pilot:
            yield Terminal(app, pilot, self.hand, size)


@pytest.fixture
async def world() -> AsyncIterator[World]:
    plugins, clock = Plugins(), StillClock()
    executive = Executive(fleet(), MemoryJournal(), plugins, clock, watch_links=False)
    async with executive:
        world = World(executive, clock, plugins.made[0])
        try:
            yield world
        finally:
            ending = asyncio.create_task(executive.stop_all("the test is over"))
            while not ending.done():  # behaviors that do not answer are given up after a while
                await clock.advance(10)
                await asyncio.sleep(0)
