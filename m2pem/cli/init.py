"""`m2pem init`: a folder with a first mission."""

import shlex
from importlib.util import find_spec
from pathlib import Path

import click

from m2pem.cli.options import example


@click.command(epilog=example("m2pem init patrol --for mavlink"))
@click.argument("folder", type=click.Path(path_type=Path))
@click.option(
    "--for",
    "kind",
    type=click.Choice(["sim", "mavlink", "ros"]),
    default="sim",
    show_default=True,
    help="The vehicles: simulated by m2pem, or reached over MAVLink or ROS 2.",
)
def init(folder: Path, kind: str) -> None:
    """Make a folder with a mission, a fleet, answers and a README.

    The README says what to type next. A folder that is not empty is refused.
    """
    from m2pem.demo.shipped_files import PLUGINS, make_folder

    files = make_folder(folder, kind)
    click.echo(f"{folder}: {', '.join(files)}")
    plugin = PLUGINS.get(kind)
    if plugin is not None and find_spec(plugin) is None:
        click.echo(f"These vehicles need a plugin: pip install {plugin.replace('_', '-')}")
    click.echo("Read README.md there, or begin with:")
    click.echo(f"  cd {shlex.quote(str(folder))}")
    click.echo("  m2pem check mission.bpmn --fleet fleet.yaml")
