"""The contract of arbiters, kept by one that runs in another process, over Zenoh on TCP."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import ClassVar

import pytest
from m2pem_plugin_zenoh.plugin import ZenohHosts
from zenoh_world import UGV1, UGV2, HostProcess, free_port, hosted_simulation, warm_up

from m2pem.api import Arbiter, ArbiterContext, Point, ResourceId, Route
from m2pem.testing import ArbiterCase, ArbiterContract
from m2pem.testing.contracts.arbiter_harness import CutLink, Effects, MakeArbiter

SPEED = 16.0


@pytest.fixture(scope="module", autouse=True)
def warm() -> None:
    warm_up()


@pytest.mark.tried_with(
    "Eclipse Zenoh",
    "the contract of arbiters, of vehicles on another host",
    kind="Databases and brokers",
    result="kept",
    package="eclipse-zenoh",
)
class TestHostedArbiter(ArbiterContract):
    unsupported: ClassVar[Mapping[str, str]] = {"virtual clock": "the host has a clock of its own"}
    speed: ClassVar[float] = SPEED

    @pytest.fixture
    def host(self, tmp_path: Path) -> Iterator[HostProcess]:
        host = HostProcess(free_port(), tmp_path, SPEED)
        yield host
        host.close()

    @pytest.fixture
    def make_arbiter(self, host: HostProcess, tmp_path: Path) -> MakeArbiter:
        hosted = hosted_simulation(host.port, tmp_path, lost_after_s=3.0)

        def make(context: ArbiterContext) -> Arbiter:
            return ZenohHosts()(hosted.connections, context, hosted)

        return make

    @pytest.fixture
    def case(self) -> ArbiterCase:
        route = Route(((38.108, -77.3192, None), (38.110, -77.3180, None)))
        return ArbiterCase(
            vehicle=UGV1,
            other=UGV2,
            long=("single_vehicle_routing", {"route": route}),
            short=("goto", {"target": Point((38.1077, -77.3192, None))}),
            bad=("speed", -1.0),
            short_s=20.0,
            route=("single_vehicle_routing", {"route": route, "speed": 4.0}),
        )

    @pytest.fixture
    def cut_link(self, host: HostProcess) -> CutLink:
        def cut(arbiter: Arbiter, vehicle: ResourceId) -> None:
            host.say(f"cut {vehicle}")

        return cut

    @pytest.fixture
    def mend_link(self, host: HostProcess) -> CutLink:
        def mend(arbiter: Arbiter, vehicle: ResourceId) -> None:
            host.say(f"mend {vehicle}")

        return mend

    @pytest.fixture
    def effects(self, host: HostProcess) -> Effects:
        return lambda arbiter, vehicle: int(host.say(f"effects {vehicle}"))
