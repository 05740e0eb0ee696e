"""`m2pem completion`: the words for a shell to complete."""

import click
from click.shell_completion import get_completion_class

from m2pem.cli.options import example

VARIABLE = "_M2PEM_COMPLETE"


@click.command(epilog=example('eval "$(m2pem completion bash)"   # in ~/.bashrc'))
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
@click.pass_context
def completion(ctx: click.Context, shell: str) -> None:
    """Print what makes a shell complete m2pem's words."""
    made = get_completion_class(shell)
    assert made is not None
    click.echo(made(ctx.find_root().command, {}, "m2pem", VARIABLE).source())
