"""`m2pem demo`: missions of the examples on simulated vehicles."""

from pathlib import Path
from typing import Any

import click

DOMAIN = click.option(
    "--domain", default=101, show_default=True, help="The ROS domain, on this machine alone."
)
ARDUPILOT = click.option(
    "--ardupilot",
    metavar="FOLDER",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    help="A folder with real autopilots that simulate themselves (docs/mavlink.md).",
)


@click.group(invoke_without_command=True, epilog="Example: m2pem demo air")
@click.pass_context
def demo(context: click.Context) -> None:
    """Show missions on simulated vehicles.

    Without a name: the paper's mission, in two ways.
    """
    if context.invoked_subcommand is None:
        from m2pem.demo import demos

        context.exit(demos.vignette())


@demo.command()
@ARDUPILOT
@click.pass_context
def air(context: click.Context, ardupilot: Path | None) -> None:
    """Survey a field over MAVLink; the link to one copter is lost."""
    from m2pem.demo import demos

    context.exit(demos.air(ardupilot))


@demo.command()
@click.option(
    "--folder",
    type=click.Path(file_okay=False, path_type=Path),
    default=Path(".demo-web"),
    show_default=True,
    help="Where the missions that are drawn and the journal are kept.",
)
@click.pass_context
def web(context: click.Context, folder: Path) -> None:
    """Draw, verify and run missions in a browser."""
    from m2pem.demo import demos

    context.exit(demos.web(folder))


@demo.command()
@DOMAIN
@click.option(
    "--only", type=click.Choice(["vehicle", "team"]), help="One of the two missions alone."
)
@click.pass_context
def ros(context: click.Context, domain: int, only: str | None) -> None:
    """Run missions on simulated ROS 2 vehicles, with an operator over ROS."""
    from m2pem.demo import demos

    status = 0
    if only != "team":
        status = demos.ros_vehicle(domain)
    if only != "vehicle" and status == 0:
        status = demos.ros_team(domain)
    context.exit(status)


@demo.command()
@DOMAIN
@click.option("--vehicles-port", default=14540, show_default=True, help="Where autopilots send to.")
@click.option("--port", default=14550, show_default=True, help="Where ground stations listen.")
@click.pass_context
def gateway(context: click.Context, domain: int, vehicles_port: int, port: int) -> None:
    """Show ROS rovers and MAVLink copters to a ROS client and a ground station."""
    from m2pem.demo import demos

    context.exit(demos.gateway(domain, vehicles_port, port))


@demo.command()
@DOMAIN
@ARDUPILOT
@click.option(
    "--fleet",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="Another fleet with the same vehicles.",
)
@click.option(
    "--answers",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="Other answers of the operator.",
)
@click.option("--port", default=14550, show_default=True, help="Where the autopilot sends to.")
@click.option(
    "--pointing-deg", default=1.0, show_default=True, help="The largest error of the camera."
)
@click.option(
    "--reached",
    metavar="EVENT",
    default="EndBypassed",
    show_default=True,
    help="The end event that the run must come to.",
)
@click.pass_context
def team(context: click.Context, /, **options: Any) -> None:
    """March in a column with a camera and a copter, over ROS 2 and MAVLink."""
    from m2pem.demo import demos

    context.exit(demos.team(**options))
