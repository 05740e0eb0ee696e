"""An ONVIF driver and a simulated camera, with real HTTP on 127.0.0.1 between them."""

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path

from m2pem_plugin_ptz.drivers.driver import DriverSetup
from m2pem_plugin_ptz.drivers.onvif import OnvifDriver
from m2pem_plugin_ptz.gimbal import Reach
from m2pem_plugin_ptz.settings import DriverName, Settings
from m2pem_plugin_ptz.simulator.onvif.camera import Account, CameraSpec
from m2pem_plugin_ptz.simulator.onvif.server import OnvifServer

from m2pem.api import Connection, ResourceId
from m2pem.testing.contracts.arbiter_harness import context
from m2pem.testing.loopback import loop_clock

ACCOUNT = Account("operator", "s3cret: #1")
RESOURCE = ResourceId("evsg2/ptz")
ANSWERS_S = 0.01
"""Quick, so that tests are."""


def write_credentials(folder: Path, password: str = ACCOUNT.password) -> Path:
    path = folder / "camera.yaml"
    path.touch(mode=0o600)
    path.write_text(f"user: {ACCOUNT.user}\npassword: '{password}'\n")
    return path


async def until(condition: Callable[[], object], within_s: float = 40.0) -> None:
    async with asyncio.timeout(within_s):
        while not condition():  # noqa: ASYNC110  # what is waited for has no event
            await asyncio.sleep(0.01)


class Bench:
    """A driver, and how often it was heard."""

    def __init__(self, port: int, reach: Reach, own: dict[str, object]) -> None:
        self.heard = 0
        settings = {"driver": "onvif", "host": "127.0.0.1", "port": port, "timeout": "5 s", **own}
        own_keys = {key: value for key, value in settings.items() if key != "driver"}
        self.driver = OnvifDriver(
            DriverSetup(
                Connection(RESOURCE, "ground", settings),
                Settings(DriverName.ONVIF, reach=reach, own=own_keys),
                context(loop_clock()),
                self._on_message,
            )
        )

    def _on_message(self) -> None:
        self.heard += 1

    async def ready(self) -> None:
        await until(lambda: not self.driver.refusal("take_picture") and self.driver.ptz)

    def looks_at(self, pan_rad: float, tilt_rad: float, within_rad: float = 0.005) -> bool:
        ptz = self.driver.ptz
        return (
            ptz is not None
            and abs(ptz.pan_rad - pan_rad) < within_rad
            and abs(ptz.tilt_rad - tilt_rad) < within_rad
        )


@asynccontextmanager
async def camera(**options: object) -> AsyncIterator[OnvifServer]:
    spec = CameraSpec(**{"latency_s": ANSWERS_S, **options})  # type: ignore[arg-type]
    async with OnvifServer(spec, monotonic=asyncio.get_running_loop().time) as server:
        yield server


@asynccontextmanager
async def driven(
    server: OnvifServer, folder: Path, reach: Reach | None = None, **own: object
) -> AsyncIterator[Bench]:
    """A driver that is open; with the camera's password, unless `credentials` is said."""
    if server.camera.spec.account is not None and "credentials" not in own:
        own["credentials"] = str(write_credentials(folder))
    said = {key: value for key, value in own.items() if value is not None}
    bench = Bench(server.port, reach or Reach(rate_rad_s=2.0), said)
    await bench.driver.open()
    try:
        yield bench
    finally:
        await bench.driver.close()
