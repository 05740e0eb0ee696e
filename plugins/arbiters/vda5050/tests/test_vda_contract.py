"""The contract of arbiters, kept over a real mosquitto, with simulated vehicles in a process of
their own. The schemas of the protocol judge every message."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import ClassVar

import pytest
from m2pem_plugin_vda5050.arbiter import Vda5050Arbiter
from vda_world import Judge, Mosquitto, SimProcess, connection, write_fleet

from m2pem.api import Arbiter, ArbiterContext, Connection, Point, ResourceId, Route
from m2pem.testing import ArbiterCase, ArbiterContract
from m2pem.testing.contracts.arbiter_harness import CutLink, Effects, MakeArbiter

SPEED = 6.0
LOST_AFTER_S = 12.0
AGV1, AGV2 = ResourceId("agv1"), ResourceId("agv2")
ROUTE = Route(((38.1080, -77.3192, None), (38.1080, -77.3186, None), (38.1084, -77.3186, None)))


@pytest.mark.tried_with(
    "VDA 5050",
    "its JSON schemas validate every message of both sides",
    kind="Automated guided vehicles",
    result="valid",
    package="vda5050-sdk",
    note="the package has copies of the schemas of the VDA",
)
class TestVda5050Arbiter(ArbiterContract):
    unsupported: ClassVar[Mapping[str, str]] = {"virtual clock": "the vehicles keep their own time"}
    speed: ClassVar[float] = SPEED
    released_nodes: ClassVar[int] = 0
    quick: ClassVar[tuple[str, ...]] = (
        "test_accepted_comes_before_running_and_one_terminal_report_last",
        "test_a_behavior_that_preempts_takes_the_vehicle_over",
        "test_another_arbiter_finds_the_behavior_again",
        "test_a_vehicle_that_another_arbiter_has_held_is_reported_as_held",
        "test_a_lost_vehicle_whose_link_returns_stops_before_it_is_free",
        "test_less_and_less_is_left_of_a_route",
    )

    @pytest.fixture
    def settings(self, broker: Mosquitto, judge: Judge) -> Mapping[str, Mapping[str, object]]:
        return {
            name: connection(broker.url, name, released_nodes=self.released_nodes)
            for name in (AGV1, AGV2)
        }

    @pytest.fixture
    def sim(
        self, settings: Mapping[str, Mapping[str, object]], tmp_path: Path
    ) -> Iterator[SimProcess]:
        made = SimProcess(write_fleet(tmp_path / "fleet.yaml", settings), SPEED)
        yield made
        made.close()

    @pytest.fixture
    def make_arbiter(
        self, settings: Mapping[str, Mapping[str, object]], sim: SimProcess
    ) -> MakeArbiter:
        connections = {
            ResourceId(name): Connection(
                ResourceId(name), "ground", each, lost_after_s=LOST_AFTER_S, sitl=True
            )
            for name, each in settings.items()
        }

        def make(context: ArbiterContext) -> Arbiter:
            return Vda5050Arbiter(connections, context)

        return make

    @pytest.fixture
    def case(self) -> ArbiterCase:
        return ArbiterCase(
            vehicle=AGV1,
            other=AGV2,
            long=("single_vehicle_routing", {"route": ROUTE}),
            short=("goto", {"target": Point((38.1076, -77.3192, None)), "speed": 2.0}),
            bad=("speed", -1.0),
            short_s=25.0,
            route=("single_vehicle_routing", {"route": ROUTE}),
            route_s=200.0,
        )

    @pytest.fixture
    def cut_link(self, sim: SimProcess) -> CutLink:
        return lambda arbiter, vehicle: sim.fault(f"{vehicle}: cut link")

    @pytest.fixture
    def mend_link(self, sim: SimProcess) -> CutLink:
        return lambda arbiter, vehicle: sim.fault(f"{vehicle}: mend link")

    @pytest.fixture
    def effects(self, sim: SimProcess) -> Effects:
        return lambda arbiter, vehicle: sim.count(f"{vehicle}: accepts order")


@pytest.mark.long
class TestVda5050ArbiterWithHorizon(TestVda5050Arbiter):
    """The same, where two nodes ahead of the vehicle are released, and updates release more."""

    released_nodes = 1
    quick = ("test_less_and_less_is_left_of_a_route",)


@pytest.mark.long
class TestVda5050ArbiterWithBrokers(TestVda5050Arbiter):
    """The same, where each vehicle has a broker of its own, which breaks off and comes back."""

    quick = ("test_a_lost_vehicle_whose_link_returns_stops_before_it_is_free",)

    @pytest.fixture
    def brokers(self, tmp_path: Path) -> Iterator[Mapping[str, Mosquitto]]:
        made: dict[str, Mosquitto] = {}
        for name in (AGV1, AGV2):
            folder = tmp_path / name
            folder.mkdir()
            made[name] = Mosquitto(folder)
            made[name].start()
        yield made
        for each in made.values():
            each.stop()

    @pytest.fixture
    def settings(
        self, brokers: Mapping[str, Mosquitto]
    ) -> Iterator[Mapping[str, Mapping[str, object]]]:
        judges = [Judge(each.port) for each in brokers.values()]
        yield {name: connection(each.url, name) for name, each in brokers.items()}
        for judge in judges:
            judge.close()
        assert [problem for judge in judges for problem in judge.problems] == []

    @pytest.fixture
    def cut_link(self, brokers: Mapping[str, Mosquitto]) -> CutLink:
        return lambda arbiter, vehicle: brokers[vehicle].stop()

    @pytest.fixture
    def mend_link(self, brokers: Mapping[str, Mosquitto]) -> CutLink:
        return lambda arbiter, vehicle: brokers[vehicle].start()
