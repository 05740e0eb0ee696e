"""SOAP 1.2: reads requests, and writes answers and faults."""

from collections.abc import Iterator
from xml.sax.saxutils import escape

from lxml import etree

ENVELOPE = "http://www.w3.org/2003/05/soap-envelope"
DEVICE = "http://www.onvif.org/ver10/device/wsdl"
MEDIA = "http://www.onvif.org/ver10/media/wsdl"
MEDIA2 = "http://www.onvif.org/ver20/media/wsdl"
PTZ = "http://www.onvif.org/ver20/ptz/wsdl"
RECORDING = "http://www.onvif.org/ver10/recording/wsdl"

_PREFIXES = {
    "env": ENVELOPE,
    "tds": DEVICE,
    "trt": MEDIA,
    "tr2": MEDIA2,
    "tptz": PTZ,
    "trc": RECORDING,
    "tt": "http://www.onvif.org/ver10/schema",
    "ter": "http://www.onvif.org/ver10/error",
    "xs": "http://www.w3.org/2001/XMLSchema",
}
_DECLARED = " ".join(f'xmlns:{prefix}="{uri}"' for prefix, uri in _PREFIXES.items())


class FaultError(Exception):
    """The fault that the camera answers. `subcodes`: of the ONVIF error, the outer one first."""

    def __init__(self, text: str, *subcodes: str, receiver: bool = False) -> None:
        super().__init__(text)
        self.text = text
        self.subcodes = subcodes or ("InvalidArgVal",)
        self.receiver = receiver

    @property
    def status(self) -> int:
        """The HTTP status."""
        return 500 if self.receiver else 400


class Element:
    """An element of a request. Names are without namespaces, as the prefixes of clients differ."""

    def __init__(self, element: etree._Element) -> None:
        self._element = element

    @property
    def name(self) -> str:
        return etree.QName(self._element).localname

    @property
    def namespace(self) -> str:
        return etree.QName(self._element).namespace or ""

    @property
    def text(self) -> str:
        return (self._element.text or "").strip()

    def attribute(self, name: str) -> str:
        """Return the text of an attribute; "" if it is missing."""
        return self._element.get(name) or ""

    def all(self, name: str) -> Iterator["Element"]:
        """Yield the children with a name."""
        for child in self._element:
            if isinstance(child.tag, str) and etree.QName(child).localname == name:
                yield Element(child)

    def child(self, *path: str) -> "Element | None":
        """Return the first child along a path of names; None if one is missing."""
        here = self
        for name in path:
            found = next(here.all(name), None)
            if found is None:
                return None
            here = found
        return here

    def says(self, *path: str) -> str:
        """Return the text of a child; "" if it is missing."""
        child = self.child(*path)
        return "" if child is None else child.text

    def first(self) -> "Element | None":
        children = (child for child in self._element if isinstance(child.tag, str))
        return next((Element(child) for child in children), None)


def read(content: bytes) -> tuple[Element | None, Element]:
    """Return the header and the requested operation.

    Raises:
        FaultError: it is no SOAP 1.2.
    """
    parser = etree.XMLParser(resolve_entities=False, no_network=True, remove_comments=True)
    try:
        root = etree.fromstring(content, parser)
    except etree.XMLSyntaxError as error:
        raise FaultError(f"not well-formed: {error}", "WellFormed") from error
    envelope = Element(root)
    body = envelope.child("Body")
    asked = body.first() if body is not None else None
    if envelope.namespace != ENVELOPE or asked is None:
        raise FaultError("not a SOAP 1.2 envelope with a body", "WellFormed")
    return envelope.child("Header"), asked


def response(asked: Element, content: str) -> str:
    """Return the response to an operation."""
    prefix = next(prefix for prefix, uri in _PREFIXES.items() if uri == asked.namespace)
    return f"<{prefix}:{asked.name}Response>{content}</{prefix}:{asked.name}Response>"


def answer(content: str) -> bytes:
    """Return an envelope with a body."""
    text = (
        f'<?xml version="1.0" encoding="UTF-8"?><env:Envelope {_DECLARED}>'
        f"<env:Body>{content}</env:Body></env:Envelope>"
    )
    return text.encode()


def refusal(fault: FaultError) -> bytes:
    """Return an envelope with a fault."""
    codes = ""
    for code in reversed(fault.subcodes):
        codes = f"<env:Subcode><env:Value>ter:{escape(code)}</env:Value>{codes}</env:Subcode>"
    side = "Receiver" if fault.receiver else "Sender"
    return answer(
        f"<env:Fault><env:Code><env:Value>env:{side}</env:Value>{codes}</env:Code>"
        f'<env:Reason><env:Text xml:lang="en">{escape(fault.text)}</env:Text></env:Reason>'
        "</env:Fault>"
    )
