"""Reads one picture of a camera over HTTP: of `VideoKind.IMAGE` the answer, of MJPEG a frame.

A camera's server is not trusted: time and size are bounded, redirects stay at its origin, and the
type is that of the content, whatever the server says.
"""

import http.client
import re
import socket
import ssl
from collections.abc import Iterator
from contextlib import closing, suppress
from dataclasses import dataclass
from http import HTTPStatus
from urllib.parse import SplitResult, quote, urljoin, urlsplit

from m2pem.fleet.fleet import Video

MOST_BYTES = 5_000_000
"""Most bytes of a picture."""

REDIRECTS = (301, 302, 303, 307, 308)
MOST_REDIRECTS = 3

CHUNK_BYTES = 65_536

HEADERS = {
    "Accept": "image/jpeg, image/png, image/webp, multipart/x-mixed-replace",
    "Cache-Control": "no-cache",
    "Connection": "close",
    "User-Agent": "m2pem",
}

_MULTIPART = re.compile(r'multipart/[^;]*;.*boundary="?([^";]+)"?', re.IGNORECASE)
_LENGTH = re.compile(rb"^content-length:[ \t]*(\d{1,9})[ \t]*\r?$", re.IGNORECASE | re.MULTILINE)


SAFE = "%/:=&?~#+!$,;'@()*[]"
"""Characters of addresses that are sent as they are."""


class NoPictureError(Exception):
    """Why there is no picture, as text for operators."""


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture; `suffix`: of names of files with such a content."""

    content: bytes
    suffix: str


MEDIA_TYPES = {"jpg": "image/jpeg", "png": "image/png", "webp": "image/webp"}
"""By the suffix."""


def picture_of(content: bytes) -> Picture:
    """Return a picture by its first bytes.

    Raises:
        NoPictureError: it is neither JPEG nor PNG nor WebP.
    """
    if content.startswith(b"\xff\xd8\xff"):
        return Picture(content, "jpg")
    if content.startswith(b"\x89PNG\r\n\x1a\n"):
        return Picture(content, "png")
    if content.startswith(b"RIFF") and content[8:12] == b"WEBP":
        return Picture(content, "webp")
    raise NoPictureError("the camera's answer is not a JPEG, PNG or WebP picture")


class PictureRequest:
    """One request. `read` blocks, in one thread; `abort`, from another one, ends it.

    `within_s`: the time limit to connect, and for each of the bytes. The whole is bounded by who
    aborts.
    """

    def __init__(self, video: Video, within_s: float, most_bytes: int = MOST_BYTES) -> None:
        self._video = video
        self._within_s = within_s
        self._most = most_bytes
        self._socket: socket.socket | None = None
        self._aborted = False

    def read(self) -> Picture:
        """Return the picture.

        Raises:
            NoPictureError: there is none.
        """
        try:
            return picture_of(self._content(urlsplit(self._video.url), MOST_REDIRECTS))
        except TimeoutError:
            raise NoPictureError("the camera does not answer") from None
        except ssl.SSLError as error:
            raise NoPictureError(f"the camera's TLS: {error.reason or error}") from None
        except OSError as error:
            why = error.strerror or "it broke off"
            raise NoPictureError(f"no connection to the camera: {why}") from None
        except (http.client.HTTPException, ValueError):
            raise NoPictureError("the camera's answer broke off, or is not HTTP") from None

    def abort(self) -> None:
        """End the request: `read` raises soon."""
        self._aborted = True
        # Whatever it waits for, it reads the end of the answer then.
        if self._socket is not None:
            with suppress(OSError):
                self._socket.shutdown(socket.SHUT_RDWR)

    def _content(self, url: SplitResult, redirects: int) -> bytes:
        with closing(self._connect(url)) as connection:
            target = f"{url.path or '/'}{f'?{url.query}' if url.query else ''}"
            connection.request("GET", quote(target, safe=SAFE), headers=HEADERS)
            with connection.getresponse() as answer:
                location = answer.headers.get("Location")
                if answer.status not in REDIRECTS or location is None:
                    return self._body(answer)
        to = urlsplit(urljoin(url.geturl(), location))
        if origin_of(to) != origin_of(url):
            raise NoPictureError("the camera's server redirects to another host or port")
        if not redirects:
            raise NoPictureError("the camera's server redirects too often")
        return self._content(to, redirects - 1)

    def _body(self, answer: http.client.HTTPResponse) -> bytes:
        if answer.status != HTTPStatus.OK:
            raise NoPictureError(f"the camera's server answers {answer.status}")
        multipart = _MULTIPART.match(answer.headers.get("Content-Type", ""))
        chunks = self._chunks(answer)
        return first_part(chunks, multipart[1]) if multipart else b"".join(chunks)

    def _connect(self, url: SplitResult) -> http.client.HTTPConnection:
        kind = http.client.HTTPSConnection if url.scheme == "https" else http.client.HTTPConnection
        connection = kind(url.hostname or "", url.port, timeout=self._within_s)
        connection.connect()
        self._socket = connection.sock
        if self._aborted:
            connection.close()
            raise TimeoutError
        return connection

    def _chunks(self, answer: http.client.HTTPResponse) -> Iterator[bytes]:
        """Yield the body as it comes.

        Raises:
            NoPictureError: it is too large.
            HTTPException: it broke off.
        """
        expected, taken = answer.length, 0
        while expected is None or taken < expected:
            if max(taken, expected or 0) > self._most:
                raise NoPictureError(f"the picture is larger than {self._most / 1e6:g} MB")
            chunk = answer.read1(CHUNK_BYTES)
            if not chunk:
                break
            taken += len(chunk)
            yield chunk
        if self._aborted or taken < (expected or 0):
            raise http.client.IncompleteRead(b"")


def origin_of(url: SplitResult) -> tuple[str, str | None, int]:
    """Return scheme, host and port of an address."""
    return url.scheme, url.hostname, url.port or (443 if url.scheme == "https" else 80)


def first_part(chunks: Iterator[bytes], boundary: str) -> bytes:
    """Return the first part of a multipart answer, as soon as it is whole.

    Raises:
        HTTPException: there is none.
        NoPictureError: as of `chunks`.
    """
    # Some cameras put the hyphens into the boundary.
    delimiter = b"--" + boundary.removeprefix("--").encode("latin-1", "replace")
    text, begin, length = bytearray(), -1, -1
    for chunk in chunks:
        searched = max(0, len(text) - len(delimiter), begin)
        text += chunk
        if begin < 0:
            at = text.find(delimiter)
            end = text.find(b"\r\n\r\n", at) if at >= 0 else -1
            if end < 0:
                continue
            begin = searched = end + 4
            said = _LENGTH.search(text, at, end + 2)
            length = int(said[1]) if said else -1
        if length >= 0:
            if len(text) >= begin + length:
                return bytes(text[begin : begin + length])
        elif (end := text.find(delimiter, searched)) >= 0:
            return bytes(text[begin:end]).removesuffix(b"\r\n")
    raise http.client.IncompleteRead(b"")
