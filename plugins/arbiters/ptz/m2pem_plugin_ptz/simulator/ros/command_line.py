"""The command `m2pem sim ros-cameras`: simulated cameras on pan-tilt units, until Ctrl-C."""

import asyncio
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from m2pem.api import SystemClock
from m2pem.api.command_options import speed_option
from m2pem.api.foreground import interrupted, until_interrupted
from m2pem.errors import PluginError

if TYPE_CHECKING:
    from m2pem_plugin_ptz.simulator.ros.camera import CameraSpec


@click.command("ros-cameras")
@click.option(
    "--fleet",
    "fleet_file",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    required=True,
    help="Simulate the cameras of this fleet file on vehicles marked `sitl: true`: of arbiter ptz "
    "and driver ros, and those of arbiter ros that have an m2pem node of their own.",
)
@speed_option(20)
@click.option(
    "--domain-id",
    type=click.IntRange(0, 101),
    help="The ROS domain of cameras whose fleet does not say.  [default: ROS_DOMAIN_ID]",
)
def ros_cameras(fleet_file: Path, speed: float, domain_id: int | None) -> None:
    """Simulate cameras on pan-tilt heads over ROS, on 127.0.0.1 alone, until Ctrl-C.

    Example: m2pem sim ros-cameras --fleet fleet.yaml
    """
    try:
        from m2pem_plugin_ros import keep_on_loopback  # noqa: PLC0415  # optional
    except ModuleNotFoundError as error:
        raise PluginError(
            "simulated cameras over ROS need the plugin m2pem-plugin-ros: "
            "pip install 'm2pem-plugin-ptz[ros]'"
        ) from error
    keep_on_loopback()
    from m2pem import load_fleet  # noqa: PLC0415  # readers of files are needed here alone
    from m2pem_plugin_ptz.simulator.ros.fleet import read_specs  # noqa: PLC0415  # it needs ROS

    specs = list(read_specs(load_fleet(fleet_file)))
    if not specs:
        raise click.UsageError(
            f"{fleet_file} has nothing to simulate: no payload of a vehicle with `sitl: true` has "
            "`arbiter: ptz` and `driver: ros`, or `arbiter: ros` and a node of its own"
        )
    asyncio.run(_run(specs, speed, domain_id))


async def _run(specs: "Sequence[CameraSpec]", speed: float, domain_id: int | None) -> None:
    from m2pem_plugin_ptz.simulator.ros.simulation import simulate  # noqa: PLC0415  # it needs ROS

    def ready() -> None:
        for spec in specs:
            node = "" if spec.node is None else ", an m2pem node"
            click.echo(f"{spec.name}: {spec.settings.joint_states}, {spec.settings.image}{node}")
        click.echo("ready")

    simulating = simulate(specs, SystemClock(speed), domain_id, ready)
    await until_interrupted(interrupted(), simulating)
