"""The simulated camera on HTTP, and its pictures: a horizon, bearings and the direction.

async with OnvifServer(CameraSpec(account=Account("operator", "secret"))) as server:

    server.port, server.camera.ptz, server.faults.silent(True)
"""

import asyncio
import io
import math
from collections.abc import Mapping
from typing import Self

from aiohttp import web
from PIL import Image, ImageDraw

from m2pem_plugin_ptz.simulator.onvif import soap
from m2pem_plugin_ptz.simulator.onvif.camera import Asks, Camera, CameraSpec, Moment
from m2pem_plugin_ptz.simulator.onvif.faults import Faults
from m2pem_plugin_ptz.simulator.onvif.security import HttpCheck, TokenCheck
from m2pem_plugin_ptz.simulator.onvif.services import Operations, device, media, ptz, recording
from m2pem_plugin_ptz.simulator.onvif.soap import FaultError

SIZE = (640, 360)
SKY, GROUND, LIGHT, DARK = (126, 168, 206), (116, 128, 92), (250, 250, 250), (20, 20, 20)
SPACING = 10
"""Degrees between lines."""


def draw(
    pan_rad: float, tilt_rad: float, zoom: float, view_rad: tuple[float, float], note: str
) -> bytes:
    """Draw a picture. `view_rad`: field of view at zoom 1."""
    width, height = SIZE
    image = Image.new("RGB", SIZE, SKY)
    canvas = ImageDraw.Draw(image)
    focal = width / 2 / math.tan(view_rad[0] / 2) * zoom
    pan_deg, tilt_deg = math.degrees(pan_rad), math.degrees(tilt_rad)
    if abs(tilt_rad) < math.radians(80):
        horizon = height / 2 + focal * math.tan(tilt_rad)
    else:
        horizon = -1.0 if tilt_rad < 0 else height + 1.0
    canvas.rectangle((0, max(0.0, horizon), width, max(0.0, height)), fill=GROUND)
    half = math.degrees(math.atan(width / 2 / focal))
    first = math.ceil((pan_deg - half) / SPACING) * SPACING
    for bearing in range(first, int(pan_deg + half) + 1, SPACING):
        x = width / 2 + focal * math.tan(math.radians(bearing - pan_deg))
        canvas.line((x, 0, x, height), fill=LIGHT)
        canvas.text((x + 3, 3), f"{(bearing + 180) % 360 - 180:d}", fill=LIGHT)
    canvas.line((width / 2 - 12, height / 2, width / 2 + 12, height / 2), fill=DARK, width=2)
    canvas.line((width / 2, height / 2 - 12, width / 2, height / 2 + 12), fill=DARK, width=2)
    text = f"pan {pan_deg:+.1f}  tilt {tilt_deg:+.1f}  zoom {zoom:.1f}  {note}"
    canvas.rectangle((0, height - 18, width, height), fill=DARK)
    canvas.text((6, height - 15), text, fill=LIGHT)
    store_image = io.BytesIO()
    image.save(store_image, "JPEG", quality=85, comment=text.encode())
    return store_image.getvalue()


SERVICES: Mapping[str, Operations] = {
    soap.DEVICE: device.OPERATIONS,
    soap.MEDIA: media.MEDIA,
    soap.MEDIA2: media.MEDIA2,
    soap.PTZ: ptz.OPERATIONS,
    soap.RECORDING: recording.OPERATIONS,
}
XML = "application/soap+xml; charset=utf-8"
CLOSE_S = 0.2


class OnvifServer:
    """One camera on one port. With port 0, a free one is chosen, and kept in a restart."""

    def __init__(
        self,
        spec: CameraSpec | None = None,
        *,
        host: str = "127.0.0.1",
        port: int = 0,
        monotonic: Moment | None = None,
    ) -> None:
        spec = spec or CameraSpec()
        self.camera = Camera(spec) if monotonic is None else Camera(spec, monotonic)
        self.host, self.port = host, port
        self.faults = Faults(self.camera, self._open, self._close)
        self._tokens = TokenCheck(spec.account) if spec.account else None
        pictures = spec.account is not None and spec.asks is not Asks.NOTHING
        self._http = HttpCheck(spec.account, spec.asks) if pictures and spec.account else None
        self._runner: web.AppRunner | None = None

    async def __aenter__(self) -> Self:
        await self._open()
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.faults.close()
        await self._close()

    async def _open(self) -> None:
        app = web.Application(client_max_size=1 << 20)
        app.router.add_post("/onvif/{service}", self._soap)
        app.router.add_get(media.SNAPSHOT, self._snapshot)
        runner = web.AppRunner(app, access_log=None, shutdown_timeout=CLOSE_S)
        await runner.setup()
        site = web.TCPSite(runner, self.host, self.port, reuse_address=True)
        try:
            await site.start()
        except BaseException:
            await runner.cleanup()
            raise
        self._runner = runner
        self.port = runner.addresses[0][1]

    async def _close(self) -> None:
        runner, self._runner = self._runner, None
        if runner is not None:
            await runner.cleanup()

    async def _delay(self, share: float) -> None:
        fault_state = self.camera.fault_state
        await fault_state.speaks.wait()
        await asyncio.sleep((self.camera.spec.latency_s + fault_state.slow_s) * share)

    async def _soap(self, request: web.Request) -> web.Response:
        # Half of the time is the way there, half the way back: what is done is done in between.
        content = await request.read()
        await self._delay(0.5)
        try:
            header, asked = soap.read(content)
            status, body = 200, soap.answer(self._do(header, asked, str(request.url.origin())))
        except FaultError as fault:
            status, body = fault.status, soap.refusal(fault)
        await self._delay(0.5)
        return web.Response(status=status, body=body, headers={"Content-Type": XML})

    def _do(self, header: soap.Element | None, asked: soap.Element, base: str) -> str:
        offered = tuple(device.offered(self.camera))
        operations = SERVICES[asked.namespace] if asked.namespace in offered else {}
        if asked.namespace != soap.DEVICE or asked.name not in device.FREE:
            if self.camera.fault_state.locked:
                raise FaultError("Sender not authorized", "NotAuthorized")
            if self._tokens is not None:
                self._tokens.check(header, self.camera.now_s)
        operation = operations.get(asked.name)
        if operation is None:
            raise FaultError(f"no {asked.name} here", "ActionNotSupported", receiver=True)
        answer = soap.response(asked, operation(self.camera, asked, base))
        self.camera.calls[asked.name] += 1
        return answer

    async def _snapshot(self, request: web.Request) -> web.StreamResponse:
        await self._delay(1.0)
        camera = self.camera
        if camera.fault_state.locked or (
            self._http is not None
            and not self._http.passes(
                "GET", request.raw_path, request.headers.get("Authorization", "")
            )
        ):
            challenge = self._http.challenge() if self._http is not None else 'Digest realm="-"'
            return web.Response(status=401, headers={"WWW-Authenticate": challenge})
        if not camera.spec.snapshots:
            return web.Response(status=404)
        if camera.fault_state.picture is not None:
            return web.Response(body=camera.fault_state.picture, content_type="text/html")
        width, height = map(math.radians, camera.spec.view_deg)
        picture = draw(*camera.ptz, (width, height), camera.spec.name)
        camera.calls["snapshot"] += 1
        return web.Response(body=picture, content_type="image/jpeg")
