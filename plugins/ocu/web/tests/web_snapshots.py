"""A server on 127.0.0.1 whose answers a camera gives: good ones, and all that can go wrong."""

import asyncio
import io
import threading
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass, field

from PIL import Image
from web_cameras import jpeg

from m2pem.fleet.fleet import Video, VideoKind

LOOPBACK = "127.0.0.1"
JPEG = jpeg(7)
DRIP_S = 0.02


def encoded(kind: str) -> bytes:
    """A small picture of another format."""
    content = io.BytesIO()
    Image.new("RGB", (8, 8), (70, 110, 70)).save(content, kind)
    return content.getvalue()


PNG, WEBP = encoded("PNG"), encoded("WEBP")


def answer(body: bytes, kind: str = "image/jpeg", *, length: int | None = None) -> bytes:
    said = len(body) if length is None else length
    head = f"HTTP/1.1 200 OK\r\nContent-Type: {kind}\r\nContent-Length: {said}\r\n\r\n"
    return head.encode() + body


def redirect(to: str) -> bytes:
    return f"HTTP/1.1 302 Found\r\nLocation: {to}\r\nContent-Length: 0\r\n\r\n".encode()


def multipart(boundary: str, *, length: bool = True, parts: int = 2) -> bytes:
    said = f"Content-Length: {len(JPEG)}\r\n" if length else ""
    part = f"--frame\r\nContent-Type: image/jpeg\r\n{said}\r\n".encode() + JPEG + b"\r\n"
    kind = f"multipart/x-mixed-replace; boundary={boundary}"
    return f"HTTP/1.1 200 OK\r\nContent-Type: {kind}\r\n\r\n".encode() + part * parts + b"--frame"


def chunked(body: bytes, *, whole: bool = True) -> bytes:
    head = b"HTTP/1.1 200 OK\r\nContent-Type: image/jpeg\r\nTransfer-Encoding: chunked\r\n\r\n"
    half = len(body) // 2
    chunks = b"".join(b"%x\r\n%b\r\n" % (len(part), part) for part in (body[:half], body[half:]))
    return head + chunks + (b"0\r\n\r\n" if whole else b"")


ANSWERS = {
    "/good": answer(JPEG),
    "/good?stream=1": answer(JPEG),
    "/lies": answer(JPEG, "text/html"),
    "/png": answer(PNG),
    "/webp": answer(WEBP),
    "/chunked": chunked(JPEG),
    "/unsaid": b"HTTP/1.0 200 OK\r\n\r\n" + JPEG,
    "/moved": redirect("/good"),
    "/mjpeg": multipart("frame"),
    "/mjpeg-hyphens": multipart('"--frame"'),
    "/mjpeg-unsaid": multipart("frame", length=False),
    "/script": answer(b"<script>alert(1)</script>", "text/html"),
    "/svg": answer(b"<svg onload='alert(1)'/>", "image/svg+xml"),
    "/empty": answer(b""),
    "/said-huge": answer(JPEG, length=4_000_000_000),
    "/short": answer(JPEG[:-100], length=len(JPEG)),
    "/cut": chunked(JPEG, whole=False),
    "/away": redirect("http://127.0.0.2:1/good"),
    "/other-port": redirect("http://127.0.0.1:1/good"),
    "/file": redirect("file:///etc/passwd"),
    "/round": redirect("/round"),
    "/missing": b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n\r\n",
    "/noise": b"\x00\xff" * 200 + b"\r\n\r\n",
    "/closed": b"",
    "/no-parts": b"HTTP/1.1 200 OK\r\nContent-Type: multipart/x-mixed-replace; boundary=a\r\n\r\nx",
}


@dataclass
class PictureServer:
    """`asked`: the paths of requests. `/held` answers as soon as `gate` is set."""

    base: str = ""
    asked: list[str] = field(default_factory=list)
    gate: asyncio.Event = field(default_factory=asyncio.Event)

    def video(self, path: str, kind: VideoKind = VideoKind.IMAGE) -> Video:
        return Video(self.base + path, kind)

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with suppress(ConnectionError, asyncio.IncompleteReadError):
            head = await reader.readuntil(b"\r\n\r\n")
            path = head.split(b" ")[1].decode()
            self.asked.append(path)
            await self._answer(path, writer)
        with suppress(ConnectionError):
            writer.close()
            await writer.wait_closed()

    async def _answer(self, path: str, writer: asyncio.StreamWriter) -> None:
        match path:
            case "/held":
                await self.gate.wait()
                writer.write(answer(JPEG))
            case "/endless":
                writer.write(b"HTTP/1.1 200 OK\r\nContent-Type: image/jpeg\r\n\r\n")
                while True:
                    writer.write(b"\xff" * 65_536)
                    await writer.drain()
            case "/mjpeg-endless":
                writer.write(multipart("frame", parts=0).removesuffix(b"--frame"))
                writer.write(b"--frame\r\n\r\n")
                while True:
                    writer.write(b"\xff" * 65_536)
                    await writer.drain()
            case "/head-drips":
                writer.write(b"HTTP/1.1 200 OK\r\n")
                while True:
                    writer.write(b"x")
                    await writer.drain()
                    await asyncio.sleep(DRIP_S)
            case "/body-drips":
                writer.write(answer(b"\xff", length=1_000_000))
                while True:
                    writer.write(b"\xff")
                    await writer.drain()
                    await asyncio.sleep(DRIP_S)
            case _:
                writer.write(ANSWERS[path])
        await writer.drain()


@asynccontextmanager
async def picture_server() -> AsyncIterator[PictureServer]:
    """Served until the end."""
    here = PictureServer()
    served: set[asyncio.Task[None]] = set()

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None
        served.add(task)
        with suppress(asyncio.CancelledError):  # asyncio logs it of a connection
            await here.serve(reader, writer)
        writer.close()

    server = await asyncio.start_server(serve, LOOPBACK, 0)
    here.base = f"http://{LOOPBACK}:{server.sockets[0].getsockname()[1]}"
    try:
        yield here
    finally:
        server.close()
        for task in served:
            task.cancel()
        await asyncio.gather(*served, return_exceptions=True)


def reading_threads() -> int:
    """How many threads wait for cameras."""
    return sum(each.name == "web: a picture" for each in threading.enumerate())
