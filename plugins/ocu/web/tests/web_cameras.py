"""Cameras that speak what real ones speak, on 127.0.0.1: pictures, Motion JPEG, HLS and WHEP."""

import asyncio
import io
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path

import aioice.ice
import av
from aiohttp import web
from aiortc import RTCPeerConnection, RTCSessionDescription, VideoStreamTrack
from PIL import Image, ImageDraw

SIZE = (320, 180)
FRAMES_S = 10
HLS_S = 60
LOOPBACK = "127.0.0.1"
CORS = {
    "Access-Control-Allow-Origin": "*",
    "Access-Control-Allow-Headers": "content-type",
    "Access-Control-Allow-Methods": "GET, POST, DELETE",
    "Access-Control-Expose-Headers": "location",
}


def drawn(number: int) -> Image.Image:
    """A picture with a box that moves."""
    image = Image.new("RGB", SIZE, (70, 110, 70))
    draw = ImageDraw.Draw(image)
    draw.polygon([(0, 180), (120, 70), (200, 70), (320, 180)], fill=(110, 100, 90))
    left = 4 * number % SIZE[0]
    draw.rectangle((left, 90, left + 40, 120), fill=(220, 200, 60))
    return image


def jpeg(number: int) -> bytes:
    content = io.BytesIO()
    drawn(number).save(content, "JPEG")
    return content.getvalue()


def write_hls(folder: Path) -> None:
    """A playlist and segments of a second (fragmented MP4, H.264)."""
    options = {"hls_time": "1", "hls_list_size": "0", "hls_segment_type": "fmp4"}
    with av.open(str(folder / "index.m3u8"), "w", format="hls", options=options) as output:
        stream = output.add_stream("libx264", rate=FRAMES_S, options={"preset": "ultrafast"})
        stream.width, stream.height = SIZE
        stream.pix_fmt = "yuv420p"
        stream.gop_size = FRAMES_S
        for number in range(HLS_S * FRAMES_S):
            frame = av.VideoFrame.from_image(drawn(number))
            frame.pts, frame.time_base = number, Fraction(1, FRAMES_S)
            output.mux(stream.encode(frame))
        output.mux(stream.encode())


class _Track(VideoStreamTrack):
    number = 0

    async def recv(self) -> av.VideoFrame:
        frame = av.VideoFrame.from_image(drawn(self.number))
        frame.pts, frame.time_base = await self.next_timestamp()
        self.number += 1
        return frame


@dataclass
class Cameras:
    """`base`: the address of all of them. `deaf`: Motion JPEG sends no more frames; `broken`: one
    picture at a time is refused. `sessions`: of WHEP, by their paths; `left`: all have ended."""

    base: str = ""
    deaf: bool = False
    broken: bool = False
    sessions: dict[str, RTCPeerConnection] = field(default_factory=dict)
    left: asyncio.Event = field(default_factory=asyncio.Event)
    folder: Path = Path()

    async def image(self, _: web.Request) -> web.Response:
        if self.broken:
            return web.Response(status=404)
        return web.Response(body=jpeg(7), content_type="image/jpeg")

    async def mjpeg(self, request: web.Request) -> web.StreamResponse:
        """With CORS at /mjpeg; without at /closed."""
        headers = {"Content-Type": "multipart/x-mixed-replace; boundary=frame"}
        answer = web.StreamResponse(headers=headers | (CORS if request.path == "/mjpeg" else {}))
        await answer.prepare(request)
        number = 0
        while True:
            if not self.deaf:
                body = jpeg(number)
                head = f"--frame\r\nContent-Type: image/jpeg\r\nContent-Length: {len(body)}\r\n\r\n"
                await answer.write(head.encode() + body + b"\r\n")
            number += 1
            await asyncio.sleep(1 / FRAMES_S)

    async def hls(self, request: web.Request) -> web.FileResponse:
        return web.FileResponse(self.folder / request.match_info["name"], headers=CORS)

    async def offer(self, request: web.Request) -> web.Response:
        lines = (await request.text()).splitlines()
        kept = [each for each in lines if "a=candidate" not in each or LOOPBACK in each]
        peer = RTCPeerConnection()
        peer.addTrack(_Track())
        await peer.setRemoteDescription(RTCSessionDescription("\r\n".join(kept) + "\r\n", "offer"))
        await peer.setLocalDescription(await peer.createAnswer())
        path = f"/whep/{len(self.sessions)}"
        self.sessions[path] = peer
        return web.Response(
            status=201,
            body=peer.localDescription.sdp,
            headers={**CORS, "Content-Type": "application/sdp", "Location": path},
        )

    async def end(self, request: web.Request) -> web.Response:
        await self.sessions.pop(request.path).close()
        if not self.sessions:
            self.left.set()
        return web.Response(headers=CORS)


async def _allowed(_: web.Request) -> web.Response:
    return web.Response(status=204, headers=CORS)


@asynccontextmanager
async def cameras(folder: Path) -> AsyncIterator[Cameras]:
    """Served until the end; files of HLS are in `folder`."""
    here = Cameras(folder=folder)
    await asyncio.to_thread(write_hls, folder)
    app = web.Application()
    app.router.add_get("/image", here.image)
    app.router.add_get("/mjpeg", here.mjpeg)
    app.router.add_get("/closed", here.mjpeg)
    app.router.add_get("/hls/{name}", here.hls)
    app.router.add_post("/whep", here.offer)
    app.router.add_delete("/whep/{session}", here.end)
    app.router.add_options("/{any:.*}", _allowed)
    runner = web.AppRunner(app, shutdown_timeout=0.1)
    await runner.setup()
    site = web.TCPSite(runner, LOOPBACK, 0)
    await site.start()
    here.base = f"http://{LOOPBACK}:{runner.addresses[0][1]}"
    addresses = aioice.ice.get_host_addresses
    aioice.ice.get_host_addresses = lambda **_: [LOOPBACK]
    try:
        yield here
    finally:
        aioice.ice.get_host_addresses = addresses
        for peer in here.sessions.values():
            await peer.close()
        await runner.cleanup()
