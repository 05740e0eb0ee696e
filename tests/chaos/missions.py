"""The missions that rounds run, and the places to which they move vehicles."""

import math
from dataclasses import dataclass
from itertools import pairwise

from tests.executive.conftest import flow, mission, question, task


@dataclass(frozen=True, slots=True)
class ChaosMission:
    """A mission that ends alone, but for its user tasks, which are answered `yes`.

    `orders`: elements in the order in which a run must leave them.
    """

    name: str
    source: bytes
    orders: tuple[tuple[str, ...], ...]


HOME = (38.1075, -77.3192)
"""The origin of the fleet: latitude and longitude, in degrees."""


def place(east_m: float, north_m: float) -> str:
    """A position as missions write it; metres from the fleet's origin."""
    latitude, longitude = HOME[0] + north_m / 111_000, HOME[1] + east_m / 87_500
    return f"[{latitude:.6f}, {longitude:.6f}]"


PLACES = {
    "Out": (12.0, 0.0),
    "Back": (-2.0, 0.0),
    "Fly": (0.0, 25.0),
    "Last": (6.0, 8.0),
    "Near": (5.0, -10.0),
    "Shared": (10.0, 5.0),
}
"""Where tasks move vehicles; metres east and north. None is the aircraft's home."""


def element_at(position: str) -> str:
    """The task that moves a vehicle to a latitude and a longitude; "" if none does."""
    latitude, longitude = map(float, position.split(","))
    east_m, north_m = (longitude - HOME[1]) * 87_500, (latitude - HOME[0]) * 111_000
    near = [name for name, at in PLACES.items() if math.dist(at, (east_m, north_m)) < 0.5]
    return near[0] if near else ""


def goto(element: str, role: str) -> str:
    """A task that moves a vehicle to its place of `PLACES`."""
    target = f'<m2pem:property name="target" value="{place(*PLACES[element])}"/>'
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
        goto("Out", f'vehicle="{ground}"'),
        question("Ask"),
        goto("Back", f'vehicle="{ground}" wait="unlimited"'),
        task("Up", f'vehicle="{air}"', "takeoff", altitude),
        goto("Fly", f'vehicle="{air}"'),
        task("Home", f'vehicle="{air}"', "land"),
        goto("Last", 'requires="vehicle.domain == \'ground\'" wait="unlimited"'),
    )
    ways = ("S Fork Out Ask Back Join Last E", "Fork Up Fly Home Join")
    orders = (("Out", "Ask", "Back", "Last"), ("Up", "Fly", "Home", "Last"))
    return ChaosMission("two_ways.bpmn", process("".join(elements), *ways), orders)


def in_turn(first: str, second: str) -> ChaosMission:
    """One vehicle after a timer, then one that another run may have: its task waits."""
    elements = (
        PAUSE,
        goto("Near", f'vehicle="{first}"'),
        goto("Shared", f'vehicle="{second}" wait="unlimited"'),
        task("Reverse", f'vehicle="{second}" wait="unlimited"', "reverse"),
    )
    source = process("".join(elements), "S Wait Near Shared Reverse E")
    return ChaosMission("in_turn.bpmn", source, (("Wait", "Near", "Shared", "Reverse"),))
