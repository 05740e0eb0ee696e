"""Vehicles, and the missions that rounds run on them.

The vehicles outlive every executive, and note themselves what they begin: the judge compares that
with the journal.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Protocol

from m2pem.simulation.executions import EffectKind
from m2pem.simulation.state_file import recorded_effects
from tests.executive.conftest import flow, mission, question, task


@dataclass(frozen=True, slots=True)
class Begun:
    """A vehicle began a behavior. `behavior`: its id, such as r1.b2; "": the vehicle does not know.
    `overlaps`: the behavior that it was still doing, "" if none."""

    vehicle: str
    behavior: str
    overlaps: str = ""


@dataclass(frozen=True, slots=True)
class ChaosMission:
    """A mission that ends alone, but for its user tasks, which are answered `yes`.

    `orders`: elements in the order in which a run must leave them.
    """

    name: str
    source: bytes
    orders: tuple[tuple[str, ...], ...]


class World(Protocol):
    """The vehicles of one round, in a folder of its own."""

    name: str
    arbiter: str
    """`module:name` of the class of their arbiter."""
    speed: float
    missions: tuple[ChaosMission, ...]
    fleet: Path

    def begun(self) -> Sequence[Begun]:
        """Return what the vehicles have begun, in order, by what they noted themselves."""
        ...

    def close(self) -> None:
        """End the vehicles."""
        ...


_HOME = (38.1075, -77.3192)


def place(east_m: float, north_m: float) -> str:
    """A position as missions write it; metres from the fleet's origin."""
    latitude, longitude = _HOME[0] + north_m / 111_000, _HOME[1] + east_m / 87_500
    return f"[{latitude:.6f}, {longitude:.6f}]"


def goto(element: str, role: str, east_m: float, north_m: float) -> str:
    """A task that moves a vehicle to a place."""
    target = f'<m2pem:property name="target" value="{place(east_m, north_m)}"/>'
    return task(element, role, "goto", target)


def _flows(*ways: str) -> str:
    pairs = dict.fromkeys(pair for way in ways for pair in pairwise(way.split()))
    return "".join(flow(*pair) for pair in pairs)


def process(elements: str, *ways: str) -> bytes:
    """A mission from its elements and its flows: each way names elements one after the other."""
    inside = f'<startEvent id="S"/>{elements}<endEvent id="E"/>{_flows(*ways)}'
    return mission(f'<process id="P" isExecutable="true">{inside}</process>')


PAUSE = (
    '<intermediateCatchEvent id="Wait"><timerEventDefinition>'
    "<timeDuration>PT6S</timeDuration></timerEventDefinition></intermediateCatchEvent>"
)
FORK = '<parallelGateway id="Fork"/><parallelGateway id="Join"/>'


def two_ways(ground: str, air: str) -> ChaosMission:
    """A ground vehicle and an aircraft at the same time, with a question; then one by need."""
    altitude = '<m2pem:property name="altitude" value="10"/>'
    elements = (
        FORK,
        goto("Out", f'vehicle="{ground}"', 12, 0),
        question("Ask"),
        goto("Back", f'vehicle="{ground}" wait="unlimited"', 0, 0),
        task("Up", f'vehicle="{air}"', "takeoff", altitude),
        goto("Fly", f'vehicle="{air}"', 0, 25),
        task("Home", f'vehicle="{air}"', "land"),
        goto("Last", 'requires="vehicle.domain == \'ground\'" wait="unlimited"', 6, 8),
    )
    ways = ("S Fork Out Ask Back Join Last E", "Fork Up Fly Home Join")
    orders = (("Out", "Ask", "Back", "Last"), ("Up", "Fly", "Home", "Last"))
    return ChaosMission("two_ways.bpmn", process("".join(elements), *ways), orders)


def in_turn(first: str, second: str) -> ChaosMission:
    """One vehicle after a timer, then one that another run may have: its task waits."""
    elements = (
        PAUSE,
        goto("Near", f'vehicle="{first}"', 5, -10),
        goto("Shared", f'vehicle="{second}" wait="unlimited"', 10, 5),
        task("Reverse", f'vehicle="{second}" wait="unlimited"', "reverse"),
    )
    source = process("".join(elements), "S Wait Near Shared Reverse E")
    return ChaosMission("in_turn.bpmn", source, (("Wait", "Near", "Shared", "Reverse"),))


_SIMULATED = """version: 1
name: chaos
origin: {{lat: 38.1075, lon: -77.3192, alt: 60.0}}
vehicles:
  ugv1: {{domain: ground, arbiter: sim, connection: {{state: {state}, telemetry_hz: 0.2}}}}
  ugv2: {{domain: ground, arbiter: sim, connection: {{state: {state}, telemetry_hz: 0.2}}}}
  uav1: {{domain: air, arbiter: sim, connection: {{state: {state}, telemetry_hz: 0.2}}}}
"""


class SimulatedVehicles:
    """Simulated vehicles whose state file outlives the executive, and has all that they began."""

    name = "simulated"
    arbiter = "m2pem.simulation.arbiters:SimArbiter"
    speed = 60.0
    missions = (two_ways("ugv1", "uav1"), in_turn("ugv2", "ugv1"))

    def __init__(self, folder: Path) -> None:
        self.fleet = folder / "fleet.yaml"
        self._state = folder / "vehicles.state"
        self.fleet.write_text(_SIMULATED.format(state=self._state), encoding="utf-8")

    def begun(self) -> list[Begun]:
        """See `World.begun`."""
        doing: dict[str, str] = {}
        found: list[Begun] = []
        for effect in recorded_effects(self._state) if self._state.exists() else ():
            if effect.kind is EffectKind.START:
                found.append(
                    Begun(effect.resource, effect.behavior, doing.get(effect.resource, ""))
                )
                doing[effect.resource] = effect.behavior
            elif effect.kind is EffectKind.END and doing.get(effect.resource) == effect.behavior:
                del doing[effect.resource]
        return found

    def close(self) -> None:
        """They end with the executive."""


WORLDS: Mapping[str, type[SimulatedVehicles]] = {SimulatedVehicles.name: SimulatedVehicles}
