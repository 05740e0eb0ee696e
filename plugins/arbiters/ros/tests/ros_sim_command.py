"""`m2pem` with the commands of this plugin alone, whatever else is installed."""

import click
from m2pem_plugin_ros.hooks import add_commands

cli = click.Group("m2pem")
add_commands(cli.commands)

if __name__ == "__main__":
    cli()
