"""XML of mission files: namespaces, names of elements, and safe parsing of untrusted files.

Files are read without entities, DTDs or network. Bytes are decoded here, and only here, so that the
check for a document type declaration and the parser see the same text. A document type declaration
is refused before the parser runs, which rules out entities of every sort. Only then may the
parser's own limits be lifted: its depth limit of 256 elements is below what nested subprocesses
need.
"""

import codecs
import os
import re
from collections.abc import Callable
from dataclasses import dataclass
from operator import attrgetter
from typing import cast

from lxml import etree

from m2pem.bpmn.rules.files import DOCTYPE, ENCODING, NOT_XML, TOO_DEEP, TOO_LARGE
from m2pem.bpmn.rules.rule import Rule
from m2pem.errors import M2pemError

VARIABLE = "M2PEM_MAX_MISSION_MIB"
DEFAULT_MIB = 64
_MIB = 1024 * 1024


def max_bytes() -> int:
    """The size limit of a mission file, in bytes.

    Raises:
        M2pemError: the environment variable is no whole number of MiB from 1.
    """
    text = os.environ.get(VARIABLE, "").strip() or str(DEFAULT_MIB)
    if not text.isascii() or not text.isdecimal() or int(text) < 1:
        raise M2pemError(
            f"{VARIABLE}={text!r} is no whole number of MiB from 1; write for example "
            f"{VARIABLE}={DEFAULT_MIB}"
        )
    return int(text) * _MIB


def too_large(has_bytes: int | None = None) -> tuple[str, str]:
    """Return the error and remedy for a file that is too large; `size` if it is known."""
    limit = max_bytes()
    has = f"has {has_bytes:,} bytes, more" if has_bytes is not None else "has more"
    return (
        f"the file {has} than the {limit:,} that m2pem reads",
        f"set {VARIABLE} to more than {limit // _MIB} (MiB), or split the mission",
    )


BPMN = "{http://www.omg.org/spec/BPMN/20100524/MODEL}"
M2PEM = "{https://m2pem.org/schema/1}"
CAMUNDA = "{http://camunda.org/schema/1.0/bpmn}"
ACTIVITI = "{http://activiti.org/bpmn}"
JBPM = "{http://www.jboss.org/drools}"
FLOWABLE = "{http://flowable.org/bpmn}"
OPERATON = "{http://operaton.org/schema/1.0/bpmn}"
"""Camunda 7's successor, whose elements are Camunda's: they are read as those."""

ZEEBE = "{http://camunda.org/schema/zeebe/1.0}"

attribute_names = cast("Callable[[etree._Element], list[str]]", etree._Element.keys)
"""The names of an element's attributes, with their namespaces."""


def local(tag: str) -> str:
    """The name without its namespace."""
    return tag.rpartition("}")[2]


_KINDS = {
    "adHocSubProcess": "ad-hoc subprocess",
    "compensateEventDefinition": "compensation event",
    "eventBasedGateway": "event-based gateway",
    "globalTask": "global task",
    "multiInstanceLoopCharacteristics": "multi-instance activity",
    "standardLoopCharacteristics": "loop activity",
    "subProcess": "subprocess",
    "subChoreography": "subchoreography",
}


def kind(tag: str) -> str:
    """Return the name of a tag's elements for people ("business rule task")."""
    name = local(tag)
    known = _KINDS.get(name)
    if known is not None:
        return known
    if name.endswith("EventDefinition"):
        name = name.removesuffix("Definition")
    words = "".join(f" {letter.lower()}" if letter.isupper() else letter for letter in name)
    return words.strip()


def a(noun: str) -> str:
    """The noun with its indefinite article."""
    return f"an {noun}" if noun[:1] in "aeio" else f"a {noun}"


MAX_ELEMENT_DEPTH = 2048
"""How deep elements may nest: libxml2's limit for `huge_tree`."""

_LAST_EXACT_LINE = 65_534  # libxml2 keeps an element's line in 16 bits

_DECLARATION = re.compile(rb"""\s*<\?xml\s[^>]*?encoding\s*=\s*["']([A-Za-z][\w.:-]*)["']""")
_PROLOG_PART = re.compile(r"\s+|<!--.*?-->|<\?.*?\?>", re.DOTALL)
_WRAPPED_TAG = re.compile(rb"<[A-Za-z_][^<>]*\n")
_MARKUP = re.compile(rb"<!--.*?-->|<!\[CDATA\[.*?\]\]>|<\?.*?\?>|<[^\s!?/<>]", re.DOTALL)
_START_TAG = 2
"""Bytes that `_MARKUP` matches of a start tag; of all else it matches more."""

_BOMS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF32_LE, "utf-32-le"),
    (codecs.BOM_UTF32_BE, "utf-32-be"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)
_REFUSED_CODECS = frozenset(
    {"idna", "punycode", "raw-unicode-escape", "unicode-escape", "utf-7"}
)  # no file encodings; some decode in quadratic time


class XmlError(Exception):
    """The bytes are no XML that m2pem reads. `line` counts from 1."""

    def __init__(self, rule: Rule, line: int, message: str, remedy: str = "") -> None:
        super().__init__(message)
        self.rule = rule
        self.line = line
        self.message = message
        self.remedy = remedy or rule.right


@dataclass(frozen=True, slots=True)
class Document:
    """A parsed document; `line` gives the line on which an element's start tag begins."""

    root: etree._Element
    line: Callable[[etree._Element], int]


