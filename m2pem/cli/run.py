"""`m2pem run`: one mission, from its start to its end."""

import asyncio
from pathlib import Path
from typing import TYPE_CHECKING

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
def run(
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
    """Run a mission to its end.

    Ends with 0 if the mission completed or terminated itself, with 1 if it failed, with 2 if it
    cannot be started, and with 130 if an operator stopped it. Ctrl-C stops it, and waits until its
    vehicles are released.
    """
    from m2pem.cli.interruption import Interruption

    with Interruption() as interruption:
        return asyncio.run(
            _run(
                mission,
                fleet_file,
                interruption,
                process=process,
                search_path=search_path,
                data=data,
                spec=spec,
                journal_url=journal,
                ocu_names=ocu_names,
                face_names=face_names,
                answers_file=answers,
                simulated=simulate,
                speed=speed,
                output=output,
            )
        )


async def _run(
    mission_file: str,
    fleet_name: str,
    interruption: "Interruption",
    *,
    process: str | None,
    search_path: tuple[Path, ...],
    data: "dict[str, Value]",
    spec: Path | None,
    journal_url: str | None,
    ocu_names: str | None,
    face_names: str | None,
    answers_file: Path | None,
    simulated: bool,
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
    from m2pem.executive.loading import known_data, load_source, monitored_requirements
    from m2pem.executive.simulated_state import tidy_up, with_own_state
    from m2pem.findings import lines
    from m2pem.fleet.fleet import simulated_fleet
    from m2pem.journal import file_of
    from m2pem.plugins import PluginManager
    from m2pem.scripting.sources import fleet_of

    plugins = PluginManager()
    operators = Operators(chosen(ocu_names, plugins), plugins)
    url = url_of(journal_url)
    mission = load_source(mission_file, search_path)
    answers = get_answers(answers_file, mission)
    fleet = fleet_of(fleet_name, mission)
    fleet = with_own_state(simulated_fleet(fleet) if simulated else fleet, file_of(url))
    refuse_speed(fleet, speed)
    faces = Faces(face_names, fleet, plugins)
    interruption.begin()
    async with journal_at(url) as journal:
        clock = SystemClock(speed)
        executive = make_executive(
            fleet,
            journal,
            plugins,
            clock,
            answers=answers,
            search_path=search_path,
        )
        faces.make(executive.control)
        process_id, warnings = executive.admit(mission, process, data)
        for line in lines(warnings):
            note(line)
        required = monitored_requirements(mission, fleet, plugins, known_data(data), spec)
        with output_of(output) as out:
            status = await drive_run(
                executive,
                out,
                operators,
                answers,
                file_of(url),
                interruption,
                lambda: executive.begin(mission, process_id, data, "", requirements=required),
                faces,
            )
        tidy_up(executive, file_of(url))
    return status
