"""`m2pem run`: one mission, from its start to its end."""

import asyncio
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from m2pem.cli.options import (
    answers_option,
    data_option,
    example,
    face_option,
    fleet_option,
    format_option,
    journal_option,
    mission_argument,
    ocu_option,
    path_option,
    process_option,
    simulate_option,
    spec_option,
    speed_option,
)

if TYPE_CHECKING:
    from m2pem.cli.interruption import Interruption
    from m2pem.mission.values import Value


@click.command(
    epilog=example(
        "m2pem run missions/vignette1.bpmn --fleet fleet_configs/vignette1.yaml "
        "--simulate --speed 20"
    )
)
@mission_argument
@fleet_option(required=True)
@process_option
@path_option
@data_option
@spec_option
@journal_option
@ocu_option
@face_option
@answers_option
@simulate_option
@speed_option
@format_option
def run(**options: Any) -> int:
    """Run a mission to its end.

    Ends with 0 if the mission completed or terminated itself, with 1 if it failed, with 2 if it
    cannot be started, and with 130 if an operator stopped it. Ctrl-C stops it, and waits until its
    vehicles are released.
    """
    from m2pem.cli.interruption import Interruption

    with Interruption() as interruption:
        return asyncio.run(_run(interruption, **options))


async def _run(
    interruption: "Interruption",
    *,
    mission: str,
    fleet_file: str,
    process: str | None,
    search_path: tuple[Path, ...],
    data: "dict[str, Value]",
    spec: Path | None,
    journal: str | None,
    ocu_names: str | None,
    face_names: str | None,
    answers: Path | None,
    simulate: bool,
    speed: float,
    output: str,
) -> int:
    from m2pem.api.clock import SystemClock
    from m2pem.cli.arguments import get_answers
    from m2pem.cli.faces import Faces
    from m2pem.cli.journals import journal_at, url_of
    from m2pem.cli.notes import note
    from m2pem.cli.ocus import Operators, chosen
    from m2pem.cli.output import output_of
    from m2pem.cli.session import drive_run, make_executive, refuse_speed
    from m2pem.executive.loading import load_source, monitored_requirements
    from m2pem.executive.simulated_state import tidy_up, with_own_state
    from m2pem.findings import lines
    from m2pem.fleet.fleet import simulated_fleet
    from m2pem.journal import file_of
    from m2pem.plugins import PluginManager
    from m2pem.scripting.sources import fleet_of

    plugins = PluginManager()
    operators = Operators(chosen(ocu_names, plugins), plugins)
    url = url_of(journal)
    loaded = load_source(mission, search_path)
    script = get_answers(answers, loaded)
    fleet = fleet_of(fleet_file, loaded)
    fleet = with_own_state(simulated_fleet(fleet) if simulate else fleet, file_of(url))
    refuse_speed(fleet, speed)
    faces = Faces(face_names, fleet, plugins)
    interruption.begin()
    async with journal_at(url) as opened:
        clock = SystemClock(speed)
        executive = make_executive(
            fleet, opened, plugins, clock, answers=script, search_path=search_path
        )
        faces.make(executive.control)
        process_id, warnings = executive.starter.admit(loaded, process, data)
        for line in lines(warnings):
            note(line)
        required = monitored_requirements(loaded, fleet, plugins, data, spec)
        with output_of(output) as out:
            status = await drive_run(
                executive,
                out,
                operators,
                script,
                file_of(url),
                interruption,
                lambda: executive.starter.begin(
                    loaded, process_id, data, "", requirements=required
                ),
                faces,
            )
        tidy_up(executive, file_of(url))
    return status
