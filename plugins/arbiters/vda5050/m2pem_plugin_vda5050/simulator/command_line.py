"""The command `m2pem sim vda5050`: simulated vehicles, until Ctrl-C."""

import asyncio
from collections.abc import Iterable
from pathlib import Path

import click

from m2pem.api.command_options import FaultOption, speed_option
from m2pem.api.faults import FaultError, PlannedFault
from m2pem.api.foreground import interrupted, plan_typed_faults, until_interrupted
from m2pem.api.latest_task import cancel_and_wait
from m2pem.errors import PluginError
from m2pem_plugin_vda5050.settings import ARBITER, Settings
from m2pem_plugin_vda5050.simulator.agv import AgvSpec
from m2pem_plugin_vda5050.simulator.faults import GRAMMAR
from m2pem_plugin_vda5050.simulator.simulation import SimulatedVehicle, Simulation, read_specs


@click.command()
@click.option(
    "--fleet",
    "fleet_file",
    required=True,
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="Simulate what this fleet file has of arbiter vda5050, marked `sitl: true`.",
)
@speed_option(50)
@click.option(
    "--fault",
    "faults",
    type=FaultOption(GRAMMAR),
    multiple=True,
    help='What goes wrong, such as "agv1: mode manual at 20 s for 5 s": [VEHICLES:] ACTION '
    "[at SECONDS s] [for SECONDS s]. May be given more than once; also a line of standard input.",
)
def vda5050(
    fleet_file: Path, speed: float, faults: tuple[PlannedFault[SimulatedVehicle], ...]
) -> None:
    """Simulate vehicles that speak VDA 5050, at the MQTT broker of the fleet, until Ctrl-C.

    Example: m2pem sim vda5050 --fleet fleet.yaml --speed 10
    """
    from m2pem import load_fleet  # noqa: PLC0415  # readers of files are needed here alone

    fleet = load_fleet(fleet_file)
    try:
        specs = read_specs(fleet)
    except PluginError as error:
        raise click.UsageError(f"{fleet_file}: {error}") from error
    if not specs:
        raise click.UsageError(
            f"{fleet_file} has nothing to simulate: no vehicle has `arbiter: {ARBITER}` and "
            "`sitl: true`"
        )
    try:
        asyncio.run(_run(specs, speed, faults))
    except FaultError as error:
        raise click.UsageError(str(error)) from error


async def _run(
    specs: list[tuple[AgvSpec, Settings, float]],
    speed: float,
    faults: Iterable[PlannedFault[SimulatedVehicle]],
) -> None:
    stop = interrupted()
    simulation = Simulation(specs, speed, faults, click.echo)
    async with simulation:
        connecting = asyncio.create_task(simulation.connected())
        stopping = asyncio.create_task(stop.wait())
        await asyncio.wait((connecting, stopping), return_when=asyncio.FIRST_COMPLETED)
        if connecting.done():
            for spec, settings, _ in specs:
                click.echo(f"{spec.name}: {settings.address}")
            click.echo("ready")
        typed = plan_typed_faults(GRAMMAR, simulation.plan)
        await until_interrupted(stop, simulation.ended(), typed)
        await cancel_and_wait(connecting, stopping)
