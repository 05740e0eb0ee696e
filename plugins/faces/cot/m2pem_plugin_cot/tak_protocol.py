"""The TAK protocol, version 1: events of Cursor on Target as protobuf instead of XML.

A datagram begins with BF, the version and BF; in a stream, BF and the length come before each
message. The optional package `takproto` reads them; here they become the XML that they stand for.
"""

import re
from xml.sax.saxutils import quoteattr

MESH_HEADER = b"\xbf\x01\xbf"
STREAM_HEADER = re.compile(rb"\s*\xbf([\x80-\xff]{0,3}[\x00-\x7f])")
"""Magic byte and length (varint), perhaps after the end of a line."""

_ANY_MESH_HEADER = re.compile(rb"\xbf[\x80-\xff]{0,9}[\x00-\x7f]\xbf")


class TakProtocolError(ValueError):
    """A message of the TAK protocol cannot be read."""


def varint(digits: bytes) -> int:
    """Return the number that protobuf writes so."""
    return sum((digit & 0x7F) << 7 * place for place, digit in enumerate(digits))


def is_tak(content: bytes) -> bool:
    """Return whether a datagram is of the TAK protocol, of any version."""
    return _ANY_MESH_HEADER.match(content) is not None


def as_xml(content: bytes) -> bytes:
    """Return the event in a datagram of the TAK protocol as XML: what of it may be a geometry.

    Raises:
        TakProtocolError: it is of another version, no protobuf, or `takproto` is not installed.
    """
    if not content.startswith(MESH_HEADER):
        raise TakProtocolError("TAK protocol of another version than 1")
    try:
        from google.protobuf.message import DecodeError  # noqa: PLC0415  # optional
        from takproto.proto import TakMessage  # noqa: PLC0415
    except ImportError:
        raise TakProtocolError(
            "TAK protocol (protobuf): install m2pem-plugin-cot[tak], or let the sender send XML"
        ) from None
    try:
        event = TakMessage.FromString(content[len(MESH_HEADER) :]).cotEvent
    except DecodeError:
        raise TakProtocolError("TAK protocol, but no valid protobuf") from None
    detail = event.detail
    named = f"<contact callsign={quoteattr(detail.contact.callsign)}/>"
    return (
        f"<event type={quoteattr(event.type)} uid={quoteattr(event.uid)}>"
        f'<point lat="{event.lat}" lon="{event.lon}"/>'
        f"<detail>{named if detail.contact.callsign else ''}{detail.xmlDetail}</detail></event>"
    ).encode()
