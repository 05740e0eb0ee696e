"""The contract of arbiters, by MAVLink rovers: over UDP to their host, and Zenoh to its arbiter."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import ClassVar

import pytest
from m2pem_plugin_zenoh.plugin import ZenohHosts
from zenoh_mavlink import AT_HOME, A, B, hosted_rovers
from zenoh_world import HostProcess, free_port, warm_up

from m2pem.api import Arbiter, ArbiterContext, Point, ResourceId, offset
from m2pem.testing import ArbiterCase, ArbiterContract
from m2pem.testing.contracts.arbiter_harness import CutLink, Effects, MakeArbiter

SPEED = 4.0


class MavlinkHost(HostProcess):
    program = "zenoh_mavlink_host_process.py"


@pytest.fixture(scope="module", autouse=True)
def warm() -> None:
    warm_up()


@pytest.mark.long
class TestHostedMavlinkArbiter(ArbiterContract):
    unsupported: ClassVar[Mapping[str, str]] = {
        "virtual clock": "the host has a clock of its own",
        "return": "the simulated link is not mended",
    }
    speed: ClassVar[float] = SPEED

    @pytest.fixture
    def udp_port(self, tmp_path: Path) -> int:
        port = free_port()
        (tmp_path / "ports").write_text(str(port))
        return port

    @pytest.fixture
    def host(self, tmp_path: Path, udp_port: int) -> Iterator[HostProcess]:
        host = MavlinkHost(free_port(), tmp_path, SPEED)
        yield host
        host.close()

    @pytest.fixture
    def make_arbiter(self, host: HostProcess, udp_port: int) -> MakeArbiter:
        hosted = hosted_rovers(host.port, udp_port)

        def make(context: ArbiterContext) -> Arbiter:
            return ZenohHosts()(hosted.connections, context, hosted)

        return make

    @pytest.fixture
    def case(self) -> ArbiterCase:
        far, near = offset(AT_HOME, 400.0, 0.0), offset(AT_HOME, 20.0, 20.0)
        return ArbiterCase(
            vehicle=A,
            other=B,
            long=("goto", {"target": Point((*far, None)), "speed": 4.0}),
            short=("goto", {"target": Point((*near, None)), "speed": 4.0}),
            bad=("speed", -1.0),
            short_s=40.0,
        )

    @pytest.fixture
    def cut_link(self, host: HostProcess) -> CutLink:
        def cut(arbiter: Arbiter, vehicle: ResourceId) -> None:
            host.say(f"cut {vehicle}")

        return cut

    @pytest.fixture
    def effects(self, host: HostProcess) -> Effects:
        return lambda arbiter, vehicle: int(host.say(f"effects {vehicle}"))
