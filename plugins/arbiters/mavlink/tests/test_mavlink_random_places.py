"""Random places on simulated autopilots, over real UDP, judged by shapely."""

import asyncio
import logging
from collections.abc import Callable, Mapping

import pytest
from m2pem_plugin_mavlink.arbiter import MavlinkArbiter
from m2pem_plugin_mavlink.simulator.geometry import Location
from m2pem_plugin_mavlink.simulator.simulator import Simulator
from m2pem_plugin_mavlink.simulator.specification import Kind, VehicleSpec
from mavlink_simulated import PATIENT

from m2pem.api import SHARED, BehaviorType, Clock, Connection, ResourceId
from m2pem.fleet.parameters import resolve
from m2pem.geo.fence import Fence
from m2pem.geo.geojson import parse_geojson
from m2pem.testing.contracts.arbiter_harness import ORIGIN, ArbiterHarness, context
from m2pem.testing.loopback import run_on_loopback
from tests.simulation.random_places import (
    Done,
    Task,
    Track,
    Trial,
    longitude_latitude,
    metres,
    mistakes,
    trial,
)

SPEED = 20.0
WITHIN_S = 3_000.0
FLOWN_M = 2.5
"""So near to its lines a vehicle keeps, also where it turns: a rover turns in a circle."""

FIRMWARES = ("ardupilot", "px4")
KINDS = {"air": Kind.COPTER, "ground": Kind.ROVER}


class Flight(ArbiterHarness):
    """A trial on simulated autopilots. `tracks`: where they really were."""

    def __init__(self, trial: Trial, simulator: Simulator, clock: Clock) -> None:
        fence = Fence(parse_geojson(trial.fence))
        connections = {}
        for name, vehicle in zip(trial.homes, simulator, strict=True):
            host, port = vehicle.address
            settings = {
                "url": f"udpout://{host}:{port}",
                "system_id": vehicle.autopilot.spec.system,
            }
            resource = ResourceId(name)
            connections[resource] = Connection(
                resource, trial.domain, settings, fence=fence, **PATIENT
            )
        lent = context(clock)
        super().__init__(MavlinkArbiter(connections, lent), clock)
        self.bus, self.sent = lent.bus, 0
        self.trial, self.simulator = trial, simulator
        self.tracks: dict[str, list[tuple[float, float, float]]] = {
            name: [] for name in trial.homes
        }
        self.done: list[Done] = []

    def look(self) -> bool:
        """Note where the vehicles are, and let them know of each other."""
        for state in self.states[self.sent :]:
            self.bus.publish(state)
        self.sent = len(self.states)
        for track, vehicle in zip(self.tracks.values(), self.simulator, strict=True):
            at = vehicle.location
            track.append((self.simulator.now_s, *metres(at.latitude_deg, at.longitude_deg)))
        return False

    async def begin(self, task: Task) -> str:
        id_ = f"r1.b{self.trial.tasks.index(task)}"
        spec = SHARED[task.behavior, BehaviorType.VEHICLE]
        given = resolve(spec, task.given, lambda _: None, self.trial.homes)
        await self.start(id_, task.behavior, task.actor, **given)
        return id_

    async def finish(self, task: Task, id_: str, begin_s: float) -> None:
        end = await self.ended(id_, WITHIN_S)
        ended = (end.state.name, end.reason, begin_s, self.simulator.now_s)
        self.done.append(Done(task, [task.actor], *ended))

    async def do(self, *tasks: Task) -> None:
        """Do the tasks together, until the first one is done."""
        begin_s = self.simulator.now_s
        ids = [await self.begin(task) for task in tasks]
        await self.finish(tasks[0], ids[0], begin_s)
        for task, id_ in zip(tasks[1:], ids[1:], strict=True):
            await self.arbiter.cancel(id_, 1)
            await self.finish(task, id_, begin_s)


def flown(trial: Trial, firmware: str) -> tuple[list[Done], Mapping[str, Track]]:
    specs = []
    for system, home in enumerate(trial.homes.values(), 1):
        longitude, latitude = longitude_latitude(home)
        place = Location(latitude, longitude, ORIGIN[2])
        kind = KINDS[trial.domain]
        specs.append(VehicleSpec(kind, system, place, firmware=firmware, estimator_s=1.0))

    async def run(clock: Clock) -> Flight:
        async with Simulator(specs, speed=SPEED, to=None) as simulator:
            flight = Flight(trial, simulator, clock)
            async with flight:
                looking = asyncio.create_task(simulator.until(flight.look))
                together = 2 if trial.leader else 1
                for task in trial.tasks[:-together]:
                    await flight.do(task)
                await flight.do(*trial.tasks[-together:])
                looking.cancel()
            return flight

    flight = run_on_loopback(run, SPEED)
    return flight.done, flight.tracks


@pytest.fixture
def judged(caplog: pytest.LogCaptureFixture) -> Callable[[int], list[str]]:
    def run(seed: int) -> list[str]:
        drawn = trial(seed, teams=False)
        with caplog.at_level(logging.WARNING):
            done, tracks = flown(drawn, FIRMWARES[seed % 2])
        said = [each.getMessage() for each in caplog.records]
        return [*mistakes(drawn, done, tracks, said, FLOWN_M, FLOWN_M)]

    return run


@pytest.mark.parametrize("seed", range(3))
def test_on_random_places_no_metre_is_inside_what_is_kept_out(
    seed: int, judged: Callable[[int], list[str]]
) -> None:
    assert judged(seed) == []


@pytest.mark.long
@pytest.mark.parametrize("seed", range(3, 500))
def test_on_many_random_places_no_metre_is_inside_what_is_kept_out(
    seed: int, judged: Callable[[int], list[str]]
) -> None:
    assert judged(seed) == []
