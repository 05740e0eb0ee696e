"""The contract of arbiters on real autopilots, in the loop with their makers' simulations."""

import asyncio
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import ClassVar

import mavlink_sitl as sitl
import pytest
from m2pem_plugin_mavlink.arbiter import MavlinkArbiter
from m2pem_plugin_mavlink.link.routed_link import open_link
from m2pem_plugin_mavlink.protocol.messages import Address
from m2pem_plugin_mavlink.vehicle.vehicle import Vehicle

from m2pem.api import Arbiter, ArbiterContext, Connection, Point, ResourceId, offset
from m2pem.api.clock import SystemClock
from m2pem.testing import ArbiterCase, ArbiterContract

A, B = ResourceId("a"), ResourceId("b")
READY_WITHIN_S = 120.0
LOST_AFTER_S = 2.0
"""Of the wall clock: tests share their processors, and a process may get none for a while."""


def ardupilots(binary: Path, model: str, ports: list[int]) -> list[sitl.Launch]:
    """Vehicles with system ids from 1 on."""
    first = sitl.first_instance(len(ports))
    return [
        sitl.ardupilot(binary, model, first + number, port, number + 1)
        for number, port in enumerate(ports)
    ]


def at(east_m: float, north_m: float) -> Point:
    """A place so far from where the first vehicle starts, m."""
    return Point((*offset(sitl.HOME[:2], east_m, north_m), None))


class _RealAutopilot(ArbiterContract):
    unsupported: ClassVar[dict[str, str]] = {
        "virtual clock": "vehicles are told over real sockets",
        "effects": "only the autopilot itself knows what it has begun",
    }
    speed = float(sitl.SPEED)
    domain = "air"
    variable = ""
    height_m = 20.0
    standing_m_s = 0.1
    watch_s = 6.0
    long: ClassVar[dict[str, object]] = {"target": at(400.0, 0.0), "speed": 3.0}
    short: ClassVar[dict[str, object]] = {"target": at(15.0, 15.0), "speed": 3.0}

    def commands(self, binary: Path, ports: list[int], folder: Path) -> list[sitl.Launch]:
        raise NotImplementedError

    def urls(self, ports: list[int]) -> list[str]:
        return [f"udpin://127.0.0.1:{port}" for port in ports]

    def ports(self) -> list[int]:
        return [sitl.free_port(), sitl.free_port()]

    @pytest.fixture
    def autopilots(self, tmp_path: Path) -> Iterator[list]:
        binary = sitl.program(self.variable)
        assert binary is not None
        ports = self.ports()
        with sitl.running(self.commands(binary, ports, tmp_path), tmp_path) as programs:
            urls = self.urls(ports)
            asyncio.run(self.prepared(urls))
            yield list(zip([each.process for each in programs], urls, strict=True))

    async def prepared(self, urls: list[str]) -> None:
        """Both are ready, and what flies is in the air."""
        await asyncio.gather(*(self._prepare(url, number) for number, url in enumerate(urls, 1)))

    async def _prepare(self, url: str, number: int) -> None:
        clock = SystemClock(self.speed)
        link = await open_link(Address(number, 1), [url], clock)
        vehicle = Vehicle(ResourceId("x"), self.domain, link, clock, lost_after_s=10.0)
        vehicle.open()
        try:
            await self._ready(vehicle)
        finally:
            await vehicle.close()
            await link.close()

    async def _ready(self, vehicle: Vehicle) -> None:
        assert await vehicle.identified(READY_WITHIN_S)
        assert await vehicle.until(lambda: vehicle.driver.readiness().ready, READY_WITHIN_S)
        if self.domain != "air":
            await vehicle.driver.arm()
            return
        await vehicle.driver.take_off(self.height_m)
        high = await vehicle.until(
            lambda: (vehicle.state.altitude_above_home_m or 0.0) > self.height_m - 2,
            READY_WITHIN_S,
        )
        assert high, vehicle.recent_texts(60.0)

    @pytest.fixture(params=["pymavlink", "mavsdk"])
    def make_arbiter(
        self, request: pytest.FixtureRequest, autopilots: list
    ) -> Callable[[ArbiterContext], Arbiter]:
        def make(context: ArbiterContext) -> Arbiter:
            connections = {}
            for number, (resource, (_, url)) in enumerate(zip((A, B), autopilots, strict=True), 1):
                settings = {"url": url, "system_id": number, "driver": request.param}
                connections[resource] = Connection(
                    resource, self.domain, settings, lost_after_s=LOST_AFTER_S * self.speed
                )
            return MavlinkArbiter(connections, context)

        return make

    @pytest.fixture
    def cut_link(self, autopilots: list) -> Callable[[Arbiter, ResourceId], None]:
        def cut(_arbiter: Arbiter, vehicle: ResourceId) -> None:
            autopilots[0 if vehicle == A else 1][0].send_signal(signal.SIGSTOP)

        return cut

    @pytest.fixture
    def mend_link(self, autopilots: list) -> Callable[[Arbiter, ResourceId], None]:
        def mend(_arbiter: Arbiter, vehicle: ResourceId) -> None:
            autopilots[0 if vehicle == A else 1][0].send_signal(signal.SIGCONT)

        return mend

    @pytest.fixture
    def case(self) -> ArbiterCase:
        return ArbiterCase(
            vehicle=A,
            other=B,
            long=("goto", dict(self.long)),
            short=("goto", dict(self.short)),
            bad=("speed", -1.0),
            watch_s=self.watch_s,
            standing_m_s=self.standing_m_s,
        )


