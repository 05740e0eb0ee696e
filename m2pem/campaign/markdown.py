"""The report of a campaign in Markdown."""

from collections.abc import Sequence

from m2pem.campaign.report import Code, Report, Section


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
    if images and section.chart is not None:
        lines += ["", f"![{section.chart.title}]({section.chart.name}.svg)"]
    return lines


def _row(cells: Sequence[str]) -> str:
    return f"| {' | '.join(map(_cell, cells))} |"


def _cell(cell: str) -> str:
    text = f"`{cell}`" if isinstance(cell, Code) else cell
    return text.replace("|", "\\|")
