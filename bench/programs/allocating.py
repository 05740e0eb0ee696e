"""Choosing vehicles: many tasks of one moment, and many missions that wait for each other.

python -m bench.programs.allocating <tasks> <vehicles> <missions> <vehicles of the missions>

The missions begin at once. Each has ten tasks at once, of which two need one of the few heavy
vehicles, the others one of the light ones, and waits for them without a limit. How long a task
waits at most follows from the order in which tasks are served. Let it need one of m vehicles, n
tasks ask for these, and none of them take longer than D. As long as it waits, none of the m is
free, and none is given to a task that comes after it. If it waits longer than k D, each of the m
has therefore begun k + 1 tasks or more that come before it; these are n - 1 at most. So it waits
D floor((n - 1) / m) at most. Here D is the longest way in the field at the speed of a vehicle.
"""

import json
import math
import random
import sys
from collections.abc import Sequence
from functools import partial

from bench.measured import Stopwatch
from m2pem.allocation.assignment import Request, RoleOptions, assign
from m2pem.allocation.candidates import Candidates, Place
from m2pem.allocation.needs import Occupancy, RoleEvaluator, Task
from m2pem.api.clock import VirtualClock, run_virtual
from m2pem.api.runs import RunStatus
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
HEAVY_TASKS = 2
"""Of a mission."""
HEAVY_EVERY = 10
"""One vehicle in so many is heavy."""
KINDS = ("light", "heavy")
SPEED_M_S = 5.0
TELEMETRY_HZ = 0.02
"""Few states, as those of many vehicles that drive take longer to simulate than the choices."""


def place(rng: random.Random) -> tuple[float, float]:
    """Return a place in the field."""
    return offset(ORIGIN[:2], rng.uniform(0, FIELD_M), rng.uniform(0, FIELD_M))


def drivers(count: int, rng: random.Random, kinds: Sequence[str]) -> Fleet:
    """Return a fleet of so many simulated vehicles; one in `HEAVY_EVERY` is of the last kind."""
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
                tags=(kinds[-1 if number % HEAVY_EVERY == 0 else 0],),
            )
            for number, name in enumerate(names)
        },
        origin=ORIGIN,
    )


def one_decision(tasks: int, vehicles: int) -> dict[str, float]:
    """Measure the choice for tasks of one moment; everything is free."""
    rng = random.Random(1)
    fleet = drivers(vehicles, rng, kinds=("light",))
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
    places = [place(rng) for _ in range(tasks)]
    # The solver is loaded before: once, by the first choice of an executive.
    assign([Request("first", (RoleOptions("driver", 1, 1, {ResourceId("v0"): 0.0}),))], order)
    watch = Stopwatch()
    with watch:
        evaluator = RoleEvaluator(Candidates(fleet, graph, states.get))
        occupied: dict[ResourceId, Occupancy] = {}  # of all runs: it is found once a decision
        tasks_of_places = [
            Task(behavior, partial(Place, (each,)), lambda _: None, (), occupied) for each in places
        ]
        requests = [
            Request(f"r1.a{number}", (evaluator.role(role, task).options,))
            for number, task in enumerate(tasks_of_places)
        ]
        chosen = assign(requests, order)
    assert len(chosen) == tasks
    return {"decision_ms": watch.cpu_s * 1_000}


def errands(number: int, rng: random.Random) -> bytes:
    """Return a mission of parallel tasks, each for a vehicle of a kind, which it waits for."""
    body = '<startEvent id="S"/><parallelGateway id="F"/>'
    body += '<sequenceFlow id="f" sourceRef="S" targetRef="F"/>'
    for task in range(TASKS_A_MISSION):
        latitude, longitude = place(rng)
        kind = KINDS[task < HEAVY_TASKS]
        body += (
            f'<scriptTask id="T{task}"><extensionElements>'
            '<m2pem:behavior type="vehicle" name="goto"><m2pem:properties>'
            f'<m2pem:property name="target" value="[{latitude:.7f}, {longitude:.7f}, 0]"/>'
            "</m2pem:properties><m2pem:resources>"
            f'<m2pem:role name="driver" requires="\'{kind}\' in vehicle.tags and '
            'vehicle.battery &gt;= 0" wait="unlimited"/>'
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
    fleet = drivers(vehicles, rng, KINDS)
    asked: dict[str, int] = {}
    waits_s: dict[str, list[float]] = {kind: [] for kind in KINDS}
    clocks: list[VirtualClock] = []

    def on_records(_: str, records: Sequence[Record]) -> None:
        for record in records:
            if isinstance(record, AllocationRequested):
                asked[record.allocation] = record.at_us
            elif isinstance(record, ResourcesAllocated):
                ((chosen,),) = record.roles.values()
                waited_us = clocks[0].now_us() - asked.pop(record.allocation)
                waits_s[fleet.vehicles[ResourceId(chosen)].tags[0]].append(waited_us / 1e6)

    async def play(clock: VirtualClock) -> tuple[float, int]:
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
            control = executive.control
            runs = [
                await control.start(errands(number, rng), even_if_busy=True)
                for number in range(missions)
            ]
            begun_us = clock.now_us()
            ended = [(await control.wait(run)).status for run in runs]
            return (clock.now_us() - begun_us) / 1e6, ended.count(RunStatus.COMPLETED)

    watch = Stopwatch()
    with watch:
        lasted_s, completed = run_virtual(play, 0)
    assert completed == missions
    heavy = math.ceil(vehicles / HEAVY_EVERY)
    able = {"light": vehicles - heavy, "heavy": heavy}
    longest_s = math.hypot(FIELD_M, FIELD_M) / SPEED_M_S
    found: dict[str, float] = {"missions_cpu_s": watch.cpu_s, "lasted_s": lasted_s}
    for kind, waited_s in waits_s.items():
        bound_s = longest_s * ((len(waited_s) - 1) // able[kind])
        assert max(waited_s) <= bound_s, (kind, max(waited_s), bound_s)
        found |= {f"{kind}_wait_s": max(waited_s), f"{kind}_bound_s": bound_s}
    return found | {"tasks": float(sum(map(len, waits_s.values()))), "completed": float(completed)}


if __name__ == "__main__":
    sizes = [int(each) for each in sys.argv[1:5]]
    print(json.dumps(one_decision(*sizes[:2]) | many_missions(*sizes[2:])))
