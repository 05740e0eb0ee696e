"""`m2pem run`: one mission, from its start to its end."""

import asyncio
from pathlib import Path
from typing import TYPE_CHECKING

import click

from m2pem.cli.options import (
    answers_option,
    data_option,
    example,
    fleet_option,
    format_option,
    journal_option,
    mission_argument,
    ocu_option,
    process_option,
    simulate_option,
    speed_option,
)

if TYPE_CHECKING:
    from m2pem.model.values import Value


@click.command(
    epilog=example(
        "m2pem run missions/vignette1.bpmn --fleet fleet_configs/vignette1.yaml "
        "--simulate --speed 20"
    )
)
@mission_argument
@fleet_option(required=True)
@process_option
@data_option
@journal_option
@ocu_option
@answers_option
@simulate_option
@speed_option
@format_option
def run(
    mission: str,
    fleet_file: str,
    process: str | None,
    data: "dict[str, Value]",
    journal: str | None,
    ocu_names: str | None,
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
    from m2pem.cli.starting import run_mission

    return asyncio.run(
        run_mission(
            mission,
            fleet_file,
            process=process,
            data=data,
            journal=journal,
            ocu_names=ocu_names,
            answers=answers,
            simulated=simulate,
            speed=speed,
            output=output,
        )
    )
