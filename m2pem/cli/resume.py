"""`m2pem resume`: a run that its executive left without ending it."""

import asyncio
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from m2pem.cli.options import (
    UnusableError,
    answers_option,
    example,
    face_option,
    format_option,
    journal_option,
    ocu_option,
    run_argument,
)

if TYPE_CHECKING:
    from m2pem.cli.interruption import Interruption


@click.command(epilog=example("m2pem resume r1"))
@run_argument
@journal_option
@ocu_option
@face_option
@answers_option
@click.option("--stop", is_flag=True, help="Stop the run, and the vehicles, at once.")
@format_option
def resume(**options: Any) -> int:
    """Take up a run that was interrupted.

    The mission, the fleet, whether it is simulated, and its speed, are in the journal; the faces
    are those of the fleet file. Ends as `m2pem run` does.
    """
    from m2pem.cli.interruption import Interruption

    with Interruption() as interruption:
        return asyncio.run(_resume(interruption, **options))


async def _resume(
    interruption: "Interruption",
    *,
    run_id: str,
    journal: str | None,
    ocu_names: str | None,
    face_names: str | None,
    answers: Path | None,
    stop: bool,
    output: str,
) -> int:
    from m2pem.api.clock import SystemClock
    from m2pem.api.operator import operator_name
    from m2pem.cli.arguments import get_answers
    from m2pem.cli.faces import Faces, with_faces_of_file
    from m2pem.cli.journals import existing_journal, find_run, last_decided_us, url_of
    from m2pem.cli.ocus import Operators, chosen
    from m2pem.cli.output import output_of
    from m2pem.cli.session import drive_run, make_executive
    from m2pem.engine.state import RunStatus
    from m2pem.executive.simulated_state import tidy_up
    from m2pem.journal import file_of
    from m2pem.journal.mission import fleet_of, mission_of
    from m2pem.plugins import PluginManager

    plugins = PluginManager()
    operators = Operators(chosen(ocu_names, plugins), plugins)
    interruption.begin()
    async with existing_journal(journal) as opened:
        line = await find_run(opened, run_id)
        header = line.header
        if line.outcome is not None:
            raise UnusableError(f"{run_id} has ended ({line.outcome.value}): nothing to resume")
        if line.driven:
            raise UnusableError(f"{run_id} is being driven by an executive that is alive")
        mission = mission_of(header)
        script = get_answers(answers, mission)
        fleet = fleet_of(header)
        faces = Faces(face_names, with_faces_of_file(fleet), plugins)
        # Simulated time may have run ahead of the wall clock; it never goes back.
        start_us = max(time.time_ns() // 1000, await last_decided_us(opened, line))
        clock = SystemClock(header.speed, start_us)
        executive = make_executive(fleet, opened, plugins, clock, answers=script)
        faces.make(executive.control)
        executive.supervisor.interrupted.expect([run_id])
        with output_of(output) as out:

            async def take_up() -> str:
                await executive.resume(run_id)
                if stop:
                    reason = "stopped after an interruption"
                    await executive.control.stop(run_id, by=operator_name(), reason=reason)
                state = executive.runner(run_id).run.state
                if out.lines is not None:
                    out.lines.restore(state)
                if state.status is RunStatus.PAUSED:
                    click.echo(f"m2pem: {run_id} is paused: an operator lets it go on", err=True)
                return run_id

            status = await drive_run(
                executive,
                out,
                operators,
                script,
                file_of(url_of(journal)),
                interruption,
                take_up,
                faces,
            )
        tidy_up(executive, file_of(url_of(journal)))
    return status