def parse_xml(data: bytes, *, declared: bool = True) -> Document:
    """Parse a document; comments and processing instructions are dropped.

    Unless `declared`, the data is UTF-8 whatever its XML declaration says.

    Raises:
        XmlError: too large, wrongly encoded, with a DOCTYPE, too deep or not well-formed.
    """
    if len(data) > max_bytes():
        raise XmlError(TOO_LARGE, 1, *too_large(len(data)))
    text = _decode(data) if declared else data.decode()
    _refuse_doctype(text)
    utf8 = text.encode().replace(OPERATON[1:-1].encode(), CAMUNDA[1:-1].encode())
    parser = _parser()
    try:
        root = etree.fromstring(utf8, parser)
    except etree.XMLSyntaxError as error:
        if any(entry.type != etree.ErrorTypes.WAR_NS_URI for entry in parser.error_log):
            raise _not_well_formed(error) from None
        root = etree.fromstring(utf8, _parser(recover=True))  # names of namespaces may be any text
    if root.getroottree().docinfo.internalDTD is not None:
        raise _doctype_found(1)
    return Document(root, _line_finder(root, utf8))


def _parser(*, recover: bool = False) -> etree.XMLParser:
    return etree.XMLParser(
        encoding="utf-8",
        resolve_entities=False,
        load_dtd=False,
        no_network=True,
        huge_tree=True,
        remove_comments=True,
        remove_pis=True,
        recover=recover,
    )


def _decode(data: bytes) -> str:
    for bom, name in _BOMS:
        if data.startswith(bom):
            encoding, data = name, data[len(bom) :]
            break
    else:
        encoding = _declared_encoding(data)
    try:
        return data.decode(encoding)
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        byte = data[error.start]
        raise XmlError(
            ENCODING,
            line,
            f"byte 0x{byte:02x} is no {encoding} text",
            "save the file as UTF-8, or declare its encoding in the first line",
        ) from None


def _declared_encoding(data: bytes) -> str:
    if data.startswith(b"<\0"):
        return "utf-16-le"
    if data.startswith(b"\0<"):
        return "utf-16-be"
    declaration = _DECLARATION.match(data[:1024])
    if declaration is None:
        return "utf-8"
    name = declaration.group(1).decode("ascii", "replace")
    try:
        encoding = codecs.lookup(name).name
        b" ".decode(encoding, "replace")
    except (LookupError, UnicodeError):
        encoding = ""
    if not encoding or encoding.replace("_", "-") in _REFUSED_CODECS:
        raise XmlError(ENCODING, 1, f"m2pem does not know the encoding '{name}'")
    if encoding.startswith(("utf-16", "utf-32")):
        return "utf-8"  # the declaration was readable byte by byte, so it is wrong about itself
    return encoding


def _refuse_doctype(text: str) -> None:
    position = 0
    while part := _PROLOG_PART.match(text, position):
        position = part.end()
    if text.startswith("<!DOCTYPE", position):
        raise _doctype_found(text.count("\n", 0, position) + 1)


def _doctype_found(line: int) -> XmlError:
    return XmlError(
        DOCTYPE,
        line,
        "the file has a document type declaration (DOCTYPE), which m2pem refuses: it can pull in "
        "other files",
    )


def _not_well_formed(error: etree.XMLSyntaxError) -> XmlError:
    message = re.sub(r", line \d+, column \d+.*", "", error.msg or "the XML is not well-formed")
    line = max(error.lineno or 1, 1)
    if "Excessive depth" in message:
        return XmlError(TOO_DEEP, line, f"elements are nested more than {MAX_ELEMENT_DEPTH} deep")
    return XmlError(NOT_XML, line, f"the file is not well-formed XML: {message.strip()}")


def _line_finder(root: etree._Element, utf8: bytes) -> Callable[[etree._Element], int]:
    """libxml2's lines when they are exact: 16 bits, and the line on which a start tag *ends*."""
    if utf8.count(b"\n") < _LAST_EXACT_LINE and not _WRAPPED_TAG.search(utf8):
        return attrgetter("sourceline")
    starts: list[int] = []
    line, counted = 1, 0
    for markup in _MARKUP.finditer(utf8):
        start, end = markup.span()
        if end - start == _START_TAG:
            line += utf8.count(b"\n", counted, start)
            counted = start
            starts.append(line)
    lines = dict(zip(root.iter(etree.Element), starts, strict=True))
    return lines.__getitem__


_MEANT = {
    ("complexBehaviorDefinition", "formalExpression"): "condition",
    ("complexBehaviorDefinition", "implicitThrowEvent"): "event",
    ("correlationPropertyBinding", "formalExpression"): "dataPath",
    ("correlationPropertyRetrievalExpression", "formalExpression"): "messagePath",
}
_PLACES = {(BPMN + outer, BPMN + inner): BPMN + meant for (outer, inner), meant in _MEANT.items()}
_TYPES = sorted({inner for _, inner in _PLACES})


def call_by_role(root: etree._Element) -> None:
    """Rename elements written under the names of their types (bpmn-moddle) to BPMN's names."""
    for element in [*root.iter(*_TYPES)]:
        parent = element.getparent()
        meant = None if parent is None else _PLACES.get((parent.tag, element.tag))
        if meant is not None:
            element.tag = meant
