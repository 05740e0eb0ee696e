"""The files that a campaign ends with: its report, the rows, and the worst runs."""

from pathlib import Path

from m2pem.campaign.campaign import CampaignResult
from m2pem.campaign.folder import write_parquet
from m2pem.campaign.html import html_page
from m2pem.campaign.markdown import markdown_lines
from m2pem.campaign.report import WORST, answers_name, report_of
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
