"""The files that a campaign ends with: its report (also in Markdown), the rows, the worst runs."""

from collections.abc import Sequence
from pathlib import Path

from m2pem.campaign.campaign import CampaignResult
from m2pem.campaign.folder import write_parquet
from m2pem.campaign.html import html_page
from m2pem.campaign.report import WORST, Report, Section, answers_name, report_of
from m2pem.campaign.runs import answers_text, replay_command, replayed
from m2pem.campaign.statistics import rehearsed, worst


def write_report(folder: Path, result: CampaignResult, other: CampaignResult | None = None) -> None:
    """Write `report.html`, `report.md` with its charts, `runs.parquet`, and the worst runs as
    answers files. `other`: the campaign that it is compared with."""
    rows = rehearsed(result.rows)
    for row in worst(rows, WORST):
        drawn, _ = replayed(result.order, row["run"])
        file = folder / answers_name(row)
        file.parent.mkdir(exist_ok=True)
        remark = f"Run {row['run']} of a campaign of {result.order.mission.file}: {row['outcome']}"
        command = replay_command(result.order, file)
        file.write_text(answers_text(drawn, f"{remark}\n{command}"), encoding="utf-8")
    if rows:
        write_parquet(folder / "runs.parquet", result.rows)
    report = report_of(result, other, folder)
    for section in report.sections:
        if section.chart is not None:
            file = folder / f"{section.chart.name}.svg"
            file.write_text(section.chart.svg(), encoding="utf-8")
    lines = markdown_lines(report, images=True)
    (folder / "report.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (folder / "report.html").write_text(html_page(report), encoding="utf-8")


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
