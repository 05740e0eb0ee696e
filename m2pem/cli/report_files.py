"""Writes what `m2pem verify` found to files: Markdown with pictures, JSON, SVG."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from m2pem.cli.options import UnusableError, as_json

if TYPE_CHECKING:
    from m2pem.verify.report.findings import Findings, Violated

KINDS = (".md", ".json", ".svg")
"""Endings of reports' files."""


def write(file: Path, findings: "Findings") -> None:
    """Write a report of the kind that the file's ending says.

    Raises:
        UnusableError: it cannot be written, or the mission cannot be drawn.
    """
    try:
        if file.suffix == ".json":
            from m2pem.verify.report.data import as_data

            file.write_text(as_json(as_data(findings)) + "\n", encoding="utf-8")
        elif file.suffix == ".svg":
            first = next(iter(findings.violations), None)
            _write_pictures(file, _pictures(findings, first))
        else:
            _write_markdown(file, findings)
    except OSError as error:
        raise UnusableError(f"{file} cannot be written: {error.strerror}") from error


def _write_markdown(file: Path, findings: "Findings") -> None:
    from m2pem.verify.report.markdown import as_markdown

    pictures: dict[int, list[str]] = {}
    for number, violation in enumerate(findings.violations):
        if violation.answer.warning and not findings.strict:
            continue
        beside = file.with_name(f"{file.stem}-{number + 1}.svg")
        try:
            drawn = _pictures(findings, violation)
        except UnusableError:  # the report is worth having without it
            break
        pictures[number] = _write_pictures(beside, drawn)
    file.write_text(as_markdown(findings, pictures), encoding="utf-8")


def _write_pictures(file: Path, drawn: Mapping[str, str]) -> list[str]:
    """The first one as `file`, the others beside it: `FILE-PROCESSES.svg`. Answers with names."""
    names = []
    for qualifier, picture in drawn.items():
        each = file.with_stem(f"{file.stem}-{_plain(qualifier)}") if qualifier else file
        each.write_text(picture, encoding="utf-8")
        names.append(each.name)
    return names


def _plain(name: str) -> str:
    """A part of a file's name: qualifiers come from strangers' files."""
    return "".join(each if each.isalnum() or each in "-_" else "_" for each in name)


def _pictures(findings: "Findings", violation: "Violated | None") -> Mapping[str, str]:
    from m2pem.verify.report.picture import pictures

    try:
        return pictures(findings, violation)
    except ValueError as error:
        raise UnusableError(f"{findings.mission.file} cannot be drawn: {error}") from error