@pytest.mark.sitl("M2PEM_ARDUCOPTER")
@pytest.mark.tried_with(
    "ArduCopter",
    "the contract of arbiters: behaviors, holding, failures, restarts; by pymavlink and by MAVSDK",
    kind="Autopilots",
    result="kept",
    version="4.7.0-dev",
    on="2026-11",
)
class TestArduCopter(_RealAutopilot):
    variable = "M2PEM_ARDUCOPTER"

    def commands(self, binary: Path, ports: list[int], folder: Path) -> list[sitl.Launch]:
        return ardupilots(binary, "quad", ports)


@pytest.mark.sitl("M2PEM_ARDUROVER")
@pytest.mark.tried_with(
    "ArduRover",
    "the contract of arbiters: behaviors, holding, failures, restarts; by pymavlink and by MAVSDK",
    kind="Autopilots",
    result="kept",
    version="4.7.0-dev",
    on="2026-11",
)
class TestArduRover(_RealAutopilot):
    variable = "M2PEM_ARDUROVER"
    domain = "ground"

    def commands(self, binary: Path, ports: list[int], folder: Path) -> list[sitl.Launch]:
        return ardupilots(binary, "rover", ports)


@pytest.mark.sitl("M2PEM_ARDUROVER")
@pytest.mark.tried_with(
    "ArduRover, as a boat",
    "the contract of arbiters: behaviors, holding, failures, restarts; by pymavlink and by MAVSDK",
    kind="Autopilots",
    result="kept",
    version="4.7.0-dev",
    on="2026-11",
)
class TestMotorboat(_RealAutopilot):
    variable = "M2PEM_ARDUROVER"
    domain = "surface"
    standing_m_s = 0.3  # waves and wind move it

    def commands(self, binary: Path, ports: list[int], folder: Path) -> list[sitl.Launch]:
        return ardupilots(binary, "motorboat", ports)


class _RealPlane(_RealAutopilot):
    """Planes are fast, turn in wide circles, and do not stop."""

    unsupported: ClassVar[dict[str, str]] = {
        **_RealAutopilot.unsupported,
        "telemetry": "a plane does not stand: it circles where it is held",
    }
    variable = "M2PEM_ARDUPLANE"
    long: ClassVar[dict[str, object]] = {"target": at(3000.0, 0.0)}
    short: ClassVar[dict[str, object]] = {"target": at(150.0, 150.0)}
    height_m = 60.0


@pytest.mark.sitl("M2PEM_ARDUPLANE")
@pytest.mark.tried_with(
    "ArduPlane",
    "the contract of arbiters: behaviors, holding, failures, restarts; by pymavlink and by MAVSDK",
    kind="Autopilots",
    result="kept",
    version="4.7.0-dev",
    note="a plane cannot stop: five tests do not apply",
    on="2026-11",
)
class TestArduPlane(_RealPlane):
    def commands(self, binary: Path, ports: list[int], folder: Path) -> list[sitl.Launch]:
        return ardupilots(binary, "plane", ports)


@pytest.mark.sitl("M2PEM_ARDUPLANE")
@pytest.mark.tried_with(
    "ArduPlane, as a QuadPlane",
    "the contract of arbiters: behaviors, holding, failures, restarts; by pymavlink and by MAVSDK",
    kind="Autopilots",
    result="kept",
    version="4.7.0-dev",
    on="2026-11",
)
class TestQuadPlane(_RealPlane):
    def commands(self, binary: Path, ports: list[int], folder: Path) -> list[sitl.Launch]:
        return ardupilots(binary, "quadplane", ports)


@pytest.mark.sitl("M2PEM_PX4")
@pytest.mark.tried_with(
    "PX4",
    "the contract of arbiters: behaviors, holding, failures, restarts; by pymavlink and by MAVSDK",
    kind="Autopilots",
    result="kept",
    version="main of August 2026",
    on="2026-11",
)
class TestPx4(_RealAutopilot):
    variable = "M2PEM_PX4"
    speed = 3.0  # two PX4s on two processors do not keep up with 5, and fall behind the clock
    # Stopped while it speeds up, it swings back to its place at up to 1.2 m/s, then creeps.
    standing_m_s = 0.3
    watch_s = 12.0
    model = "sihsim_quadx"

    def commands(self, binary: Path, ports: list[int], folder: Path) -> list[sitl.Launch]:
        return [sitl.px4(binary, instance, folder, self.model, self.speed) for instance in (0, 1)]

    def ports(self) -> list[int]:
        # PX4 sends to 14540 and its instance's number, wherever else somebody would like it to.
        return [14540, 14541]


@pytest.mark.sitl("M2PEM_PX4")
@pytest.mark.tried_with(
    "PX4, as a rover",
    "the contract of arbiters: behaviors, holding, failures, restarts; by pymavlink and by MAVSDK",
    kind="Autopilots",
    result="kept",
    version="main of August 2026",
    note="its simulated rover moves since PX4's change 28476",
    on="2026-11",
)
class TestPx4Rover(TestPx4):
    model = "sihsim_rover_ackermann"
    domain = "ground"


@pytest.mark.sitl("M2PEM_PX4")
@pytest.mark.xfail(reason="the plane of PX4's simulation does not take off (its issue 27344)")
class TestPx4Plane(TestPx4):
    model = "sihsim_airplane"
    unsupported = _RealPlane.unsupported
    long = _RealPlane.long
    short = _RealPlane.short
    height_m = _RealPlane.height_m
