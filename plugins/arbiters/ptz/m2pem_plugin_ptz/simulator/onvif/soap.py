"""SOAP 1.2 as cameras speak it: requests in, answers and faults out."""

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
    """What the camera answers instead. `subcodes`: of the ONVIF error, the outer one first."""

    def __init__(self, text: str, *subcodes: str, receiver: bool = False) -> None:
        super().__init__(text)
        self.text = text
        self.subcodes = subcodes or ("InvalidArgVal",)
        self.receiver = receiver

    @property
    def status(self) -> int:
        """Of HTTP."""
        return 500 if self.receiver else 400


class Element:
    """An element of a request. Names are without namespaces: clients prefix as they like."""

    def __init__(self, element: etree._Element) -> None:
        self._element = element

    @property
    def name(self) -> str:
        """Its name."""
        return etree.QName(self._element).localname

    @property
    def namespace(self) -> str:
        """Its namespace."""
        return etree.QName(self._element).namespace or ""

    @property
    def text(self) -> str:
        """Its text."""
        return (self._element.text or "").strip()

    def attribute(self, name: str) -> str:
        """An attribute's text; "" if it is not there."""
        return self._element.get(name) or ""

    def all(self, name: str) -> Iterator["Element"]:
        """Its children of this name."""
        for child in self._element:
            if isinstance(child.tag, str) and etree.QName(child).localname == name:
                yield Element(child)

    def child(self, *path: str) -> "Element | None":
        """The first child of this name, or its first one of the next."""
        here = self
        for name in path:
            found = next(here.all(name), None)
            if found is None:
                return None
            here = found
        return here

    def says(self, *path: str) -> str:
        """A child's text; "" if it is not there."""
        child = self.child(*path)
        return "" if child is None else child.text

    def first(self) -> "Element | None":
        """Its first child."""
        children = (child for child in self._element if isinstance(child.tag, str))
        return next((Element(child) for child in children), None)


def read(content: bytes) -> tuple[Element | None, Element]:
    """The header, and what is asked for.

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


def answer(content: str) -> bytes:
    """An envelope around it."""
    text = (
        f'<?xml version="1.0" encoding="UTF-8"?><env:Envelope {_DECLARED}>'
        f"<env:Body>{content}</env:Body></env:Envelope>"
    )
    return text.encode()


def refusal(fault: FaultError) -> bytes:
    """An envelope around a fault."""
    codes = ""
    for code in reversed(fault.subcodes):
        codes = f"<env:Subcode><env:Value>ter:{escape(code)}</env:Value>{codes}</env:Subcode>"
    side = "Receiver" if fault.receiver else "Sender"
    return answer(
        f"<env:Fault><env:Code><env:Value>env:{side}</env:Value>{codes}</env:Code>"
        f'<env:Reason><env:Text xml:lang="en">{escape(fault.text)}</env:Text></env:Reason>'
        "</env:Fault>"
    )
