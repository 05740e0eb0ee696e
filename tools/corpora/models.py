"""Which files of a folder may be BPMN models."""

from pathlib import Path

SUFFIXES = (".bpmn", ".bpmn2", ".bpmn20.xml")
NAMESPACE = b"http://www.omg.org/spec/BPMN/20100524/MODEL"
HEAD_BYTES = 10_000
"""Where a file that only ends in `.xml` must name BPMN's namespace to be taken for a model."""


def models(folder: Path) -> list[Path]:
    """The models in a folder and below, by name."""
    return sorted(path for path in folder.rglob("*") if path.is_file() and _is_model(path))


def _is_model(path: Path) -> bool:
    name = path.name.lower()
    if name.endswith(SUFFIXES):
        return True
    if not name.endswith(".xml"):
        return False
    with path.open("rb") as stream:
        return NAMESPACE in stream.read(HEAD_BYTES)
