"""`m2pem` with the commands of this plugin alone, whatever else is installed."""

import click
from m2pem_plugin_ros.commands import add_to

cli = click.Group("m2pem")
add_to(cli.commands)

if __name__ == "__main__":
    cli()
