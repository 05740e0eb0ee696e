"""Choosing vehicles: many tasks of one moment, and many missions that wait for each other.

python -m bench.programs.allocating <tasks> <vehicles> <missions> <vehicles of the missions>
"""

import json
import math
import random
import sys
from collections.abc import Sequence

from bench.measured import Stopwatch
from m2pem.allocation.assignment import Request, RoleOptions, assign
from m2pem.allocation.candidates import Candidates, Place
from m2pem.allocation.needs import RoleEvaluator, Task
from m2pem.api.clock import VirtualClock, run_virtual
from m2pem.api.telemetry import GeoPosition, VehicleState
from m2pem.engine.records import AllocationRequested, Record, ResourcesAllocated
from m2pem.executive.executive import Executive
from m2pem.fleet.behaviors import SHARED
from m2pem.fleet.fleet import Domain, Fleet, Vehicle
from m2pem.fleet.graph import ResourceGraph
from m2pem.geo.local_frame import offset
from m2pem.journal import MemoryJournal
from m2pem.mission.behavior import Behavior, BehaviorType, Need, Role, RoleKind
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.expression import parse
from m2pem.plugins import PluginManager

ORIGIN = (38.0, -77.0, 0.0)
FIELD_M = 10_000.0
TASKS_A_MISSION = 10
WAY_M = 100.0
SPEED_M_S = 5.0
TELEMETRY_HZ = 0.02
"""Few states, as those of many vehicles that drive take longer to simulate than the choices."""


def place(rng: random.Random) -> tuple[float, float]:
    """Return a place in the field."""
    return offset(ORIGIN[:2], rng.uniform(0, FIELD_M), rng.uniform(0, FIELD_M))


def drivers(count: int, rng: random.Random) -> Fleet:
    """Return a fleet of so many simulated vehicles."""
    names = [ResourceId(f"v{number}") for number in range(count)]
    return Fleet(
        "bench",
        "bench.yaml",
        {
            name: Vehicle(
                name,
                Domain.GROUND,
                "sim",
                {"home": list(place(rng)), "telemetry_hz": TELEMETRY_HZ},
                cruise_speed_m_s=SPEED_M_S,
                tags=("light",),
            )
            for name in names
        },
        origin=ORIGIN,
    )


def one_decision(tasks: int, vehicles: int) -> dict[str, float]:
    """Measure the choice for tasks of one moment; everything is free."""
    rng = random.Random(1)
    fleet = drivers(vehicles, rng)
    graph = ResourceGraph(fleet, lambda _: list(SHARED.values()))
    states = {
        name: VehicleState(
            name, 0, GeoPosition(*place(rng), 0.0), battery_fraction=rng.uniform(0.2, 1.0)
        )
        for name in fleet.vehicles
    }
    order = {name: index for index, name in enumerate(fleet.vehicles)}
    condition = parse("'light' in vehicle.tags and vehicle.battery > 0.3")
    role = Role("driver", RoleKind.VEHICLE, "", 1, need=Need(condition))
    behavior = Behavior(BehaviorType.VEHICLE, "goto", 1, (), (role,))
    places = [Place((place(rng),)) for _ in range(tasks)]
    # The solver is loaded before: once, by the first choice of an executive.
    assign([Request("first", (RoleOptions("driver", 1, 1, {ResourceId("v0"): 0.0}),))], order)
    watch = Stopwatch()
    with watch:
        evaluator = RoleEvaluator(Candidates(fleet, graph, states.get))
        requests = [
            Request(
                f"r1.a{number}",
                (evaluator.role(role, Task(behavior, each, lambda _: None, (), {})).options,),
            )
            for number, each in enumerate(places)
        ]
        chosen = assign(requests, order)
    assert len(chosen) == tasks
    return {"decision_ms": watch.cpu_s * 1_000}


def errands(number: int, rng: random.Random) -> bytes:
    """Return a mission of parallel tasks, each for any vehicle, which it waits for."""
    body = '<startEvent id="S"/><parallelGateway id="F"/>'
    body += '<sequenceFlow id="f" sourceRef="S" targetRef="F"/>'
    for task in range(TASKS_A_MISSION):
        latitude, longitude = place(rng)
        body += (
            f'<scriptTask id="T{task}"><extensionElements>'
            '<m2pem:behavior type="vehicle" name="goto"><m2pem:properties>'
            f'<m2pem:property name="target" value="[{latitude:.7f}, {longitude:.7f}, 0]"/>'
            "</m2pem:properties><m2pem:resources>"
            '<m2pem:role name="driver" requires="true" wait="unlimited"/>'
            "</m2pem:resources></m2pem:behavior></extensionElements></scriptTask>"
            f'<sequenceFlow id="f{task}" sourceRef="F" targetRef="T{task}"/>'
        )
    return (
        '<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" '
        'xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="urn:bench">'
        f'<process id="P{number}" isExecutable="true">{body}</process></definitions>'
    ).encode()


def many_missions(missions: int, vehicles: int) -> dict[str, float]:
    """Run missions at once that need more vehicles than there are, in virtual time."""
    rng = random.Random(2)
    fleet = drivers(vehicles, rng)
    asked: dict[str, int] = {}
    waits_s: list[float] = []
    clocks: list[VirtualClock] = []

    def on_records(_: str, records: Sequence[Record]) -> None:
        for record in records:
            if isinstance(record, AllocationRequested):
                asked[record.allocation] = record.at_us
            elif isinstance(record, ResourcesAllocated):
                waits_s.append((clocks[0].now_us() - asked.pop(record.allocation)) / 1e6)

    async def play(clock: VirtualClock) -> float:
        clocks.append(clock)
        executive = Executive(
            fleet,
            MemoryJournal(),
            PluginManager(block=("all",)),
            clock,
            watch_links=False,
            observed=False,
            on_records=on_records,
        )
        async with executive:
            runs = [
                await executive.control.start(errands(number, rng), even_if_busy=True)
                for number in range(missions)
            ]
            begun_us = clock.now_us()
            for run in runs:
                await executive.control.wait(run)
            return (clock.now_us() - begun_us) / 1e6

    watch = Stopwatch()
    with watch:
        lasted_s = run_virtual(play, 0)
    # A task is served before all that asked after it: at most this many rounds of the longest way.
    rounds = math.ceil(missions * TASKS_A_MISSION / vehicles) - 1
    return {
        "missions_cpu_s": watch.cpu_s,
        "tasks": float(len(waits_s)),
        "longest_wait_s": max(waits_s),
        "bound_s": rounds * math.hypot(FIELD_M, FIELD_M) / SPEED_M_S,
        "lasted_s": lasted_s,
    }


if __name__ == "__main__":
    sizes = [int(each) for each in sys.argv[1:5]]
    print(json.dumps(one_decision(*sizes[:2]) | many_missions(*sizes[2:])))
