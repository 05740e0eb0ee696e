"""Events of Cursor on Target that come in: what of them is a geometry.

They come from a network, and nothing in them is trusted. They are XML or, as ATAK sends them to its
multicast group, of the TAK protocol, version 1: protobuf, which the optional package takproto
reads. A datagram of it begins with BF, the version and BF; in a stream, each message with BF and
its length.
"""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from xml.sax.saxutils import quoteattr

from lxml import etree

from m2pem.api import Area, Point, Route

MAX_EVENT_BYTES = 65_536
MAX_TAK_BYTES = MAX_EVENT_BYTES - 16
"""With its header, it is no longer than another event."""

MAX_CORNERS = 1000
MAX_NAME = 100
MAX_CHAT = 500
END = b"</event>"
TAK_MAGIC = b"\xbf"
TAK_HEADER = b"\xbf\x01\xbf"
_NAMES = ("callsign", "uid")
_TAK_IN_STREAM = re.compile(rb"\s*\xbf([\x80-\xff]{0,3}[\x00-\x7f])")
"""Magic byte and length, a varint; perhaps after the end of a line."""


class EventError(ValueError):
    """Bytes are no event, or one that cannot be used."""


@dataclass(frozen=True, slots=True)
class Received:
    """A marker, route or shape; or, with `text`, a message of chat. `name`: its callsign on the
    map, or that of the sender; `uid`: of the event, or of the sender. `to`: the callsigns or uids
    of those to whom it is sent; empty: to all."""

    uid: str
    name: str
    geometry: Point | Route | Area | None
    text: str = ""
    to: tuple[str, ...] = ()


def read_event(content: bytes) -> Received | None:
    """Return what an event draws or says; None if it does neither, as the position of a person.

    Raises:
        EventError: it is too long, neither XML nor of the TAK protocol, or its positions make no
            sense.
    """
    if content.startswith(TAK_MAGIC) and len(content) <= MAX_EVENT_BYTES:
        content = _xml_of_tak(content)
    if len(content) > MAX_EVENT_BYTES:
        raise EventError(f"it has {len(content):,} bytes, more than {MAX_EVENT_BYTES:,}")
    # Before the parser: a document type could declare entities, and those could be huge.
    if b"<!" in content or b"\0" in content:
        raise EventError("it has a document type, a comment or a null byte")
    # As UTF-8, whatever it declares: in UTF-7, a document type looks otherwise.
    parser = etree.XMLParser(
        encoding="utf-8", resolve_entities=False, no_network=True, huge_tree=False
    )
    try:
        event = etree.fromstring(content, parser)
    except (etree.XMLSyntaxError, ValueError) as error:
        raise EventError(f"no XML: {printable(str(error))}") from None
    if event.tag != "event":
        raise EventError("its root is no event")
    type_, uid = event.get("type", ""), printable(event.get("uid", ""))
    contact = event.find("detail/contact")
    name = "" if contact is None else contact.get("callsign", "")[:MAX_NAME]
    sent_to = [dest.get(key) for dest in event.findall("detail/marti/dest") for key in _NAMES]
    to = tuple(each for each in sent_to if each)
    if type_ == "b-t-f":
        return _chat(event)
    geometry = _geometry(type_, event)
    return None if geometry is None else Received(uid, name, geometry, to=to)


def _chat(event: etree._Element) -> Received | None:
    """Return a message to one contact; None for one to a room or a team."""
    chat, link = event.find("detail/__chat"), event.find("detail/link")
    text = (event.findtext("detail/remarks") or "")[:MAX_CHAT]
    if chat is None or link is None or not text.strip():
        raise EventError("chat without its sender or a text")
    name, uid = printable(chat.get("senderCallsign", "")), printable(link.get("uid", ""))
    return Received(uid, name, None, text, (chat.get("id", ""),))


