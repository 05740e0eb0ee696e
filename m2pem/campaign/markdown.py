"""The report of a campaign in Markdown."""

from collections.abc import Sequence

from m2pem.campaign.report import Report, Section


def markdown_lines(report: Report, *, images: bool = False) -> list[str]:
    """Return the lines of a report. `images`: the charts are SVG files beside it."""
    lines = [f"# {report.title}"]
    for text in report.paragraphs:
        lines += ["", text]
    for section in report.sections:
        lines += _section(section, images=images)
    return lines


def _section(section: Section, *, images: bool) -> list[str]:
    lines = ["", f"## {section.title}"]
    for text in section.before:
        lines += ["", text]
    lines += ["", _row(section.table.columns), "|" + "---|" * len(section.table.columns)]
    lines += [_row(cells) for cells in section.table.rows]
    for text in section.after:
        lines += ["", text]
    if section.commands:
        lines += ["", *(f"    {each}" for each in section.commands)]
    if images and section.chart is not None:
        lines += ["", f"![{section.chart.title}]({section.chart.name}.svg)"]
    return lines


def _row(cells: Sequence[str]) -> str:
    escaped = (cell.replace("|", "\\|") for cell in cells)
    return f"| {' | '.join(escaped)} |"
