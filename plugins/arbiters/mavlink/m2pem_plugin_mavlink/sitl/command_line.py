"""`m2pem sitl`: the real programs of autopilots, for the vehicles of a fleet, until Ctrl-C."""

import asyncio
import tempfile
from collections.abc import Sequence
from contextlib import AsyncExitStack, ExitStack
from pathlib import Path
from typing import NoReturn

import click

from m2pem import load_fleet
from m2pem.api.foreground import interrupted
from m2pem.errors import M2pemError, PluginError
from m2pem_plugin_mavlink.sitl.fleet import ARBITER, Vehicle, launches, read_vehicles
from m2pem_plugin_mavlink.sitl.launch import Launch, Program, first_to_end, running
from m2pem_plugin_mavlink.sitl.readiness import connected, ready

_FOLDER = click.Path(exists=True, file_okay=False, path_type=Path)


class EndedError(M2pemError):
    """A program has ended by itself; the text says which, how, and what it printed last."""


@click.command()
@click.option(
    "--fleet",
    "fleet_file",
    required=True,
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="Start what this fleet file has of arbiter mavlink, marked `sitl: true`.",
)
@click.option(
    "--ardupilot",
    type=_FOLDER,
    help="A source tree of ArduPilot, built for SITL, or a folder with its programs and NAME.parm "
    "beside each.",
)
@click.option(
    "--px4", type=_FOLDER, help="A source tree of PX4, built for SIH, or a folder with bin and etc."
)
@click.option(
    "--speed",
    type=click.FloatRange(0.1, 100),
    default=1.0,
    show_default=True,
    help="Simulated seconds per second.",
)
@click.option(
    "--keep",
    type=click.Path(file_okay=False, path_type=Path),
    help="Keep the vehicles' folders here, with logs, parameters and what the programs print.",
)
def sitl(
    fleet_file: Path,
    ardupilot: Path | None,
    px4: Path | None,
    speed: float,
    keep: Path | None,
) -> None:
    """Start the real autopilots of a fleet, as software in the loop, until Ctrl-C.

    Example: m2pem sitl --ardupilot ~/ardupilot --fleet fleet_configs/survey_pair.yaml --speed 5
    """
    fleet = load_fleet(fleet_file)
    with ExitStack() as opened:
        folder = keep or Path(
            opened.enter_context(tempfile.TemporaryDirectory(prefix="m2pem-sitl-"))
        )
        folder = folder.absolute()
        try:
            vehicles = read_vehicles(fleet, speed)
            if not vehicles:
                raise click.UsageError(
                    f"{fleet_file} has nothing to start: no vehicle has `arbiter: {ARBITER}` and "
                    "`sitl: true`"
                )
            starts = list(launches(vehicles, ardupilot, px4, folder))
        except PluginError as error:
            raise click.UsageError(f"{fleet_file}: {error}") from error
        for start in starts:
            if (folder / start.name).exists():
                raise click.UsageError(
                    f"--keep {keep}: it has a folder {start.name} of an earlier start; name a new "
                    "one"
                )
        asyncio.run(_run(vehicles, starts, folder, speed))


async def _run(
    vehicles: Sequence[Vehicle], starts: Sequence[Launch], folder: Path, speed: float
) -> None:
    """Start, wait until the vehicles are ready, give their ports up for the executive, and wait."""
    stop = interrupted()
    async with AsyncExitStack() as ports:
        watched = await ports.enter_async_context(connected(vehicles, speed))
        with ExitStack() as started:
            try:
                programs = started.enter_context(running(starts, folder))
            except OSError as error:
                raise click.ClickException(f"cannot start a program: {error}") from error
            for vehicle, program in zip(vehicles, programs, strict=True):
                click.echo(f"{vehicle}, pid {program.process.pid}")

            async def become_ready() -> None:
                await ready(watched, lambda text: click.echo(text, err=True))
                await ports.aclose()
                click.echo("ready")
                await stop.wait()

            waits = {
                asyncio.ensure_future(wait)
                for wait in (become_ready(), stop.wait(), _end_of_one(programs))
            }
            done, others = await asyncio.wait(waits, return_when=asyncio.FIRST_COMPLETED)
            for other in others:
                other.cancel()
            await asyncio.gather(*others, return_exceptions=True)
            if not stop.is_set():
                for each in done:
                    each.result()


async def _end_of_one(programs: Sequence[Program]) -> NoReturn:
    ended = await first_to_end(programs)
    raise EndedError(ended.how_it_ended())