def _xml_of_tak(content: bytes) -> bytes:
    """Return the event in a datagram of the TAK protocol as XML: what of it may be a geometry."""
    if not content.startswith(TAK_HEADER):
        raise EventError("TAK protocol of another version than 1")
    try:
        from google.protobuf.message import DecodeError  # noqa: PLC0415  # optional
        from takproto.proto import TakMessage  # noqa: PLC0415
    except ImportError:
        raise EventError(
            "TAK protocol (protobuf): install m2pem-plugin-cot[tak], or let the sender send XML"
        ) from None
    try:
        event = TakMessage.FromString(content[len(TAK_HEADER) :]).cotEvent
    except DecodeError:
        raise EventError("TAK protocol, but no valid protobuf") from None
    name = event.detail.contact.callsign
    return (
        f"<event type={quoteattr(event.type)} uid={quoteattr(event.uid)}>"
        f'<point lat="{event.lat}" lon="{event.lon}"/><detail>'
        f"{f'<contact callsign={quoteattr(name)}/>' if name else ''}"
        f"{event.detail.xmlDetail}</detail></event>"
    ).encode()


def printable(text: str) -> str:
    """Return a text of a sender for logs and journals: in one line, and not too long."""
    return "".join(each if each.isprintable() else " " for each in text[:MAX_NAME])


def _geometry(type_: str, event: etree._Element) -> Point | Route | Area | None:
    if type_.startswith("b-m-p"):
        point = event.find("point")
        if point is None:
            raise EventError("it has no point")
        return Point((*_place(point.get("lat", ""), point.get("lon", "")), None))
    if type_ == "b-m-r":
        return Route(_corners(event, 2))
    if type_ in ("u-d-f", "u-d-r"):
        corners = _corners(event, 3)
        if corners[0] != corners[-1]:
            corners = (*corners, corners[0])
        if len(set(corners)) < 3:
            raise EventError("an area has three corners or more")
        return Area((corners,))
    return None


def _corners(event: etree._Element, least: int) -> tuple[tuple[float, float, None], ...]:
    texts = [point for link in event.findall("detail/link") if (point := link.get("point"))]
    if not least <= len(texts) <= MAX_CORNERS:
        raise EventError(f"it has {len(texts)} corners, not {least} to {MAX_CORNERS}")
    split = [[*text.split(","), "", ""] for text in texts]
    return tuple((*_place(lat, lon), None) for lat, lon, *_ in split)


def _place(latitude: str, longitude: str) -> tuple[float, float]:
    try:
        lat, lon = float(latitude), float(longitude)
    except ValueError:
        raise EventError(f"{latitude[:20]!r}, {longitude[:20]!r} is no place") from None
    if not (math.isfinite(lat) and math.isfinite(lon) and abs(lat) <= 90 and abs(lon) <= 180):
        raise EventError(f"{lat:g}, {lon:g} is no place on Earth")
    return lat, lon


class EventStream:
    """Finds the events in a stream of bytes; one that is too long is left out, and counted. One of
    the TAK protocol gets the header that it would have in a datagram."""

    def __init__(self) -> None:
        self.too_long = 0
        self._waiting = b""
        self._skips = False
        self._skipped_bytes = 0
        """How much is yet to come of a message of the TAK protocol that is too long."""

    def feed(self, content: bytes) -> Iterator[bytes]:
        """Yield the events that are whole now."""
        waiting, begin = self._waiting + content, self._skipped_bytes
        while True:
            if not self._skips and (header := _TAK_IN_STREAM.match(waiting, begin)):
                start = header.end()
                end = start + sum((each & 127) << 7 * at for at, each in enumerate(header[1]))
                if end - start > MAX_TAK_BYTES:
                    self.too_long += 1
                elif end > len(waiting):
                    break
                else:
                    yield TAK_HEADER + waiting[start:end]
                begin = end
                continue
            if (found := waiting.find(END, begin)) < 0:
                break
            end = found + len(END)
            if self._skips:
                self._skips = False
            elif end - begin > MAX_EVENT_BYTES:
                self.too_long += 1
            else:
                yield waiting[begin:end].strip()  # of line ends between events
            begin = end
        self._skipped_bytes = max(0, begin - len(waiting))
        self._waiting = waiting[begin:]
        if len(self._waiting) > MAX_EVENT_BYTES:
            self.too_long += not self._skips
            self._skips = True
            # What may be the begin of its end stays.
            self._waiting = self._waiting[-len(END) :]
