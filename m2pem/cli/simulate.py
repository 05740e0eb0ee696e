"""`m2pem simulate`: a mission on a virtual clock."""

from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import click

from m2pem.cli.options import (
    answers_option,
    data_option,
    example,
    fleet_option,
    format_option,
    mission_argument,
    path_option,
    process_option,
    spec_option,
    writing,
)
from m2pem.units import US_PER_S

if TYPE_CHECKING:
    from m2pem.api.runs import StampedRecord
    from m2pem.fleet.fleet import Fleet
    from m2pem.mission.values import Value


def _read_start(_: click.Context, __: click.Parameter, text: str | None) -> int | None:
    """Microseconds since the Unix epoch; a date without a zone is UTC."""
    if text is None:
        return None
    try:
        start = datetime.fromisoformat(text)
    except ValueError as error:
        raise click.BadParameter(f"{text!r} is no ISO 8601 date: 2026-01-01T00:00:00Z") from error
    return round((start if start.tzinfo else start.replace(tzinfo=UTC)).timestamp() * US_PER_S)


@click.command(
    epilog=example(
        "m2pem simulate missions/vignette1.bpmn --fleet fleet_configs/vignette1.yaml "
        "--answers missions/answers/vignette1_detection.yaml"
    )
)
@mission_argument
@fleet_option(required=False)
@process_option
@path_option
@data_option
@spec_option
@answers_option
@click.option(
    "--start",
    "start_us",
    metavar="DATE",
    callback=_read_start,
    help="When it begins, ISO 8601  [default: 2026-01-01T00:00:00Z]",
)
@click.option(
    "--max-steps",
    type=click.IntRange(min=1),
    default=10_000_000,
    show_default=True,
    help="Engine steps after which it is given up.",
)
@click.option(
    "--gantt", type=click.Path(path_type=Path), metavar="FILE.svg", help="Draw who did what when."
)
@format_option
def simulate(
    mission: str,
    fleet_file: str | None,
    process: str | None,
    search_path: tuple[Path, ...],
    data: "dict[str, Value]",
    spec: Path | None,
    answers: Path | None,
    start_us: int | None,
    max_steps: int,
    gantt: Path | None,
    output: str,
) -> int:
    """Rehearse a mission on a virtual clock.

    Every vehicle is simulated; the same mission, fleet and answers give the same records, byte for
    byte. Needs no fleet if the mission commands nothing. Ends as `m2pem run` does.
    """
    from m2pem.cli.arguments import get_answers
    from m2pem.cli.notes import progress_line
    from m2pem.cli.output import output_of
    from m2pem.executive.loading import load_source
    from m2pem.plugins import PluginManager
    from m2pem.rehearsal.rehearsal import START_US, rehearse
    from m2pem.scripting.sources import fleet_of

    loaded = load_source(mission, search_path)
    fleet = fleet_of(fleet_file, loaded) if fleet_file is not None else None
    script = get_answers(answers, loaded)
    kept: list[StampedRecord] = []
    # On a terminal the records themselves are the progress.
    with output_of(output) as out, progress_line(wanted=not out.shown_to_a_person) as progress:
        out.format_with(lambda _: loaded, one=True, asks=True)

        def show(stamped: "StampedRecord") -> None:
            out.show(stamped)
            progress(lambda: f"{stamped.t_s:,.0f} s rehearsed, {stamped.seq:,} records")
            if gantt is not None:
                kept.append(stamped)
            if out.writer.full:
                out.writer.drain()
            if out.writer.broken:
                raise BrokenPipeError

        result = rehearse(
            loaded,
            fleet,
            plugins=PluginManager(),
            process=process,
            data=data,
            spec=spec,
            answers=script,
            start_us=START_US if start_us is None else start_us,
            max_steps=max_steps,
            on_record=show,
        )
        out.summarize(result.summary.run, result.requirements)
        out.writer.drain()
    if gantt is not None:
        _draw(gantt, kept, fleet)
    return result.exit_status


def _draw(file: Path, records: "list[StampedRecord]", fleet: "Fleet | None") -> None:
    from m2pem.cli.notes import note
    from m2pem.rehearsal.gantt import gantt_svg

    with writing(file):
        file.write_text(gantt_svg(records, fleet), encoding="utf-8")
    note(f"the chart is in {file}")
