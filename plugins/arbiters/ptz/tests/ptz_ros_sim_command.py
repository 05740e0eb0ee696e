"""`m2pem sim` with the simulated cameras over ROS alone."""

import click
from m2pem_plugin_ptz.simulator.ros.command_line import ros_cameras

cli = click.Group("m2pem")
cli.add_command(ros_cameras)

if __name__ == "__main__":
    cli()
