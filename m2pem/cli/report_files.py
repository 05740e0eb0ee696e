"""Writes what `m2pem verify` found to files: Markdown with pictures, JSON, SVG."""

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
            file.write_text(_picture(findings, first), encoding="utf-8")
        else:
            _write_markdown(file, findings)
    except OSError as error:
        raise UnusableError(f"{file} cannot be written: {error.strerror}") from error


def _write_markdown(file: Path, findings: "Findings") -> None:
    from m2pem.verify.report.markdown import as_markdown

    pictures: dict[int, str] = {}
    for number, violation in enumerate(findings.violations):
        if violation.answer.warning and not findings.strict:
            continue
        beside = file.with_name(f"{file.stem}-{number + 1}.svg")
        try:
            drawn = _picture(findings, violation)
        except UnusableError:  # the report is worth having without it
            break
        beside.write_text(drawn, encoding="utf-8")
        pictures[number] = beside.name
    file.write_text(as_markdown(findings, pictures), encoding="utf-8")


def _picture(findings: "Findings", violation: "Violated | None") -> str:
    from m2pem.verify.report.picture import picture

    try:
        return picture(findings, violation)
    except ValueError as error:
        raise UnusableError(f"{findings.mission.file} cannot be drawn: {error}") from error
