"""An executive on a virtual clock, with a fake arbiter that does what the test says."""

import itertools
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from typing import Any

import pytest

from m2pem.api.arbiter import ArbiterContext, Connection
from m2pem.api.clock import VirtualClock, run_virtual
from m2pem.engine.records import Record
from m2pem.executive.executive import Executive
from m2pem.fleet.fleet import Domain, Fleet, Vehicle
from m2pem.journal import MemoryJournal
from m2pem.mission.catalogue import ResourceId
from m2pem.plugins import PluginManager
from m2pem.testing.fake_arbiter import FakeArbiter

START_US = 1_767_225_600_000_000
MAX_OUTAGE_S: float | None = None

HEAD = """<?xml version="1.0" encoding="UTF-8"?>
<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"
             xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="test">
"""


def mission(body: str) -> bytes:
    """A mission file around `body`."""
    return f"{HEAD}{body}</definitions>".encode()


def behavior(element: str, name: str, vehicle: str, *, parameters: str = "") -> str:
    """A script task that commands a behavior."""
    return (
        f'<scriptTask id="{element}"><extensionElements>'
        f'<m2pem:behavior type="vehicle" name="{name}">'
        f"<m2pem:properties>{parameters}</m2pem:properties>"
        f'<m2pem:resources><m2pem:role name="driver" vehicle="{vehicle}"/></m2pem:resources>'
        "</m2pem:behavior></extensionElements></scriptTask>"
    )


def task(element: str, role: str, name: str = "drive_stop", parameters: str = "") -> str:
    """A task of one vehicle; `role`: the attributes of its role."""
    return (
        f'<scriptTask id="{element}"><extensionElements>'
        f'<m2pem:behavior type="vehicle" name="{name}">'
        f"<m2pem:properties>{parameters}</m2pem:properties>"
        f'<m2pem:resources><m2pem:role name="driver" {role}/></m2pem:resources>'
        "</m2pem:behavior></extensionElements></scriptTask>"
    )


def flow(source: str, target: str) -> str:
    """A sequence flow named after its ends."""
    return f'<sequenceFlow id="{source}_{target}" sourceRef="{source}" targetRef="{target}"/>'


def sequence(*elements: tuple[str, str]) -> str:
    """Elements (id, xml) between a start and an end, in one process P."""
    ids = ["S", *(name for name, _ in elements), "E"]
    flows = "".join(flow(a, b) for a, b in itertools.pairwise(ids))
    inside = "".join(xml for _, xml in elements)
    return (
        f'<process id="P" isExecutable="true"><startEvent id="S"/>{inside}<endEvent id="E"/>'
        f"{flows}</process>"
    )


def fleet(*names: str) -> Fleet:
    """Vehicles of the fake arbiter: those called uav1, uav2 fly, others drive."""
    domains = {name: Domain.AIR if name.startswith("uav") else Domain.GROUND for name in names}
    return Fleet(
        "test",
        "test.yaml",
        {ResourceId(name): Vehicle(ResourceId(name), domains[name], "fake", {}) for name in names},
        max_outage_s=MAX_OUTAGE_S,
    )


def question(element: str) -> str:
    """A user task that asks yes or no."""
    return (
        f'<userTask id="{element}"><extensionElements><m2pem:prompt>Go?</m2pem:prompt>'
        '<m2pem:decision value="yes" label="Yes"/><m2pem:decision value="no" label="No"/>'
        "</extensionElements></userTask>"
    )


@dataclass
class World:
    """The executive under test and what surrounds it."""

    clock: VirtualClock
    executive: Executive
    fake: FakeArbiter
    journal: MemoryJournal
    seen: list[Record] = field(default_factory=list)

    def names(self) -> list[str]:
        """Names of the records seen so far."""
        return [type(record).__name__ for record in self.seen]


class Fakes:
    """A plugin that registers the fake arbiter, and remembers the object made."""

    def __init__(self) -> None:
        self.made: list[FakeArbiter] = []

    def make(
        self, connections: dict[ResourceId, Connection], context: ArbiterContext
    ) -> FakeArbiter:
        arbiter = FakeArbiter(connections, context)
        self.made.append(arbiter)
        return arbiter


class FakePlugins(PluginManager):
    """The built-in plugins, and the arbiter `fake`."""

    def __init__(self, fakes: Fakes, seen: list[Record]) -> None:
        super().__init__(block=("all",))
        self._fakes = fakes
        self._seen = seen

    def arbiter(self, name: str) -> Callable[..., Any]:
        return self._fakes.make if name == "fake" else super().arbiter(name)

    def records_committed(self, run_id: str, records: Any) -> None:
        self._seen.extend(records)


@pytest.fixture
def play() -> Callable[..., Any]:
    """Runs `story(world)` in virtual time, on an executive with the named vehicles."""

    def run(story: Callable[[World], Awaitable[Any]], *vehicles: str, **options: Any) -> Any:
        async def main(clock: VirtualClock) -> Any:
            fakes = Fakes()
            seen: list[Record] = []
            journal = options.pop("journal", None) or MemoryJournal()
            options.setdefault("watch_links", False)
            given = options.pop("fleet", None) or fleet(*vehicles)
            executive = Executive(given, journal, FakePlugins(fakes, seen), clock, **options)
            async with executive:
                fake = fakes.made[0] if fakes.made else None
                return await story(World(clock, executive, fake, journal, seen))

        return run_virtual(main, options.pop("start_us", START_US))

    return run
