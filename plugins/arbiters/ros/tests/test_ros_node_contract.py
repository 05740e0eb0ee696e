"""The contract of arbiters, kept over DDS by simulated vehicles with an m2pem node each."""

import contextlib
import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from uuid import uuid4

import pytest
import rclpy
from m2pem_interfaces.msg import VehicleStatus
from m2pem_plugin_ros.runtime import qos
from m2pem_plugin_ros.testing import Peer, reserved_domain
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from std_msgs.msg import UInt32

from m2pem.api import Arbiter, ArbiterContext, Connection, Point, ResourceId
from m2pem.testing import ArbiterCase, ArbiterContract

arbiters = pytest.importorskip("m2pem_plugin_ros.arbiter", reason="there is no ROS arbiter yet")
simulation = pytest.importorskip("ros_sim_watch", reason="there are no simulated vehicles yet")

A, B = ResourceId("ugv1"), ResourceId("ugv2")
ORIGIN = (38.1, -77.3, 60.0)
SPEED = 10.0
VEHICLES = ["sim", "ros", "--ground", "2", "--speed", f"{SPEED:g}", "--home", "38.1,-77.3,60"]


class Witness:
    """Sees what the vehicles do, and has them fall silent, beside the arbiter and its loop."""

    def __init__(self, domain: int) -> None:
        self.motions = dict.fromkeys((A, B), 0)
        self._unheard: set[str] = {A, B}
        self._all_heard = threading.Event()
        self._context = Context()
        rclpy.init(context=self._context, domain_id=domain)
        node = self._node = rclpy.create_node("witness", context=self._context)
        for vehicle in (A, B):
            node.create_subscription(
                UInt32, f"/{vehicle}/motions", self._count(vehicle), qos.STATUS
            )
            node.create_subscription(
                VehicleStatus, f"/{vehicle}/vehicle_status", self._hear, qos.STATUS
            )
        self._faults = node.create_client(SetParameters, "/m2pem_sim/set_parameters")
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(node)
        self._thread = threading.Thread(target=self._spin, daemon=True)
        self._thread.start()
        assert self._faults.wait_for_service(20.0)

    def _count(self, vehicle: ResourceId) -> Callable[[UInt32], None]:
        def count(message: UInt32) -> None:
            self.motions[vehicle] = message.data

        return count

    def _hear(self, message: VehicleStatus) -> None:
        self._unheard.discard(message.vehicle)
        if not self._unheard:
            self._all_heard.set()

    def _spin(self) -> None:
        with contextlib.suppress(ExternalShutdownException):
            self._executor.spin()

    def silence(self, vehicle: ResourceId) -> None:
        """For some seconds of the simulation."""
        fault = f"{vehicle}: silent for 8 s"
        value = ParameterValue(type=ParameterType.PARAMETER_STRING, string_value=fault)
        request = SetParameters.Request(parameters=[Parameter(name="fault", value=value)])
        self._faults.call_async(request)

    def close(self) -> None:
        """Once all vehicles are heard, again, for those who come after."""
        self._all_heard.clear()
        self._unheard = {A, B}
        assert self._all_heard.wait(20.0)
        rclpy.try_shutdown(context=self._context)
        self._thread.join()
        self._node.destroy_node()


class Kept(ArbiterContract):
    unsupported = {"virtual clock": "DDS takes real time"}  # noqa: RUF012  # as the contract has it
    speed = SPEED
    via = "topics"

    @pytest.fixture
    def domain(self, vehicles: int) -> int:
        return vehicles

    @pytest.fixture
    def make_arbiter(self, domain: int) -> Callable[[ArbiterContext], Arbiter]:
        journal = uuid4()
        connections = {
            name: Connection(
                name,
                "ground",
                {"namespace": f"/{name}", "domain_id": domain, "via": self.via},
                sitl=True,
            )
            for name in (A, B)
        }

        def make(context: ArbiterContext) -> Arbiter:
            context = replace(context, journal=journal, origin=ORIGIN)
            arbiter: Arbiter = arbiters.RosArbiter(connections, context)
            return arbiter

        return make

    @pytest.fixture
    def witness(self, domain: int) -> Iterator[Witness]:
        witness = Witness(domain)
        yield witness
        witness.close()

    @pytest.fixture
    def cut_link(self, witness: Witness) -> Callable[[Arbiter, ResourceId], None]:
        return lambda _, vehicle: witness.silence(vehicle)

    @pytest.fixture
    def effects(self, witness: Witness) -> Callable[[Arbiter, ResourceId], int]:
        return lambda _, vehicle: witness.motions[vehicle]

    @pytest.fixture
    def case(self) -> ArbiterCase:
        return ArbiterCase(
            vehicle=A,
            other=B,
            long=("goto", {"target": Point((38.12, -77.3, None)), "speed": 2.0}),
            short=("reverse", {"distance": 2.0}),
            bad=("speed", -1.0),
            short_s=15.0,
        )


@pytest.fixture(scope="module")
def vehicles() -> Iterator[int]:
    with reserved_domain() as domain, Peer(simulation.COMMAND, domain, VEHICLES):
        yield domain


class TestByTopics(Kept):
    pass


class TestByAction(Kept):
    via = "action"


del Kept
