"""Templates for new missions: the BPMN files of this folder, with title and documentation."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from xml.etree import ElementTree as ET

_MODEL = "{http://www.omg.org/spec/BPMN/20100524/MODEL}"
SUFFIX = ".bpmn"


@dataclass(frozen=True, slots=True)
class Template:
    """A template. `title`: the name of its process; `doc`: the documentation of it."""

    name: str
    title: str
    doc: str
    xml: str


@cache
def templates() -> Sequence[Template]:
    """Return all templates in alphabetical order."""
    found = [
        _read(each.name.removesuffix(SUFFIX), each.read_text(encoding="utf-8"))
        for each in files(__name__).iterdir()
        if each.name.endswith(SUFFIX)
    ]
    return sorted(found, key=lambda each: each.name)


def find(name: str) -> Template | None:
    """Return the template with a name; None if it does not exist."""
    return next((each for each in templates() if each.name == name), None)


def _read(name: str, xml: str) -> Template:
    process = ET.fromstring(xml).find(f"{_MODEL}process")
    title = doc = ""
    if process is not None:
        title = process.get("name", "")
        doc = " ".join((process.findtext(f"{_MODEL}documentation") or "").split())
    return Template(name, title or name, doc, xml)
