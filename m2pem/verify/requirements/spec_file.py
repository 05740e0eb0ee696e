"""Requirements in a YAML file of their own (`m2pem verify --spec FILE`)."""

from pathlib import Path
from typing import Any

from m2pem.findings import Finding
from m2pem.fleet.nearmiss import suggest
from m2pem.fleet.yaml_source import KeyPath, YamlSource, dotted, parse_yaml, read_yaml
from m2pem.verify.requirements.names import Names
from m2pem.verify.requirements.reading import UnusableError, Written, made
from m2pem.verify.requirements.requirement import Requirement, RequirementsError, misread

_KEYS = ("id", "text", "ltl", "pattern", "args", "fair")


def read_spec(path: Path, names: Names) -> list[Requirement]:
    """The requirements of a file, in its order.

    Raises:
        RequirementsError: the file, or something in it, cannot be used; tells all that is wrong.
    """
    return _requirements(read_yaml(path), names)


def parse_spec(content: bytes, file: str, names: Names) -> list[Requirement]:
    """The same, of text from elsewhere; `file` is what findings call it."""
    return _requirements(parse_yaml(content, file), names)


def _requirements(source: YamlSource, names: Names) -> list[Requirement]:
    found: list[Requirement] = []
    if not source.findings:
        entries = _entries(source)
        seen: dict[str, int] = {}
        for number, entry in enumerate(entries):
            path: KeyPath = ("requirements", number)
            written = _written(source, path, entry)
            if written is None:
                continue
            if written.id in seen:
                source.error(
                    (*path, "id"),
                    "requirement-id",
                    f"two requirements have the id '{written.id}'",
                    f"give each its own; the first is in line {seen[written.id]}",
                )
                continue
            seen[written.id] = written.line
            try:
                found += made(written, names)
            except UnusableError as error:
                where = (*path, *error.where.split(".", 1)) if error.where else path
                _note(source, where, written.id, error)
    if source.findings:
        raise RequirementsError(_sorted(source.findings))
    return found


def _note(source: YamlSource, where: KeyPath, name: str, error: UnusableError) -> None:
    said = f"{name}: {error.message}"
    wrong = error.misread
    if wrong is None:
        source.error(where, "requirement", said, error.remedy)
        return
    line, key = source.line(where), dotted(where)
    source.findings.append(misread(source.file, line, key, said, wrong.text, wrong.position))


def _sorted(findings: list[Finding]) -> list[Finding]:
    return sorted(findings, key=lambda finding: finding.line)


def _entries(source: YamlSource) -> list[Any]:
    data = source.data
    entries = data.get("requirements") if isinstance(data, dict) else None
    if not isinstance(entries, list):
        source.error((), "requirement", "has no list 'requirements'", "write 'requirements:' first")
        return []
    assert isinstance(data, dict)
    for key in data:
        if key != "requirements":
            source.error((key,), "requirement", f"'{key}' means nothing here", "delete it")
    return entries


def _written(source: YamlSource, path: KeyPath, entry: Any) -> Written | None:
    if not isinstance(entry, dict):
        source.error(
            path, "requirement", "is no requirement", "write 'id:' and 'ltl:' or 'pattern:'"
        )
        return None
    wrong = False
    for key in entry:
        if key not in _KEYS:
            wrong = True
            source.error(
                (*path, key),
                "requirement",
                f"a requirement has no '{key}'",
                suggest(key, _KEYS, "keys"),
            )
    for key in ("id", "text", "ltl", "pattern"):
        if key in entry and not isinstance(entry[key], str):
            wrong = True
            source.error((*path, key), "requirement", f"'{key}' is no text", "quote it")
    if not entry.get("id"):
        wrong = True
        source.error(path, "requirement-id", "a requirement has no id", "write 'id: ...' first")
    if not isinstance(entry.get("args", {}), dict):
        wrong = True
        source.error((*path, "args"), "requirement", "'args' is no map", "write {name: value}")
    if not isinstance(entry.get("fair", False), bool):
        wrong = True
        source.error((*path, "fair"), "requirement", "'fair' is true or false")
    if wrong:
        return None
    return Written(
        entry["id"],
        entry.get("ltl"),
        entry.get("pattern"),
        entry.get("args", {}),
        entry.get("text", ""),
        entry.get("fair"),
        source.file,
        source.line(path),
    )
