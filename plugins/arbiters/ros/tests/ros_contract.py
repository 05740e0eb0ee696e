"""The contract of arbiters over DDS, with two simulated vehicles in a process of their own."""

import asyncio
import threading
from collections.abc import Callable, Collection, Coroutine, Iterator, Mapping
from dataclasses import replace
from typing import Any, ClassVar
from uuid import uuid4

import pytest
from m2pem_plugin_ros.arbiter import RosArbiter
from m2pem_plugin_ros.runtime import RosRuntime, qos
from m2pem_plugin_ros.testing import Peer, reserved_domain
from nav_msgs.msg import Odometry
from ros_nav2_bench import ORIGIN, at
from ros_sim_watch import COMMAND, switch, until
from std_msgs.msg import UInt32

from m2pem.api import Arbiter, ArbiterContext, Connection, ResourceId, Route
from m2pem.testing import ArbiterCase, ArbiterContract

A, B = ResourceId("ugv1"), ResourceId("ugv2")
LOST_AFTER_S = 8.0
"""Of a clock that is five times as fast: on a machine that is busy, who is well may be silent for
more than a second."""

SILENT_S = LOST_AFTER_S + 12.0
"""Who looks for it may be late by a second or two."""


class Witness:
    """Sees what the vehicles do, and makes them go wrong, beside the arbiter and its loop."""

    def __init__(self, domain: int) -> None:
        self.motions: dict[ResourceId, int] = {}
        self._heard: set[ResourceId] = set()
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, name="witness", daemon=True)
        self._thread.start()
        self._ros: RosRuntime = self._do(lambda: self._open(domain))

    def fault(self, vehicle: ResourceId, what: str) -> None:
        """Have something go wrong for some seconds of the simulation."""
        done = self._do(lambda: switch(self._ros, f"{vehicle}: {what} for {SILENT_S:g} s"))
        assert done.successful, done.reason

    def close(self) -> None:
        """Once both vehicles are heard, again, for those who come after."""
        self._do(self._close)
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    def _do(self, work: Callable[[], Coroutine[Any, Any, Any]]) -> Any:
        return asyncio.run_coroutine_threadsafe(work(), self._loop).result(30.0)

    async def _open(self, domain: int) -> RosRuntime:
        ros = RosRuntime("witness", domain_id=domain)
        for vehicle in (A, B):
            ros.subscribe(UInt32, f"/{vehicle}/motions", self._count(vehicle), qos.STATUS)
            ros.subscribe(Odometry, f"/{vehicle}/odom", self._on_message(vehicle), qos.TELEMETRY)
        await until(lambda: len(self.motions) == 2)
        return ros

    async def _close(self) -> None:
        self._heard.clear()
        await until(lambda: len(self._heard) == 2)
        await self._ros.close()

    def _count(self, vehicle: ResourceId) -> Callable[[UInt32], None]:
        return lambda message: self.motions.update({vehicle: message.data})

    def _on_message(self, vehicle: ResourceId) -> Callable[[Odometry], None]:
        return lambda _: self._heard.add(vehicle)


ROUTE = Route(tuple(at(*place).position for place in ((0.0, 5.0), (60.0, 5.0), (60.0, 45.0))))


class OverDds(ArbiterContract):
    """Inherit, and say with which `driver` and other settings the vehicles are reached."""

    unsupported: ClassVar[Mapping[str, str]] = {"virtual clock": "DDS takes real time"}
    speed = 5.0
    driver: ClassVar[str]
    settings: ClassVar[Mapping[str, str]] = {}
    quick: ClassVar[Collection[str]] = (
        "test_accepted_comes_before_running_and_one_terminal_report_last",
        "test_a_second_start_has_one_physical_effect",
        "test_a_behavior_that_preempts_takes_the_vehicle_over",
        "test_cancel_ends_a_behavior_within_the_declared_bound",
        "test_another_arbiter_finds_the_behavior_again",
        "test_hold_stops_the_vehicle_within_the_declared_bound",
        "test_a_cut_link_is_lost_within_the_declared_bound",
        "test_less_and_less_is_left_of_a_route",
        "test_two_vehicles_do_not_mix",
        "test_nothing_leaks_after_close",
    )
    """What a driver and its DDS do for it; the arbiter, which does the rest, is held to all of the
    contract with a double. `make test-long` runs all tests."""

    cut: ClassVar[str] = "silent"
    """The fault after which nothing is heard of a vehicle."""

    @pytest.fixture(scope="class")
    @classmethod
    def domain(cls) -> Iterator[int]:
        """Of the vehicles, which stay where a test has left them for the next one."""
        home = ",".join(map(str, ORIGIN))
        words = ["sim", "ros", "--driver", cls.driver, "--ground", "2", "--home", home]
        words += ["--speed", f"{cls.speed:g}"]
        with reserved_domain() as domain, Peer(COMMAND, domain, words):
            asyncio.run(_speak_once(domain))
            yield domain

    @pytest.fixture
    def make_arbiter(self, domain: int) -> Callable[[ArbiterContext], Arbiter]:
        journal = uuid4()
        own = {"driver": self.driver, "domain_id": domain, **self.settings}
        connections = {
            vehicle: Connection(
                vehicle,
                "ground",
                {"namespace": f"/{vehicle}", **own},
                lost_after_s=LOST_AFTER_S,
                sitl=True,
            )
            for vehicle in (A, B)
        }
        return lambda context: RosArbiter(connections, replace(context, journal=journal))

    @pytest.fixture
    def witness(self, domain: int) -> Iterator[Witness]:
        witness = Witness(domain)
        yield witness
        witness.close()

    @pytest.fixture
    def cut_link(self, witness: Witness) -> Callable[[Arbiter, ResourceId], None]:
        return lambda _, vehicle: witness.fault(vehicle, self.cut)

    @pytest.fixture
    def effects(self, witness: Witness) -> Callable[[Arbiter, ResourceId], int]:
        return lambda _, vehicle: witness.motions[vehicle]

    @pytest.fixture
    def case(self) -> ArbiterCase:
        return ArbiterCase(
            vehicle=A,
            other=B,
            long=("goto", {"target": at(0.0, 10_000.0), "speed": 2.0}),
            short=("reverse", {"distance": 2.0}),
            bad=("speed", -1.0),
            short_s=15.0,
            route=("single_vehicle_routing", {"route": ROUTE, "speed": 3.0}),
            route_s=900.0,
        )


async def _speak_once(domain: int) -> None:
    """With its first participant Fast DDS opens sockets that it keeps as long as the process."""
    await RosRuntime("first", domain_id=domain).close()
